"""Contact with the ground as data: places of the feet, their forces, and patterns of walking.

A pattern is the order in which places of the feet stand on the ground over a stride: one right and
one left step.  That of Sreenivasa et al. (2017), section 2.3, is "heel_toe" on both sides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, cached_property
from itertools import pairwise, product
from typing import TYPE_CHECKING, Any, Final, Literal, get_args

import numpy as np

from pathwalker_cli.errors import InputError
from pathwalker_cli.model.choices import (
    ROCKER_SHARES,
    ROUNDNESS,
    SOLE_CREEP,
    SOLE_DAMPING,
    SOLE_DEPTH,
)
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient

Feet = Literal["points", "rockers", "sole", "compliant"]
"""What feet touch the ground with: heel and toe as points, the same as circles that roll without
slipping, one convex sole that rolls from heel to toe, or the same sole giving way."""

SOLES: Final[tuple[Feet, ...]] = ("sole", "compliant")
"""Feet of one convex body."""

Posture = Literal["heel", "flat", "toe"]
"""What of a foot with heel and toe stands on the ground."""


@dataclass(frozen=True)
class Use:
    """How a foot with heel and toe is used.

    Args:
        single: What of it is on the ground while the other foot swings, in order.
        landing: What of it is on the ground after it has landed, until the other one leaves it.
    """

    single: tuple[Posture, ...]
    landing: tuple[Posture, ...]

    @property
    def name(self) -> str:
        """Its name if it comes with this package, else ""."""
        return next((name for name in SHIPPED_USES if USES[name] == self), "")

    def __str__(self) -> str:
        """Return it as a config gives it."""
        parts = (f"{key}: [{', '.join(value)}]" for key, value in vars(self).items())
        return self.name or f"{{{', '.join(parts)}}}"

    @property
    def fault(self) -> str:
        """What no foot can do of this, "" if there is nothing."""
        for support in (self.single, self.landing):
            if not support:
                return "leaves a support without any posture"
            if len(set(support)) < len(support):
                return "comes back to a posture within one support"
        way = (*self.landing, *self.single)
        if any({here, there} == {"heel", "toe"} for here, there in pairwise(way)):
            return "passes from heel to toe, or back, without standing flat"
        return ""


USES: Final[dict[str, Use]] = {
    "heel_toe": Use(("flat", "toe"), ("heel", "flat")),
    "flat": Use(("flat", "toe"), ("flat",)),
    "toe": Use(("toe",), ("toe",)),
}
"""Uses by the name that configs call them: lands on the heel and then the toe, lands flat, walks on
the toe alone, and what was registered, see `extensions`."""

SHIPPED_USES: Final = tuple(USES)
"""Names of those that come with this package."""

AS_RECORDED: Final = Use((), ())
"""The use that a child's recordings show, before they are read: see `model.landing`."""

Contact = tuple[Use, Use]
"""Use of the right and the left foot."""

HEEL_TOE: Final[Contact] = (USES["heel_toe"], USES["heel_toe"])
"""That of the article."""


@dataclass(frozen=True)
class ContactPoint:
    """A place of a foot that may stand on the ground."""

    place: Literal["heel", "toe", "sole", "tip"]
    side: Side

    @property
    def name(self) -> str:
        """Name of the place, e.g. "heel_r"; but for soles also that of its frame."""
        return f"{self.place}_{SUFFIX[self.side]}"

    @property
    def link(self) -> str:
        """The link that carries it."""
        return f"{'toes' if self.soft else 'foot'}_{SUFFIX[self.side]}"

    @property
    def soft(self) -> bool:
        """Whether it gives way under any foot: the pads of toes that a joint carries."""
        return self.place == "tip"

    @cached_property
    def shape(self) -> Number:
        """Radius of the circle of heel, toe or tip [m], roundness of the sole [-]."""
        if self.place == "sole":
            return Number(
                f"sole_roundness.{self.side}", "sole_roundness", "roundness of the sole", "1",
                self.side, ROUNDNESS, "see model.choices",
            )  # fmt: skip

        return Number(
            f"rocker_radius.{self.place}.{self.side}", f"{self.place}_radius",
            f"radius of the {self.place} rocker", "m", self.side,
            lambda patient: ROCKER_SHARES[self.place] * patient.length("foot", self.side),
            "share of the length of the foot, see model.choices",
        )  # fmt: skip

    @cached_property
    def law(self) -> tuple[Number, Number, Number]:
        """Numbers of what gives way: depth under body weight, damping, sliding speed."""

        def depth(patient: Patient) -> float:
            return SOLE_DEPTH * patient.length("foot", self.side)

        source = "Ackermann and van den Bogert (2010), scaled, see model.choices"
        entries: tuple[tuple[str, str, str, Any], ...] = (
            (f"{self.place}_depth", f"depth to which a {self.place} sinks", "m", depth),
            (f"{self.place}_damping", f"damping of the {self.place}", "s/m", SOLE_DAMPING),
            (f"{self.place}_creep", f"sliding speed of the {self.place}", "m/s", SOLE_CREEP),
        )
        first, second, third = (
            Number(f"{name}.{self.side}", name, label, unit, self.side, default, source)
            for name, label, unit, default in entries
        )
        return first, second, third


