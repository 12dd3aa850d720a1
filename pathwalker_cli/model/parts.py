"""What walkers are made of: force elements, device and feet, before any patient's numbers."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

from pathwalker_cli.conventions import Condition
from pathwalker_cli.model.contact import (
    HEEL_TOE,
    POINTS,
    SOLES,
    TIPS,
    Contact,
    ContactPattern,
    ContactPoint,
    Feet,
    contact_pattern,
)
from pathwalker_cli.model.devices import Device, device_on
from pathwalker_cli.model.elements import ForceElement, registered_elements
from pathwalker_cli.model.elements.muscle import MuscleTorqueGenerator, generators
from pathwalker_cli.model.elements.tissue import leg_tissue
from pathwalker_cli.model.elements.toes import toe_joints
from pathwalker_cli.model.numbers import Number, Unknown, unknowns_at
from pathwalker_cli.model.skeleton import Build, Side, Skeleton, walker_skeleton

_MUSCLES: Final = generators()
_TISSUE: Final = leg_tissue()
_TOES: Final = toe_joints()


@dataclass(frozen=True)
class Parts:
    """Which parts a walker has.

    Args:
        condition: "barefoot" or "orthosis".
        tissue: Whether joints have passive torques.
        feet: What the feet touch the ground with.
        contact: How right and left foot are used; a sole needs to know nothing of it.
        further: Names of force elements that were registered, see `extensions`.
        braced: Sides that wear an orthosis.
        toes: Whether a joint carries the toes.
        orthosis: Whether an orthosis is glued to shank and foot, or a body of its own.
    """

    condition: Condition = "barefoot"
    tissue: bool = False
    feet: Feet = "points"
    contact: Contact = HEEL_TOE
    further: tuple[str, ...] = ()
    braced: tuple[Side, ...] = ()
    toes: bool = False
    orthosis: Build = "glued"

    @property
    def skeleton(self) -> Skeleton:
        """Bodies and joints."""
        return walker_skeleton(self.toes, self.shelled)

    @property
    def shelled(self) -> tuple[Side, ...]:
        """Sides whose orthosis is a body of its own."""
        return self.braced if self.orthosis == "body" else ()

    @property
    def pattern(self) -> ContactPattern:
        """The order in which places of the feet stand on the ground."""
        return contact_pattern(self.feet, self.contact, self.toes)

    @property
    def soles(self) -> bool:
        """Whether each foot is one convex body."""
        return self.feet in SOLES

    @property
    def compliant(self) -> bool:
        """Whether the feet give way, so that the ground reaction follows from the motion."""
        return self.feet == "compliant"

    @property
    def device(self) -> Device:
        """What the patient walks with."""
        return device_on(self.braced, self.orthosis)

    @property
    def muscles(self) -> tuple[MuscleTorqueGenerator, ...]:
        """The muscle torque generators."""
        return _MUSCLES

    @property
    def passive(self) -> tuple[ForceElement, ...]:
        """Force elements of the body beside the muscles.

        Raises:
            ConfigError: If nothing has registered one of the further ones.
        """
        toes, tissue = _TOES if self.toes else (), _TISSUE if self.tissue else ()
        return (*tissue, *toes, *registered_elements(self.further))

    @cached_property
    def elements(self) -> tuple[ForceElement, ...]:
        """All force elements: muscles, other tissue, then what the device adds."""
        return (*self.muscles, *self.passive, *self.device.forces)

    @property
    def frames(self) -> tuple[ContactPoint, ...]:
        """Heels and toes, the ends of soles, and tips where a joint carries toes."""
        return (*POINTS, *(TIPS if self.toes else ()))

    @cached_property
    def shapes(self) -> tuple[Number, ...]:
        """Radii of the circles in the order of `frames`, roundness of soles; none of points."""
        if self.feet == "points":
            return ()
        soles = [point for point in self.pattern.points if self.soles and not point.soft]
        return tuple(point.shape for point in (*self.frames, *soles))

    @cached_property
    def body_numbers(self) -> tuple[Number, ...]:
        """The numbers that enter the rigid bodies and their contacts, all of them linearly."""
        return (*self.device.body_numbers, *self.shapes)

    @property
    def moved_joints(self) -> tuple[str, ...]:
        """Coordinates of the joints whose place is a number that may move."""
        return tuple(joint.coordinate for joint in self.skeleton.joints if joint.beside)

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """Every named number: of the elements, of the bodies, of what gives way."""
        of_elements = (n for element in self.elements for n in element.numbers)
        laws = (number for place in self.pattern.yielding for number in place.law)
        return tuple(dict.fromkeys((*of_elements, *self.body_numbers, *laws)))

    def unknowns(self, free: Sequence[str] = ()) -> tuple[Unknown, ...]:
        """Return what a problem chooses: what is asked for, and what a device is identified by.

        What a device is identified for stands first, per kind right before left, unless both sides
        alike are asked for.

        Raises:
            ConfigError: If there is no such number.
        """
        asked = unknowns_at(free, self.numbers)
        taken = {address for unknown in asked for address in unknown.addresses}
        usual = [
            Unknown.of(number)
            for name in self.device.identified
            for number in self.numbers
            if number.name == name and number.address not in taken
        ]
        return (*usual, *asked)
