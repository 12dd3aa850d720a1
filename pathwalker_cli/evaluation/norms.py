"""Typically developing children at the speed of a stride: who walks as fast walks how.

References:
    Schwartz, Rozumalski, Trost (2008) J. Biomech. 41, 1639-1650: 83 children, 4 to 17 years.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured

from pathwalker_cli.conventions import GRAVITY, SIDES
from pathwalker_cli.paths import shipped
from pathwalker_cli.stride.figures.curves import ANGLES, MOMENTS, POWERS
from pathwalker_cli.stride.stride import Stride

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
    """One quantity of typical children of a speed class.

    Args:
        mean: Mean over the gait cycle, 51 points from 0 to 100 %, in the unit of the curve.
        sd: Standard deviation between children, likewise.
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


def _off(stride: Stride) -> dict[str, tuple[np.ndarray, Norm]]:
    """Return the differences to typical children at the speed of a stride, by key of the curve.

    Of a recorded cycle its own side counts.
    """
    typical, sides = norms(speed_class(stride)), SIDES if stride.side is None else (stride.side,)
    found = {}
    for curve in (*ANGLES, *MOMENTS):
        norm = typical.get(curve.key)
        if norm is not None:
            each = (curve.lines(stride, side, norm.mean.size) for side in sides)
            lines = np.array([line for one in each for line in one])
            if lines.size:
                found[curve.key] = lines - norm.mean, norm
    return found


def within_norms(stride: Stride, deviations: float = 2.0) -> dict[str, float]:
    """Return the share of the gait cycle within so many standard deviations of typical children.

    At the speed of the stride, right and left pooled, by key of the curve; [1].
    """
    off = _off(stride).items()
    return {k: float(np.mean(np.abs(lines) < deviations * norm.sd)) for k, (lines, norm) in off}


def movement_profile(stride: Stride) -> dict[str, float]:
    """Return the sagittal part of the Movement Analysis Profile by key of the angle [deg].

    Root mean square differences to typical children at the speed of the stride, right and left
    pooled; their root mean square is the sagittal part of the Gait Profile Score.

    References:
        Baker et al. (2009) Gait & Posture 30, 265-269.
    """
    angles = {curve.key for curve in ANGLES}
    off = {key: lines for key, (lines, _) in _off(stride).items() if key in angles}
    return {key: float(np.sqrt(np.mean(lines**2))) for key, lines in off.items()}


def profile_score(strides: Iterable[Stride]) -> float:
    """Return the mean sagittal Gait Profile Score of some strides [deg]; NaN without any."""
    profiles = [[*movement_profile(stride).values()] for stride in strides]
    scores = [float(np.sqrt(np.mean(np.square(each)))) for each in profiles if each]
    return float(np.mean(scores)) if scores else float("nan")


def norm_notes(stride: Stride, recorded: Iterable[Stride] = ()) -> tuple[str, ...]:
    """Return in sentences how near a gait is to that of typical children at its speed.

    Args:
        stride: The gait.
        recorded: Recorded cycles, each judged at its own speed.
    """
    shares, profile = within_norms(stride), movement_profile(stride)
    curves = [curve for curve in ANGLES if curve.key in shares]
    inside = ", ".join(f"{curve.name} {100.0 * shares[curve.key]:.0f}" for curve in curves)
    parts = ", ".join(f"{curve.name} {profile[curve.key]:.1f}" for curve in curves)
    own = profile_score(recorded)
    beside = "" if np.isnan(own) else f"; of the recorded cycles {own:.1f}"
    speed = speed_class(stride).replace("_", " ")
    return (
        f"within two standard deviations of typical children at a {speed} speed (Schwartz et al. "
        f"2008), share of the gait cycle [%]: {inside}",
        f"sagittal Gait Profile Score {profile_score([stride]):.1f} deg ({parts}){beside}",
    )
