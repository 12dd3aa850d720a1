"""Maximum isometric torques from recorded gait, as in section 2.2.1 of the article.

The patient is assumed to walk at 90 % of capability: at the peak of a joint's extension torque the
activation is 0.9, and equation (1) gives the maximum isometric torque.  The peak is that of the
mean over all measured stances, which a single stance's strike does not decide.  Flexion follows
from the ratio of strengths of healthy adults, the trunk from the mean of both hips.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, table 1.
    Anderson et al. (2007), J. Biomech. 40, 3105-3113.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from pydantic import ValidationError

from pathwalker_cli.conventions import GENERATORS, LEG_JOINTS, SIDES, SUFFIX
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import resampled
from pathwalker_cli.inverse.dynamics import MOTION_CUTOFF, frame_rate, smooth_rates
from pathwalker_cli.inverse.published import forward_difference, published_filter
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.io.fields import Sides
from pathwalker_cli.model.elements.muscle import MuscleTorqueGenerator, curves_of, generators
from pathwalker_cli.model.elements.tissue import passive_series
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Strengths

ACTIVATION_AT_PEAK: Final = 0.9
"""Activation at the peak of the torque, article, section 2.2.1."""


@dataclass(frozen=True)
class Peak:
    """Peak of the mean extension torque of one joint.

    Args:
        generator: Name of the extension generator, "hip_extension_r".
        torque: Peak of the torque in the direction of extension [N m].
        angle: Mean joint angle there [rad].
        speed: Mean joint speed there [rad/s].
        strength: Maximum isometric torque that it takes [N m].
        single: Maximum isometric torque by each curve in the mean alone [N m].
    """

    generator: str
    torque: float
    angle: float
    speed: float
    strength: float
    single: tuple[float, ...]


@dataclass(frozen=True)
class StrengthRow:
    """Maximum isometric torque of one generator.

    Args:
        generator: Its name.
        value: Estimated strength [N m].
        given: Strength in the patient's file [N m], or None.
        peak: Where the strength comes from; None for those that follow from others by ratio.
        remark: What to be careful about, in words, "" if nothing.
    """

    generator: str
    value: float
    given: float | None
    peak: Peak | None
    remark: str

    @property
    def deviation(self) -> float | None:
        """Deviation from the patient's file as a share of it."""
        return None if self.given is None else self.value / self.given - 1.0


@dataclass(frozen=True)
class StrengthTable:
    """All strengths, or why there are none."""

    rows: tuple[StrengthRow, ...]
    strengths: Strengths | None
    reason: str


def strength_table(
    trials: Sequence[Trial], patient: Patient, config: InverseDynamicsConfig
) -> StrengthTable:
    """Return all strengths by the barefoot trials, beside those of the patient's file."""
    barefoot = [t for t in trials if t.condition == "barefoot" and t.tau is not None]
    curves = stance_curves(barefoot, config.motion_cutoff, patient if config.tissue else None)
    peaks = extension_peaks(curves, any(trial.published for trial in barefoot))
    try:
        strengths = strengths_of(peaks)
    except DataError as problem:
        return StrengthTable((), None, str(problem) if barefoot else "no barefoot trials")
    except ValidationError:
        worst = min(peaks, key=lambda peak: peak.strength)
        return StrengthTable((), None, f"{worst.generator} comes out as {worst.strength:.3g} N m")
    by_name = {peak.generator: peak for peak in peaks}
    given = patient.strengths.vector() if patient.strengths else (None,) * len(GENERATORS)
    rows = []
    for name, value, known in zip(GENERATORS, strengths.vector(), given, strict=True):
        peak = by_name.get(name)
        ratio = "mean of both hips" if name == "lumbar_extension" else "ratio to extension"
        rows.append(StrengthRow(name, value, known, peak, _remark(peak, config) if peak else ratio))
    return StrengthTable(tuple(rows), strengths, "")


def stance_curves(
    trials: Sequence[Trial], cutoff: float = MOTION_CUTOFF, patient: Patient | None = None
) -> dict[str, list[np.ndarray]]:
    """Return torque, angle and speed of every leg joint over every measured stance.

    The published method takes its gait cycles instead, and does not filter.

    Args:
        trials: Trials without an orthosis, whose torque would add to the muscles'.
        cutoff: Cut-off frequency of the motion [Hz], that of the torques.
        patient: Whose passive torques are not the muscles'; None to leave them in.

    Returns:
        Per coordinate, arrays of shape (POINTS, 3): torque [N m], angle [rad], speed [rad/s].
    """
    curves: dict[str, list[np.ndarray]] = {}
    for trial in trials:
        if trial.tau is None:
            continue
        motion = trial.motion
        if trial.published:
            q, v = motion.values, forward_difference(motion.values, frame_rate(motion))
            spans = [(cycle.side, cycle.rows) for cycle in trial.cycles]
        else:
            q, v, _ = smooth_rates(motion, cutoff)
            spans = [(s.stance.side, s.stance.rows) for s in trial.stances if s.measured]
        passive = {} if patient is None else passive_series(patient, motion.names, q, v)
        for side, rows in spans:
            for name in (f"{joint}_{SUFFIX[side]}" for joint in LEG_JOINTS):
                column = motion.names.index(name)
                torque = trial.tau[name] - passive.get(name, 0.0)
                parts = (torque[rows], q[rows, column], v[rows, column])
                curve = np.stack(parts, axis=1)
                if np.isfinite(curve).all():
                    curves.setdefault(name, []).append(resampled(curve))
    return curves


