"""What an uncertainty study found: draws, and how measures spread over them.

References:
    Spearman (1904), The American Journal of Psychology 15, 72-101: rank correlation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy import stats

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.pool import Solved
from pathwalker_cli.studies.springs import Ranges
from pathwalker_cli.studies.uncertainty.draws import Draws, Input

__all__ = ["Spread", "Uncertainty", "chance_level", "rank_correlations", "spreads"]

QUANTILES: Final = (0.05, 0.5, 0.95)
"""What is told of the distribution of a measure: the middle, and the range of 90 % of draws."""

_CHANCE: Final = 0.05
"""Probability that among inputs without any effect the strongest one is named all the same."""


@dataclass(frozen=True)
class Uncertainty:
    """All draws and where they ended.

    Args:
        config: The config of the base.
        patient: Id of the patient.
        intervals: Mesh intervals of all solves.
        base: Measures at the numbers of the file, SI units.
        ranges: Allowed range by spring [N m/rad].
        draws: What was drawn.
        solved: How each draw ended, in order.
        seconds: Wall seconds in all, the solve of the base from nothing apart.
        workers: Processes that solved.
    """

    config: StudyConfig
    patient: str
    intervals: int
    base: Mapping[str, float]
    ranges: Ranges
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

    @property
    def measures(self) -> tuple[Measure, ...]:
        """What is measured, in order."""
        return tuple(m for m in measures_in("studies") if m.key in self.base)

    def values(self, key: str) -> np.ndarray:
        """Return a measure of all converged draws; at a limit, the limit itself, shape (n,)."""
        found = []
        for end in self.converged:
            at = spring_ends(end.values, self.ranges).get(key)
            limit = None if at is None else self.ranges[key][at == "upper"]
            found.append(end.values[key] if limit is None else limit)
        return np.array(found)


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


def spreads(result: Uncertainty) -> list[Spread]:
    """Return how every measure spreads."""
    return [_spread(result, measure) for measure in result.measures]


def _spread(result: Uncertainty, measure: Measure) -> Spread:
    values = result.values(measure.key)
    free = measure.key in result.ranges and len(values) > 0
    low, high = result.ranges.get(measure.key, (np.nan, np.nan))
    kept = [end.name for end in result.converged]
    rows = [i for i, end in enumerate(result.solved) if end.name in set(kept)]
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
    """Return the correlation that the strongest of so many idle inputs exceeds in 5 % of studies.

    Args:
        draws: Number of converged draws.
        inputs: Number of inputs.
    """
    if draws < 3:
        return 1.0
    return float(min(1.0, stats.norm.ppf(1.0 - _CHANCE / (2.0 * inputs)) / np.sqrt(draws - 1.0)))


def _strongest(inputs: Sequence[Input], correlations: Iterable[float], draws: int) -> Input | None:
    sizes = [abs(c) if np.isfinite(c) else 0.0 for c in correlations]
    best = int(np.argmax(sizes))
    return inputs[best] if sizes[best] > chance_level(draws, len(inputs)) else None
