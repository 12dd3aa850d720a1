"""Stances, gait cycles and steps from foot strikes and toe-offs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SIDES, Side
from pathwalker_cli.io.c3d import Event
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "GaitCycle",
    "Stance",
    "gait_cycles",
    "joint_ranges",
    "stances",
    "step_lengths",
    "swings",
    "walking_speed",
]

FLAT: Final = (0.1, 0.25)
"""When after its strike a foot surely stands flat, also at the fastest recorded walk [s]."""


@dataclass(frozen=True)
class Stance:
    """A foot on the ground.

    Args:
        side: "right" or "left".
        strike: Frame of the foot strike.
        toe_off: Frame of the toe-off.
    """

    side: Side
    strike: int
    toe_off: int


@dataclass(frozen=True)
class GaitCycle:
    """A stride: from a foot strike to the next one of the same foot.

    Args:
        side: "right" or "left".
        start: Frame of the first strike.
        toe_off: Frame of the toe-off in between.
        end: Frame of the next strike.
    """

    side: Side
    start: int
    toe_off: int
    end: int


def stances(events: tuple[Event, ...]) -> tuple[Stance, ...]:
    """Return the stances that the recording shows from strike to toe-off, in order of time."""
    found = []
    for side in SIDES:
        own = [event for event in events if event.side == side]
        for first, second in pairwise(own):
            if (first.kind, second.kind) == ("foot_strike", "toe_off"):
                found.append(Stance(first.side, first.frame, second.frame))
    return tuple(sorted(found, key=lambda stance: stance.strike))


def gait_cycles(events: tuple[Event, ...]) -> tuple[GaitCycle, ...]:
    """Return the gait cycles that the recording shows in full, in order of time."""
    found = []
    for side in SIDES:
        own = [event for event in events if event.side == side]
        for first, off, second in zip(own, own[1:], own[2:], strict=False):
            kinds = (first.kind, off.kind, second.kind)
            if kinds == ("foot_strike", "toe_off", "foot_strike"):
                found.append(GaitCycle(first.side, first.frame, off.frame, second.frame))
    return tuple(sorted(found, key=lambda cycle: cycle.start))


def swings(events: tuple[Event, ...], side: Side) -> tuple[tuple[int, int], ...]:
    """Return toe-off and next strike of a foot's swings that the recording shows in full."""
    own = [event for event in events if event.side == side]
    return tuple(
        (off.frame, strike.frame)
        for off, strike in pairwise(own)
        if (off.kind, strike.kind) == ("toe_off", "foot_strike")
    )


def step_lengths(
    events: tuple[Event, ...], heels: Mapping[Side, np.ndarray], rate: float
) -> dict[Side, tuple[float, ...]]:
    """Return the lengths of the steps of each side.

    A step reaches from the other foot's heel to the stepping foot's, each taken while its foot
    stands flat, which is a tenth to a quarter of a second after its strike.

    Args:
        events: Foot strikes and toe-offs.
        heels: Per side, forward position of the heel [m], shape (n,).
        rate: Frames per second [1/s].

    Returns:
        Per side, lengths of its steps [m].
    """
    strikes = [event for event in events if event.kind == "foot_strike"]
    lengths: dict[Side, list[float]] = {"right": [], "left": []}
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
    motions: tuple[tuple[Trajectory, tuple[GaitCycle, ...]], ...],
) -> dict[str, tuple[float, float]]:
    """Return the lowest and highest angle [rad] of every joint over gait cycles.

    Args:
        motions: Motions of several trials with their cycles.
    """
    ranges = {}
    for name in COORDINATES[2:]:
        parts = [
            motion[name][cycle.start : cycle.end + 1]
            for motion, cycles in motions
            for cycle in cycles
        ]
        if parts:
            values = np.concatenate(parts)
            ranges[name] = (float(values.min()), float(values.max()))
    return ranges
