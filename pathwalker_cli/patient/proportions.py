"""Body proportions that stand in for segment lengths that were not measured.

Fractions of standing height.  Limbs, head, ankle, hip and shoulder heights are those that Winter
prints after Drillis and Contini; they were taken on adults.  A child's legs are shorter for its
height (the shipped seven-year-old: thigh 0.21 instead of 0.245), so a measured length is always
better, and every length that comes from here is named in `Patient.notes`.

References:
    Drillis and Contini (1966), Body Segment Parameters, New York University, TR 1166-03.
    Winter (2009), Biomechanics and Motor Control of Human Movement, 4th ed., figure 4.1.
    Gordon et al. (1989), Anthropometric Survey of US Army Personnel (heel to ball of the foot).
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023: where the pelvis ends in the model.
"""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

SOURCE: Final = "Drillis and Contini (1966), adults"

_HIP_HEIGHT: Final = 0.530
_SHOULDER_HEIGHT: Final = 0.818
_CHIN_HEIGHT: Final = 0.870
_HIP_DROP: Final = 0.0436
"""Hips below the pelvis origin: 0.054496 m at 1.25 m in the published model."""
_LUMBAR: Final = 0.04
"""Lumbar joint above the pelvis origin: 0.05 m at 1.25 m in the published model."""
_BALL_SHARE: Final = 0.73
"""Heel to ball of the foot, as a share of the length of the foot."""

TOES_SHARE: Final = 1.0 / _BALL_SHARE - 1.0
"""Toes in front of the ball, as a share of the model's foot, which ends there."""

ANKLE_HEIGHT: Final = 0.039
"""Height of the ankle above the sole, fraction of standing height."""

CUFF_HEIGHT: Final = 0.7
"""Middle of the cuff above the ankle, as a share of the shank: an orthosis ends 2 to 3 cm below the
head of the fibula, and its band is some 5 cm high."""
CUFF_AREA: Final = 0.06
"""Area of the cuff over the squared length of the shank: 5 cm by half a calf's girth of a child."""

HEEL_SHARE: Final = -0.35
TOE_SHARE: Final = 0.65
"""Heel and toe in front of the ankle as shares of the model's foot length (published model)."""

FRACTIONS: Final = MappingProxyType(
    {
        "pelvis": 0.08,
        "hip_drop": _HIP_DROP,
        "lumbar_height": _LUMBAR,
        "trunk": _CHIN_HEIGHT - _HIP_HEIGHT - _HIP_DROP - _LUMBAR,
        "shoulder_height": _SHOULDER_HEIGHT - _HIP_HEIGHT - _HIP_DROP - _LUMBAR,
        "head": 0.130,
        "upper_arm": 0.186,
        "lower_arm": 0.146,
        "hand": 0.108,
        "thigh": 0.245,
        "shank": 0.246,
        "foot": 0.152 * _BALL_SHARE,
    }
)
"""Segment lengths as fractions of standing height.  `foot` reaches from heel to ball, as the
model's foot does (heel marker to toe marker)."""


def default_length(name: str, height: float) -> float:
    """Return a segment length [m] for a body of this height [m], to the millimetre."""
    return round(FRACTIONS[name] * height, 3)
