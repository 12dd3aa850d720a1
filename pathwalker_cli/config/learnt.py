"""Learnt numbers: what a child's recordings say of tissue, strength and what its walking costs.

Numbers stand under their place in the patient's file, e.g. "tissue.damping" or
"examination.popliteal_angle.right", or under their key in the config, e.g. "cost.goals.time".
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field, model_validator

from pathwalker_cli.conventions import Condition
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid

COST: Final = "cost."
"""Beginning of the numbers that stand in the config."""

Amount = Annotated[float, Quantity("SI units", -1e4, 1e4)]


class Prior(YamlModel):
    """What is thought of a number before any recording is looked at.

    Args:
        prior: The likeliest value [its unit].
        spread: Standard deviation around it [its unit].
        factor: Instead of it, the factor that is one standard deviation: of what is positive.
        range: Values that it may take [its unit].
    """

    prior: Amount
    spread: Annotated[float, Quantity("", 1e-6, 1e4)] | None = None
    factor: Annotated[float, Quantity("", 1.001, 100.0)] | None = None
    range: Annotated[tuple[Amount, Amount], AS_TUPLE]

    @model_validator(mode="after")
    def _sound(self) -> Prior:
        if (self.spread is None) == (self.factor is None):
            what = "neither spread nor" if self.spread is None else "both spread and"
            raise invalid(f"has {what} factor", allowed="one of the two")
        if not self.range[0] < self.prior < self.range[1]:
            low, high = self.range
            raise invalid(
                f"has the prior {self.prior:g} outside its range [{low:g}, {high:g}]",
                allowed="a prior inside the range",
            )
        if self.factor is not None and self.range[0] <= 0.0:
            raise invalid(
                f"has a factor and a range from {self.range[0]:g} on",
                allowed="positive numbers only",
                mend="give a spread instead, or a positive range",
            )
        return self

    def value(self, deviations: float) -> float:
        """Return the value so many prior standard deviations from the prior [its unit]."""
        if self.factor is not None:
            return float(self.prior * self.factor**deviations)
        return float(self.prior + (self.spread or 0.0) * deviations)

    def deviations(self, value: float) -> float:
        """Return how many prior standard deviations a value is from the prior."""
        if self.factor is not None:
            return float(np.log(value / self.prior) / np.log(self.factor))
        return float((value - self.prior) / (self.spread or 1.0))


class LearntNumber(Prior):
    """A number after the recordings were looked at."""

    learnt: Amount


class Learnt(YamlModel):
    """A set of learnt numbers: the content of `learnt.yaml`.

    Args:
        patient: Id of the patient whose recordings were looked at.
        condition: What the patient walked with.
        origin: The command that made it.
        numbers: The numbers by place.
        covariance: Their covariance in prior standard deviations, row by row in their order.
    """

    patient: str
    condition: Condition
    origin: str = ""
    numbers: Annotated[dict[str, LearntNumber], Field(min_length=1)]
    covariance: Annotated[tuple[Annotated[tuple[float, ...], AS_TUPLE], ...], AS_TUPLE]

    @model_validator(mode="after")
    def _square(self) -> Learnt:
        matrix, size = self.covariance, len(self.numbers)
        if len(matrix) != size or any(len(row) != size for row in matrix):
            raise invalid("has a covariance of another size", allowed=f"{size} rows of {size}")
        if float(np.linalg.eigvalsh(np.array(matrix)).min()) < 0.0:
            raise invalid("has a covariance that is none", allowed="a symmetric positive matrix")
        return self

    @property
    def values(self) -> dict[str, float]:
        """The learnt values by place [their units]."""
        return {place: number.learnt for place, number in self.numbers.items()}

    def at(self, deviations: np.ndarray) -> dict[str, float]:
        """Return values (n,) prior standard deviations from the learnt ones, within ranges."""
        values = {}
        for (place, number), step in zip(self.numbers.items(), deviations, strict=True):
            value = number.value(number.deviations(number.learnt) + float(step))
            values[place] = float(np.clip(value, *number.range))
        return values


def config_values(values: Mapping[str, float]) -> dict[str, Any]:
    """Return learnt values as entries of a config by dotted key."""
    costs = {place: value for place, value in values.items() if place.startswith(COST)}
    return {"numbers": {p: v for p, v in values.items() if p not in costs}, **costs}
