"""The mean slope of the net torque-angle profile of the ankle."""

from __future__ import annotations

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SUFFIX, Side
from pathwalker_cli.stride.feet import toe_bearing
from pathwalker_cli.stride.series import GaitSeries

__all__ = ["ankle_torque_line", "ankle_torque_slope"]


def ankle_torque_slope(series: GaitSeries, side: Side) -> float:
    """Return the mean slope of the net ankle torque-angle profile [N m/rad].

    The slope of the least-squares line of net ankle torque (muscles and orthosis, + plantarflexing)
    over dorsiflexion (minus the ankle coordinate), while the foot stands flat or on its toe; every
    instant counts by its share of time.  Positive like a spring that resists dorsiflexion.
    """
    return ankle_torque_line(series, side)[0]


def ankle_torque_line(series: GaitSeries, side: Side) -> tuple[float, float]:
    """Return slope [N m/rad] and torque at zero angle [N m] of the line of `ankle_torque_slope`.

    NaN if the ankle does not move.
    """
    rows, name = toe_bearing(series, side), f"ankle_{SUFFIX[side]}"
    angle, weight = -series.column(name)[rows], series.quadrature[rows]
    torque = series.net_torque[rows, COORDINATES.index(name)]
    weight = weight / weight.sum()
    middle = float(weight @ angle)
    spread = float(weight @ (angle - middle) ** 2)
    slope = float(weight @ ((angle - middle) * torque)) / spread if spread > 0.0 else np.nan
    return slope, float(weight @ torque) - slope * middle
