"""What a key of a file may hold, in words: type, unit and range, from its model."""

from __future__ import annotations

from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Le
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pathwalker_cli.io.fields import Quantity, Sides

__all__ = ["described", "field_at", "is_model", "quantity_at", "side_type"]

_KINDS: Final[dict[Any, str]] = {
    float: "number",
    int: "whole number",
    bool: "true or false",
    str: "text",
    Any: "any value",
}


def described(annotation: Any, metadata: list[Any]) -> tuple[str, str]:
    """Return the type and the allowed values of an annotation in words."""
    for entry in metadata:
        if isinstance(entry, Quantity):
            unit = f", {entry.unit}" if entry.unit else ""
            return f"number{unit}", f"{entry.lower:g} to {entry.upper:g}"
    lowest = next((entry.ge for entry in metadata if isinstance(entry, Ge)), None)
    highest = next((entry.le for entry in metadata if isinstance(entry, Le)), None)
    if lowest is not None or highest is not None:
        return _KINDS[annotation], _between(lowest, highest)
    if annotation in _KINDS:
        return _KINDS[annotation], ""
    if is_model(annotation) and issubclass(annotation, Sides):
        kind, allowed = described(side_type(annotation), [])
        return f"{kind}; per side", allowed
    if is_model(annotation):
        return f"block of {', '.join(annotation.model_fields)}", ""
    return _composed(get_origin(annotation), get_args(annotation))


def side_type(annotation: type[Sides[Any]]) -> Any:
    """Return the type of the value of one side."""
    return annotation.__pydantic_generic_metadata__["args"][0]


def _between(lowest: Any, highest: Any) -> str:
    """Return a range in words; either end may be open."""
    if highest is None:
        return f"{lowest} or more"
    return f"up to {highest}" if lowest is None else f"{lowest} to {highest}"


def _composed(origin: Any, parts: tuple[Any, ...]) -> tuple[str, str]:
    """Return the same for an annotation that is made of others."""
    if origin is Literal:
        return "text", ", ".join(f"`{part}`" for part in parts)
    if origin is Annotated:
        return described(parts[0], list(parts[1:]))
    if origin in (Union, UnionType):
        kinds = [("null", "") if part is NoneType else described(part, []) for part in parts]
        allowed = "; ".join(text for _, text in kinds if text)
        return " or ".join(kind for kind, _ in kinds), allowed
    if origin is dict:
        kind, allowed = described(parts[1], [])
        return f"{kind} per name", allowed
    kind, allowed = described(parts[0], [])
    if len(parts) == 1 or parts[1] is Ellipsis:
        return f"list of {kind}", allowed
    return kind.replace("number", "[lower, upper]"), allowed


def is_model(annotation: Any) -> bool:
    """Return whether an annotation is a model: a block of keys."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def field_at(model: type[BaseModel], place: str) -> FieldInfo:
    """Return the field at a dotted place below a model, e.g. "orthosis.mass.shank".

    Raises:
        KeyError: If there is no such place.
    """
    name, _, rest = place.partition(".")
    field = model.model_fields[name]
    if not rest:
        return field
    inner = next(part for part in (field.annotation, *get_args(field.annotation)) if is_model(part))
    if issubclass(inner, Sides):
        inner = inner.model_fields["right"].annotation
    return field_at(inner, rest)


def quantity_at(model: type[BaseModel], place: str) -> Quantity:
    """Return unit and range of the number at a dotted place below a model."""
    field = field_at(model, place)
    inside: Any = field.annotation
    metadata = list(field.metadata)
    if is_model(inside):
        metadata += get_args(side_type(inside))[1:]
    return next(entry for entry in metadata if isinstance(entry, Quantity))
