"""The numbers that describe a gait: speed, steps, crouch, loads, work and effort."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GENERATORS, ROOT, SUFFIX, Side
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.stride.ankle_profile import ankle_torque_slope
from pathwalker_cli.stride.cycle import (
    BOTH_SIDES,
    foot_strike_time,
    switching_times,
    toe_off_time,
)
from pathwalker_cli.stride.feet import (
    in_contact,
    loaded,
    point_rows,
    stance,
    vertical_point_force,
)
from pathwalker_cli.stride.series import GaitSeries

__all__ = ["GaitMetrics", "gait_metrics"]

PerSide = dict[Side, float]

_WEIGHTS_SUFFIX: Final = "_body_weights"


@dataclass(frozen=True)
class GaitMetrics:
    """One stride in numbers; SI units and radians, signs as in `conventions`.

    Body weight and mass include the orthosis, as the ground carries both.

    Args:
        distance: Distance of the stride [m].
        stride_time: Time of the stride [s].
        walking_speed: Distance over time [m/s].
        cadence: Steps per minute [1/min].
        step_length: Per side, from the other foot's heel to this foot's heel, both flat [m].
        stance_share: Per side, share of the stride with the foot on the ground.
        swing_share: Per side, share of the stride with the foot in the air.
        double_support_share: Share of the stride with both feet on the ground.
        phase_durations: Per phase [s].
        min_stance_knee_flexion: Per side, least knee flexion of stance [rad]: the crouch measure.
        min_stance_knee_flexion_time: Per side, when that is [s].
        joint_range: Per coordinate but the pelvis position, least and largest value [rad].
        body_weight: Weight, with orthoses if they are worn [N].
        peak_vertical_force: Per side, largest vertical ground reaction force [N].
        peak_vertical_force_body_weights: The same over body weight.
        min_vertical_force: Least vertical force on a contact point in contact [N]; below zero the
            ground would have to pull.
        max_friction_ratio: Per side, largest |forward| / vertical force while loaded.
        peak_joint_moment: Per joint, net moment of largest magnitude, with its sign [N m].
        peak_joint_moment_per_mass: The same over mass [N m/kg].
        peak_activation: Per generator, largest activation.
        positive_muscle_work: Work that generators did, each for itself [J].
        negative_muscle_work: Work that generators took up, each for itself, negative [J].
        positive_orthosis_work: Work that the orthoses gave back [J].
        negative_orthosis_work: Work that the orthoses took up, negative [J].
        effort: Integral of the sum of squared activations [s].
        effort_per_distance: Effort over distance [s/m].
        max_height_violation: How far a contact point is below the ground at most [m].
        ankle_torque_slope: Per side, see `ankle_profile.ankle_torque_slope` [N m/rad].
        dorsiflexion_stiffness: Per side, K_D [N m/rad]; None when barefoot.
        plantarflexion_stiffness: Per side, K_P [N m/rad]; None when barefoot.
    """

    distance: float
    stride_time: float
    walking_speed: float
    cadence: float
    step_length: PerSide
    stance_share: PerSide
    swing_share: PerSide
    double_support_share: float
    phase_durations: dict[str, float]
    min_stance_knee_flexion: PerSide
    min_stance_knee_flexion_time: PerSide
    joint_range: dict[str, tuple[float, float]]
    body_weight: float
    peak_vertical_force: PerSide
    peak_vertical_force_body_weights: PerSide
    min_vertical_force: float
    max_friction_ratio: PerSide
    peak_joint_moment: dict[str, float]
    peak_joint_moment_per_mass: dict[str, float]
    peak_activation: dict[str, float]
    positive_muscle_work: float
    negative_muscle_work: float
    positive_orthosis_work: float
    negative_orthosis_work: float
    effort: float
    effort_per_distance: float
    max_height_violation: float
    ankle_torque_slope: PerSide
    dorsiflexion_stiffness: PerSide | None
    plantarflexion_stiffness: PerSide | None

    def as_dict(self) -> dict[str, Any]:
        """Return the metrics ready for JSON: one key per side, None for what does not exist.

        Values per phase, coordinate or generator stay together under one key.
        """
        flat: dict[str, Any] = {}
        for field in fields(self):
            value = getattr(self, field.name)
            if value is None or (isinstance(value, dict) and set(value) == set(BOTH_SIDES)):
                stem = field.name.removesuffix(_WEIGHTS_SUFFIX)
                suffix = field.name.removeprefix(stem)
                flat |= {f"{stem}_{s}{suffix}": value and _plain(value[s]) for s in BOTH_SIDES}
            else:
                flat[field.name] = _plain(value)
        return flat


def _plain(value: Any) -> Any:
    """Return a value without NumPy types, tuples and numbers that JSON does not know."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return float(value) if np.isfinite(value) else None


def gait_metrics(series: GaitSeries) -> GaitMetrics:
    """Return the metrics of one stride.

    Raises:
        DataError: If the motion is not one stride in the eight phases.
    """
    return GaitMetrics(
        **_steps_and_timing(series), **_angles(series), **_loads(series), **_energetics(series)
    )


def _steps_and_timing(series: GaitSeries) -> dict[str, Any]:
    """Return the metrics of speed, steps and phases."""
    time, distance = series.duration, series.distance
    shares = {side: _stance_share(series, side) for side in BOTH_SIDES}
    durations = np.diff(switching_times(series)).tolist()
    return {
        "distance": distance,
        "stride_time": time,
        "walking_speed": distance / time,
        "cadence": 120.0 / time,
        "step_length": _step_lengths(series),
        "stance_share": shares,
        "swing_share": {side: 1.0 - share for side, share in shares.items()},
        "double_support_share": sum(shares.values()) - 1.0,
        "phase_durations": dict(zip(PHASE_NAMES, durations, strict=True)),
    }


