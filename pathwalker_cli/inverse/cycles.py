"""Stances, gait cycles and steps from foot strikes and toe-offs, and curves over the cycles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from pathwalker_cli.conventions import ANGLES, SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d_events import Event, frames_of
from pathwalker_cli.trajectory import Trajectory

OTHER: Final[Mapping[Side, Side]] = {"right": "left", "left": "right"}

POINTS: Final = 101
"""Points of a normalised curve: one per cent each."""

FLAT: Final = (0.1, 0.25)
"""When after its strike a foot surely stands flat, also at the fastest recorded walk [s]."""


@dataclass(frozen=True)
class Stance:
    """A foot on the ground, from the frame of its strike to that of its toe-off."""

    side: Side
    strike: int
    toe_off: int

    @property
    def rows(self) -> slice:
        """All frames, strike and toe-off among them."""
        return slice(self.strike, self.toe_off + 1)


@dataclass(frozen=True)
class GaitCycle:
    """A stride: from a foot strike to the next one of the same foot, with the toe-off in between.

    All three are frames.
    """

    side: Side
    start: int
    toe_off: int
    end: int

    @property
    def rows(self) -> slice:
        """All frames, both strikes among them."""
        return slice(self.start, self.end + 1)


def stances(events: Sequence[Event]) -> tuple[Stance, ...]:
    """Return the stances that the recording shows from strike to toe-off, in order of time."""
    every = [
        Stance(side, *frames)
        for side in SIDES
        for frames in frames_of(events, side, "foot_strike", "toe_off")
    ]
    return tuple(sorted(every, key=lambda stance: stance.strike))


def gait_cycles(events: Sequence[Event]) -> tuple[GaitCycle, ...]:
    """Return the gait cycles that the recording shows in full, in order of time."""
    every = [
        GaitCycle(side, *frames)
        for side in SIDES
        for frames in frames_of(events, side, "foot_strike", "toe_off", "foot_strike")
    ]
    return tuple(sorted(every, key=lambda cycle: cycle.start))


def swings(events: Sequence[Event], side: Side) -> tuple[tuple[int, ...], ...]:
    """Return toe-off and next strike of a foot's swings that the recording shows in full."""
    return frames_of(events, side, "toe_off", "foot_strike")


def single_support(stance: Stance, events: Sequence[Event]) -> np.ndarray:
    """Return the frames of a stance in which the other foot is in the air."""
    frames = np.arange(stance.strike, stance.toe_off + 1)
    alone = np.zeros(frames.size, dtype=bool)
    for off, strike in swings(events, OTHER[stance.side]):
        alone |= (frames > off) & (frames < strike)
    return frames[alone]


def step_lengths(
    events: tuple[Event, ...], heels: Mapping[Side, np.ndarray], rate: float
) -> dict[Side, tuple[float, ...]]:
    """Return the lengths of the steps of each side [m].

    A step reaches from the other foot's heel to the stepping foot's, each taken while its foot
    stands flat, which is a tenth to a quarter of a second after its strike.

    Args:
        events: Foot strikes and toe-offs.
        heels: Per side, forward position of the heel [m], shape (n,).
        rate: Frames per second [1/s].
    """
    strikes = [event for event in events if event.kind == "foot_strike"]
    lengths: dict[Side, list[float]] = {side: [] for side in SIDES}
    for other, own in pairwise(strikes):
        length = _flat(heels[own.side], own, rate) - _flat(heels[other.side], other, rate)
        if own.side != other.side and np.isfinite(length):
            lengths[own.side].append(length)
    return {side: tuple(values) for side, values in lengths.items()}


def _flat(heel: np.ndarray, strike: Event, rate: float) -> float:
    """Return where the heel stands after a strike [m], NaN if the recording ends before."""
    first, last = (strike.frame + round(delay * rate) for delay in FLAT)
    return float(np.median(heel[first : last + 1])) if first < heel.size else np.nan


def walking_speed(motion: Trajectory) -> float:
    """Return the mean forward speed of the pelvis over a motion [m/s]."""
    forward = motion["pelvis_tx"]
    return float((forward[-1] - forward[0]) / motion.duration)


def joint_ranges(
    motions: Sequence[tuple[Trajectory, tuple[GaitCycle, ...]]],
) -> dict[str, tuple[float, float]]:
    """Return the lowest and highest angle [rad] of every joint over gait cycles."""
    ranges = {}
    for name in ANGLES:
        parts = [motion[name][cycle.rows] for motion, cycles in motions for cycle in cycles]
        if parts:
            values = np.concatenate(parts)
            ranges[name] = (float(values.min()), float(values.max()))
    return ranges


@dataclass(frozen=True)
class CycleBand:
    """Statistics over gait cycles, from strike (0 %) to the next strike of the same foot (100 %).

    Args:
        names: Column names, m of them.
        mean: Mean, shape (POINTS, m); NaN where no cycle has a value.
        deviation: Standard deviation between cycles, shape (POINTS, m).
        lowest: Smallest value, shape (POINTS, m).
        highest: Largest value, shape (POINTS, m).
        count: Number of cycles that have a value, shape (POINTS, m).
        toe_off: Mean position of the toe-off [%].
    """

    names: tuple[str, ...]
    mean: np.ndarray
    deviation: np.ndarray
    lowest: np.ndarray
    highest: np.ndarray
    count: np.ndarray
    toe_off: float


def resampled(columns: np.ndarray) -> np.ndarray:
    """Return columns over 0 to 100 % of their length, shape (n, m) to (POINTS, m)."""
    old, new = np.linspace(0.0, 1.0, len(columns)), np.linspace(0.0, 1.0, POINTS)
    return np.stack([np.interp(new, old, column) for column in columns.T], axis=1)


def cycle_band(trials: Sequence[tuple[Trajectory, tuple[GaitCycle, ...]]], side: Side) -> CycleBand:
    """Return mean and spread of curves, NaN where not measured, over the gait cycles of one side.

    Raises:
        DataError: If the trials show no complete cycle of that side.
    """
    own = [(curve, c) for curve, cycles in trials for c in cycles if c.side == side]
    if not own:
        raise DataError(f"the trials show no complete gait cycle of the {side} side")
    stacked = np.array([resampled(curve.values[cycle.rows]) for curve, cycle in own])
    toe_off = 100.0 * float(np.mean([(c.toe_off - c.start) / (c.end - c.start) for _, c in own]))
    known = np.ma.masked_invalid(stacked)
    over = (known.mean(axis=0), known.std(axis=0), known.min(axis=0), known.max(axis=0))
    mean, deviation, lowest, highest = (np.ma.filled(each, np.nan) for each in over)
    count = known.count(axis=0)
    return CycleBand(trials[0][0].names, mean, deviation, lowest, highest, count, toe_off)
