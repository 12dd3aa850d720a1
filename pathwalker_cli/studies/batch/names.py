"""Names of cases: readable, safe as names of folders, and the same when patients are added."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Mapping
from typing import Any, Final

__all__ = ["case_name", "short_keys", "slug"]

_SEPARATOR: Final = "--"
_LONGEST_VALUE: Final = 40
_LONGEST_NAME: Final = 160
"""Characters; a file system takes 255 bytes, and a run is written beside its place first."""


def case_name(patient: str, problem: str, values: Mapping[str, Any], variant: str) -> str:
    """Return the name of a case.

    Args:
        patient: Id of the patient.
        problem: Name of the problem.
        values: What is varied, by short key.
        variant: Name of the overrides that belong together; "" without.
    """
    parts = [patient, problem]
    parts += [f"{slug(key)}_{slug(_text(value))}" for key, value in values.items()]
    parts += [variant] if variant else []
    name = _SEPARATOR.join(parts)
    return name if len(name) <= _LONGEST_NAME else _cut(name, _LONGEST_NAME, name)


def short_keys(keys: Collection[str]) -> dict[str, str]:
    """Return the shortest ends of dotted keys that tell them apart, by key."""
    short = {}
    for key in keys:
        parts = key.split(".")
        ends = (".".join(parts[-length:]) for length in range(1, len(parts) + 1))
        short[key] = next(
            (end for end in ends if sum(f".{other}".endswith(f".{end}") for other in keys) == 1),
            key,
        )
    return short


def slug(text: str) -> str:
    """Return a text with letters, digits, "_", "." and "-" only, not longer than 40.

    What had to be changed gets a hash of the text, so that different texts stay different.
    """
    safe = re.sub(r"[^A-Za-z0-9_.-]+", "_", text)
    if safe == text and 0 < len(text) <= _LONGEST_VALUE:
        return text
    return _cut(safe, _LONGEST_VALUE, text)


def _cut(text: str, length: int, whole: str) -> str:
    """Return the beginning of a text and a hash of the whole."""
    digest = hashlib.sha256(whole.encode()).hexdigest()[:8]
    return f"{text[: length - len(digest) - 1]}-{digest}"


def _text(value: Any) -> str:
    """Return a value as it stands in a name: 1 for 1.0, 92_92 for [92, 92]."""
    if isinstance(value, str):
        return value
    if isinstance(value, float) and value.is_integer() and abs(value) < 1e15:
        return str(int(value))
    if isinstance(value, list) and not any(isinstance(entry, list | dict) for entry in value):
        return "_".join(map(_text, value))
    return json.dumps(value)