@dataclass(frozen=True)
class ContactForce:
    """One component of the ground reaction force on a place, and the direction it blocks.

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


@dataclass(frozen=True)
class ContactPhase:
    """A stretch of gait in which the same contact forces act.

    Args:
        forces: Active components.
        step: The side that stands while the other one swings and lands.
        compliant: Whether all places give way, not those alone that always do.
    """

    name: str
    forces: tuple[ContactForce, ...]
    step: Side
    compliant: bool = False

    @cached_property
    def force_names(self) -> tuple[str, ...]:
        """Names of the active components."""
        return tuple(force.name for force in self.forces)

    @cached_property
    def yielding(self) -> tuple[ContactForce, ...]:
        """Forces that follow from how their places sink and slide, on the ground or off it."""
        return tuple(force for force in self.forces if self.compliant or force.point.soft)

    @cached_property
    def rigid(self) -> tuple[ContactForce, ...]:
        """Forces that each stand for one direction in which their place does not move."""
        return tuple(force for force in self.forces if force not in self.yielding)

    @cached_property
    def points(self) -> tuple[ContactPoint, ...]:
        """Places that are on the ground because the phase says so; of soles that give way both."""
        given = self.forces if self.compliant else self.rigid
        return tuple(dict.fromkeys(force.point for force in given if not force.point.soft))

    @property
    def with_toes(self) -> ContactPhase:
        """The same phase of feet with toes: their tips push whenever they touch the ground."""
        return replace(self, forces=(*self.forces, *_both(TIPS)))

    @property
    def feet(self) -> tuple[Side, ...]:
        """Feet on the ground."""
        standing = {point.side for point in self.points}
        return tuple(side for side in SIDES if side in standing)

    def touched_down(self, following: ContactPhase) -> tuple[ContactForce, ...]:
        """Return the directions in which new places are stopped when the next phase begins.

        Of a rigid foot that stands already, that is the vertical one alone.
        """
        new = (force for force in following.rigid if force.point not in self.points)
        return tuple(f for f in new if f.bears or f.point.side not in self.feet)

    def lifted_off(self, following: ContactPhase) -> tuple[ContactForce, ...]:
        """Return the forces that have faded to zero when the next phase begins.

        While its foot stays on the ground a place loses its vertical force only: the friction
        of a rigid foot may pass from heel to toe at once.
        """
        gone = [force for force in self.rigid if force.point not in following.points]
        return tuple(f for f in gone if f.bears or f.point.side not in following.feet)


@dataclass(frozen=True)
class ContactPattern:
    """The phases of a stride, from left toe-off on, and the places that take part.

    Args:
        points: All places, right before left, tips of toes last; those that never stand may not
            sink either.
        phases: The phases in order.
    """

    points: tuple[ContactPoint, ...]
    phases: tuple[ContactPhase, ...]

    @cached_property
    def forces(self) -> tuple[ContactForce, ...]:
        """All components of the ground reaction forces (on the body) in order [N]."""
        return _both(self.points)

    @cached_property
    def yielding(self) -> tuple[ContactPoint, ...]:
        """The places that give way."""
        return tuple(dict.fromkeys(force.point for force in self.phases[0].yielding))

    @cached_property
    def force_names(self) -> tuple[str, ...]:
        """Their names."""
        return tuple(force.name for force in self.forces)

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of the phases."""
        return tuple(phase.name for phase in self.phases)

    @cached_property
    def steps(self) -> tuple[tuple[ContactPhase, ...], tuple[ContactPhase, ...]]:
        """The phases of the right step and of the left one."""
        right, left = (tuple(p for p in self.phases if p.step == side) for side in SIDES)
        return right, left

    @cached_property
    def following(self) -> tuple[ContactPhase, ...]:
        """The phase that comes after each, of the last one the first."""
        return self.phases[1:] + self.phases[:1]

    def indices(self, forces: Sequence[ContactForce]) -> list[int]:
        """Return the positions of some components in `forces`."""
        return [self.forces.index(force) for force in forces]

    def upward(self, points: Sequence[ContactPoint]) -> list[int]:
        """Return the positions in `forces` of the vertical components of some places."""
        return [2 * self.points.index(point) + 1 for point in points]

    def phase(self, phase: str | int | ContactPhase) -> ContactPhase:
        """Return a phase of such feet; see `phase_named`."""
        if isinstance(phase, ContactPhase):
            return phase
        found = phase_named(phase)
        return found.with_toes if any(point.soft for point in self.points) else found

    def rows(self, side: Side) -> list[int]:
        """Return the positions of the places of a side in `points`."""
        return [i for i, point in enumerate(self.points) if point.side == side]

    def in_the_air(self, phase: ContactPhase) -> list[int]:
        """Return the positions in `points` of the places that are not on the ground.

        Tips of toes are none: the ground pushes them wherever they are.
        """
        standing = () if phase.compliant else phase.points
        pairs = enumerate(self.points)
        return [i for i, point in pairs if point not in standing and not point.soft]

    def strike(self, side: Side) -> int:
        """Return the number of the phase that begins with the foot strike of a side."""
        return self._turn(side, stands=True)

    def toe_off(self, side: Side) -> int:
        """Return the number of the phase that begins with the toe-off of a side."""
        return self._turn(side, stands=False)

    def _turn(self, side: Side, stands: bool) -> int:
        """Return the number of the first phase in which a foot stands, or no longer does."""
        on = [side in phase.feet for phase in self.phases]
        return next(i for i, now in enumerate(on) if now == stands != on[i - 1])

    def durations(self, parts: Sequence[float] | np.ndarray) -> np.ndarray:
        """Return the durations of the phases from those of `PHASES` [s].

        A single or double support of another number of phases shares out the time of the two that
        it has there evenly, a step that has one phase takes all of it.
        """
        result: list[float] = []
        for step, quarters in zip(self.steps, np.split(np.asarray(parts, float), 2), strict=True):
            if len(step) == 1:
                result.append(float(quarters.sum()))
                continue
            for support, pair in zip((1, 2), np.split(quarters, 2), strict=True):
                count = sum(len(phase.feet) == support for phase in step)
                even = [float(pair.sum()) / count] * count
                result += pair.tolist() if count == len(pair) else even
        return np.array(result)


