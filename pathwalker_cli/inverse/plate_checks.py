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
from pathwalker_cli.io.c3d_plates import LOADED, ForcePlate, centre_of_pressure, plate_axes

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

_IDLE: Final = 0.1
"""Share of the frames, those of least load, in which nobody stands on a plate."""

_SHARE: Final = 0.4
"""Peak load, as a share of the body's weight, from which a stance tells about a plate."""

_PRESSED: Final = 0.2
"""Share of its peak from which the load of a stance says where its centre is."""

_ROLLS: Final = 0.1
"""Way of the centre of pressure in a stance, in foot lengths, that is surely one: 0.4 to 0.6 in
healthy adults, 0.2 in the shipped patient."""

_DRIVES: Final = 0.02
"""Turn of the force from backward to forward, by the vertical one: 0.12 to 0.24 in healthy adults,
0.05 in the shipped patient."""

_TWICE: Final = 2.0
"""Ratio of distances that tells one order of the corners from another."""

_FOUND: Final = 0.5
"""Distance of the centre of pressure from where it belongs, in foot lengths, that is still right:
feet roll over at different times, and toes reach beyond the marker."""


@dataclass(frozen=True)
class Fault:
    """One way in which the plate of an index is not stored as it stands, and the plate mended."""

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
        if level := _zero_level(plate):
            faults.append(Fault(index, *level))
            continue
        rows = [
            (stance, at) for stance in stances if (at := _pressed(plate, stance, weight)).size > 4
        ]
        if not rows or (stored := _walk(plate, rows, feet)).right:
            continue
        known = np.isfinite(feet[rows[0][0].side].aside).any()
        tried = {
            names: _changed(plate, *names)
            for names in product(_ORDERS, _SIGNS, _UNITS)
            if sum(map(bool, names)) == 1 and (known or not names[0])
        }
        walks = {names: _walk(other, rows, feet) for names, other in tried.items()}
        better = [n for n, walk in walks.items() if walk.clearer_than(stored)]
        if better:
            best = min(better, key=lambda names: walks[names].distance)
            order, sign, unit = best
            what = f"its corners seem to be stored {order}" if order else ""
            faults.append(Fault(index, what or f"it seems to hold {sign or unit}", tried[best]))
    return tuple(faults)


def _zero_level(plate: ForcePlate) -> tuple[str, ForcePlate] | None:
    """Return by how much a plate that is never unloaded is off, and how it would be right."""
    size = np.abs(plate.force[:, 2])
    lowest = size <= np.quantile(size, _IDLE)
    level = np.median(plate.force[lowest], axis=0)
    if size.min() < LOADED or np.ptp(plate.force[lowest, 2]) > LOADED:
        return None
    moment = plate.moment - np.median(plate.moment[lowest], axis=0)
    what = f"its zero level seems to be off by {level[2]:.0f} N"
    return what, replace(plate, force=plate.force - level, moment=moment)


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


@dataclass(frozen=True)
class _Walk:
    """How the load on a plate behaves in its stances.

    Args:
        up: Mean vertical force by the mean size of it: 1 or -1, about.
        rolls: How far the centre of pressure runs ahead, in foot lengths; NaN where the direction
            of the plate's x is a guess.
        drives: How the force turns from backward to forward, as a share of the vertical one.
        distance: How far the centre of pressure is from where it belongs, in foot lengths.
    """

    up: float
    rolls: float
    drives: float
    distance: float

    @property
    def right(self) -> bool:
        """Whether bodies walk like this."""
        ahead = not (self.rolls < _ROLLS or self.drives < _DRIVES)
        return self.up > 0.0 and ahead and self.distance < _FOUND

    def clearer_than(self, stored: _Walk) -> bool:
        """Whether this is right, and what is stored is wrong beyond doubt."""
        backward = stored.rolls < -_ROLLS and stored.drives < -_DRIVES
        apart = stored.distance > _TWICE * self.distance
        return self.right and (stored.up < 0.0 or backward or apart)


def _walk(plate: ForcePlate, rows: _Rows, feet: Mapping[Side, Footprint]) -> _Walk:
    """Return how the load on a plate behaves."""
    up = np.concatenate([plate.force[at, 2] for _, at in rows])
    size = float(np.abs(up).mean())
    centres = centre_of_pressure(plate, -np.inf)
    rolls, drives = [], []
    for stance, at in rows:
        foot, progress = feet[stance.side], np.linspace(-0.5, 0.5, at.size)
        rolls.append(np.polyfit(progress, centres[at, 0], 1)[0] / foot.length)
        drives.append(np.polyfit(progress, plate.force[at, 0], 1)[0] / size)
    known = np.isfinite(feet[rows[0][0].side].aside).any()
    return _Walk(
        float(up.mean()) / size,
        float(np.mean(rolls)) if known else np.nan,
        float(np.mean(drives)) if known else np.nan,
        _distance(centres, rows, feet),
    )


def _distance(centres: np.ndarray, rows: _Rows, feet: Mapping[Side, Footprint]) -> float:
    """Return how far centres of pressure (n, 3) are from where they belong, in foot lengths."""
    misses = []
    for stance, at in rows:
        foot = feet[stance.side]
        share = np.linspace(0.0, 1.0, at.size)
        heel, tip = foot.ends[at].T
        ahead = centres[at, 0] - (heel + share * (tip - heel))
        aside = np.nan_to_num(centres[at, 1] - foot.aside[at])
        misses.append(np.hypot(ahead, aside) / foot.length)
    return float(np.median(np.concatenate(misses)))
