"""Typically developing children at the speed of a stride: who walks as fast walks how.

References:
    Schwartz, Rozumalski, Trost (2008) J. Biomech. 41, 1639-1650: 83 children, 4 to 17 years.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np
from numpy.lib.recfunctions import structured_to_unstructured

from pathwalker_cli.conventions import GRAVITY, SIDES
from pathwalker_cli.paths import shipped
from pathwalker_cli.stride.figures.curves import ANGLES, MOMENTS
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
    **{c.key: f"{c.key.removeprefix('moment_')}_moment" for c in MOMENTS},
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


def within_norms(stride: Stride, deviations: float = 2.0) -> dict[str, float]:
    """Return the share of the gait cycle within so many standard deviations of typical children.

    At the speed of the stride, right and left pooled, by key of the curve; [1].
    """
    typical = norms(speed_class(stride))
    shares = {}
    for curve in (*ANGLES, *MOMENTS):
        norm = typical.get(curve.key)
        if norm is None:
            continue
        lines = [line for side in SIDES for line in curve.lines(stride, side, norm.mean.size)]
        if lines:
            off = np.abs(np.array(lines) - norm.mean) / norm.sd
            shares[curve.key] = float(np.mean(off < deviations))
    return shares


def norm_note(stride: Stride) -> str:
    """Return in one sentence how much of the gait cycle is as typical children walk."""
    shares = within_norms(stride)
    curves = (curve for curve in ANGLES if curve.key in shares)
    shown = ", ".join(f"{curve.name} {100.0 * shares[curve.key]:.0f}" for curve in curves)
    return (
        f"within two standard deviations of typical children at a {speed_class(stride)} speed "
        f"(Schwartz et al. 2008), share of the gait cycle [%]: {shown}"
    ).replace("_", " ")
