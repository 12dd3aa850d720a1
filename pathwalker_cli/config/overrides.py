"""Other values for some keys of a config."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pathwalker_cli.config.nested import holder, merged
from pathwalker_cli.config.schema import StudyConfig
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.yaml_file import KeyPath, read_value, validate
from pathwalker_cli.model.contact import PHASE_NAMES

__all__ = ["apply_change", "smoke_version", "with_values"]


def apply_change(mapping: dict[str, Any], change: str) -> KeyPath:
    """Put one override "a.b=value" into a mapping; the value is read as YAML.

    Returns:
        The key that was overridden.

    Raises:
        ConfigError: If it is no override, or there is no such place.
    """
    key, equals, text = change.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"'{change}' is no override", where="--set", allowed="dotted.key=value")
    value = read_value(text, f"--set {change}")
    inner, last = holder(mapping, key.strip(), f"--set {change}")
    inner[last] = value
    return tuple(key.strip().split("."))


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
        inner, last = holder(content, key, f"{where}, {key}")
        whole = last == key and isinstance(value, Mapping) and isinstance(inner.get(last), dict)
        inner[last] = merged(inner[last], value) if whole else value
    return validate(content, StudyConfig, where=where or "overrides", error=ConfigError)


def smoke_version(config: StudyConfig) -> StudyConfig:
    """Return a config with a short horizon for quick checks: coarse mesh, no refinement."""
    mesh = config.mesh.model_copy(update={"intervals": (2,) * len(PHASE_NAMES), "refinements": 0})
    loose = {"max_iterations": min(400, config.solver.max_iterations), "tolerance": 1e-3}
    solver = config.solver.model_copy(update=loose)
    changes = {"mesh": mesh, "solver": solver, "smoke": True, "verdict": False}
    return config.model_copy(update=changes)
