"""Events of a stride and the gait cycle of each side."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.stride.series import GaitSeries

__all__ = [
    "BOTH_SIDES",
    "STRIKE_PHASE",
    "TOE_OFF_PHASE",
    "OwnCycle",
    "foot_strike_time",
    "own_cycle",
    "switching_times",
    "toe_off_time",
]

BOTH_SIDES: Final[tuple[Side, Side]] = (SIDES[0], SIDES[1])
"""`conventions.SIDES` as what they are to a type checker."""

STRIKE_PHASE: Final[dict[Side, str]] = {
    "right": "left_toe_right_heel",
    "left": "right_toe_left_heel",
}
"""Phase that begins with the foot strike of a side."""
TOE_OFF_PHASE: Final[dict[Side, str]] = {"right": "left_flat", "left": "right_flat"}
"""Phase that begins with the toe-off of a side."""


def switching_times(series: GaitSeries) -> np.ndarray:
    """Return the beginnings of the eight phases and the end of the last one [s], shape (9,).

    Raises:
        DataError: If the motion is not one stride in the eight phases.
    """
    names = tuple(phase.name for phase in series.motion.phases)
    if names != PHASE_NAMES:
        raise DataError(
            f"a motion of the phases {', '.join(names)} is no full stride",
            allowed=", ".join(PHASE_NAMES),
        )
    return np.concatenate([[0.0], np.cumsum(series.motion.durations)])


def foot_strike_time(series: GaitSeries, side: Side) -> float:
    """Return when the heel of a side strikes the ground [s]."""
    return float(switching_times(series)[PHASE_NAMES.index(STRIKE_PHASE[side])])


def toe_off_time(series: GaitSeries, side: Side) -> float:
    """Return when the toe of a side leaves the ground [s]."""
    return float(switching_times(series)[PHASE_NAMES.index(TOE_OFF_PHASE[side])])


@dataclass(frozen=True)
class OwnCycle:
    """The gait cycle of one side, from its foot strike to its next one.

    The stride is periodic, so its instants before the strike follow those after it.

    Args:
        side: "right" or "left".
        index: Rows of the series in the order of this cycle, shape (n + 1,).
        percent: Their positions in the cycle [%], from 0 to 100, shape (n + 1,).
        toe_off: Position of the side's toe-off [%].
    """

    side: Side
    index: np.ndarray
    percent: np.ndarray
    toe_off: float


def own_cycle(series: GaitSeries, side: Side) -> OwnCycle:
    """Return the gait cycle of a side."""
    strike, duration = foot_strike_time(series, side), series.duration
    first = int(np.argmin(np.abs(series.time - strike)))
    index = np.concatenate([np.arange(first, series.time.size), np.arange(first + 1)])
    later = np.repeat([0.0, duration], [series.time.size - first, first + 1])
    percent = 100.0 * (series.time[index] + later - series.time[first]) / duration
    toe_off = 100.0 * ((toe_off_time(series, side) - strike) % duration) / duration
    return OwnCycle(side, index, percent, toe_off)
