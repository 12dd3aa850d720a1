"""What a patient walks with: the force elements, masses and soles that a condition adds."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final

from pathwalker_cli.model.elements import ForceElement
from pathwalker_cli.model.elements.orthosis import AnkleOrthosis
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, Side


@dataclass(frozen=True)
class Device:
    """What a patient wears on both feet.

    Args:
        elements: Force elements that it adds, one per side.
        added_mass: What it adds to a segment of each leg [kg], by the segment.
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


DEVICES: Final[dict[str, Device]] = {
    "barefoot": Device(),
    "orthosis": Device(
        elements={side: AnkleOrthosis(side) for side in SIDES},
        added_mass={
            segment: Number(
                f"orthosis.mass.{segment}", f"{segment}_mass", f"mass on the {segment}", "kg"
            )
            for segment in ("shank", "foot")
        },
        identified=("dorsiflexion_stiffness", "plantarflexion_stiffness"),
    ),
}
"""Device by condition."""
