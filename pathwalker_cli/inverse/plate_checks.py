"""What is wrong with how a file describes a plate: sign, order of the corners, unit, zero level.

A walking body tells: the ground pushes it up, first back and then ahead, and the centre of pressure
runs from heel to toes.  What fails this as it is stored, and passes it with one change, is named by
that change.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product
from typing import Final

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.inverse.cycles import Stance
from pathwalker_cli.io.c3d_plates import ForcePlate, plate_axes

_ORDERS: Final[Mapping[str, tuple[int, ...]]] = {
    "": (0, 1, 2, 3),
    "half a turn round": (2, 3, 0, 1),
    "a quarter turn round": (1, 2, 3, 0),
    "three quarter turns round": (3, 0, 1, 2),
    "mirrored along the plate's x": (1, 0, 3, 2),
    "mirrored along the plate's y": (3, 2, 1, 0),
    "mirrored about corners 1 and 3": (0, 3, 2, 1),
    "mirrored about corners 2 and 4": (2, 1, 0, 3),
}
"""Orders in which the four corners may be stored, by how they differ from the right one."""

_SIGNS: Final = {"": 1.0, "the forces on the plate, not on the body": -1.0}
_UNITS: Final = {"": 1.0, "its moments 1000 times too large": 1e-3, "its moments 1000 times too "
                 "small": 1e3}  # fmt: skip

_SHARE: Final = 0.4
"""Peak load, as a share of the body's weight, from which a stance tells about a plate."""

_PRESSED: Final = 0.2
"""Share of its peak from which the load of a stance says where its centre is."""

_FOUND: Final = 0.5
"""Distance of the centre of pressure from where it belongs, in foot lengths, that is still right:
feet roll over at different times, and toes reach beyond the marker."""


@dataclass(frozen=True)
class Fault:
    """One way in which a plate is not stored as it stands.

    Args:
        plate: Index of the plate.
        what: What is wrong, in words.
        mended: The plate as it would be right.
    """

    plate: int
    what: str
    mended: ForcePlate


@dataclass(frozen=True)
class Footprint:
    """Where a foot is on the ground in every frame.

    Args:
        ends: Forward positions of heel and tip of the toes [m], shape (n, 2).
        aside: Sideways position of its middle [m], shape (n,); NaN if unknown.
        length: Heel to toe marker [m].
    """

    ends: np.ndarray
    aside: np.ndarray
    length: float


def plate_faults(
    loads: Sequence[ForcePlate],
    stances: Sequence[Stance],
    feet: Mapping[Side, Footprint],
    weight: float,
) -> tuple[Fault, ...]:
    """Return what is wrong with plates that the recording's stances disprove.

    Args:
        loads: Plates with their loads in every frame, x along the walk.
        stances: The stances.
        feet: Per side, where the foot is.
        weight: Weight of the body [N].
    """
    faults = []
    for index, plate in enumerate(loads):
        rows = [
            (stance, at)
            for stance in stances
            if (at := _pressed(plate, stance, weight)).size > 4  # noqa: PLR2004 - for a slope
        ]
        if not rows or _right(plate, rows, feet):
            continue
        changes = sorted(product(_ORDERS, _SIGNS, _UNITS), key=lambda names: sum(map(bool, names)))
        known = np.isfinite(feet[rows[0][0].side].aside).any()
        single = [n for n in changes if sum(map(bool, n)) == 1 and (known or not n[0])]
        tried = [(what, _changed(plate, *what)) for what in single]
        passed = [(what, other) for what, other in tried if _right(other, rows, feet)]
        if passed:
            (order, sign, unit), mended = min(
                passed, key=lambda item: _distance(item[1], rows, feet)
            )
            what = f"its corners seem to be stored {order}" if order else f"it seems to hold {sign}"
            faults.append(Fault(index, f"it seems to hold {unit}" if unit else what, mended))
    return tuple(faults)


def _changed(plate: ForcePlate, order: str, sign: str, unit: str) -> ForcePlate:
    """Return a plate with another order of corners, sign or unit of moments."""
    old = plate_axes(plate.corners)
    corners = plate.corners[list(_ORDERS[order])]
    turn = old.T @ plate_axes(corners) * _SIGNS[sign]
    moment = plate.moment @ turn * _UNITS[unit]
    return replace(plate, corners=corners, force=plate.force @ turn, moment=moment)


def _pressed(plate: ForcePlate, stance: Stance, weight: float) -> np.ndarray:
    """Return the frames of a stance that press on a plate, none if no foot stood on it."""
    size = np.abs(plate.force[stance.rows, 2])
    if not size.size or size.max() < _SHARE * weight:
        return np.zeros(0, dtype=int)
    return stance.strike + np.flatnonzero(size > _PRESSED * size.max())


_Rows = Sequence[tuple[Stance, np.ndarray]]


def _right(plate: ForcePlate, rows: _Rows, feet: Mapping[Side, Footprint]) -> bool:
    """Return whether a plate agrees with how bodies walk."""
    up = np.concatenate([plate.force[at, 2] for _, at in rows])
    if up.mean() < 0.0:
        return False
    if not np.isfinite(feet[rows[0][0].side].aside).any():  # which way x points is a guess then
        return _distance(plate, rows, feet) < _FOUND
    rolls, drives = [], []
    for _, at in rows:
        progress = np.linspace(-1.0, 1.0, at.size)
        point, ahead = _point(plate, at)[:, 0], plate.force[at, 0]
        rolls.append(float((point - point.mean()) @ progress))
        drives.append(float((ahead - ahead.mean()) @ progress))
    reversed_ = sum(rolls) < 0.0 and sum(drives) < 0.0
    return not reversed_ and sum(drives) > 0.0 and _distance(plate, rows, feet) < _FOUND


def _distance(plate: ForcePlate, rows: _Rows, feet: Mapping[Side, Footprint]) -> float:
    """Return how far the centre of pressure is from where it belongs, in foot lengths."""
    misses = []
    for stance, at in rows:
        foot = feet[stance.side]
        share = np.linspace(0.0, 1.0, at.size)
        heel, tip = foot.ends[at].T
        point = _point(plate, at)
        ahead = point[:, 0] - (heel + share * (tip - heel))
        aside = np.nan_to_num(point[:, 1] - foot.aside[at])
        misses.append(np.hypot(ahead, aside) / foot.length)
    return float(np.median(np.concatenate(misses)))


def _point(plate: ForcePlate, at: np.ndarray) -> np.ndarray:
    """Return the centre of pressure in some frames [m], shape (frames, 2)."""
    force, moment = plate.force[at], plate.moment[at]
    offset = np.column_stack([-moment[:, 1], moment[:, 0]]) / force[:, 2:]
    return np.asarray(plate.centre[:2] + offset)