POINTS: Final = tuple(ContactPoint(place, side) for side in SIDES for place in ("heel", "toe"))
"""Heel and toe of both feet, the ends of their soles."""

_SOLES: Final = tuple(ContactPoint("sole", side) for side in SIDES)

TIPS: Final = tuple(ContactPoint("tip", side) for side in SIDES)
"""Tips of toes that a joint carries."""


def _both(points: Sequence[ContactPoint]) -> tuple[ContactForce, ...]:
    """Return both components of the forces on some places."""
    return tuple(ContactForce(point, axis) for point in points for axis in ("x", "z"))


def _on(side: Side, posture: str) -> tuple[ContactForce, ...]:
    """Return the components of a foot on the ground; flat, friction counts once."""
    if posture == "flat":
        heel, toe = (ContactPoint(place, side) for place in ("heel", "toe"))
        return ContactForce(heel, "x"), ContactForce(heel, "z"), ContactForce(toe, "z")
    place = next(p for p in (*POINTS, *_SOLES) if (p.place, p.side) == (posture, side))
    return ContactForce(place, "x"), ContactForce(place, "z")


def _step(side: Side, single: Sequence[str], landing: Sequence[str]) -> list[ContactPhase]:
    """Return the phases from single support of a foot to double support of both."""
    other: Side = "left" if side == "right" else "right"
    last = single[-1]
    return [
        *(ContactPhase(f"{side}_{posture}", _on(side, posture), side) for posture in single),
        *(
            ContactPhase(
                f"{side}_{last}_{other}_{posture}", _on(side, last) + _on(other, posture), side
            )
            for posture in landing
        ),
    ]


@cache
def contact_pattern(
    feet: Feet = "points", contact: Contact = HEEL_TOE, toes: bool = False
) -> ContactPattern:
    """Return the pattern of feet that are used like this, with toes that a joint carries or not."""
    if toes:
        bare = contact_pattern(feet, contact)
        return ContactPattern((*bare.points, *TIPS), tuple(p.with_toes for p in bare.phases))
    if feet == "sole":
        phases = [p for side in SIDES for p in _step(side, ("sole",), ("sole",))]
        return ContactPattern(_SOLES, tuple(phases))
    if feet == "compliant":
        forces = tuple(force for side in SIDES for force in _on(side, "sole"))
        steps = (ContactPhase(f"{side}_step", forces, side, compliant=True) for side in SIDES)
        return ContactPattern(_SOLES, tuple(steps))
    on_right, on_left = contact
    right = _step("right", on_right.single, on_left.landing)
    left = _step("left", on_left.single, on_right.landing)
    return ContactPattern(POINTS, (*right, *left))


PHASES: Final = contact_pattern().phases
"""The eight phases of a stride from heel to toe."""

_NAMED: Final = {
    phase.name: phase
    for phase in (
        *PHASES,
        *(
            phase
            for last, landing in product(get_args(Posture), repeat=2)
            for side in SIDES
            for phase in _step(side, (last,), (landing,))
        ),
        *(phase for feet in SOLES for phase in contact_pattern(feet).phases),
    )
}
PHASE_NAMES: Final = tuple(_NAMED)
"""Names of the phases of all patterns that feet can walk in."""


def phase_named(phase: str | int) -> ContactPhase:
    """Return a phase by its name or by its position in `PHASES`.

    Raises:
        InputError: If there is no such phase.
    """
    if isinstance(phase, int) and 0 <= phase < len(PHASES):
        return PHASES[phase]
    if phase in _NAMED:
        return _NAMED[str(phase)]
    raise InputError(f"there is no phase {phase!r}", allowed=", ".join(PHASE_NAMES))


def mirrored_phase(name: str) -> ContactPhase:
    """Return the phase in which left and right are exchanged."""
    swapped = {"right": "left", "left": "right"}
    return _NAMED["_".join(swapped.get(word, word) for word in name.split("_"))]
