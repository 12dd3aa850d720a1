"""Passive joint torques: what ligaments, tendons and slack muscles do at hip, knee and ankle.

Two-joint muscles couple neighbours: hamstrings and rectus femoris hip and knee, gastrocnemius knee
and ankle.  What a clinic measures on the couch shifts the curves: a joint whose range ends ten
degrees earlier than usual meets the same resistance ten degrees earlier.

References:
    Riener, R., Edrich, T. (1999) J. Biomech. 32, 539-544: torques of adults, angles in degrees.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

import casadi as ca
import numpy as np

from pathwalker_cli.model.choices import DAMPING, STEEPEST
from pathwalker_cli.model.elements import Curve, State, plain
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SIDES, SUFFIX, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient

_JOINTS: Final = ("hip", "knee", "ankle")
_DEGREES: Final = 180.0 / np.pi

_ADULT: Final = 75.0 * 1.75
"""Body mass times height of the adults whose torques are scaled [kg m]."""

_EXAMINATION: Final = {
    "hip_extension": (10.0, "hip extension"),
    "popliteal_angle": (26.0, "popliteal angle"),
    "knee_extension": (0.0, "knee extension"),
    "dorsiflexion_knee_extended": (13.0, "dorsiflexion, knee extended"),
    "dorsiflexion_knee_flexed": (13.0 + 90.0 * 0.0176 / 0.0843, "dorsiflexion, knee flexed"),
}
"""Ranges of typical children [deg], to which the curves belong unshifted, and their names.  That
with the knee flexed follows from the curves' own coupling at 90 degrees."""


def size_beside_adults(patient: Patient) -> float:
    """Return how large passive torques are beside those of adults: as mass times height."""
    return patient.body_mass * patient.height / _ADULT


SHARED: Final = (
    Number("tissue.size", "passive_size", "passive torques beside adults'", "1", None,
           size_beside_adults, "body mass times height, Riener and Edrich (1999)"),
    Number("tissue.damping", "joint_damping", "damping of leg joints", "N m s/rad", None,
           DAMPING, "see model.choices"),
)  # fmt: skip
"""Numbers of both sides."""


@dataclass(frozen=True)
class LegTissue:
    """The passive torques of one leg as a force element."""

    side: Side

    @property
    def name(self) -> str:
        """Its name, e.g. "tissue_r"."""
        return f"tissue_{SUFFIX[self.side]}"

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Hip, knee and ankle."""
        return tuple(f"{joint}_{SUFFIX[self.side]}" for joint in _JOINTS)

    @cached_property
    def _own(self) -> dict[str, Number]:
        """The numbers of the side by their names."""
        side, own = self.side, "unshifted curves, typical children"
        numbers = [
            Number(f"examination.{name}.{side}", name, label, "deg", side, usual, own)
            for name, (usual, label) in _EXAMINATION.items()
        ]
        numbers += [
            Number(f"tissue.{joint}_stiffness.{side}", f"passive_{joint}_stiffness",
                   f"passive stiffness of the {joint}", "1", side, 1.0, "as size says")
            for joint in _JOINTS
        ]  # fmt: skip
        return {number.name: number for number in numbers}

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """What was examined [deg], stiffness factors, and what both sides share."""
        shared = SHARED if self.side == SIDES[0] else ()  # every number belongs to one element
        return (*self._own.values(), *shared)

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return the torques on hip, knee and ankle [N m]; see `ForceElement.forces`."""
        own = {name: numbers[number.address] for name, number in self._own.items()}
        size, damping = (numbers[number.address] for number in SHARED)
        hip, knee, ankle = (state.q[name] for name in self.coordinates)
        torques = passive_torques(hip, knee, ankle, own)
        factors = (size * own[f"passive_{joint}_stiffness"] for joint in _JOINTS)
        speeds = (state.v[name] for name in self.coordinates)
        each = zip(factors, torques, speeds, strict=True)
        return tuple(factor * torque - damping * speed for factor, torque, speed in each)


def passive_torques(hip: Any, knee: Any, ankle: Any, examined: Mapping[str, Any]) -> list[Any]:
    """Return the passive torques of an adult leg on hip, knee and ankle [N m].

    Args:
        hip: Hip angle [rad], + extension.
        knee: Knee angle [rad], + flexion.
        ankle: Ankle angle [rad], + plantarflexion.
        examined: Range of motion by the names of `_EXAMINATION` [deg]: hip extension (Thomas
            test), popliteal angle (knee flexion left with the hip at 90), knee extension (negative
            where the knee does not straighten), dorsiflexion with the knee straight and at 90.

    Returns:
        Torques in the senses of the coordinates.

    References:
        Riener and Edrich (1999), equations for hip, knee and ankle.
    """
    lost = {name: usual - examined[name] for name, (usual, _) in _EXAMINATION.items()}
    h, k, a = -_DEGREES * hip, _DEGREES * knee, _DEGREES * ankle
    bent = k + lost["popliteal_angle"]
    coupling = 0.0843 / 90.0 * (
        examined["dorsiflexion_knee_flexed"] - examined["dorsiflexion_knee_extended"]
    )  # fmt: skip
    resists = _exponential
    flexing_hip = (
        resists(1.4655 - 0.0034 * k - 0.0750 * (h - lost["hip_extension"]))
        - resists(1.3403 - 0.0226 * k + 0.0305 * h)
        + 8.072
    )
    flexing_knee = (
        resists(1.800 - 0.0460 * a - 0.0352 * bent + 0.0217 * h)
        - resists(-3.971 - 0.0004 * a + 0.0495 * k - 0.0128 * h)
        - 4.820
        + resists(2.220 - 0.150 * (k - lost["knee_extension"]))
    )
    plantarflexing = (
        resists(2.1016 - 0.0843 * (a - lost["dorsiflexion_knee_extended"]) - coupling * k)
        - resists(-7.9763 + 0.1949 * a + 0.0008 * k)
        - 1.792
    )
    return [-flexing_hip, flexing_knee, plantarflexing]


def _exponential(x: Any) -> Any:
    """Return exp(x), beyond `STEEPEST` its expansion to second order: finite in any posture."""
    low = (ca.fmin if isinstance(x, ca.SX | ca.MX) else np.minimum)(x, STEEPEST)
    over = x - low
    grown = ca.exp(low) if isinstance(x, ca.SX | ca.MX) else np.exp(low)
    return grown * (1.0 + over + over * over / 2.0)


def passive_series(
    patient: Patient, names: Sequence[str], q: np.ndarray, v: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the passive torques of a patient's legs at m instants [N m], by coordinate.

    Coordinates q [m, rad] and velocities v [m/s, rad/s] are of shape (m, len(names)).
    """
    angles, speeds = (dict(zip(names, x.T, strict=True)) for x in (q, v))
    state = State(angles, speeds, {})
    elements = leg_tissue()
    values = {n.address: n.value_for(patient) for each in elements for n in each.numbers}
    torques = [(each, each.forces(state, values)) for each in elements]
    return {name: x for each, xs in torques for name, x in zip(each.coordinates, xs, strict=True)}


def leg_tissue() -> tuple[LegTissue, ...]:
    """Return the passive tissue of both legs."""
    return tuple(LegTissue(side) for side in SIDES)
