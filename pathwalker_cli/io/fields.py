"""Building blocks of validated files: strict frozen models and numbers with a unit and bounds."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Generic, Literal, TypeVar, Union, get_args, get_origin

from annotated_types import Ge, Le
from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

T = TypeVar("T")


@dataclass(frozen=True)
class Words:
    """Annotation: type and allowed values in words, where the type does not tell them."""

    kind: str
    allowed: str


_WRITTEN: Final = re.compile(r"([-+]?\d+(?:\.\d*)?) *(deg|N m/deg)")
_PER_DEGREE: Final = {
    ("rad", "deg"): math.pi / 180.0,
    ("deg", "deg"): 1.0,
    ("N m/rad", "N m/deg"): 180.0 / math.pi,
}
"""Factors from a written unit to that of a quantity."""

_LARGEST: Final = sys.float_info.max


def _as_tuple(value: Any) -> Any:
    return tuple(value) if isinstance(value, list) else value


AS_TUPLE: Final = BeforeValidator(_as_tuple)
"""Annotation of a tuple below `Sides`, where strict validation no longer sees YAML's lists."""


class YamlModel(BaseModel):
    """Base of everything that is read from YAML: frozen, no unknown keys, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def invalid(what: str, *, allowed: str = "", mend: str = "") -> PydanticCustomError:
    """Return the error that a validator raises so that the user sees these three clauses.

    What is wrong stands without the key: "is 125 m".
    """
    context = {"what": what, "allowed": allowed, "mend": mend}
    return PydanticCustomError("pathwalker", "{what}", context)


@dataclass(frozen=True)
class Quantity:
    """Annotation of a float: its unit and the range that is physically sensible.

    Use as `Annotated[float, Quantity("kg", 5, 150, above="is it in grams?")]`.

    Args:
        unit: SI unit, or "" for a plain number.
        lower: Smallest value that is accepted.
        upper: Largest value that is accepted.
        below: What to do about a value below `lower`.
        above: What to do about a value above `upper`.
    """

    unit: str
    lower: float
    upper: float
    below: str = ""
    above: str = ""

    @property
    def allowed(self) -> str:
        """The accepted range with its unit, for messages."""
        return f"{self.lower:g} to {self.upper:g} {self.unit}".rstrip()

    def check(self, value: Any) -> float:
        """Return the value as a float, or raise an error that names unit and range.

        What is per radian here may be written per degree, with that unit: "7.5 deg".
        """
        if isinstance(value, str) and (written := _WRITTEN.fullmatch(value.strip())):
            factor = _PER_DEGREE.get((self.unit, written[2]))
            value = value if factor is None else factor * float(written[1])
        if isinstance(value, bool) or not isinstance(value, int | float):
            unit = f" in {self.unit}" if self.unit else ""
            mend = f"write the number alone, the unit is always {self.unit}" if self.unit else ""
            other = next((w for unit, w in _PER_DEGREE if unit == self.unit != w), "")
            mend += f", or a number with {other}" if other else ""
            if isinstance(value, dict):
                mend = "to go on with dots within a name, give the mapping: KEY={name.with.dots: 1}"
            shown = "empty" if value is None else repr(value)
            what = f"is {shown}, which is not a number{unit}"
            raise invalid(what, allowed=self.allowed, mend=mend)
        if self.lower <= value <= self.upper:
            return float(value)
        shown = f"{value:g}" if abs(value) < _LARGEST else "beyond all numbers"
        what = f"is {shown} {self.unit}".rstrip()
        mend = self.below if value < self.lower else self.above
        raise invalid(what, allowed=self.allowed, mend=mend)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        """Run `check` before pydantic's own validation."""
        return core_schema.no_info_before_validator_function(self.check, handler(source))


