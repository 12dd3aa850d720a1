"""Values of study configs by dotted key: put in from outside, not the default, or differing."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Any, Final

from pathwalker_cli.config.schema import StudyConfig, merged
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.refusals import KeyPath
from pathwalker_cli.io.yaml_file import read_value, validate

NO_VALUE: Final = "-"
"""Stands for the value of a key that a config does not have, such as one of a mapping."""


PLACES: Final[tuple[KeyPath, ...]] = (
    ("variation", "scale"),
    ("variation", "shift"),
    ("numbers",),
    ("free",),
)
"""Mappings whose keys are dotted places themselves, e.g. "strengths.knee_extension.left"."""


def apply_change(
    mapping: dict[str, Any], change: str, places: Collection[KeyPath] = PLACES
) -> KeyPath:
    """Put one override "a.b=value" (value: YAML) into a mapping; return its key.

    Raises:
        ConfigError: If it is no override, or there is no such place.
    """
    key, equals, text = change.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"'{change}' is no override", where="--set", allowed="dotted.key=value")
    path = _path(key.strip(), places)
    value = read_value(text, f"--set {change}")
    _holder(mapping, path, f"--set {change}")[path[-1]] = value
    return path


def with_values(config: StudyConfig, values: Mapping[str, Any], where: str = "") -> StudyConfig:
    """Return a config with some values replaced and validated anew.

    Args:
        config: The config.
        values: New values by dotted key, e.g. {"cost.walking_speed_weight": 1.0}.  A mapping at a
            section, e.g. {"mesh": {...}}, replaces only what it names; one below a section, e.g.
            {"variation.scale": {...}}, takes the place of what was there.
        where: Origin of the values, for the message.

    Raises:
        ConfigError: If a key does not exist or a value is refused.
    """
    content: dict[str, Any] = config.model_dump(mode="json")
    for key, value in values.items():
        path = _path(key)
        inner = _holder(content, path, f"{where}, {key}")
        whole = len(path) == 1 and isinstance(inner.get(key), dict)
        if isinstance(value, Mapping):
            value = merged(inner[key] if whole else {}, value)
        inner[path[-1]] = value
    return validate(content, StudyConfig, where=where or "overrides", error=ConfigError)


def nested(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values by dotted key as the content of a config."""
    content: dict[str, Any] = {}
    for key, value in values.items():
        path = _path(key)
        _holder(content, path, key)[path[-1]] = value
    return content


def smoke_version(config: StudyConfig) -> StudyConfig:
    """Return a config with a short horizon for quick checks: coarse mesh, no refinement."""
    coarse = (2,) * len(config.model.pattern.phases)
    mesh = config.mesh.model_copy(update={"intervals": coarse, "refinements": 0})
    loose = {"max_iterations": min(400, config.solver.max_iterations), "tolerance": 1e-3}
    solver = config.solver.model_copy(update=loose)
    changes = {"mesh": mesh, "solver": solver, "smoke": True, "verdict": False}
    return config.model_copy(update=changes)


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
    texts = {key: tuple(value_text(values.get(key, NO_VALUE)) for values in flat) for key in keys}
    return {key: values for key, values in texts.items() if len(set(values)) > 1}


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


def _path(key: str, places: Collection[KeyPath] = PLACES) -> tuple[str, ...]:
    """Return the parts of a dotted key; what stands in one of `places` has dots in its name."""
    parts = tuple(key.split("."))
    for names in places:
        if len(parts) > len(names) and parts[: len(names)] == names:
            return (*parts[: len(names)], ".".join(parts[len(names) :]))
    return parts


def _holder(mapping: dict[str, Any], path: tuple[str, ...], where: str) -> dict[str, Any]:
    """Return the mapping that holds a key, made where it lacks.

    Raises:
        ConfigError: If there is a value on the way that holds no keys.
    """
    for parent in path[:-1]:
        mapping = mapping.setdefault(parent, {})
        if not isinstance(mapping, dict):
            raise ConfigError(f"'{parent}' holds no keys", where=where)
    return mapping
