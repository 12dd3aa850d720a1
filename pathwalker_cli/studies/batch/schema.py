"""The file of a study of many cases: what it may hold, how it is read, and how cases are named."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field, field_validator, model_validator

from pathwalker_cli.config import StudyConfig, read_config
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.fields import YamlModel, invalid

_DOTTED: Final = (("set",), ("grid",), ("warm_start",))
"""Mappings whose keys have dots."""

_LISTED: Final = {"problem": "problems", "patient": "patients"}
"""Keys of a config that every case brings along, and where they are listed."""


class NamedCase(YamlModel):
    """Overrides that belong together, under a name."""

    name: str
    set: dict[str, Any] = Field(default_factory=dict)

    @field_validator("name")
    @classmethod
    def _safe(cls, value: str) -> str:
        if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,39}", value):
            raise invalid(
                f"is {value!r}, which is not safe in the name of a folder",
                allowed="letters, digits, - _ and ., at most 40, a letter or digit first",
            )
        return value


class BatchStudy(YamlModel):
    """Many cases: every patient in every problem with every override."""

    patients: Annotated[tuple[str, ...], Field(min_length=1)]
    problems: Annotated[tuple[str, ...], Field(min_length=1)]
    set: dict[str, Any] = Field(default_factory=dict)
    grid: dict[str, Annotated[list[Any], Field(min_length=1)]] = Field(default_factory=dict)
    cases: tuple[NamedCase, ...] = ()
    warm_start: dict[str, str] = Field(default_factory=dict)

    @model_validator(mode="after")
    def _each_key_once(self) -> BatchStudy:
        everywhere, fixed = list(flat(self.set)), [key for c in self.cases for key in flat(c.set)]
        for key in (*everywhere, *self.grid, *fixed):
            if key in _LISTED:
                raise invalid(
                    f"overrides {key}, which every case has of its own",
                    mend=f"list it under {_LISTED[key]}",
                )
            if key in self.grid and key in (*everywhere, *fixed):
                place = "set" if key in everywhere else "cases"
                what = f"varies {key} in grid and sets it in {place}"
                raise invalid(what, mend="leave one of them out")
        names = [case.name for case in self.cases]
        twice = next((name for name in names if names.count(name) > 1), None)
        if twice is not None:
            raise invalid(f"has two cases named {twice}", mend="rename one of them")
        return self


def flat(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return overrides with blocks such as {mesh: {degree: 4}} written as "mesh.degree"."""
    result: dict[str, Any] = {}
    for key, value in values.items():
        if key in StudyConfig.model_fields and isinstance(value, Mapping):
            result |= {f"{key}.{inner}": entry for inner, entry in value.items()}
        else:
            result[key] = value
    return result


def load_batch(path: str | Path, changes: tuple[str, ...] = ()) -> tuple[BatchStudy, Path]:
    """Read a study of many cases; return it and the file that it stands in.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    for change in changes:
        head = change.partition("=")[0].strip().partition(".")[0]
        if head in StudyConfig.model_fields and head not in BatchStudy.model_fields:
            raise ConfigError(
                f"'{head}' is no key of a study of many cases",
                where=f"--set {change}",
                allowed=", ".join(BatchStudy.model_fields),
                mend=f"for a value of every case: --set set.{change}",
            )
    study, source = read_config(path, BatchStudy, changes, _DOTTED)
    return study, source.resolve()


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
