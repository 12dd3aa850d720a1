"""Maximum isometric torques from recorded gait, as in section 2.2.1 of the article.

The patient is assumed to walk at 90 % of capability: at the peak of a joint's extension torque the
activation is 0.9, and equation (1) gives the maximum isometric torque.  The peak is that of the
mean over all measured stances, which a single stance's strike does not decide.  Flexion follows
from the ratio of strengths of healthy adults, the trunk from the mean of both hips.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023.
    Anderson et al. (2007), J. Biomech. 40, 3105-3113.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Protocol

import numpy as np

from pathwalker_cli.conventions import LEG_JOINTS, SIDES, SUFFIX
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.bands import resampled
from pathwalker_cli.inverse.filters import MOTION_CUTOFF
from pathwalker_cli.inverse.process import smooth_motion
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.io.fields import Sides
from pathwalker_cli.model.elements.muscle import MuscleTorqueGenerator, curves_of, generators
from pathwalker_cli.patient.blocks import Strengths
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "ACTIVATION_AT_PEAK",
    "MeasuredTrial",
    "Peak",
    "extension_peaks",
    "isometric_torque",
    "stance_curves",
    "strengths",
    "strengths_of",
]

ACTIVATION_AT_PEAK: Final = 0.9
"""Activation at the peak of the torque, article, section 2.2.1."""


class MeasuredTrial(Protocol):
    """A trial with torques, whatever else is known about it."""

    @property
    def motion(self) -> Trajectory:
        """Coordinates in every frame, unfiltered [m, rad]."""

    @property
    def tau(self) -> Trajectory | None:
        """Generalised forces [N, N m], NaN where not measured, or None."""

    @property
    def stances(self) -> tuple[StanceForce, ...]:
        """What the plates know about every stance."""


@dataclass(frozen=True)
class Peak:
    """Peak of the mean extension torque of one joint.

    Args:
        generator: Name of the extension generator, "hip_extension_r".
        torque: Peak of the torque in the direction of extension [N m].
        angle: Mean joint angle there [rad].
        speed: Mean joint speed there [rad/s].
        strength: Maximum isometric torque that it takes [N m].
        count: Number of curves in the mean.
    """

    generator: str
    torque: float
    angle: float
    speed: float
    strength: float
    count: int


def isometric_torque(
    generator: MuscleTorqueGenerator, torque: float, angle: float, speed: float
) -> float:
    """Return tau_0 [N m] for which equation (1) gives this torque at an activation of 0.9.

    Args:
        generator: The muscle torque generator.
        torque: Torque in its direction [N m].
        angle: Joint angle [rad].
        speed: Joint speed [rad/s].
    """
    factor = float(generator.angle_factor(angle)) * float(generator.velocity_factor(speed))
    return torque / (ACTIVATION_AT_PEAK * factor)


def stance_curves(
    trials: Sequence[MeasuredTrial], cutoff: float = MOTION_CUTOFF
) -> dict[str, list[np.ndarray]]:
    """Return torque, angle and speed of every leg joint over every measured stance.

    Args:
        trials: Trials without an orthosis, whose torque would add to the muscles'.
        cutoff: Cut-off frequency of the motion [Hz], that of the torques.

    Returns:
        Per coordinate, arrays of shape (POINTS, 3): torque [N m], angle [rad], speed [rad/s].
    """
    curves: dict[str, list[np.ndarray]] = {}
    for trial in trials:
        if trial.tau is None:
            continue
        parts = (trial.tau, *smooth_motion(trial.motion, cutoff))
        for item in trial.stances:
            rows = slice(item.stance.strike, item.stance.toe_off + 1)
            for joint in LEG_JOINTS:
                name = f"{joint}_{SUFFIX[item.stance.side]}"
                columns = np.stack([part[name][rows] for part in parts], axis=1)
                if item.measured and np.isfinite(columns).all():
                    curves.setdefault(name, []).append(resampled(columns))
    return curves


def extension_peaks(means: Mapping[str, np.ndarray], counts: Mapping[str, int]) -> tuple[Peak, ...]:
    """Return the peaks of hip, knee and ankle extension in mean curves.

    Args:
        means: Per coordinate, mean torque, angle and speed, shape (POINTS, 3).
        counts: Per coordinate, number of curves in the mean.
    """
    peaks = []
    for generator in generators():
        if "extension" not in generator.name or generator.coordinate not in means:
            continue
        torque, angle, speed = means[generator.coordinate].T
        extension = generator.torque_sign * torque
        top = int(np.argmax(extension))
        values = (float(extension[top]), float(angle[top]), float(speed[top]))
        strength = isometric_torque(generator, *values)
        peaks.append(Peak(generator.name, *values, strength, counts[generator.coordinate]))
    return tuple(peaks)


def strengths(trials: Sequence[MeasuredTrial], cutoff: float = MOTION_CUTOFF) -> Strengths:
    """Return all strengths [N m] from the mean torque of each joint over its measured stances.

    Args:
        trials: Trials without an orthosis.
        cutoff: Cut-off frequency of the motion [Hz], that of the torques.

    Raises:
        DataError: If a joint has no measured stance.
    """
    curves = stance_curves(trials, cutoff)
    means = {name: np.mean(found, axis=0) for name, found in curves.items()}
    counts = {name: len(found) for name, found in curves.items()}
    return strengths_of(extension_peaks(means, counts))


def strengths_of(peaks: tuple[Peak, ...]) -> Strengths:
    """Return all strengths [N m]: flexion by Anderson's ratios, the trunk by the mean of the hips.

    Raises:
        DataError: If a joint has no peak.
    """
    found = {peak.generator: peak.strength for peak in peaks}
    values: dict[str, Sides[float]] = {}
    for joint in LEG_JOINTS:
        sides = {side: _known(found, f"{joint}_extension_{SUFFIX[side]}") for side in SIDES}
        ratio = _extension_over_flexion(joint)
        values[f"{joint}_extension"] = Sides(**sides)
        values[f"{joint}_flexion"] = Sides(**{side: x / ratio for side, x in sides.items()})
    hips = values["hip_extension"]
    trunk = 0.5 * (hips.right + hips.left)
    flexion = trunk / _extension_over_flexion("hip")
    dumped = {name: value.model_dump() for name, value in values.items()}
    return Strengths.model_validate(dumped | {"lumbar_extension": trunk, "lumbar_flexion": flexion})


def _known(found: Mapping[str, float], generator: str) -> float:
    """Return the strength of a generator [N m]."""
    if generator not in found:
        raise DataError(
            f"no measured stance shows {generator}",
            mend="add trials in which that foot alone stands on a force plate",
        )
    return found[generator]


def _extension_over_flexion(joint: str) -> float:
    """Return the ratio of peak isometric torques of healthy adults, Anderson's c1."""
    return curves_of(f"{joint}_extension_r").strength / curves_of(f"{joint}_flexion_r").strength
