"""What a patient walks with: the force elements, masses and soles that a condition adds.

One hinge per side, at the ankle: `Walker.device_torques` and what is made from it know no other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, Final

from pathwalker_cli.model.elements import ForceElement, State
from pathwalker_cli.model.elements.cuff import Cuff, RigidCuff, YieldingCuff
from pathwalker_cli.model.elements.orthosis import AnkleOrthosis
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Build, Side


@dataclass(frozen=True)
class Device:
    """What a patient wears on the feet.

    Args:
        elements: Force elements that it adds, one per side that wears it.
        cuffs: What it presses on the leg with, on the same sides.
        added_mass: What it adds to a link [kg], by the link.
        identified: Names of the numbers that a prediction with it looks for by itself.
    """

    elements: Mapping[Side, AnkleOrthosis] = field(default_factory=dict)
    cuffs: Mapping[Side, Cuff] = field(default_factory=dict)
    added_mass: Mapping[str, Number] = field(default_factory=dict)
    identified: tuple[str, ...] = ()

    @property
    def forces(self) -> tuple[ForceElement, ...]:
        """Its force elements, right before left, torques before cuffs."""
        parts: tuple[Mapping[Side, ForceElement], ...] = self.elements, self.cuffs
        return tuple(part[side] for part in parts for side in SIDES if side in part)

    @property
    def body_numbers(self) -> tuple[Number, ...]:
        """Its numbers that enter the rigid bodies: masses, and where hinges are."""
        hinges = (number for cuff in self.cuffs.values() for number in cuff.hinge)
        return (*self.added_mass.values(), *hinges)

    @property
    def worn(self) -> bool:
        """Whether there is one at all."""
        return bool(self.elements)

    def cuff_forces(
        self, state: State, numbers: Mapping[str, Any], torques: Mapping[Side, Any]
    ) -> dict[Side, tuple[Any, Any]]:
        """Return what each cuff does to the leg, across and along the shank [N]; see `Cuff.load`.

        Args:
            state: Posture and speeds.
            numbers: Values by address.
            torques: Torques of the orthoses [N m] by the side that wears one.
        """
        return {side: cuff.load(state, numbers, torques[side]) for side, cuff in self.cuffs.items()}


_LINKS: Final[dict[Build, dict[str, str]]] = {
    "glued": {"shank": "shank", "foot": "foot"},
    "body": {"shank": "shell", "foot": "foot"},
}
"""Which link is heavier by what the patient's file calls the mass on shank and foot."""


@cache
def device_on(sides: tuple[Side, ...], build: Build = "glued") -> Device:
    """Return an ankle-foot orthosis on each of these sides; nothing on none."""
    joint, cuff = ("hinge", YieldingCuff) if build == "body" else ("ankle", RigidCuff)
    return Device(
        elements={side: AnkleOrthosis(side, joint) for side in sides},
        cuffs={side: cuff(side) for side in sides},
        added_mass={
            f"{link}_{SUFFIX[side]}": Number(
                f"orthosis.mass.{segment}.{side}", f"{segment}_mass", f"mass on the {segment}",
                "kg", side,
            )
            for segment, link in _LINKS[build].items()
            for side in sides
        },
        identified=("dorsiflexion_stiffness", "plantarflexion_stiffness") if sides else (),
    )  # fmt: skip
