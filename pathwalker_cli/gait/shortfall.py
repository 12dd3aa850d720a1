"""What a walk lacks: the least torques beyond the muscles with which it is possible.

A solve that fails is tried again by way of reserve actuators at the joints.  If the walk is not
found without them, what is left of them says whether the muscles are too weak.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Final

from pathwalker_cli.stride.series import GaitSeries

__all__ = ["MissingTorque", "Shortfall", "missing_torques"]

_LEAST_SHARE: Final = 0.01
"""Share of a strength below which a torque is what the price of reserves leaves, not a lack."""


@dataclass(frozen=True)
class MissingTorque:
    """What a muscle torque generator lacks.

    Args:
        generator: Its name in `conventions.GENERATORS`.
        torque: The largest missing torque [N m].
        strength: Its maximum isometric torque [N m].
        percent: When, in percent of the stride.
    """

    generator: str
    torque: float
    strength: float
    percent: float


@dataclass(frozen=True)
class Shortfall:
    """Why no motion was found.

    Args:
        within_bounds: Whether muscles of any strength can walk within the bounds, as far as found.
        missing: What the muscles lack for it, the largest share of a strength first.
    """

    within_bounds: bool
    missing: tuple[MissingTorque, ...] = ()

    @property
    def too_weak(self) -> bool:
        """Whether the muscles are too weak for a motion that the bounds allow."""
        return self.within_bounds and bool(self.missing)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        missing = [dict(vars(torque)) for torque in self.missing]
        return {"within_bounds": self.within_bounds, "missing_torques": missing}


def missing_torques(series: GaitSeries) -> tuple[MissingTorque, ...]:
    """Return what the muscles lack in a stride that reserve actuators help along."""
    found = sorted(_missing(series), key=lambda torque: -torque.torque / torque.strength)
    return tuple(torque for torque in found if torque.torque > _LEAST_SHARE * torque.strength)


def _missing(series: GaitSeries) -> Iterator[MissingTorque]:
    """Yield the largest help for each generator; help against it is help for its antagonist."""
    walker = series.walker
    for muscle, strength in zip(walker.muscles, walker.max_isometric_torque, strict=True):
        row = walker.skeleton.index(muscle.coordinate)
        help_ = muscle.torque_sign * series.reserve[:, row]
        k = int(help_.argmax())
        percent = 100.0 * float(series.time[k] / series.time[-1])
        yield MissingTorque(muscle.name, float(help_[k]), float(strength), percent)
