"""JSON as every file of the package has it: two spaces further in, readable text, real numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pathwalker_cli.io.atomic import atomic_open

__all__ = ["json_text", "write_json"]


def json_text(content: Mapping[str, Any]) -> str:
    """Return plain values as JSON with an end of line.

    Raises:
        ValueError: If a number is infinite or NaN: JSON knows neither.
    """
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def write_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write plain values in one stroke; see `json_text`."""
    text = json_text(content)
    with atomic_open(path) as file:
        file.write(text)