def _angles(series: GaitSeries) -> dict[str, Any]:
    """Return the metrics of joint angles and foot heights."""
    crouch = {side: _crouch(series, side) for side in BOTH_SIDES}
    return {
        "min_stance_knee_flexion": {side: angle for side, (angle, _) in crouch.items()},
        "min_stance_knee_flexion_time": {side: time for side, (_, time) in crouch.items()},
        "joint_range": _joint_ranges(series),
        "max_height_violation": float(max(0.0, -series.contact_position[:, :, 1].min())),
    }


def _loads(series: GaitSeries) -> dict[str, Any]:
    """Return the metrics of ground forces and joint moments."""
    weight, mass = series.walker.weight, series.walker.total_mass
    peaks = {side: float(series.vertical_force(side).max()) for side in BOTH_SIDES}
    moments = _peak_moments(series)
    return {
        "body_weight": weight,
        "peak_vertical_force": peaks,
        "peak_vertical_force_body_weights": {s: peak / weight for s, peak in peaks.items()},
        "min_vertical_force": float(vertical_point_force(series)[in_contact(series)].min()),
        "max_friction_ratio": {side: _friction_ratio(series, side) for side in BOTH_SIDES},
        "peak_joint_moment": moments,
        "peak_joint_moment_per_mass": {name: m / mass for name, m in moments.items()},
        "ankle_torque_slope": {side: ankle_torque_slope(series, side) for side in BOTH_SIDES},
        "dorsiflexion_stiffness": _stiffness(series, 0),
        "plantarflexion_stiffness": _stiffness(series, 2),
    }


def _energetics(series: GaitSeries) -> dict[str, Any]:
    """Return the metrics of activation and work."""
    effort = float(series.quadrature @ (series.activation**2).sum(axis=1))
    walker = series.walker
    muscle = _work(series, walker.columns(walker.muscles))
    orthosis = _work(series, walker.columns(walker.device.forces))
    peaks = series.activation.max(axis=0).tolist()
    return {
        "peak_activation": dict(zip(GENERATORS, peaks, strict=True)),
        "positive_muscle_work": muscle[0],
        "negative_muscle_work": muscle[1],
        "positive_orthosis_work": orthosis[0],
        "negative_orthosis_work": orthosis[1],
        "effort": effort,
        "effort_per_distance": effort / series.distance,
    }


def _stance_share(series: GaitSeries, side: Side) -> float:
    """Return the share of the stride from foot strike to toe-off of a side."""
    stretch = toe_off_time(series, side) - foot_strike_time(series, side)
    return (stretch % series.duration) / series.duration


def _step_lengths(series: GaitSeries) -> PerSide:
    """Return heel-to-heel distances [m] of consecutive flat feet.

    The right foot stands flat at the beginning and at the end of the stride, the left foot at the
    beginning of `left_flat`.
    """
    middle = int(np.argmin(np.abs(series.time - toe_off_time(series, "right"))))
    heels = {side: series.contact_position[:, point_rows(side)[0], 0] for side in BOTH_SIDES}
    return {
        "right": float(heels["right"][-1] - heels["left"][middle]),
        "left": float(heels["left"][middle] - heels["right"][0]),
    }


def _crouch(series: GaitSeries, side: Side) -> tuple[float, float]:
    """Return the least knee flexion of stance [rad] and its instant [s]."""
    rows = np.flatnonzero(stance(series, side))
    knee = series.column(f"knee_{SUFFIX[side]}")[rows]
    least = int(np.argmin(knee))
    return float(knee[least]), float(series.time[rows[least]])


def _joint_ranges(series: GaitSeries) -> dict[str, tuple[float, float]]:
    """Return least and largest value of every angle [rad]."""
    return {
        name: (float(series.column(name).min()), float(series.column(name).max()))
        for name in COORDINATES[2:]
    }


def _friction_ratio(series: GaitSeries, side: Side) -> float:
    """Return the largest |forward| / vertical force of a loaded foot; NaN if it never is."""
    rows = loaded(series, side)
    ratio = np.abs(series.forward_force(side)[rows]) / series.vertical_force(side)[rows]
    return float(ratio.max()) if ratio.size else np.nan


def _peak_moments(series: GaitSeries) -> dict[str, float]:
    """Return the net moment of largest magnitude of every joint, with its sign [N m]."""
    row = np.argmax(np.abs(series.net_torque), axis=0)
    return {
        name: float(series.net_torque[row[i], i])
        for i, name in enumerate(COORDINATES)
        if name not in ROOT
    }


def _work(series: GaitSeries, columns: list[int]) -> tuple[float, float]:
    """Return positive and negative work of some force elements over the stride [J]."""
    power, weights = series.element_power[:, columns], series.quadrature
    positive, negative = np.maximum(power, 0.0), np.minimum(power, 0.0)
    return float(weights @ positive.sum(axis=1)), float(weights @ negative.sum(axis=1))


def _stiffness(series: GaitSeries, first: int) -> PerSide | None:
    """Return two neighbouring entries of (K_D right, left, K_P right, left) [N m/rad]."""
    if series.stiffness.size == 0:
        return None
    return {side: float(series.stiffness[first + i]) for i, side in enumerate(BOTH_SIDES)}
