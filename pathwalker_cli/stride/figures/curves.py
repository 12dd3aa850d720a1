"""Curves over the gait cycle of each side, the recorded range behind them and clinical signs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.stride.figures.style import LINE_COLOUR, LINE_STYLE, toe_off_line
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import own_cycle

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


def draw_band(ax: Axes, band: Band | None, side: Side, factor: float) -> None:
    """Draw a recorded band in the unit of the panel.

    Args:
        ax: The panel.
        band: The band; nothing is drawn without one.
        side: Its side.
        factor: From the band's unit and sign to the panel's.
    """
    if band is None:
        return
    colour, style = LINE_COLOUR[side], LINE_STYLE[side]
    low, high = sorted((factor * band.low, factor * band.high), key=lambda values: values.mean())
    ax.fill_between(band.percent, low, high, color=colour, alpha=0.15, linewidth=0)
    for edge in (low, high):  # so that the ranges of both sides differ without colour too
        ax.plot(band.percent, edge, color=colour, linestyle=style, linewidth=0.4, alpha=0.6)
    mean = factor * band.mean
    ax.plot(band.percent, mean, color=colour, linestyle=style, linewidth=0.7, alpha=0.6)


def draw_sides(ax: Axes, series: GaitSeries, values: Mapping[Side, np.ndarray]) -> None:
    """Draw a quantity of both sides over their own gait cycles and mark the toe-offs.

    Args:
        ax: The panel.
        series: The stride.
        values: Per side, shape (n,), in the unit of the panel.
    """
    for side in SIDES:
        cycle = own_cycle(series, side)
        curve = values[side][cycle.index]
        ax.plot(cycle.percent, curve, color=LINE_COLOUR[side], linestyle=LINE_STYLE[side])
        toe_off_line(ax, cycle)
