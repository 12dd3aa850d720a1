"""Draws of uncertain numbers of a patient, of learnt ones as they go together, repeatably.

References:
    McKay, Beckman and Conover (1979), Technometrics 21, 239-245: Latin hypercube sampling.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import model_validator
from scipy import stats
from scipy.stats import qmc

from pathwalker_cli.config.learnt import Learnt
from pathwalker_cli.errors import ConfigError, InputError
from pathwalker_cli.io.fields import Quantity, YamlModel, invalid
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.variation import Variation, varied

_TRUNCATION: Final = 3.0
"""Standard deviations at which normal and lognormal distributions end: no absurd patients."""

_LARGEST: Final = {"normal": 0.33, "uniform": 0.99, "lognormal": 0.7}
"""Largest relative spread by kind, at which the smallest factor is still positive."""

_DIGITS: Final = 9
"""Significant digits of what is drawn, so that the numbers in a table are those that were used."""


class Distribution(YamlModel):
    """How uncertain a number of the patient's file is: by a share of itself, or by an amount.

    `normal` and `lognormal` take a standard deviation and end at three of them, `uniform` takes
    half its width.  `each` draws every number at and below the place for itself.
    """

    kind: Literal["normal", "uniform", "lognormal"] = "normal"
    relative: Annotated[float, Quantity("", 1e-6, 1.0, above="is it in percent?")] | None = None
    absolute: Annotated[float, Quantity("SI units", 1e-6, 100.0)] | None = None
    each: bool = False

    @model_validator(mode="after")
    def _one(self) -> Distribution:
        if (self.relative is None) == (self.absolute is None):
            what = "neither relative nor" if self.relative is None else "both relative and"
            raise invalid(f"has {what} absolute", allowed="one of the two")
        if self.kind == "lognormal" and self.relative is None:
            raise invalid("is lognormal and absolute", allowed="relative: it is one of factors")
        if self.relative is not None and self.relative > _LARGEST[self.kind]:
            raise invalid(
                f"has relative {self.relative:g}",
                allowed=f"up to {_LARGEST[self.kind]:g} if {self.kind}: factors stay positive",
            )
        return self

    def amounts(self, shares: np.ndarray) -> np.ndarray:
        """Return what is drawn: factors if the spread is relative, shifts if it is absolute.

        Args:
            shares: Shares of the distribution that lie below, in (0, 1), shape (n,).
        """
        spread = self.absolute if self.relative is None else self.relative
        unit = (
            stats.uniform.ppf(shares, -1.0, 2.0)
            if self.kind == "uniform"
            else stats.truncnorm.ppf(shares, -_TRUNCATION, _TRUNCATION)
        )
        if self.kind == "lognormal":
            return np.asarray(np.exp(spread * unit))
        return np.asarray(spread * unit + (self.relative is not None))


@dataclass(frozen=True)
class Input:
    """A number, or a block of numbers that change together; learnt where not distributed."""

    place: str
    distribution: Distribution | None = None

    @property
    def relative(self) -> bool:
        """Whether factors are drawn, not shifts."""
        return self.distribution is not None and self.distribution.relative is not None

    @property
    def heading(self) -> str:
        """Name of its column."""
        if self.distribution is None:
            return f"{self.place} [learnt]"
        return f"{self.place} [{'factor' if self.relative else 'shift, SI'}]"


@dataclass(frozen=True)
class Draws:
    """What was drawn: factors and shifts, of learnt numbers values, shape (draws, inputs)."""

    inputs: tuple[Input, ...]
    values: np.ndarray

    def variation(self, number: int) -> Variation:
        """Return a draw as a variation of the patient's file, learnt numbers apart."""
        pairs = self._pairs(number, learnt=False)
        return Variation(
            scale={i.place: value for i, value in pairs if i.relative},
            shift={i.place: value for i, value in pairs if not i.relative},
        )

    def learnt(self, number: int) -> dict[str, float]:
        """Return the learnt numbers of a draw by place."""
        return {i.place: value for i, value in self._pairs(number, learnt=True)}

    def _pairs(self, number: int, learnt: bool) -> list[tuple[Input, float]]:
        pairs = zip(self.inputs, self.values[number].tolist(), strict=True)
        return [(i, value) for i, value in pairs if (i.distribution is None) == learnt]


def draw(inputs: tuple[Input, ...], count: int, seed: int, learnt: Learnt | None = None) -> Draws:
    """Return draws by a Latin hypercube: every input goes evenly through its distribution.

    Args:
        inputs: What is drawn.
        count: Number of draws.
        seed: Equal seeds give equal draws.
        learnt: Learnt numbers that are drawn too, from their covariance.
    """
    size = 0 if learnt is None else len(learnt.numbers)
    cube = qmc.LatinHypercube(len(inputs) + size, rng=np.random.default_rng(seed)).random(count)
    columns = [i.distribution.amounts(cube[:, j]) for j, i in enumerate(inputs) if i.distribution]
    if learnt is not None:
        normal = stats.truncnorm.ppf(cube[:, len(inputs) :], -_TRUNCATION, _TRUNCATION)
        roots = np.linalg.cholesky(np.array(learnt.covariance))
        drawn = [learnt.at(roots @ row) for row in normal]
        columns += [np.array([values[place] for values in drawn]) for place in learnt.numbers]
        inputs = (*inputs, *(Input(place) for place in learnt.numbers))
    rounded = [[float(f"{x:.{_DIGITS}g}") for x in column] for column in columns]
    return Draws(inputs, np.array(rounded).T)


def inputs_of(quantities: Mapping[str, Distribution], patient: Patient) -> tuple[Input, ...]:
    """Return what is drawn for a patient: places with `each` become all numbers below them.

    A pair of numbers, such as a range, stays together.

    Raises:
        ConfigError: If a place does not exist, holds no number, or would be drawn twice.
    """
    inputs: list[Input] = []
    for place, distribution in quantities.items():
        places = tuple(_numbers(patient, place)) if distribution.each else (place,)
        _content(patient, place)
        inputs += [Input(single, distribution) for single in places]
    seen: set[tuple[str, bool]] = set()
    for entry in inputs:
        if (entry.place, entry.relative) in seen:
            raise ConfigError(
                f"draws {entry.place} twice",
                where="quantities",
                mend="leave out one of the two entries, or the `each` of the upper one",
            )
        seen.add((entry.place, entry.relative))
    return tuple(inputs)


def _content(patient: Patient, place: str) -> Any:
    """Return what stands at a place, with lengths written out that the file leaves out."""
    try:
        content: Any = varied(patient, Variation(scale={place: 1.0})).model_dump(mode="json")
    except InputError as error:
        raise ConfigError(
            error.what, where=f"quantities.{place}", allowed=error.allowed, mend=error.mend
        ) from None
    for part in place.split("."):
        content = content[part]
    return content


def _numbers(patient: Patient, place: str) -> Iterator[str]:
    """Yield the places of all numbers at and below a place."""
    waiting = [(place, _content(patient, place))]
    while waiting:
        here, value = waiting.pop(0)
        if isinstance(value, dict):
            waiting = [(f"{here}.{key}", below) for key, below in value.items()] + waiting
        elif isinstance(value, list) or (
            isinstance(value, int | float) and not isinstance(value, bool)
        ):
            yield here
