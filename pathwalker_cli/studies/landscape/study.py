"""The config of a landscape."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, model_validator

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid
from pathwalker_cli.patient.blocks import Stiffness
from pathwalker_cli.studies.base import NeighbourStudy

__all__ = ["Axis", "LandscapeStudy", "axis_values"]


class Axis(YamlModel):
    """Values of one stiffness."""

    from_: Stiffness | None = Field(default=None, alias="from")
    to: Stiffness | None = None
    points: Annotated[int, Field(ge=2, le=40)] = 8
    spacing: Literal["logarithmic", "linear"] = "logarithmic"
    values: Annotated[tuple[Stiffness, ...], AS_TUPLE] = ()

    @model_validator(mode="before")
    @classmethod
    def _list(cls, value: Any) -> Any:
        return {"values": value} if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _rising(self) -> Axis:
        ends = [end for end in (self.from_, self.to) if end is not None]
        given = self.values or tuple(ends)
        if any(a >= b for a, b in pairwise(given)):
            raise invalid("does not rise", allowed="values in rising order, each once")
        if self.values and ends:
            raise invalid("has values and ends", allowed="values, or from and to")
        if len(self.values) == 1:
            raise invalid("has one value", allowed="two or more: one is no axis")
        return self


class LandscapeStudy(NeighbourStudy):
    """A landscape around the optimum of a problem with orthoses."""

    side: Literal["right", "left", "both"] = "right"
    dorsiflexion: Axis = Axis()
    plantarflexion: Axis = Axis()
    tolerance: Annotated[float, Quantity("", 1e-4, 1.0, above="is it in percent?")] = 0.05
    leaps: bool = True
    sweeps: Annotated[int, Field(ge=0, le=20)] = 6
    max_iterations: Annotated[int, Field(ge=20, le=100000)] = 200

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides whose springs are varied."""
        return SIDES if self.side == "both" else (self.side,)


def axis_values(axis: Axis, allowed: tuple[float, float], name: str) -> np.ndarray:
    """Return the values of an axis, rising [N m/rad], shape (n,).

    Args:
        axis: What was asked for.
        allowed: Lowest and highest stiffness that the base allows [N m/rad].
        name: Key of the axis, for the message.

    Raises:
        ConfigError: If the ends are upside down.
    """
    if axis.values:
        return np.array(axis.values)
    low = allowed[0] if axis.from_ is None else axis.from_
    high = allowed[1] if axis.to is None else axis.to
    if low >= high:
        raise ConfigError(
            f"runs from {low:g} to {high:g} N m/rad", where=name, allowed="from below to",
            mend="give both ends: what is left out is the range of the base",
        )  # fmt: skip
    space = np.geomspace if axis.spacing == "logarithmic" else np.linspace
    return np.asarray(space(low, high, axis.points))
