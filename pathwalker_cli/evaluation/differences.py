"""Root-mean-square differences of a stride to recordings: joint angles in two ways, and forces.

The article's programs took one recorded trial and compared angles at equal time from the beginning
of the stride (`one_trial`); its text says average recorded gait, which is compared over the per
cent of the gait cycle (`mean_cycle`).  Over the per cent of stance the forces of equal stages are
compared even if the stances differ in length; over the per cent of the cycle their timing counts
too, and so does swing.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Side
from pathwalker_cli.evaluation.norms import sides_shown
from pathwalker_cli.evaluation.recorded import RecordedGait, Spread, left_toe_off_stride, spread
from pathwalker_cli.stride.measure import CYCLE, FORCE, TRIAL, Measure
from pathwalker_cli.stride.stride import POINTS, Part, Stride

JOINTS: Final = {
    "pelvis": ("pelvis_tilt",),
    "hip": ("hip_r", "hip_l"),
    "knee": ("knee_r", "knee_l"),
    "ankle": ("ankle_r", "ankle_l"),
    "trunk": ("lumbar",),
}
"""Coordinates that share one root mean square."""

FORCE_RMS: Final[dict[str, tuple[Part, int]]] = {
    "rms_vertical_force_stance": ("stance", 1),
    "rms_vertical_force_cycle": ("stride", 1),
    "rms_forward_force_stance": ("stance", 0),
}
"""Differences of forces: over which span, and which component of (forward, up)."""

_CUT: Final = 4
"""Samples at the end of the recorded stride that the article's program leaves out."""
_DENSE: Final = 1e-3
"""Longest step between instants of a gait at which its nearest instant will do [s]."""


def _difference(key: str, label: str, unit: str, section: str) -> Measure:
    return Measure(key, label, unit, "", None, section=section)


DIFFERENCES: Final = (
    *(_difference(f"rms_one_trial_{joint}", joint, "rad", TRIAL) for joint in JOINTS),
    *(_difference(f"rms_mean_cycle_{joint}", joint, "rad", CYCLE) for joint in JOINTS),
    _difference("rms_vertical_force_stance", "vertical RMS, stance", "N", FORCE),
    _difference("rms_vertical_force_cycle", "vertical RMS, cycle", "N", FORCE),
    _difference("rms_forward_force_stance", "fore-aft RMS, stance", "N", FORCE),
)
"""What only a comparison with recordings gives."""


def rms_one_trial(stride: Stride, reference: Stride) -> dict[str, float]:
    """Return the RMS difference to one recorded stride at equal time [rad], by joint.

    As the article's program: right and left pooled, the end of the recorded stride left out, and
    the last posture standing for instants after the end of the gait.  It takes the nearest instant
    of its dense output; between instants further apart than a millisecond the angles are
    interpolated.  The recorded stride comes from `recorded.reference_stride`.
    """
    at, time = reference.time[:-_CUT], stride.time
    known = stride.q[:, : len(COORDINATES)]
    if np.diff(time).max() <= _DENSE:
        q = known[np.abs(time[:, None] - at).argmin(axis=0)]
    else:
        q = np.stack([np.interp(at, time, column) for column in known.T], axis=1)
    difference = q - reference.q[:-_CUT]
    return {
        joint: _rms(difference[:, [COORDINATES.index(name) for name in names]])
        for joint, names in JOINTS.items()
    }


def recorded_rms_one_trial(recorded: RecordedGait, reference: Stride) -> dict[str, Spread]:
    """Return `rms_one_trial` of strides of other trials, how much the patient varies [rad]."""
    strides = (left_toe_off_stride(recorded.walker, trial) for trial in recorded.trials)
    return _spreads(
        rms_one_trial(each, reference) for each in strides if each and each.name != reference.name
    )


def rms_mean_cycle(stride: Stride, recorded: RecordedGait) -> dict[str, float]:
    """Return the RMS difference to the mean recorded gait cycle [rad], by joint.

    Over the per cent of the gait cycle of each side that the stride shows, right and left pooled.
    """
    errors: dict[str, list[np.ndarray]] = {}
    for side in sides_shown(stride):
        cycles = [cycle.over_cycle(cycle.q, side) for cycle in recorded.of("stride", side)]
        known = stride.q[:, : len(COORDINATES)]
        difference = stride.over_cycle(known, side) - np.mean(cycles, axis=0)
        for joint, names in JOINTS.items():
            for name in names:
                if len(names) == 1 or name.endswith(f"_{SUFFIX[side]}"):
                    errors.setdefault(joint, []).append(difference[:, COORDINATES.index(name)])
    return {joint: _rms(np.array(each)) for joint, each in errors.items()}


def recorded_rms_mean_cycle(recorded: RecordedGait) -> dict[str, Spread]:
    """Return the RMS difference of single recorded cycles to their mean [rad], by joint."""
    return _spreads(rms_mean_cycle(cycle, recorded) for cycle in recorded.cycles)


def force_rms(stride: Stride, recorded: RecordedGait) -> dict[str, float]:
    """Return the RMS differences to the mean measured force [N], right and left pooled.

    Returns:
        The keys of `FORCE_RMS`; without those of which a side was not measured.
    """
    values = {}
    for key, (span, axis) in FORCE_RMS.items() if stride.force else ():
        curves = {side: _forces(recorded, span, side)[:, :, axis] for side in SIDES}
        if all(map(len, curves.values())):
            errors = [
                _over(stride, span, side)[:, axis] - c.mean(axis=0) for side, c in curves.items()
            ]
            values[key] = _rms(np.array(errors))
    return values


def recorded_force_rms(recorded: RecordedGait) -> dict[str, Spread]:
    """Return the RMS differences of single measured curves to the mean of their side [N]."""
    single: dict[str, list[float]] = {key: [] for key in FORCE_RMS}
    for key, (span, axis) in FORCE_RMS.items():
        for side in SIDES:
            curves = _forces(recorded, span, side)[:, :, axis]
            if len(curves) > 1:
                single[key] += [_rms(curve - curves.mean(axis=0)) for curve in curves]
    return {key: each for key, values in single.items() if (each := spread(values))}


def _over(stride: Stride, span: Part, side: Side) -> np.ndarray:
    """Return the force on a foot over its stance or its gait cycle [N], shape (POINTS, 2)."""
    over = stride.over_stance if span == "stance" else stride.over_cycle
    return over(stride.force[side], side)


def _forces(recorded: RecordedGait, span: Part, side: Side) -> np.ndarray:
    """Return the measured forces of a side over a span [N], shape (curves, POINTS, 2)."""
    curves = [_over(each, span, side) for each in recorded.of(span, side) if each.force]
    known = [curve for curve in curves if np.isfinite(curve).all()]
    return np.array(known).reshape(-1, POINTS, 2)


def _rms(values: np.ndarray) -> float:
    """Return the root mean square of all values."""
    return float(np.sqrt(np.mean(values**2)))


def _spreads(single: Iterable[Mapping[str, float]]) -> dict[str, Spread]:
    """Return mean and range by joint."""
    each = list(single)
    spreads = {joint: spread(values[joint] for values in each) for joint in JOINTS}
    return {joint: value for joint, value in spreads.items() if value is not None}
