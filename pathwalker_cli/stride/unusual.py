"""What no child does when it walks: a predicted stride that does it is said to."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.stride.stride import Stride

_SWINGS: Final = {"pelvis_tilt": ("pelvis", 27.0), "lumbar": ("trunk", 32.0)}
"""How far they turn to and fro in a stride [deg]: just above the most in 51 recorded strides of the
shipped patient, 26 and 31; the mean pelvis of typical children turns by 4 at most (Schwartz et al.
2008)."""
_PEAK: Final = 1.5
"""Vertical force [body weights]: the shipped patient's recorded stances stay below 1.44."""


def unusual(stride: Stride) -> tuple[str, ...]:
    """Return what a walking child does not do, one phrase each; forces only where known."""
    return tuple(_found(stride))


def _found(stride: Stride) -> Iterator[str]:
    for coordinate, (name, most) in _SWINGS.items():
        swing = float(to_degrees(np.ptp(stride.column(coordinate))))
        if swing > most:
            yield (
                f"the {name} swings to and fro by {swing:.0f} deg in a stride, where walking "
                f"children stay below {most:g}"
            )
    peaks = {side: stride.force[side][:, 1].max() for side in SIDES if side in stride.force}
    high = {side: peak / stride.walker.weight for side, peak in peaks.items()}
    high = {side: peak for side, peak in high.items() if peak > _PEAK}
    if high:
        sides = " and ".join(f"{peak:.2f} ({side})" for side, peak in high.items())
        yield (
            f"the ground pushes up with {sides} body weights, where walking children stay below "
            f"{_PEAK:g}"
        )
    late = [s for s in SIDES if stride.toe_off(s) - stride.strike(s) < 0.5 * stride.duration]
    if late:
        yield (
            f"the {' and '.join(late)} foot is on the ground for less than half of the stride: "
            "that is running"
        )
