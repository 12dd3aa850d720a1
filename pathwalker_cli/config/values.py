"""Values of study configs by dotted key: what is not a default, and what differs between runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Final

from pathwalker_cli.config.schema import StudyConfig

__all__ = ["NO_VALUE", "changed_values", "differing_values", "value_text"]

NO_VALUE: Final = "-"
"""Stands for the value of a key that a config does not have, such as one of a mapping."""


def changed_values(config: StudyConfig) -> dict[str, tuple[Any, Any]]:
    """Return value and default of the keys whose value is not the default of the problem."""
    usual = _flat(StudyConfig(problem=config.problem, patient=config.patient))
    now = _flat(config)
    return {
        key: (value, usual.get(key, NO_VALUE))
        for key, value in now.items()
        if usual.get(key, NO_VALUE) != value
    }


def differing_values(configs: Sequence[StudyConfig]) -> dict[str, tuple[str, ...]]:
    """Return the keys whose values are not the same in all configs, with all values as text."""
    flat = [_flat(config) for config in configs]
    keys = dict.fromkeys(key for values in flat for key in values)
    found = {key: tuple(value_text(values.get(key, NO_VALUE)) for values in flat) for key in keys}
    return {key: values for key, values in found.items() if len(set(values)) > 1}


def value_text(value: Any) -> str:
    """Return a value as people read it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else str(value)


def _flat(config: StudyConfig) -> dict[str, Any]:
    """Return every value of a config by dotted key."""
    return dict(_entries("", config.model_dump(mode="json")))


def _entries(prefix: str, content: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _entries(f"{prefix}{key}.", value)
        else:
            yield f"{prefix}{key}", value
