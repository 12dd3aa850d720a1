"""Contact with the ground as data: points of the feet, their forces, and the walking pattern.

Phases, in order, follow Sreenivasa et al. (2017), section 2.3: one right and one left step.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Final, Literal

import numpy as np

from pathwalker_cli.errors import InputError
from pathwalker_cli.model.choices import ROCKER_SHARES
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient

Feet = Literal["points", "rockers"]
"""What feet touch the ground with: points, or circles that roll without slipping."""


@dataclass(frozen=True)
class ContactPoint:
    """A point of a foot that may stand on the ground, or the circle that touches it there.

    With the sole level the circle touches the ground at the point, its centre above it.

    Args:
        place: Where on the foot.
        side: Which foot.
    """

    place: Literal["heel", "toe"]
    side: Side

    @property
    def name(self) -> str:
        """Name of the point and of its frame, e.g. "heel_r"."""
        return f"{self.place}_{SUFFIX[self.side]}"

    @property
    def link(self) -> str:
        """The link that carries it."""
        return f"foot_{SUFFIX[self.side]}"

    @cached_property
    def radius(self) -> Number:
        """Radius of the circle [m]."""

        def by_length(patient: Patient) -> float:
            return ROCKER_SHARES[self.place] * patient.length("foot", self.side)

        return Number(
            f"rocker_radius.{self.place}.{self.side}", f"{self.place}_radius",
            f"radius of the {self.place} rocker", "m", self.side, by_length,
            "share of the length of the foot, see model.choices",
        )  # fmt: skip


@dataclass(frozen=True)
class ContactForce:
    """One component of the ground reaction force on a point, and the direction it blocks.

    Args:
        point: Where it acts.
        axis: "x" forward or "z" up.
    """

    point: ContactPoint
    axis: Literal["x", "z"]

    @property
    def name(self) -> str:
        """Its name, e.g. "heel_r_z"."""
        return f"{self.point.name}_{self.axis}"

    @property
    def bears(self) -> bool:
        """Whether it is the vertical component."""
        return self.axis == "z"

    @property
    def index(self) -> int:
        """Its position in `FORCES`."""
        return FORCES.index(self)


def lowest(rotation: np.ndarray, radius: float) -> np.ndarray:
    """Return where a circle touches the ground, from its contact point [m], shape (3,).

    Args:
        rotation: Rotation of the foot in the world, shape (3, 3).
        radius: Radius of the circle [m].
    """
    return radius * (np.asarray(rotation)[:, 2] - (0.0, 0.0, 1.0))


POINTS: Final = tuple(ContactPoint(place, side) for side in SIDES for place in ("heel", "toe"))
"""All contact points in order."""

FORCES: Final = tuple(ContactForce(point, axis) for point in POINTS for axis in ("x", "z"))
"""All components of the ground reaction forces (on the body) in order [N]."""


@dataclass(frozen=True)
class ContactPhase:
    """A stretch of gait in which the same contact forces act.

    Args:
        name: Name of the phase.
        forces: Active components; each stands for one direction in which its point does not move.
    """

    name: str
    forces: tuple[ContactForce, ...]

    @cached_property
    def force_names(self) -> tuple[str, ...]:
        """Names of the active components."""
        return tuple(force.name for force in self.forces)

    @cached_property
    def points(self) -> tuple[ContactPoint, ...]:
        """Contact points on the ground."""
        return tuple(dict.fromkeys(force.point for force in self.forces))

    @property
    def feet(self) -> tuple[Side, ...]:
        """Feet on the ground."""
        standing = {point.side for point in self.points}
        return tuple(side for side in SIDES if side in standing)

    @cached_property
    def indices(self) -> tuple[int, ...]:
        """Positions of the active components in `FORCES`."""
        return tuple(force.index for force in self.forces)

    def touched_down(self, following: ContactPhase) -> tuple[ContactForce, ...]:
        """Return the directions in which new points are stopped when the next phase begins."""
        return tuple(force for force in following.forces if force.point not in self.points)

    def lifted_off(self, following: ContactPhase) -> tuple[ContactForce, ...]:
        """Return the forces that have faded to zero when the next phase begins.

        While its foot stays on the ground a point loses its vertical force only: the friction
        of a rigid foot may pass from heel to toe at once.
        """
        gone = [force for force in self.forces if force.point not in following.points]
        return tuple(f for f in gone if f.bears or f.point.side not in following.feet)


def _on(side: Side, *components: str) -> tuple[ContactForce, ...]:
    """Return components of a foot in the order of `FORCES`, e.g. "heel x"."""
    return tuple(
        f for f in FORCES if f.point.side == side and f"{f.point.place} {f.axis}" in components
    )


def _step(side: Side, other: Side) -> tuple[ContactPhase, ...]:
    """Return the four phases from single support of a foot to double support of both."""
    flat, toe = ("heel x", "heel z", "toe z"), ("toe x", "toe z")
    standing, landing = _on(side, *toe), _on(other, "heel x", "heel z")
    return (
        ContactPhase(f"{side}_flat", _on(side, *flat)),
        ContactPhase(f"{side}_toe", standing),
        ContactPhase(f"{side}_toe_{other}_heel", standing + landing),
        ContactPhase(f"{side}_toe_{other}_flat", standing + _on(other, *flat)),
    )


PHASES: Final = _step("right", "left") + _step("left", "right")
"""The eight phases of a stride."""

PHASE_NAMES: Final = tuple(phase.name for phase in PHASES)


def phase_named(phase: str | int) -> ContactPhase:
    """Return a phase by its name or by its position in `PHASES`.

    Raises:
        InputError: If there is no such phase.
    """
    if isinstance(phase, int) and 0 <= phase < len(PHASES):
        return PHASES[phase]
    for candidate in PHASES:
        if candidate.name == phase:
            return candidate
    raise InputError(f"there is no phase {phase!r}", allowed=", ".join(PHASE_NAMES))
