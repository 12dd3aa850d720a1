"""What a patient walks with: the force elements, masses and soles that a condition adds.

One hinge per side, at the ankle: `Walker.device_torques` and what is made from it know no other.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Final

from pathwalker_cli.model.elements import ForceElement
from pathwalker_cli.model.elements.orthosis import AnkleOrthosis
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Side


@dataclass(frozen=True)
class Device:
    """What a patient wears on the feet.

    Args:
        elements: Force elements that it adds, one per side that wears it.
        added_mass: What it adds to a link [kg], by the link.
        identified: Names of the numbers that a prediction with it looks for by itself.
    """

    elements: Mapping[Side, AnkleOrthosis] = field(default_factory=dict)
    added_mass: Mapping[str, Number] = field(default_factory=dict)
    identified: tuple[str, ...] = ()

    @property
    def forces(self) -> tuple[ForceElement, ...]:
        """Its force elements, right before left."""
        return tuple(self.elements[side] for side in SIDES if side in self.elements)

    @property
    def worn(self) -> bool:
        """Whether there is one at all."""
        return bool(self.elements)


_MASSES: Final = ("shank", "foot")
"""Segments of a leg that an orthosis makes heavier."""


@cache
def device_on(sides: tuple[Side, ...]) -> Device:
    """Return an ankle-foot orthosis on each of these sides; nothing on none."""
    return Device(
        elements={side: AnkleOrthosis(side) for side in sides},
        added_mass={
            f"{segment}_{SUFFIX[side]}": Number(
                f"orthosis.mass.{segment}.{side}", f"{segment}_mass", f"mass on the {segment}",
                "kg", side,
            )
            for segment in _MASSES
            for side in sides
        },
        identified=("dorsiflexion_stiffness", "plantarflexion_stiffness") if sides else (),
    )  # fmt: skip
