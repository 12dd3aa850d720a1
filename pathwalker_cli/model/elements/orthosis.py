"""The ankle-foot orthosis as a force element: a five-stage torque-angle curve at its joint.

References:
    Sreenivasa et al. (2017), figure 2 and table 2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final

from pathwalker_cli.model.choices import BLEND, CURVINESS, NO_PRELOAD, STEEP
from pathwalker_cli.model.elements import Curve, State, plain
from pathwalker_cli.model.elements.curves import BezierChain, evaluate
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.model.skeleton import SUFFIX, Side


@dataclass(frozen=True)
class OrthosisSide:
    """Fixed parameters of the orthosis on one side; angles + in plantarflexion.

    Args:
        neutral_angle: theta_0 [rad].
        free_play: theta_W [rad], positive.
        preload_torque: tau_0 [N m], positive.
        dorsiflexion_stop: theta_DH [rad], below the free play.
        plantarflexion_stop: theta_PH [rad], above the free play.
        dorsiflexion_stop_stiffness: K_DH [N m/rad].
        plantarflexion_stop_stiffness: K_PH [N m/rad].
    """

    neutral_angle: Any
    free_play: Any
    preload_torque: Any
    dorsiflexion_stop: Any
    plantarflexion_stop: Any
    dorsiflexion_stop_stiffness: Any
    plantarflexion_stop_stiffness: Any


def orthosis_curve(side: OrthosisSide, k_d: Any, k_p: Any) -> BezierChain:
    """Return the characteristic curve; the torque on the joint is its negative.

    Args:
        side: Fixed parameters.
        k_d: Dorsiflexion stiffness K_D [N m/rad]; number or CasADi expression.
        k_p: Plantarflexion stiffness K_P [N m/rad]; number or CasADi expression.

    Returns:
        Seven knots: stop, spring, edge of free play, neutral angle, and back again.

    The reference's slope at the neutral angle, 4 tau_0/theta_W, makes a curve only for springs
    that are softer than the rise of the preload, 2 tau_0/theta_W: the end tangents of stiffer
    ones meet outside their piece. Up to half of that stiffness the slope is the reference's;
    from there to equal stiffness it falls to 2 tau_0/theta_W, and stays there.
    """
    middle, play, preload = side.neutral_angle, side.free_play, side.preload_torque
    reach_d = (middle - play / 2) - side.dorsiflexion_stop
    reach_p = side.plantarflexion_stop - (middle + play / 2)
    over_d, over_p = (BLEND * stop.spring for stop in stops_of(side, k_d, k_p))
    steep_d, meeting_d = _preload_rise(play, preload, k_d)
    steep_p, meeting_p = _preload_rise(play, preload, k_p)
    steep = steep_d * steep_p
    stop_d, stop_p = side.dorsiflexion_stop_stiffness, side.plantarflexion_stop_stiffness
    x = [
        side.dorsiflexion_stop - over_d / stop_d,
        side.dorsiflexion_stop + BLEND * reach_d,
        middle - play,
        middle,
        middle + play,
        side.plantarflexion_stop - BLEND * reach_p,
        side.plantarflexion_stop + over_p / stop_p,
    ]
    y = [
        -preload - reach_d * k_d - over_d,
        -preload - (1 - BLEND) * reach_d * k_d,
        -preload - play * k_d / 2,
        0.0,
        preload + play * k_p / 2,
        preload + (1 - BLEND) * reach_p * k_p,
        preload + reach_p * k_p + over_p,
    ]
    slopes = [stop_d, k_d, k_d, 2 * (1 + steep) * preload / play, k_p, k_p, stop_p]
    # of the way from the edge of free play to the neutral angle
    share_d, share_p = (
        (1 + 2 * q) / (2 + 2 * q) for q in (meeting_d * steep_p, meeting_p * steep_d)
    )
    corners = [
        side.dorsiflexion_stop,
        (x[1] + x[2]) / 2,
        x[2] + share_d * play,
        x[4] - share_p * play,
        (x[4] + x[5]) / 2,
        side.plantarflexion_stop,
    ]
    return BezierChain(x, y, slopes, CURVINESS, corners=corners)


@dataclass(frozen=True)
class Stop:
    """A hard stop.

    Args:
        name: "dorsiflexion" or "plantarflexion".
        sign: Sign of ankle angles beyond it: -1 or 1.
        angle: Where it is [rad].
        stiffness: Its stiffness [N m/rad].
        spring: Torque of its spring there [N m]: the spring is bent no further, and whatever the
            orthosis exerts beyond is on the stop.
    """

    name: str
    sign: float
    angle: Any
    stiffness: Any
    spring: Any

    def beyond(self, angle: Any) -> Any:
        """Return how far an ankle angle is beyond it [rad], negative before it."""
        return self.sign * (angle - self.angle)


def stops_of(side: OrthosisSide, k_d: Any, k_p: Any) -> tuple[Stop, Stop]:
    """Return the stops behind K_D and K_P; see `orthosis_curve` for the arguments."""
    half = side.free_play / 2
    reach_d = (side.neutral_angle - half) - side.dorsiflexion_stop
    reach_p = side.plantarflexion_stop - (side.neutral_angle + half)
    return (
        Stop("dorsiflexion", -1.0, side.dorsiflexion_stop, side.dorsiflexion_stop_stiffness,
             side.preload_torque + reach_d * k_d),
        Stop("plantarflexion", 1.0, side.plantarflexion_stop, side.plantarflexion_stop_stiffness,
             side.preload_torque + reach_p * k_p),
    )  # fmt: skip


def _preload_rise(play: Any, preload: Any, stiffness: Any) -> tuple[Any, Any]:
    """Return how far the rise of the preload is the reference's, s, and s / (1 - r).

    With r = K theta_W / (2 tau_0), s(r) is 1 up to r_0 = `STEEP`, 0 from 1 on, and a smoothstep
    of seventh degree between, whose fourfold zero keeps s / (1 - r) C2.
    """
    ratio = stiffness * play / (2 * preload + NO_PRELOAD)
    soft = ratio < STEEP
    between = (1 - soft) * (ratio < 1)
    way = between * (ratio - STEEP) / (1 - STEEP)
    rest = between * (1 - way) ** 3 * (1 + 4 * way + 10 * way**2 + 20 * way**3)
    return soft + rest * (1 - way), soft / (1 - soft * ratio) + rest / (1 - STEEP)


def orthosis_torque(side: OrthosisSide, angle: Any, k_d: Any, k_p: Any) -> Any:
    """Return the torque of the orthosis on the ankle [N m], restoring.

    The angle is + in plantarflexion [rad]; for k_d and k_p see `orthosis_curve`.
    """
    return -evaluate(orthosis_curve(side, k_d, k_p), angle).value


_NUMBERS: Final = (
    ("stiffness_guess.dorsiflexion", "dorsiflexion_stiffness", "K_D", "N m/rad"),
    ("stiffness_guess.plantarflexion", "plantarflexion_stiffness", "K_P", "N m/rad"),
    ("neutral_angle", "neutral_angle", "neutral angle", "rad"),
    ("free_play", "free_play", "free play", "rad"),
    ("preload_torque", "preload_torque", "preload", "N m"),
    ("dorsiflexion_stop", "dorsiflexion_stop", "dorsiflexion stop", "rad"),
    ("plantarflexion_stop", "plantarflexion_stop", "plantarflexion stop", "rad"),
    ("stop_stiffness.dorsiflexion", "dorsiflexion_stop_stiffness",
     "dorsiflexion stop stiffness", "N m/rad"),
    ("stop_stiffness.plantarflexion", "plantarflexion_stop_stiffness",
     "plantarflexion stop stiffness", "N m/rad"),
)  # fmt: skip
"""Place below `orthosis` in the patient's file, name, label and unit of every number: both springs,
then the fields of `OrthosisSide`."""


@dataclass(frozen=True)
class AnkleOrthosis:
    """The joint of the orthosis of one side as a force element.

    Args:
        side: The side.
        joint: What it bends: "ankle", to which it is glued, or a "hinge" of its own.
    """

    side: Side
    joint: str = "ankle"

    @property
    def name(self) -> str:
        """Its name, e.g. "orthosis_r"."""
        return f"orthosis_{SUFFIX[self.side]}"

    @property
    def coordinates(self) -> tuple[str]:
        """The ankle, or the hinge."""
        return (f"{self.joint}_{SUFFIX[self.side]}",)

    @cached_property
    def numbers(self) -> tuple[Number, ...]:
        """K_D and K_P, then the fields of `OrthosisSide` in order."""
        return tuple(
            Number(
                f"orthosis.{place}.{self.side}", name, label, unit, self.side, faded=unit != "rad"
            )
            for place, name, label, unit in _NUMBERS
        )

    def fixed(self, numbers: Mapping[str, Any]) -> OrthosisSide:
        """Return all but the springs, from numbers by address."""
        return OrthosisSide(*self._values(numbers)[2:])

    def springs(self, numbers: Mapping[str, Any]) -> tuple[Any, Any]:
        """Return K_D and K_P [N m/rad], from numbers by address."""
        k_d, k_p = self._values(numbers)[:2]
        return k_d, k_p

    def _values(self, numbers: Mapping[str, Any]) -> list[Any]:
        return [numbers[number.address] for number in self.numbers]

    def forces(
        self, state: State, numbers: Mapping[str, Any], curve: Curve = plain
    ) -> tuple[Any, ...]:
        """Return the torque on its joint [N m]; see `ForceElement.forces`."""
        (joint,) = self.coordinates
        return (curve(_torque, state.q[joint], *self._values(numbers)),)


def _torque(angle: Any, k_d: Any, k_p: Any, *fixed: Any) -> Any:
    """Return `orthosis_torque` with all numbers in a row, in the order of `_NUMBERS`."""
    return orthosis_torque(OrthosisSide(*fixed), angle, k_d, k_p)
