"""The cuff of an orthosis: how its shell holds the shank, and presses on it.

A shell that is a body of its own turns about a hinge on the foot, the shank about the ankle.  In
the shank's frame (x forward, z up along the leg), the shell's cuff is off the place that it was
fitted to, at h above the ankle, by

    d = R(a) c + R(a - b) (h e_z - c) - h e_z,

    R(t) (x, z) = (x cos t + z sin t, z cos t - x sin t),

with ankle a and hinge b [rad], + = plantarflexion, and the hinge at c in front of and above the
ankle [m, foot frame].  It depends on nothing else.

References:
    Zheng and Mak (1999) J. Biomech. Eng. 121(3):330-339: soft tissue of lower limbs, indented.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any, Final, Protocol

import casadi as ca
import numpy as np

from pathwalker_cli.model.choices import (
    CUFF_MODULUS,
    CUFF_RELAXATION,
    CUFF_SHEAR,
    CUFF_TISSUE,
)
from pathwalker_cli.model.elements import Curve, ForceElement, State, plain
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SUFFIX, Side

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient

Pair = tuple[Any, Any]
"""Two components: across the shank (forward) and along it (up)."""


class Cuff(ForceElement, Protocol):
    """What an orthosis holds the shank with."""

    @property
    def hinge(self) -> tuple[Number, ...]:
        """Where the hinge is in front of and above the ankle [m]; nothing if on its axis."""

    def load(self, state: State, numbers: Mapping[str, Any], torque: Any) -> Pair:
        """Return the force on the leg, across (forward) and along (up) the shank [N].

        Args:
            state: Posture and speeds.
            numbers: Values by address.
            torque: Torque of the orthosis [N m].
        """

    def shift(self, state: State, numbers: Mapping[str, Any]) -> Pair:
        """Return how far the cuff is off its place on the leg, across and along [m]."""


def cuff_height(side: Side) -> Number:
    """Return how far above the ankle a cuff presses on the leg, as a number."""
    return Number(f"orthosis.cuff_height.{side}", "cuff_height", "height of the cuff", "m", side,
                  partial(_height, side=side), "a share of the shank")  # fmt: skip


def _height(patient: Patient, side: Side) -> float:
    return patient.cuff_height(side)


def _stiffness(patient: Patient, side: Side, share: float) -> float:
    """Return the stiffness of tissue under a cuff [N/m], as a share of that across."""
    thickness = CUFF_TISSUE * patient.length("shank", side)
    return share * CUFF_MODULUS * patient.cuff_area(side) / thickness


def _damping(patient: Patient, spring: Number) -> float:
    return CUFF_RELAXATION * spring.value_for(patient)


@dataclass(frozen=True)
class RigidCuff:
    """The cuff of an orthosis that is glued to the leg: it gives way by nothing.

    It acts on no coordinate: the torque of the orthosis is on the ankle.
    """

    side: Side

    @property
    def name(self) -> str:
        """Its name, e.g. "cuff_r"."""
        return f"cuff_{SUFFIX[self.side]}"

    @property
    def coordinates(self) -> tuple[()]:
        """None."""
        return ()

    @property
    def hinge(self) -> tuple[Number, ...]:
        """None: the hinge is on the ankle's axis."""
        return ()

    @cached_property
    def numbers(self) -> tuple[Number]:
        """Its height [m]."""
        return (cuff_height(self.side),)

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return nothing; see `ForceElement.forces`."""
        return ()

    def load(self, state: State, numbers: Mapping[str, Any], torque: Any) -> Pair:
        """Return the force on the leg [N]: the torque over the height; see `Cuff.load`."""
        return -torque / numbers[self.numbers[0].address], 0.0 * torque

    def shift(self, state: State, numbers: Mapping[str, Any]) -> Pair:
        """Return no way at all [m]; see `Cuff.shift`."""
        still = 0.0 * state.q[f"ankle_{SUFFIX[self.side]}"]
        return still, still


@dataclass(frozen=True)
class YieldingCuff:
    """A cuff with linear springs and dampers across the shank and along it.

    Its generalised forces on ankle and hinge are -J' (K d + C d'), with the Jacobian J of d.
    """

    side: Side

    @property
    def name(self) -> str:
        """Its name, e.g. "cuff_r"."""
        return f"cuff_{SUFFIX[self.side]}"

    @property
    def coordinates(self) -> tuple[str, str]:
        """Ankle and hinge."""
        s = SUFFIX[self.side]
        return f"ankle_{s}", f"hinge_{s}"

    @cached_property
    def hinge(self) -> tuple[Number, ...]:
        """Where the hinge is in front of and above the ankle, in the foot's frame [m]."""
        source = "on the axis of the ankle"
        return tuple(
            Number(f"orthosis.hinge.{way}.{self.side}", f"hinge_{way}", f"hinge {words}", "m",
                   self.side, 0.0, source)
            for way, words in (("forward", "in front of the ankle"), ("up", "above the ankle"))
        )  # fmt: skip

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """Height [m]; stiffness [N/m] and damping [N s/m] across and along; then the hinge [m]."""
        side = self.side

        def stiffness(way: str, share: float) -> Number:
            return Number(f"orthosis.cuff_stiffness.{way}.{side}", f"cuff_stiffness_{way}",
                          f"stiffness of the cuff {way}", "N/m", side,
                          partial(_stiffness, side=side, share=share),
                          "soft tissue of lower limbs, Zheng and Mak (1999); its thickness is "
                          "assumed")  # fmt: skip

        springs = tuple(stiffness(way, share) for way, share in _WAYS)

        def damping(way: str, spring: Number) -> Number:
            return Number(f"orthosis.cuff_damping.{way}.{side}", f"cuff_damping_{way}",
                          f"damping of the cuff {way}", "N s/m", side,
                          partial(_damping, spring=spring),
                          "assumed: the shell does not swing on the leg")  # fmt: skip

        dampers = (damping(way, k) for (way, _), k in zip(_WAYS, springs, strict=True))
        return (cuff_height(side), *springs, *dampers, *self.hinge)

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return the torques on ankle and hinge [N m]; see `ForceElement.forces`."""
        across, along = self.load(state, numbers, None)
        return tuple(-(across * x + along * z) for x, z in self._jacobian(state, numbers))

    def load(self, state: State, numbers: Mapping[str, Any], torque: Any) -> Pair:
        """Return the force on the leg [N]: K d + C d'; see `Cuff.load`."""
        _, k_x, k_z, c_x, c_z, *_ = (numbers[number.address] for number in self.numbers)
        x, z = self.shift(state, numbers)
        speeds = [state.v[name] for name in self.coordinates]
        v_x, v_z = (
            sum(part * speed for part, speed in zip(row, speeds, strict=True))
            for row in zip(*self._jacobian(state, numbers), strict=True)
        )
        return k_x * x + c_x * v_x, k_z * z + c_z * v_z

    def shift(self, state: State, numbers: Mapping[str, Any]) -> Pair:
        """Return d [m]; see `Cuff.shift`."""
        (hinge_x, hinge_z), (arm_x, arm_z) = self._arms(state, numbers)
        return hinge_x + arm_x, hinge_z + arm_z - numbers[self.numbers[0].address]

    def _arms(self, state: State, numbers: Mapping[str, Any]) -> tuple[Pair, Pair]:
        """Return ankle to hinge, and hinge to cuff, in the shank's frame [m]."""
        ankle, hinge = (state.q[name] for name in self.coordinates)
        height = numbers[self.numbers[0].address]
        x, z = (numbers[number.address] for number in self.hinge)
        return _turned(ankle, x, z), _turned(ankle - hinge, -x, height - z)

    def _jacobian(self, state: State, numbers: Mapping[str, Any]) -> tuple[Pair, Pair]:
        """Return the derivatives of d by ankle and hinge [m/rad]."""
        (hinge_x, hinge_z), (arm_x, arm_z) = self._arms(state, numbers)
        return (hinge_z + arm_z, -hinge_x - arm_x), (-arm_z, arm_x)


_WAYS: Final = (("across", 1.0), ("along", CUFF_SHEAR))
"""Directions of a cuff, and their stiffness beside that across."""


def _turned(angle: Any, x: Any, z: Any) -> Pair:
    """Return a point turned by an angle about +y [rad]."""
    symbolic = isinstance(angle, ca.SX)
    sin, cos = (ca.sin, ca.cos) if symbolic else (np.sin, np.cos)
    return x * cos(angle) + z * sin(angle), z * cos(angle) - x * sin(angle)
