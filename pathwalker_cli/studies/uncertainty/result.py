"""How measures spread over draws of a patient: what was drawn, where it ended, and how it varies.

References:
    Spearman (1904), The American Journal of Psychology 15, 72-101: rank correlation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np
from scipy import stats

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.studies.measures import Ranges
from pathwalker_cli.studies.neighbours import Solved
from pathwalker_cli.studies.uncertainty.draws import Draws, Input

_DIGITS: Final = {"N m/rad": 1, "deg": 1, "m": 3, "m/s": 3, "s": 3, "s/m": 3, "": 4}
"""Digits after the point by unit shown; of others three."""

QUANTILES: Final = (0.05, 0.5, 0.95)
"""What stands for the distribution of a measure: the middle, and the range of 90 % of draws."""

ENOUGH: Final = 20
"""Draws from which on the range of 90 % of them leaves some out; of fewer, all are told."""

_CHANCE: Final = 0.05
"""Probability that among inputs without any effect the strongest one is named all the same."""


@dataclass(frozen=True)
class Uncertainty:
    """All draws and where they ended.

    Args:
        base: Measures at the numbers of the file, SI units.
        ranges: Allowed range by spring and further number [SI].
        further: SI units of the unknowns beside the springs, by name.
        seconds: Wall seconds in all, the solve of the base from nothing apart.
    """

    config: StudyConfig
    patient: str
    intervals: int
    base: Mapping[str, float]
    ranges: Ranges
    measures: tuple[Measure, ...]
    further: Mapping[str, str]
    draws: Draws
    solved: tuple[Solved, ...]
    seconds: float
    workers: int

    @property
    def failed(self) -> tuple[Solved, ...]:
        """Draws that did not converge."""
        return tuple(end for end in self.solved if not end.values)

    @property
    def converged(self) -> tuple[Solved, ...]:
        """Draws that did."""
        return tuple(end for end in self.solved if end.values)

    @cached_property
    def spreads(self) -> tuple[Spread, ...]:
        """How every measure spreads over the converged draws."""
        return tuple(_spread(self, measure) for measure in self.measures)

    def values(self, key: str) -> np.ndarray:
        """Return a measure of all converged draws; at a limit, the limit itself, shape (n,)."""
        values = []
        for end in self.converged:
            at = spring_ends(end.values, self.ranges).get(key)
            limit = None if at is None else self.ranges[key][at == "upper"]
            values.append(end.values[key] if limit is None else limit)
        return np.array(values)


@dataclass(frozen=True)
class Spread:
    """How a measure spreads over the converged draws.

    Args:
        measure: The measure.
        base: Its value at the numbers of the file, SI units.
        quantiles: Its 5 % quantile, median and 95 % quantile; NaN if no draw converged.
        lower: Share of draws at the lower limit; None if there is none.
        upper: Share of draws at the upper limit.
        correlations: Rank correlation with every input; NaN where the measure does not vary.
        strongest: The input of the largest correlation, None if chance alone could make it so.
    """

    measure: Measure
    base: float
    quantiles: tuple[float, ...]
    lower: float | None
    upper: float | None
    correlations: np.ndarray
    strongest: Input | None

    @property
    def place(self) -> str:
        """Place of the strongest input, "" without one."""
        return "" if self.strongest is None else self.strongest.place

    @property
    def strength(self) -> float | None:
        """The largest correlation; None if chance alone could make it."""
        if self.strongest is None:
            return None
        return float(self.correlations[np.nanargmax(np.abs(self.correlations))])


def _spread(result: Uncertainty, measure: Measure) -> Spread:
    values = result.values(measure.key)
    free = measure.key in result.ranges and len(values) > 0
    low, high = result.ranges.get(measure.key, (np.nan, np.nan))
    rows = [i for i, end in enumerate(result.solved) if end.values]
    correlations = rank_correlations(result.draws.values[rows], values)
    return Spread(
        measure=measure,
        base=result.base[measure.key],
        quantiles=tuple(np.quantile(values, QUANTILES).tolist()) if len(values) else (np.nan,) * 3,
        lower=float(np.mean(values == low)) if free and low < high else None,
        upper=float(np.mean(values == high)) if free and low < high else None,
        correlations=correlations,
        strongest=_strongest(result.draws.inputs, correlations, len(values)),
    )


def span_words(draws: int) -> str:
    """Return what the range of a measure is called: few draws have no tails."""
    return "90 % of draws" if draws >= ENOUGH else f"range of {draws}"


def most(draws: int) -> str:
    """Return what of so many draws their quantiles of 5 and 95 % enclose, in words."""
    return "90 %" if draws >= ENOUGH else "nearly all"


def span_text(spread: Spread, values: np.ndarray, limits: tuple[float, float] | None) -> str:
    """Return the range of a measure; the one limit that holds all draws is named as such.

    Args:
        spread: How the measure spreads.
        values: Its values, see `Uncertainty.values`.
        limits: Its allowed range, if it has one.
    """
    low, _, high = spread.quantiles
    if 0 < len(values) < ENOUGH:
        low, high = float(values.min()), float(values.max())
    if limits is not None and low == high and limits[0] < limits[1] and low in limits:
        return f"all at {'lower' if low == limits[0] else 'upper'} limit"
    return f"{shown_text(spread.measure, low)} to {shown_text(spread.measure, high)}"


def shown_text(measure: Measure, value: float) -> str:
    """Return a value of a measure in the unit for people."""
    return f"{measure.in_shown_unit(value):.{_DIGITS.get(measure.shown_unit, 3)}f}"


def rank_correlations(inputs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return Spearman's rank correlation of every input with a measure, shape (m,).

    Args:
        inputs: Shape (n, m).
        values: Shape (n,); without variation, correlations are NaN.
    """
    if len(values) < 3 or np.ptp(values) == 0.0:
        return np.full(inputs.shape[1], np.nan)
    ranks = stats.rankdata(values)
    return np.array([np.corrcoef(stats.rankdata(column), ranks)[0, 1] for column in inputs.T])


def chance_level(draws: int, inputs: int) -> float:
    """Return what the strongest correlation of so many idle inputs exceeds in 5 % of studies."""
    if draws < 3:
        return 1.0
    return float(min(1.0, stats.norm.ppf(1.0 - _CHANCE / (2.0 * inputs)) / np.sqrt(draws - 1.0)))


def _strongest(inputs: Sequence[Input], correlations: Iterable[float], draws: int) -> Input | None:
    sizes = [abs(c) if np.isfinite(c) else 0.0 for c in correlations]
    best = int(np.argmax(sizes))
    return inputs[best] if sizes[best] > chance_level(draws, len(inputs)) else None
