"""Units of what a study varies, from the models that validate it."""

from __future__ import annotations

from typing import Any, get_args

from pydantic import BaseModel

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.io.fields import Quantity
from pathwalker_cli.patient import Patient

__all__ = ["unit_of"]


def unit_of(key: str) -> str:
    """Return the unit of a config value by its dotted key; "" if it has none or it is not known.

    Args:
        key: E.g. "bounds.least_walking_speed", or "variation.shift." and a place in the patient's
            file.
    """
    block, kind, place = (*key.split(".", 2), "", "")[:3]
    if block == "variation" and place:
        return _unit(Patient, place.split(".")) if kind == "shift" else "1"
    return _unit(StudyConfig, key.split("."))


def _unit(annotation: Any, path: list[str]) -> str:
    """Return the unit at a path below an annotation."""
    quantity = next((a for a in getattr(annotation, "__metadata__", ()) if _is_quantity(a)), None)
    if quantity is not None and not path:
        return quantity.unit or "1"
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return _below(annotation, path)
    inner = get_args(annotation)
    steps = path[1:] if getattr(annotation, "__origin__", None) is dict else path
    found = (_unit(argument, steps) for argument in inner)
    return next((unit for unit in found if unit), "")


def _below(model: type[BaseModel], path: list[str]) -> str:
    """Return the unit at a path below a model; both sides of a body have the same."""
    fields = model.model_fields
    name, rest = (path[0], path[1:]) if path else ("right", [])
    if name not in fields:
        return ""
    field = fields[name]
    quantity = next((a for a in field.metadata if _is_quantity(a)), None)
    if quantity is not None and not rest:
        return quantity.unit or "1"
    return _unit(field.annotation, rest)


def _is_quantity(value: Any) -> bool:
    return isinstance(value, Quantity)
