"""Root-mean-square differences of joint angles, in the two ways in which the article has them.

Its programs took one recorded trial and compared at equal time from the beginning of the stride
(`rms_one_trial`); its text says average recorded gait, which is compared over the per cent of the
gait cycle (`rms_mean_cycle`).
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SUFFIX, Side
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.evaluation.reference import ReferenceStride, left_toe_off_stride
from pathwalker_cli.evaluation.spread import Spread, spread
from pathwalker_cli.inverse.cycles import cycle_band, resampled
from pathwalker_cli.stride.cycle import BOTH_SIDES
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "JOINTS",
    "recorded_rms_mean_cycle",
    "recorded_rms_one_trial",
    "rms_mean_cycle",
    "rms_one_trial",
]

JOINTS: Final = {
    "pelvis": ("pelvis_tilt",),
    "hip": ("hip_r", "hip_l"),
    "knee": ("knee_r", "knee_l"),
    "ankle": ("ankle_r", "ankle_l"),
    "trunk": ("lumbar",),
}
"""Coordinates that share one root mean square."""

_CUT: Final = 4
"""Samples at the end of the recorded stride that the article's program leaves out."""

_DENSE: Final = 1e-3
"""Longest step between instants of a gait at which its nearest instant will do [s]."""


def rms_one_trial(gait: Gait, reference: ReferenceStride) -> dict[str, float]:
    """Return the RMS difference to one recorded stride at equal time [rad], per joint.

    As the article's program: right and left pooled, the end of the recorded stride left out, and
    the last posture standing for instants after the end of the gait.  It takes the nearest instant
    of its dense output; between instants further apart than a millisecond the angles are
    interpolated.

    Args:
        gait: The gait.
        reference: The recorded stride, from `reference.reference_stride`.
    """
    return _one_trial(gait.time, gait.q, reference.motion)


def recorded_rms_one_trial(recorded: RecordedGait, reference: ReferenceStride) -> dict[str, Spread]:
    """Return `rms_one_trial` of strides of other trials: how much the patient varies.

    Args:
        recorded: The recordings.
        reference: The stride to compare with.

    Returns:
        Per joint [rad]; empty if there is no other stride.
    """
    strides = [left_toe_off_stride(trial) for trial in recorded.trials]
    return _spreads(
        [
            _one_trial(stride.motion.time, stride.motion.values, reference.motion)
            for stride in strides
            if stride is not None and stride.trial != reference.trial
        ]
    )


def rms_mean_cycle(gait: Gait, recorded: RecordedGait) -> dict[str, float]:
    """Return the RMS difference to the mean recorded gait cycle [rad], per joint.

    Over the per cent of the gait cycle of each side, right and left pooled.

    Args:
        gait: The gait.
        recorded: The recordings, with complete cycles of both sides.
    """
    errors: dict[str, list[np.ndarray]] = {}
    for side in BOTH_SIDES:
        mean = _mean_cycle(recorded, side)
        curves = gait.over_cycle(gait.q, side)
        _add(errors, side, curves - mean)
    return _pooled(errors)


def recorded_rms_mean_cycle(recorded: RecordedGait) -> dict[str, Spread]:
    """Return the RMS difference of single recorded cycles to their mean [rad], per joint."""
    single = []
    for side in BOTH_SIDES:
        mean = _mean_cycle(recorded, side)
        for trial, cycle in recorded.cycles(side):
            errors: dict[str, list[np.ndarray]] = {}
            curves = resampled(trial.motion.values[cycle.start : cycle.end + 1])
            _add(errors, side, curves - mean)
            single.append(_pooled(errors))
    return _spreads(single)


def _one_trial(time: np.ndarray, q: np.ndarray, reference: Trajectory) -> dict[str, float]:
    """Return the RMS difference of coordinates at n instants, shape (n, 10), to a stride."""
    at, wanted = reference.time[:-_CUT], reference.values[:-_CUT]
    if np.diff(time).max() <= _DENSE:
        found = q[np.abs(time[:, None] - at).argmin(axis=0)]
    else:
        found = np.stack([np.interp(at, time, column) for column in q.T], axis=1)
    difference = found - wanted
    return {
        joint: _rms(difference[:, [COORDINATES.index(name) for name in names]])
        for joint, names in JOINTS.items()
    }


def _mean_cycle(recorded: RecordedGait, side: Side) -> np.ndarray:
    """Return the mean over all recorded gait cycles of a side, shape (POINTS, 10)."""
    trials = [(trial.motion, trial.cycles) for trial in recorded.trials]
    return cycle_band(trials, side).mean


def _add(errors: dict[str, list[np.ndarray]], side: Side, difference: np.ndarray) -> None:
    """Add the differences of a side's joints, and of the midline in its cycle."""
    for joint, names in JOINTS.items():
        for name in names:
            if len(names) == 1 or name.endswith(f"_{SUFFIX[side]}"):
                errors.setdefault(joint, []).append(difference[:, COORDINATES.index(name)])


def _pooled(errors: Mapping[str, list[np.ndarray]]) -> dict[str, float]:
    """Return the root mean square per joint."""
    return {joint: _rms(np.array(found)) for joint, found in errors.items()}


def _rms(values: np.ndarray) -> float:
    """Return the root mean square of all values."""
    return float(np.sqrt(np.mean(values**2)))


def _spreads(single: list[dict[str, float]]) -> dict[str, Spread]:
    """Return mean and range per joint."""
    found = {joint: spread(each[joint] for each in single) for joint in JOINTS}
    return {joint: value for joint, value in found.items() if value is not None}
