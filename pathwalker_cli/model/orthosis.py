"""The five-stage torque-angle curve of the ankle-foot orthosis, built from its stiffnesses.

References:
    Sreenivasa et al. (2017), figure 2 and table 2.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any, Final

from pathwalker_cli.model.curves import BezierChain, evaluate

__all__ = ["OrthosisSide", "orthosis_curve", "orthosis_torque"]

_CURVINESS: Final = 0.7
_BLEND: Final = 0.1
"""Part of the way from free play to hard stop over which spring and stop are blended."""

_STEEP: Final = 0.5
"""Stiffness, as a share of 2 tau_0/theta_W, up to which the preload rises with 4 tau_0/theta_W."""

_NO_PRELOAD: Final = 1e-12
"""Keeps the ratio of an orthosis without preload finite [N m]."""


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

    def scaled(self, share: float) -> OrthosisSide:
        """Return an orthosis whose preload and stops carry a share of the torque."""
        names = ("preload_torque", "dorsiflexion_stop_stiffness", "plantarflexion_stop_stiffness")
        return replace(self, **{name: share * getattr(self, name) for name in names})


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
    over_d = _BLEND * (preload + reach_d * k_d)
    over_p = _BLEND * (preload + reach_p * k_p)
    steep_d, meeting_d = _preload_rise(play, preload, k_d)
    steep_p, meeting_p = _preload_rise(play, preload, k_p)
    steep = steep_d * steep_p
    stop_d, stop_p = side.dorsiflexion_stop_stiffness, side.plantarflexion_stop_stiffness
    x = [
        side.dorsiflexion_stop - over_d / stop_d,
        side.dorsiflexion_stop + _BLEND * reach_d,
        middle - play,
        middle,
        middle + play,
        side.plantarflexion_stop - _BLEND * reach_p,
        side.plantarflexion_stop + over_p / stop_p,
    ]
    y = [
        -preload - reach_d * k_d - over_d,
        -preload - (1 - _BLEND) * reach_d * k_d,
        -preload - play * k_d / 2,
        0.0,
        preload + play * k_p / 2,
        preload + (1 - _BLEND) * reach_p * k_p,
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
    return BezierChain(x, y, slopes, _CURVINESS, corners=corners)


def _preload_rise(play: Any, preload: Any, stiffness: Any) -> tuple[Any, Any]:
    """Return how far the rise of the preload is the reference's, s, and s / (1 - r).

    With r = K theta_W / (2 tau_0), s(r) is 1 up to r_0 = `_STEEP`, 0 from 1 on, and a smoothstep
    of seventh degree between, whose fourfold zero keeps s / (1 - r) C2.
    """
    ratio = stiffness * play / (2 * preload + _NO_PRELOAD)
    soft = ratio < _STEEP
    between = (1 - soft) * (ratio < 1)
    way = between * (ratio - _STEEP) / (1 - _STEEP)
    rest = between * (1 - way) ** 3 * (1 + 4 * way + 10 * way**2 + 20 * way**3)
    return soft + rest * (1 - way), soft / (1 - soft * ratio) + rest / (1 - _STEEP)


def orthosis_torque(side: OrthosisSide, angle: Any, k_d: Any, k_p: Any) -> Any:
    """Return the torque of the orthosis on the ankle [N m], restoring.

    Args:
        side: Fixed parameters.
        angle: Ankle angle [rad], + plantarflexion; NumPy array or CasADi expression.
        k_d: Dorsiflexion stiffness K_D [N m/rad].
        k_p: Plantarflexion stiffness K_P [N m/rad].
    """
    return -evaluate(orthosis_curve(side, k_d, k_p), angle).value
