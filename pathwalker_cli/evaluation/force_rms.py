"""Root-mean-square differences of ground reaction forces to the mean of the measured ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Literal

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.evaluation.spread import Spread, spread
from pathwalker_cli.stride.cycle import BOTH_SIDES

__all__ = ["FORCE_RMS", "Span", "force_rms", "recorded_force_rms"]

Span = Literal["stance", "cycle"]

FORCE_RMS: Final[dict[str, tuple[Span, int]]] = {
    "rms_vertical_force_stance": ("stance", 1),
    "rms_vertical_force_cycle": ("cycle", 1),
    "rms_forward_force_stance": ("stance", 0),
}
"""Quantities: over which span, and which component of (forward, up)."""


def force_rms(gait: Gait, recorded: RecordedGait) -> dict[str, float]:
    """Return the RMS differences to the mean measured force [N], right and left pooled.

    Over the per cent of stance the forces of equal stages are compared even if the stances differ
    in length; over the per cent of the cycle their timing counts too, and so does swing.

    Args:
        gait: The gait, with forces.
        recorded: The recordings.

    Returns:
        The keys of `FORCE_RMS`; without those of which a side was not measured.
    """
    if gait.force is None:
        return {}
    found = {}
    for key, (span, axis) in FORCE_RMS.items():
        over = gait.over_stance if span == "stance" else gait.over_cycle
        means = {side: _curves(recorded, span)(side) for side in BOTH_SIDES}
        if all(len(curves) for curves in means.values()):
            errors = [
                over(gait.force[side], side)[:, axis] - means[side][:, :, axis].mean(axis=0)
                for side in BOTH_SIDES
            ]
            found[key] = float(np.sqrt(np.mean(np.square(errors))))
    return found


def recorded_force_rms(recorded: RecordedGait) -> dict[str, Spread]:
    """Return the RMS differences of single measured curves to the mean of their side [N]."""
    found = {}
    for key, (span, axis) in FORCE_RMS.items():
        single: list[float] = []
        for side in BOTH_SIDES:
            curves = _curves(recorded, span)(side)
            if len(curves) > 1:
                errors = curves[:, :, axis] - curves[:, :, axis].mean(axis=0)
                single += np.sqrt(np.mean(errors**2, axis=1)).tolist()
        values = spread(single)
        if values is not None:
            found[key] = values
    return found


def _curves(recorded: RecordedGait, span: Span) -> Callable[[Side], np.ndarray]:
    """Return what gives the measured forces of a side over a span."""
    return recorded.stance_forces if span == "stance" else recorded.cycle_forces
