"""What a series says about the feet: contact, load and centre of pressure."""

from __future__ import annotations

from typing import Final

import numpy as np

from pathwalker_cli.conventions import CONTACT_FORCES, CONTACT_POINTS, SUFFIX, Side
from pathwalker_cli.model.contact import POINTS, phase_named
from pathwalker_cli.stride.series import GaitSeries

__all__ = [
    "LOADED_SHARE",
    "centre_of_pressure",
    "in_contact",
    "loaded",
    "point_rows",
    "stance",
    "toe_bearing",
    "vertical_point_force",
]

LOADED_SHARE: Final = 0.05
"""Share of body weight above which a foot counts as loaded: below it, centre of pressure and
friction ratio are quotients of two small numbers; force plates are evaluated with a similar one."""


def point_rows(side: Side) -> list[int]:
    """Return the positions of heel and toe of a side in `conventions.CONTACT_POINTS`."""
    return [CONTACT_POINTS.index(f"{point}_{SUFFIX[side]}") for point in ("heel", "toe")]


def in_contact(series: GaitSeries) -> np.ndarray:
    """Return whether each contact point is on the ground, shape (n, 4)."""
    points = {name: phase_named(name).points for name in set(series.phase)}
    return np.array([[p in points[name] for p in POINTS] for name in series.phase])


def stance(series: GaitSeries, side: Side) -> np.ndarray:
    """Return whether heel or toe of a side is on the ground, shape (n,)."""
    return np.asarray(in_contact(series)[:, point_rows(side)].any(axis=1))


def toe_bearing(series: GaitSeries, side: Side) -> np.ndarray:
    """Return whether a foot stands flat or on its toe, shape (n,)."""
    return np.asarray(in_contact(series)[:, point_rows(side)[1]])


def loaded(series: GaitSeries, side: Side) -> np.ndarray:
    """Return whether a foot bears more than `LOADED_SHARE` of body weight, shape (n,)."""
    return np.asarray(series.vertical_force(side) > LOADED_SHARE * series.walker.weight)


def vertical_point_force(series: GaitSeries) -> np.ndarray:
    """Return the vertical ground reaction force on each contact point [N], shape (n, 4)."""
    return series.force[:, [CONTACT_FORCES.index(f"{point}_z") for point in CONTACT_POINTS]]


def centre_of_pressure(series: GaitSeries, side: Side) -> np.ndarray:
    """Return the forward position of the centre of pressure [m], shape (n,).

    NaN where the foot is not loaded.
    """
    rows, bearing = point_rows(side), loaded(series, side)
    force = vertical_point_force(series)[:, rows]
    moment = (force * series.contact_position[:, rows, 0]).sum(axis=1)
    centre = np.full(series.time.size, np.nan)
    centre[bearing] = moment[bearing] / force.sum(axis=1)[bearing]
    return centre