class Sides(YamlModel, Generic[T]):
    """One value per side; a single value in the file counts for both sides."""

    right: T
    left: T

    @model_validator(mode="before")
    @classmethod
    def _both(cls, value: Any) -> Any:
        if isinstance(value, dict) and {"right", "left"} & value.keys():
            return value
        return value if isinstance(value, cls) else {"right": value, "left": value}

    def __reduce__(self) -> tuple[Any, ...]:
        """Travel by the type of the values: the class of a pair has no name of its own."""
        kind = type(self).__pydantic_generic_metadata__["origin"]
        return _pair, (kind, side_type(type(self)), self.right, self.left)

    @property
    def given(self) -> dict[str, T]:
        """The values by side, right before left."""
        both = {"right": self.right, "left": self.left}
        return {side: value for side, value in both.items() if value is not None}

    def __str__(self) -> str:
        """Return the one value of all sides, or each as a file gives it."""
        texts = {side: str(value) for side, value in self.given.items()}
        if len(set(texts.values())) == 1:
            return next(iter(texts.values()))
        return f"{{{', '.join(f'{side}: {text}' for side, text in texts.items())}}}"

    def __getitem__(self, side: str) -> T:
        """Return the value of "right" or "left"."""
        return {"right": self.right, "left": self.left}[side]


class Worn(Sides[T], Generic[T]):
    """One value per side that wears something, see `on_sides`; None on the other one."""

    right: T | None = None  # type: ignore[assignment]
    left: T | None = None  # type: ignore[assignment]


def _pair(kind: Any, of: Any, right: Any, left: Any) -> Sides[Any]:
    """Return a pair of checked values of a type."""
    pair: Sides[Any] = kind[of].model_construct(right=right, left=left)
    return pair


def on_sides(
    model: type[BaseModel], content: Mapping[str, Any], sides: Sequence[str], above: str = ""
) -> dict[str, Any]:
    """Return the content of a block in which every `Worn` has a value for just these sides.

    A single value counts for all of them.

    Raises:
        PydanticCustomError: If there is one for another side, or none for one of these.
    """
    result = dict(content)
    for name, field in model.model_fields.items():
        value = content.get(name)
        for inner in models_in(field.annotation):
            if issubclass(inner, Worn) and value is not None:
                result[name] = _of_sides(value, sides, above + name)
            elif isinstance(value, Mapping):
                result[name] = on_sides(inner, value, sides, f"{above}{name}.")
    return result


def _of_sides(value: Any, sides: Sequence[str], key: str) -> Any:
    """Return what is given for some sides, by side."""
    if isinstance(value, Worn):
        return value
    if not isinstance(value, Mapping) or not {"right", "left"} & value.keys():
        return dict.fromkeys(sides, value)
    only = " and ".join(sides)
    for side in ("right", "left"):
        given = value.get(side) is not None
        if given and side not in sides:
            raise invalid(
                f"has {key}.{side}, but is worn on the {only} only",
                allowed=f"{key} of the {only}",
                mend=f"leave it out, or add {side} to sides",
            )
        if side in sides and not given:
            raise invalid(f"has {key} without {side}", allowed=f"one value, or one for {only}")
    return value


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
        if isinstance(entry, Words):
            return entry.kind, entry.allowed
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
    inner = models_in(field.annotation)[0]
    if issubclass(inner, Sides):
        inner = side_type(inner)
    return field_at(inner, rest)


def models_in(annotation: Any) -> list[Any]:
    """Return the models in an annotation such as `dict[str, X] | None`, if it is a block."""
    if is_model(annotation):
        return [annotation]
    return [model for part in get_args(annotation) for model in models_in(part)]


def quantity_at(model: type[BaseModel], place: str) -> Quantity:
    """Return unit and range of the number at a dotted place below a model."""
    field = field_at(model, place)
    metadata = list(field.metadata)
    for inside in models_in(field.annotation):
        metadata += get_args(side_type(inside))[1:]
    return next(entry for entry in metadata if isinstance(entry, Quantity))