def extension_peaks(
    curves: Mapping[str, Sequence[np.ndarray]], published: bool = False
) -> tuple[Peak, ...]:
    """Return the peaks of extension in the means of `stance_curves`, smoothed if `published`."""

    def peak(generator: MuscleTorqueGenerator, every: Sequence[np.ndarray]) -> Peak:
        mean = np.mean(every, axis=0)
        torque, angle, speed = (published_filter(mean) if published else mean).T
        extension = generator.torque_sign * torque
        top = int(np.argmax(extension))
        values = (float(extension[top]), float(angle[top]), float(speed[top]))
        strength = isometric_torque(generator, *values)
        more = len(every) > 1
        single = tuple(peak(generator, [one]).strength for one in every) if more else (strength,)
        return Peak(generator.name, *values, strength, single)

    return tuple(
        peak(generator, curves[generator.coordinate])
        for generator in generators()
        if "extension" in generator.name and generator.coordinate in curves
    )


def isometric_torque(
    generator: MuscleTorqueGenerator, torque: float, angle: float, speed: float
) -> float:
    """Return tau_0 [N m] for which equation (1) gives this torque at an activation of 0.9.

    Torque in the direction of the generator [N m], joint angle [rad] and speed [rad/s].
    """
    factor = float(generator.angle_factor(angle)) * float(generator.velocity_factor(speed))
    return torque / (ACTIVATION_AT_PEAK * factor)


def strengths_of(peaks: Sequence[Peak]) -> Strengths:
    """Return all strengths [N m]: flexion by Anderson's ratios, the trunk by the mean of the hips.

    Raises:
        DataError: If a joint has no peak.
    """
    known = {peak.generator: peak.strength for peak in peaks}
    values: dict[str, Sides[float]] = {}
    for joint in LEG_JOINTS:
        names = {side: f"{joint}_extension_{SUFFIX[side]}" for side in SIDES}
        for name in names.values():
            if name not in known:
                raise DataError(
                    f"no measured stance shows {name}",
                    mend="add trials in which that foot alone stands on a force plate",
                )
        sides = {side: known[name] for side, name in names.items()}
        ratio = _extension_over_flexion(joint)
        values[f"{joint}_extension"] = Sides(**sides)
        values[f"{joint}_flexion"] = Sides(**{side: x / ratio for side, x in sides.items()})
    hips = values["hip_extension"]
    trunk = 0.5 * (hips.right + hips.left)
    flexion = trunk / _extension_over_flexion("hip")
    dumped = {name: value.model_dump() for name, value in values.items()}
    return Strengths.model_validate(dumped | {"lumbar_extension": trunk, "lumbar_flexion": flexion})


def _extension_over_flexion(joint: str) -> float:
    """Return the ratio of peak isometric torques of healthy adults, Anderson's c1."""
    return curves_of(f"{joint}_extension_r").strength / curves_of(f"{joint}_flexion_r").strength


def _remark(peak: Peak, config: InverseDynamicsConfig) -> str:
    """Return in words why a strength is uncertain."""
    remarks = []
    count, low, high = len(peak.single), min(peak.single), max(peak.single)
    if count < config.least_stances:
        remarks.append(f"only {count} stance{'s' if count > 1 else ''}")
    generator = next(g for g in generators() if g.name == peak.generator)
    changes = {}
    for sign in (1.0, -1.0):
        angle, speed = sign * config.angle_error, sign * config.speed_error
        for name, da, dv in ((f"{angle:+g} rad", angle, 0.0), (f"{speed:+g} rad/s", 0.0, speed)):
            value = isometric_torque(generator, peak.torque, peak.angle + da, peak.speed + dv)
            changes[name] = value / peak.strength - 1.0
    worst = max(changes, key=lambda name: abs(changes[name]))
    if abs(changes[worst]) > config.largest_sensitivity:
        remarks.append(f"ill-conditioned: {worst} changes it by {changes[worst]:+.0%}")
    if high > 1.5 * low:
        remarks.append(f"single stances give {low:.0f} to {high:.0f} N m")
    return "; ".join(remarks)
