"""Typically developing children at the speed of a stride: who walks as fast walks how.

References:
    Schwartz, Rozumalski, Trost (2008) J. Biomech. 41, 1639-1650: 83 children, 4 to 17 years.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, partial
from typing import Final

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured

from pathwalker_cli.conventions import GRAVITY, SIDES, Side
from pathwalker_cli.paths import shipped
from pathwalker_cli.stride.figures.curves import ANGLES, MOMENTS, POWERS
from pathwalker_cli.stride.measure import TYPICAL, Measure, per_side
from pathwalker_cli.stride.stride import NotKnownError, Stride

CLASSES: Final = (
    ("very_slow", 0.227),
    ("slow", 0.363),
    ("free", 0.500),
    ("fast", 0.636),
    ("very_fast", np.inf),
)
"""Speed classes and the root of the Froude number, v / sqrt(g leg length), at which each ends."""

_COMMENTS: Final = 4
"""Lines at the head of the table."""

QUANTITIES: Final = {
    **{c.key: c.key.removeprefix("angle_") for c in ANGLES if c.key != "angle_lumbar"},
    **{c.key: f"{c.key.partition('_')[2]}_{c.key.partition('_')[0]}" for c in (*MOMENTS, *POWERS)},
}
"""Column of the table by key of a curve."""


@dataclass(frozen=True)
class Norm:
    """Mean and standard deviation between typical children of a speed class.

    Over the gait cycle, 51 points from 0 to 100 %, in the unit of the curve.
    """

    mean: np.ndarray
    sd: np.ndarray


def speed_class(stride: Stride) -> str:
    """Return the class of the speed of a stride."""
    froude = stride.walking_speed / np.sqrt(GRAVITY * stride.walker.leg_length)
    return next(name for name, end in CLASSES if froude < end)


@cache
def norms(speed: str) -> Mapping[str, Norm]:
    """Return the quantities of typical children of a speed class, by key of the curve."""
    table = np.genfromtxt(
        shipped("patient_data") / "typical-children.csv",
        delimiter=",", names=True, dtype=None, encoding="utf-8", skip_header=_COMMENTS,
    )  # fmt: skip
    rows = table[table["speed"] == speed]
    return {
        key: Norm(*structured_to_unstructured(rows[[f"{name}_mean", f"{name}_sd"]]).T)
        for key, name in QUANTITIES.items()
    }


def _off(stride: Stride, side: Side) -> dict[str, tuple[np.ndarray, Norm]]:
    """Return the differences to typical children at the speed of a stride, by key of the curve.

    Over the cycle of a side, shape (51,) each; none of a curve that is not known.
    """
    typical = norms(speed_class(stride))
    return {
        curve.key: (line - norm.mean, norm)
        for curve in (*ANGLES, *MOMENTS)
        if (norm := typical.get(curve.key))
        for line in curve.lines(stride, side, norm.mean.size)
    }


def sides_shown(stride: Stride) -> tuple[Side, ...]:
    """Return the sides whose cycles a stride shows: of a recorded one its own."""
    return SIDES if stride.side is None else (stride.side,)


def within_norms(stride: Stride) -> dict[str, float]:
    """Return the share of the gait cycle within two standard deviations of typical children.

    At the speed of the stride, right and left pooled, by key of the curve; [1].
    """
    inside: dict[str, list[float]] = {}
    for side in sides_shown(stride):
        for key, (line, norm) in _off(stride, side).items():
            share = float(np.mean(np.abs(line) < 2.0 * norm.sd))
            inside.setdefault(key, []).append(share)
    return {key: float(np.mean(shares)) for key, shares in inside.items()}


def _variable_score(stride: Stride, side: Side, key: str) -> float:
    """Return the root mean square difference of one angle [rad]: a bar of the profile."""
    off = _off(stride, side)
    if key not in off:
        raise NotKnownError(key)
    return float(np.radians(np.sqrt(np.mean(off[key][0] ** 2))))


def _profile_score(stride: Stride, side: Side | None = None) -> float:
    """Return the root mean square of the bars of one side, or of all that are known [rad]."""
    sides = sides_shown(stride) if side is None else (side,)
    bars = [_variable_score(stride, each, angle.key) for each in sides for angle in _SAGITTAL]
    return float(np.sqrt(np.mean(np.square(bars))))


_SAGITTAL: Final = tuple(curve for curve in ANGLES if curve.key in QUANTITIES)

PROFILE: Final = (
    *(
        measure
        for curve in _SAGITTAL
        for measure in per_side(
            f"movement_profile_{curve.key.removeprefix('angle_')}_*",
            f"{curve.name} off typical children, *", "rad",
            "root mean square difference of the angle to typical children at the same speed",
            partial(_variable_score, key=curve.key), f"{curve.name}, *", section=TYPICAL,
            kept=False,
        )
    ),
    *per_side("gait_profile_score_*", "sagittal Gait Profile Score, *", "rad",
              "root mean square of the four", _profile_score, "score, *", section=TYPICAL,
              kept=False),
    Measure("gait_profile_score", "sagittal Gait Profile Score", "rad",
            "root mean square of the four of both sides", _profile_score, "score",
            section=TYPICAL, kept=False),
)  # fmt: skip
"""The sagittal part of the Movement Analysis Profile, and of the Gait Profile Score.

References:
    Baker et al. (2009) Gait & Posture 30, 265-269.
"""


def norm_note(stride: Stride) -> str:
    """Return in a sentence how near a gait is to that of typical children at its speed."""
    shares = within_norms(stride)
    inside = ", ".join(
        f"{curve.name} {100.0 * shares[curve.key]:.0f}" for curve in ANGLES if curve.key in shares
    )
    speed = speed_class(stride).replace("_", " ")
    return (
        f"within two standard deviations of typical children at a {speed} speed (Schwartz et al. "
        f"2008), share of the gait cycle [%]: {inside}"
    )
