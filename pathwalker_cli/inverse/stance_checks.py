"""Which stances the plates measured: one foot alone, and all of it, stood on one plate.

Every check looks for another way in which a plate tells less or more than one foot's load, and
gives its reason in words.  Markers may lie in the walking plane, so nothing is known about where a
foot stood across it; the loads themselves have to tell.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.inverse.cycles import OTHER, Stance, single_support
from pathwalker_cli.io.c3d import Event

LOADED: Final = 20.0
"""Vertical force from which a plate counts as loaded [N]; about ten times its noise."""

EDGE: Final = 3
"""Frames by which force and event may differ at either end of a stance."""

MARGIN: Final = 0.05
"""Distance by which the centre of pressure may lie outside heel and toe [m]: shoes and markers."""

INSIDE: Final = 0.9
"""Share of a stance in which the centre of pressure must lie under the foot."""

PRESENT: Final = 0.4
"""Peak force on a plate in single support, as a share of what the body needs, from which a foot
stood on it."""

SUPPORT: Final = (0.85, 1.15)
"""Mean vertical force in single support as a share of m (g + acceleration of the centre of mass):
outside, part of the foot stood off the plate or something else stood on it."""

JUMP: Final = 0.02
"""Distance by which the body's whole weight may seem to jump ahead on a plate when the other foot
strikes [m]: a second foot 0.4 m ahead shows from a twentieth of the weight on.  In the shipped
recordings a foot that stands alone gives up to 0.008, two feet give 0.03 and more."""


@dataclass(frozen=True)
class StanceForce:
    """What the plates know about one stance.

    Args:
        stance: The stance.
        plate: Index of the plate that carried it, or None.
        reason: Why the stance is not measured, "" if it is.
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
        feet: Per side, forward positions of heel and toe [m], shape (n, 2).
        carried: Vertical force that the motion of the centre of mass takes [N], shape (n,).
    """

    events: tuple[Event, ...]
    up: np.ndarray
    points: np.ndarray
    feet: Mapping[Side, np.ndarray]
    carried: np.ndarray


def judge(stance: Stance, seen: Evidence) -> StanceForce:
    """Return the plate that carried a stance alone, or why there is none."""
    rows = single_support(stance, seen.events)
    if not rows.size:
        rows = np.arange(stance.strike, stance.toe_off + 1)
    plate = int(np.argmax(seen.up[rows].sum(axis=0)))
    if seen.up[rows, plate].max() < PRESENT * seen.carried[rows].mean():
        return StanceForce(stance, None, "no plate below the foot")
    return StanceForce(stance, plate, next(_doubts(stance, plate, seen), ""))


def _doubts(stance: Stance, plate: int, seen: Evidence) -> Iterator[str]:
    """Yield what is wrong with a stance on a plate, the plainest first."""
    name, load = f"plate {plate + 1}", seen.up[:, plate]
    ends = (stance.strike - EDGE, stance.toe_off + EDGE)
    if any(0 <= end < load.size and load[end] > LOADED for end in ends):
        yield f"{name} loaded before or after the stance"
    other = OTHER[stance.side]
    strikes = [e.frame for e in seen.events if (e.side, e.kind) == (other, "foot_strike")]
    for strike in strikes:
        if stance.strike < strike <= stance.toe_off and _struck(plate, strike, seen):
            yield f"{name} also carries the {other} foot from frame {strike}"
    for index in range(seen.up.shape[1]):
        if index != plate and _struck(index, stance.strike, seen):
            yield f"plate {index + 1} carries part of the foot from frame {stance.strike}"
    gap = outside(seen.points[stance.rows, plate], seen.feet[stance.side][stance.rows])
    if not np.mean(gap[np.isfinite(gap)] < MARGIN) >= INSIDE:
        yield f"{name}: load not under the foot"
    single = single_support(stance, seen.events)
    share = float(load[single].mean() / seen.carried[single].mean()) if single.size else 0.0
    if not SUPPORT[0] < share < SUPPORT[1]:
        yield f"{name} carries {share:.0%} of the body in single support"


def _struck(plate: int, strike: int, seen: Evidence) -> bool:
    """Return whether a foot that strikes comes down on a plate, at least with a part.

    A free plate gets loaded then.  On one that carries the standing foot, whose centre of pressure
    moves on smoothly, the load jumps ahead: the second foot adds its load times the distance
    between the feet to the moment about where the load was before.

    Args:
        plate: Index of the plate.
        strike: Frame of the foot strike.
        seen: Loads and feet.
    """
    rows = slice(max(strike - EDGE, 0), strike + 2 * EDGE + 1)
    load, point = seen.up[rows, plate], seen.points[rows, plate]
    if np.isnan(point[0]):
        return bool(load.max() > LOADED)
    ahead = np.nan_to_num(load * (point - point[0]))
    return bool(ahead.max() > JUMP * seen.carried.mean())


def outside(points: np.ndarray, extents: np.ndarray) -> np.ndarray:
    """Return by how much points lie behind the heel or before the toe [m], 0 if between.

    Args:
        points: Forward positions [m], shape (n,).
        extents: Forward positions of heel and toe [m], shape (n, 2).
    """
    ends = np.sort(extents, axis=1)
    return np.maximum(0.0, np.maximum(ends[:, 0] - points, points - ends[:, 1]))
