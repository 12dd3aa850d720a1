"""Building blocks of validated files: strict frozen models and numbers with a unit and bounds."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import Any, Final, Generic, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, GetCoreSchemaHandler, model_validator
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

__all__ = ["AS_TUPLE", "Quantity", "Sides", "YamlModel", "invalid"]

T = TypeVar("T")

_LARGEST: Final = sys.float_info.max


AS_TUPLE: Final = BeforeValidator(lambda value: tuple(value) if isinstance(value, list) else value)
"""Annotation of a tuple below `Sides`, where strict validation no longer sees YAML's lists."""


class YamlModel(BaseModel):
    """Base of everything that is read from YAML: frozen, no unknown keys, no NaN or infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def invalid(what: str, *, allowed: str = "", mend: str = "") -> PydanticCustomError:
    """Return the error that a validator raises so that the user sees these three clauses.

    Args:
        what: What is wrong, without the key: "is 125 m".
        allowed: What would be accepted.
        mend: What to do about it.
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
        """Return the value as a float, or raise an error that names unit and range."""
        if isinstance(value, bool) or not isinstance(value, int | float):
            unit = f" in {self.unit}" if self.unit else ""
            mend = f"write the number alone, the unit is always {self.unit}" if self.unit else ""
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

    def __getitem__(self, side: str) -> T:
        """Return the value of "right" or "left"."""
        return {"right": self.right, "left": self.left}[side]
