"""Mappings within mappings, and the dotted keys that lead into them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from pathwalker_cli.errors import ConfigError

__all__ = ["holder", "merged"]


def merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return two nested mappings as one; where both have a value, `over` counts."""
    result = dict(under)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            result[key] = merged(below, value)
        else:
            result[key] = value
    return result


def holder(mapping: dict[str, Any], key: str, where: str) -> tuple[dict[str, Any], str]:
    """Return the mapping that holds a dotted key, and the last part of the key.

    Args:
        mapping: The outermost mapping; what lacks on the way is put into it.
        key: The key, e.g. "mesh.degree".
        where: Origin of the key, for the message.

    Raises:
        ConfigError: If there is a value on the way that holds no keys.
    """
    *parents, last = key.split(".")
    for parent in parents:
        mapping = mapping.setdefault(parent, {})
        if not isinstance(mapping, dict):
            raise ConfigError(f"'{parent}' holds no keys", where=where)
    return mapping, last
