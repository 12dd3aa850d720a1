"""Values of study configs by dotted key: what is not a default, and what differs between runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from pathwalker_cli.config import StudyConfig

__all__ = ["changed_values", "differing_values"]


def changed_values(config: StudyConfig) -> dict[str, str]:
    """Return the keys of a config whose values are not the defaults of its problem."""
    bare = _flat(StudyConfig(problem=config.problem, patient=config.patient))
    return {key: text for key, text in _flat(config).items() if bare.get(key) != text}


def differing_values(configs: Sequence[StudyConfig]) -> dict[str, tuple[str, ...]]:
    """Return the keys whose values are not the same in all configs, with all values in order.

    A key that a config does not have, such as one of a mapping, counts as "-".
    """
    flat = [_flat(config) for config in configs]
    keys = dict.fromkeys(key for values in flat for key in values)
    found = {key: tuple(values.get(key, "-") for values in flat) for key in keys}
    return {key: values for key, values in found.items() if len(set(values)) > 1}


def _flat(config: StudyConfig) -> dict[str, str]:
    """Return every value of a config as text by dotted key."""
    return dict(_entries("", config.model_dump(mode="json")))


def _entries(prefix: str, content: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    for key, value in content.items():
        if isinstance(value, Mapping):
            yield from _entries(f"{prefix}{key}.", value)
        else:
            yield f"{prefix}{key}", _text(value)


def _text(value: Any) -> str:
    """Return a value as people read it."""
    if isinstance(value, bool):
        return "yes" if value else "no"
    return "none" if value is None else str(value)
