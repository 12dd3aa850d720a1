"""Which stances the plates measured: one foot alone, and all of it, stood on one plate.

Every check looks for another way in which a plate tells less or more than one foot's load, and
gives its reason in words.  Where the markers lie in the walking plane, nothing is known about where
a foot stood across it, and the loads themselves have to tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.inverse.cycles import OTHER, Stance, single_support
from pathwalker_cli.inverse.plate_checks import Footprint
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.c3d_plates import LOADED, ForcePlate

EDGE: Final = 3
"""Frames by which force and event may differ at either end of a stance."""

MARGIN: Final = 0.36
"""Distance by which the centre of pressure may lie outside heel and toes, in foot lengths (heel to
toe marker): shoes and markers; 5 cm for the shipped patient."""

INSIDE: Final = 0.9
"""Share of a stance in which the centre of pressure must lie under the foot."""

PRESENT: Final = 0.4
"""Peak force on a plate in single support, as a share of what the body needs, from which a foot
stood on it."""

SUPPORT: Final = (0.85, 1.15)
"""Mean vertical force in single support as a share of m (g + acceleration of the centre of mass):
outside, part of the foot stood off the plate or something else stood on it."""

JUMP: Final = 0.145
"""Distance by which the body's whole weight may seem to jump ahead on a plate when the other foot
strikes, in foot lengths; 2 cm for the shipped patient: a second foot 0.4 m ahead shows from a
twentieth of the weight on.  A foot that stands alone there gives up to 0.8 cm, two feet 3."""

REACH: Final = 0.5
"""Distance from a plate at which the middle line of a foot surely does not touch it, in foot
lengths: half the foot's breadth, and that much again for markers and corners."""


@dataclass(frozen=True)
class StanceForce:
    """The index of the plate that carried a stance, or None, and why the stance is not measured.

    The reason is "" if it is measured.
    """

    stance: Stance
    plate: int | None
    reason: str

    @property
    def measured(self) -> bool:
        """Whether the force of this stance is known."""
        return not self.reason


@dataclass(frozen=True)
class Evidence:
    """Where loads and feet are in every frame of a recording.

    Args:
        events: Foot strikes and toe-offs.
        up: Vertical force on each plate [N], shape (n, plates).
        points: Forward position of its centre of pressure [m], NaN without load, shape (n, plates).
        feet: Per side, where the foot is on the ground.
        carried: Vertical force that the motion of the centre of mass takes [N], shape (n,).
        off: Per side, distance of the foot from every plate [m], 0 if unknown, shape (n, plates).
        faults: What is wrong with plates that cannot be used, by their index.
        first: Number that the recording program gives the first frame.
    """

    events: tuple[Event, ...]
    up: np.ndarray
    points: np.ndarray
    feet: Mapping[Side, Footprint]
    carried: np.ndarray
    off: Mapping[Side, np.ndarray]
    faults: Mapping[int, str]
    first: int


def judge(stance: Stance, seen: Evidence) -> StanceForce:
    """Return the plate that carried a stance alone, or why there is none."""
    rows = single_support(stance, seen.events)
    if not rows.size:
        rows = np.arange(stance.strike, stance.toe_off + 1)
    size = np.abs(seen.up[rows])
    plate = int(np.argmax(size.sum(axis=0)))
    if size[:, plate].max() < PRESENT * seen.carried[rows].mean():
        return StanceForce(stance, None, "no plate below the foot")
    return StanceForce(stance, plate, next(_doubts(stance, plate, seen), ""))


def _doubts(stance: Stance, plate: int, seen: Evidence) -> Iterator[str]:
    """Yield what is wrong with a stance on a plate, the plainest first."""
    name, load = f"plate {plate + 1}", seen.up[:, plate]
    if plate in seen.faults:
        yield f"{name}: {seen.faults[plate]}"
    ends = (stance.strike - EDGE, stance.toe_off + EDGE)
    if any(0 <= end < load.size and load[end] > LOADED for end in ends):
        yield f"{name} loaded before or after the stance"
    other = OTHER[stance.side]
    strikes = [e.frame for e in seen.events if (e.side, e.kind) == (other, "foot_strike")]
    for strike in strikes:
        if stance.strike < strike <= stance.toe_off and _struck(plate, strike, other, seen):
            yield f"{name} also carries the {other} foot from frame {seen.first + strike}"
    for index in range(seen.up.shape[1]):
        if index != plate and _struck(index, stance.strike, stance.side, seen):
            frame = seen.first + stance.strike
            yield f"plate {index + 1} carries part of the foot from frame {frame}"
    foot = seen.feet[stance.side]
    gap = outside(seen.points[stance.rows, plate], foot.ends[stance.rows])
    if not np.mean(gap[np.isfinite(gap)] < MARGIN * foot.length) >= INSIDE:
        yield f"{name}: load not under the foot"
    single = single_support(stance, seen.events)
    share = float(load[single].mean() / seen.carried[single].mean()) if single.size else 0.0
    if not SUPPORT[0] < share < SUPPORT[1]:
        usual = f"{100 * SUPPORT[0]:.0f} to {100 * SUPPORT[1]:.0f} %"
        yield f"{name} carries {100 * share:.0f} % of the body in single support, not {usual}"


def _struck(plate: int, strike: int, side: Side, seen: Evidence) -> bool:
    """Return whether a foot that strikes comes down on a plate, at least with a part.

    A free plate gets loaded then.  On one that carries the standing foot, whose centre of pressure
    moves on smoothly, the load jumps ahead: the second foot adds its load times the distance
    between the feet to the moment about where the load was before.  A foot that stands beside the
    plate does neither, however far the other one rolls.
    """
    rows = slice(max(strike - EDGE, 0), strike + 2 * EDGE + 1)
    load, point, foot = seen.up[rows, plate], seen.points[rows, plate], seen.feet[side]
    if seen.off[side][rows, plate].min() > REACH * foot.length:
        return False
    if np.isnan(point[0]):
        return bool(load.max() > LOADED)
    ahead = np.nan_to_num(load * (point - point[0]))
    return bool(ahead.max() > JUMP * foot.length * seen.carried.mean())


def off_plate(foot: Footprint, plates: Sequence[ForcePlate]) -> np.ndarray:
    """Return how far a foot's middle line is from each plate [m], shape (n, plates).

    It is 0 on the plate, and where the foot's sideways position is unknown.
    """
    line = np.linspace(foot.ends[:, 0], foot.ends[:, 1], 5)
    points = np.stack([line, np.broadcast_to(foot.aside, line.shape)], axis=-1)
    gaps = []
    for plate in plates:
        sides = np.array([plate.corners[0] - plate.corners[1], plate.corners[0] - plate.corners[3]])
        sizes = np.linalg.norm(sides, axis=1)
        inside = (points - plate.centre[:2]) @ (sides[:, :2] / sizes[:, None]).T
        beyond = np.maximum(np.abs(inside) - sizes / 2.0, 0.0)
        gaps.append(np.linalg.norm(beyond, axis=-1).min(axis=0))
    return np.nan_to_num(np.stack(gaps, axis=1))


def outside(points: np.ndarray, extents: np.ndarray) -> np.ndarray:
    """Return by how much points lie behind the heel or before the toe [m], 0 if between.

    Args:
        points: Forward positions [m], shape (n,).
        extents: Forward positions of heel and toe [m], shape (n, 2).
    """
    return np.asarray(np.abs(points - np.clip(points, *np.sort(extents, axis=1).T)))
