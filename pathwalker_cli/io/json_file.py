"""JSON as every file of the package has it: two spaces further in, readable text, real numbers."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, NoReturn

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.atomic import atomic_open, refuse_special

_MOST_DIGITS: Final = 300
"""Digits of a whole number that still is a float."""


def json_text(content: Mapping[str, Any]) -> str:
    """Return plain values as JSON with an end of line.

    Raises:
        ValueError: If a number is infinite or NaN: JSON knows neither.
    """
    return json.dumps(content, indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def read_json(path: Path, mend: str = "make it again") -> dict[str, Any]:
    """Return the mapping in a JSON file.

    Raises:
        DataError: If it cannot be read or holds something else.
    """
    refuse_special(path)
    try:
        content = json.loads(
            path.read_text(encoding="utf-8"), parse_int=_whole, parse_constant=_refused
        )
    except UnicodeDecodeError:
        raise DataError("is not text in UTF-8", where=str(path), mend=mend) from None
    except json.JSONDecodeError as problem:
        where = f"{path}, line {problem.lineno}"
        raise DataError("is not valid JSON", where=where, mend=mend) from None
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise DataError(f"cannot be read: {reason}", where=str(path), mend=mend) from None
    except (ValueError, RecursionError) as problem:
        raise DataError(f"is not valid JSON: {problem}", where=str(path), mend=mend) from None
    if not isinstance(content, dict):
        raise DataError("holds no keys with values", where=str(path), mend=mend)
    return content


def _whole(text: str) -> int:
    if len(text) > _MOST_DIGITS:
        raise ValueError(f"a number of {len(text)} digits")
    return int(text)


def _refused(constant: str) -> NoReturn:
    raise ValueError(f"{constant} is no number")


def write_json(path: str | Path, content: Mapping[str, Any]) -> None:
    """Write plain values in one stroke; see `json_text`."""
    text = json_text(content)
    with atomic_open(path) as file:
        file.write(text)
