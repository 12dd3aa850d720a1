"""The metatarsophalangeal joint: toes that spring back and are damped, without any muscle.

References:
    Falisse, A., Afschrift, M., De Groote, F. (2022) PLoS ONE 17(1): e0256311: stiffness and damping
    of adults, from the settings that its authors published with the model.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from pathwalker_cli.model.choices import TOE_DAMPING, TOE_STIFFNESS
from pathwalker_cli.model.elements import Curve, State, plain
from pathwalker_cli.model.elements.tissue import size_beside_adults
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient


def _scaled(patient: Patient, adult: float) -> float:
    """Return a number of an adult for a child of another size."""
    return adult * size_beside_adults(patient)


@dataclass(frozen=True)
class ToeJoint:
    """A linear spring and damper at the toes of one foot."""

    side: Side

    @property
    def name(self) -> str:
        """Its name, e.g. "toe_joint_r"."""
        return f"toe_joint_{SUFFIX[self.side]}"

    @property
    def coordinates(self) -> tuple[str]:
        """The toes."""
        return (f"mtp_{SUFFIX[self.side]}",)

    @cached_property
    def numbers(self) -> tuple[Number, Number, Number]:
        """Stiffness [N m/rad], damping [N m s/rad] and the angle at rest [rad]."""
        stiffness, damping = (partial(_scaled, adult=a) for a in (TOE_STIFFNESS, TOE_DAMPING))
        side, source = self.side, "Falisse et al. (2022), scaled by body mass times height"
        return (
            Number(f"toes.stiffness.{side}", "toe_stiffness", "stiffness of the toe joint",
                   "N m/rad", side, stiffness, source),
            Number(f"toes.damping.{side}", "toe_damping", "damping of the toe joint",
                   "N m s/rad", side, damping, source),
            Number(f"toes.rest.{side}", "toe_rest", "toes at rest", "rad", side, 0.0,
                   "in line with the foot"),
        )  # fmt: skip

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return the torque on the toes [N m]; see `ForceElement.forces`."""
        stiffness, damping, rest = (numbers[number.address] for number in self.numbers)
        (toe,) = self.coordinates
        return (-stiffness * (state.q[toe] - rest) - damping * state.v[toe],)


def toe_joints() -> tuple[ToeJoint, ...]:
    """Return the toe joints of both feet."""
    return tuple(ToeJoint(side) for side in SIDES)
