"""What is drawn over the gait cycle of a side: angles, forces, moments, powers and activations.

Flexion, dorsiflexion and forward lean are positive angles, as gait laboratories plot them; moments
are internal ones, extension and plantarflexion positive; power that a joint gives is positive.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GENERATORS, LEG_JOINTS, SUFFIX, Side, to_degrees
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.stride import NotKnownError, Stride

CLINICAL_ANGLE: Final = {"hip": -1.0, "knee": 1.0, "ankle": -1.0}
"""Sign that makes flexion and dorsiflexion angles positive, as clinicians plot them."""
EXTENSION: Final = {"hip": 1.0, "knee": -1.0, "ankle": 1.0}
"""Sign that makes the torque of extensors and plantarflexors positive, as clinicians plot it."""


@dataclass(frozen=True)
class Band:
    """What recordings show over a gait cycle, SI units and signs of `conventions`.

    Args:
        percent: Positions in the gait cycle of the side [%], shape (n,).
        low: Least value over the trials, shape (n,).
        mean: Mean over the trials, shape (n,).
        high: Largest value over the trials, shape (n,).
    """

    percent: np.ndarray
    low: np.ndarray
    mean: np.ndarray
    high: np.ndarray

    @classmethod
    def over(cls, percent: np.ndarray, curves: np.ndarray) -> Band:
        """Return the band of several trials.

        Args:
            percent: Positions in the gait cycle [%], shape (n,).
            curves: One row per trial, shape (m, n).
        """
        return cls(percent, curves.min(axis=0), curves.mean(axis=0), curves.max(axis=0))


@dataclass(frozen=True)
class Reference:
    """Recorded bands to draw behind the curves; what is missing is left out.

    Midline coordinates are given once per side, as `pelvis_tilt_r`, `pelvis_tilt_l`, `lumbar_r`
    and `lumbar_l`, since each side has its own gait cycle.

    Args:
        angles: Joint angles [rad], e.g. "hip_r".
        moments: Net joint moments [N m], e.g. "hip_r".
        forces: Ground reaction forces [N], e.g. "foot_r_z" and "foot_l_x".
    """

    angles: Mapping[str, Band] = field(default_factory=dict)
    moments: Mapping[str, Band] = field(default_factory=dict)
    forces: Mapping[str, Band] = field(default_factory=dict)


@dataclass(frozen=True)
class CycleCurve:
    """A quantity over the gait cycle of a side.

    Args:
        key: Its name in files.
        name: Its name for people, e.g. "hip".
        label: Label of the y axis with its unit.
        raw: Its columns of a stride, SI units and signs of `conventions`, shape (n, m).
        factor: From these to the unit and the sign of the label; of a walker.
        midline: Whether it belongs to no side, so that the title names the cycle.
        zero: Whether zero is of interest.
        least_in_stance: Whether a dot marks the least value of stance.
    """

    key: str
    name: str
    label: str
    raw: Callable[[Stride, Side], np.ndarray]
    factor: Callable[[Walker], Any]
    midline: bool = False
    zero: bool = True
    least_in_stance: bool = False

    def title(self, side: Side) -> str:
        """Return the title of the panel of a side."""
        return (
            f"{self.name}, {side} cycle" if self.midline else f"{side} {self.name}"
        ).capitalize()

    def columns(self, stride: Stride, side: Side) -> np.ndarray:
        """Return its columns of a stride in the unit of the label, shape (n, m).

        Raises:
            NotKnownError: If the stride does not know them.
        """
        return np.asarray(self.factor(stride.walker) * self.raw(stride, side))

    def lines(self, stride: Stride, side: Side, points: int) -> np.ndarray:
        """Return its curves over the cycle of a side, (m, points); none if they are not known."""
        try:
            curves = stride.over_cycle(self.columns(stride, side), side, points).T
        except NotKnownError:
            return np.empty((0, points))
        return curves if np.isfinite(curves).all() else np.empty((0, points))


def _angle(joint: str, name: str, label: str) -> CycleCurve:
    factor = CLINICAL_ANGLE.get(joint, 1.0) * float(to_degrees(1.0))
    midline = joint not in CLINICAL_ANGLE

    def raw(stride: Stride, side: Side) -> np.ndarray:
        return stride.column(joint if midline else f"{joint}_{SUFFIX[side]}")[:, None]

    knee = joint == "knee"  # it is never straight
    return CycleCurve(f"angle_{joint}", name, label, raw, lambda _: factor, midline, not knee, knee)


def _toe_extension(stride: Stride, side: Side) -> np.ndarray:
    if not stride.walker.parts.toes:
        raise NotKnownError("toes")
    return -stride.column(f"mtp_{SUFFIX[side]}")[:, None]


def _force(key: str, axis: int, name: str) -> CycleCurve:
    def raw(stride: Stride, side: Side) -> np.ndarray:
        return stride.foot_force(side)[:, [axis]]

    return CycleCurve(key, name, "force [% body weight]", raw, lambda w: 100.0 / w.weight)


def _moment(joint: str, label: str) -> CycleCurve:
    def raw(stride: Stride, side: Side) -> np.ndarray:
        return stride.known("net_torque")[:, [COORDINATES.index(f"{joint}_{SUFFIX[side]}")]]

    return CycleCurve(
        f"moment_{joint}", f"{joint} moment", label, raw, lambda w: EXTENSION[joint] / w.total_mass
    )


def _power(joint: str) -> CycleCurve:
    def raw(stride: Stride, side: Side) -> np.ndarray:
        row = COORDINATES.index(f"{joint}_{SUFFIX[side]}")
        return (stride.known("net_torque") * stride.velocity)[:, [row]]

    return CycleCurve(
        f"power_{joint}", f"{joint} power", "generated + [W/kg]", raw, lambda w: 1.0 / w.total_mass
    )


def _activation(joint: str, up: str, down: str) -> CycleCurve:
    """Return the activation of an antagonistic pair: one upward, the other downward."""
    midline = joint not in LEG_JOINTS

    def raw(stride: Stride, side: Side) -> np.ndarray:
        suffix = "" if midline else f"_{SUFFIX[side]}"
        rows = [GENERATORS.index(f"{joint}_{way}{suffix}") for way in (up, down)]
        return stride.known("activation")[:, rows]

    name, ways = ("trunk", "ext. +, bend -") if midline else (joint, "ext. +, flex. -")
    both = np.array([1.0, -1.0])
    return CycleCurve(
        f"activation_{joint}", f"{name} muscles", f"{ways} [1]", raw, lambda _: both, midline
    )


ANGLES: Final = (
    _angle("pelvis_tilt", "pelvis", "forward tilt [deg]"),
    _angle("hip", "hip", "flexion [deg]"),
    _angle("knee", "knee", "flexion [deg]"),
    _angle("ankle", "ankle", "dorsiflexion [deg]"),
    _angle("lumbar", "trunk", "forward lean [deg]"),
)
TOES: Final = CycleCurve(
    "angle_mtp",
    "toes",
    "extension [deg]",
    _toe_extension,
    lambda _: float(to_degrees(1.0)),
)
"""Of walkers whose toes a joint carries; no recording has it."""
FORCES: Final = (
    _force("force_vertical", 1, "vertical force"),
    _force("force_forward", 0, "fore-aft force"),
)
MOMENTS: Final = (
    _moment("hip", "extension [N m/kg]"),
    _moment("knee", "extension [N m/kg]"),
    _moment("ankle", "plantarflexion [N m/kg]"),
)
POWERS: Final = tuple(map(_power, LEG_JOINTS))
# `lumbar_flexion` extends the trunk, see `conventions.GENERATORS`.
ACTIVATIONS: Final = (
    *(_activation(joint, "extension", "flexion") for joint in LEG_JOINTS),
    _activation("lumbar", "flexion", "extension"),
)
