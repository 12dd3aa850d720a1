"""Mean and spread of recorded curves over the gait cycle."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import GaitCycle
from pathwalker_cli.trajectory import Trajectory

__all__ = ["POINTS", "CycleBand", "cycle_band", "resampled"]

POINTS: Final = 101
"""Points of a normalised curve: one per cent each."""


@dataclass(frozen=True)
class CycleBand:
    """Statistics over gait cycles, from strike (0 %) to the next strike of the same foot (100 %).

    Args:
        names: Column names, m of them.
        units: Their units.
        mean: Mean, shape (POINTS, m); NaN where no cycle has a value.
        deviation: Standard deviation between cycles, shape (POINTS, m).
        lowest: Smallest value, shape (POINTS, m).
        highest: Largest value, shape (POINTS, m).
        count: Number of cycles that have a value, shape (POINTS, m).
    """

    names: tuple[str, ...]
    units: tuple[str, ...]
    mean: np.ndarray
    deviation: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    count: np.ndarray


def resampled(columns: np.ndarray) -> np.ndarray:
    """Return columns over 0 to 100 % of their length, shape (n, m) to (POINTS, m)."""
    old, new = np.linspace(0.0, 1.0, len(columns)), np.linspace(0.0, 1.0, POINTS)
    return np.stack([np.interp(new, old, column) for column in columns.T], axis=1)


def cycle_band(trials: Sequence[tuple[Trajectory, tuple[GaitCycle, ...]]], side: Side) -> CycleBand:
    """Return mean and spread of curves over the gait cycles of one side.

    Args:
        trials: Curves of several trials, NaN where not measured, with their gait cycles.
        side: Side whose strike starts the cycle.

    Raises:
        DataError: If the trials show no complete cycle of that side.
    """
    curves = [
        resampled(curve.values[cycle.start : cycle.end + 1])
        for curve, cycles in trials
        for cycle in cycles
        if cycle.side == side
    ]
    if not curves:
        raise DataError(f"the trials show no complete gait cycle of the {side} side")
    stacked = np.array(curves)
    known = np.isfinite(stacked)
    count = known.sum(axis=0)
    with np.errstate(invalid="ignore"):
        mean = np.where(known, stacked, 0.0).sum(axis=0) / count
        square = (np.where(known, stacked - mean, 0.0) ** 2).sum(axis=0) / count
    lowest = np.where(known, stacked, np.inf).min(axis=0)
    highest = np.where(known, stacked, -np.inf).max(axis=0)
    lowest[count == 0] = highest[count == 0] = np.nan
    first = trials[0][0]
    return CycleBand(first.names, first.units, mean, np.sqrt(square), lowest, highest, count)
