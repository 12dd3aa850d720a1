"""Bodies and joints as data: the names, the order and the kinds of generalised coordinates.

World frame: x forward, z up, rotations about +y (right-hand rule), SI units and radians.
Positive: pelvis_tilt and lumbar = forward lean, hip = extension, knee = flexion,
ankle and hinge (of an orthosis) = plantarflexion, mtp (toes) = flexion, so that it is negative when
the heel rises.  The zero pose is upright with straight legs and feet at 90 degrees.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache, cached_property
from typing import Final, Literal

import numpy as np

Side = Literal["right", "left"]
SIDES: Final[tuple[Side, Side]] = ("right", "left")
SUFFIX: Final[dict[str, str]] = {"right": "r", "left": "l"}
"""Suffix of a side in coordinate and link names."""

Build = Literal["glued", "body"]
"""An orthosis that is glued to shank and foot, or a shell that turns about a hinge on the foot."""


@dataclass(frozen=True)
class Joint:
    """A joint of one degree of freedom.

    Args:
        coordinate: Name of its generalised coordinate.
        parent: Link that carries it.
        child: Link that it moves.
        axis: Axis of the joint frame along or about which it moves.
        slides: Whether it is a slider [m], not a hinge [rad].
        side: The side that it belongs to; None on the midline.
        root: Whether it hangs the pelvis on the world: nothing drives it.
        beside: Coordinate of the joint of the body that it turns with, from outside.
    """

    coordinate: str
    parent: str
    child: str
    axis: Literal["x", "y", "z", "-y"] = "y"
    slides: bool = False
    side: Side | None = None
    root: bool = False
    beside: str = ""


@dataclass(frozen=True)
class Skeleton:
    """Joints in the order of the generalised coordinates, parents before children."""

    joints: tuple[Joint, ...]

    @cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of all generalised coordinates in order."""
        return tuple(joint.coordinate for joint in self.joints)

    @cached_property
    def translations(self) -> tuple[str, ...]:
        """Coordinates in metres; all others are angles."""
        return tuple(joint.coordinate for joint in self.joints if joint.slides)

    @cached_property
    def angles(self) -> tuple[str, ...]:
        """Coordinates in radians, in order."""
        return tuple(joint.coordinate for joint in self.joints if not joint.slides)

    @cached_property
    def root(self) -> tuple[str, ...]:
        """Coordinates that no actuator drives: where and how the pelvis is."""
        return tuple(joint.coordinate for joint in self.joints if joint.root)

    @cached_property
    def links(self) -> frozenset[str]:
        """Names of the links that joints move."""
        return frozenset(joint.child for joint in self.joints)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.joints)

    def index(self, coordinate: str) -> int:
        """Return the position of a coordinate."""
        return self.coordinates.index(coordinate)

    def named(self, what: str) -> tuple[str, ...]:
        """Return names of what belongs to every coordinate, e.g. "velocity"."""
        return tuple(f"{name}_{what}" for name in self.coordinates)

    def completed(self, q: np.ndarray) -> np.ndarray:
        """Return postures (..., m) with the coordinates behind the first m at 0, (..., size)."""
        further = np.zeros((*q.shape[:-1], self.size - q.shape[-1]))
        return np.concatenate([q, further], axis=-1)


def _leg(side: Side) -> tuple[Joint, ...]:
    s = SUFFIX[side]
    return (
        Joint(f"hip_{s}", "pelvis", f"thigh_{s}", side=side),
        Joint(f"knee_{s}", f"thigh_{s}", f"shank_{s}", side=side),
        Joint(f"ankle_{s}", f"shank_{s}", f"foot_{s}", side=side),
    )


PLANAR_WALKER: Final = Skeleton(
    (
        Joint("pelvis_tx", "world", "pelvis_tx_slider", "x", slides=True, root=True),
        Joint("pelvis_tz", "pelvis_tx_slider", "pelvis_tz_slider", "z", slides=True, root=True),
        Joint("pelvis_tilt", "pelvis_tz_slider", "pelvis", root=True),
        *_leg("right"),
        *_leg("left"),
        Joint("lumbar", "pelvis", "trunk"),
    )
)
"""The sagittal walker of Sreenivasa et al. (2017): two translations, eight angles."""

_TOES: Final = tuple(
    Joint(f"mtp_{SUFFIX[side]}", f"foot_{SUFFIX[side]}", f"toes_{SUFFIX[side]}", side=side)
    for side in SIDES
)
_HINGES: Final = {
    side: Joint(
        f"hinge_{SUFFIX[side]}",
        f"foot_{SUFFIX[side]}",
        f"shell_{SUFFIX[side]}",
        axis="-y",
        side=side,
        beside=f"ankle_{SUFFIX[side]}",
    )
    for side in SIDES
}


@cache
def walker_skeleton(toes: bool = False, shelled: tuple[Side, ...] = ()) -> Skeleton:
    """Return the skeleton of a walker: the planar one, further joints behind its ten.

    Args:
        toes: Whether a metatarsophalangeal joint carries the toes of each foot.
        shelled: Sides whose orthosis is a body of its own: a shell that turns about a hinge on the
            foot.
    """
    hinges = (_HINGES[side] for side in shelled)
    return Skeleton((*PLANAR_WALKER.joints, *(_TOES if toes else ()), *hinges))


EVERY_JOINT: Final = walker_skeleton(toes=True, shelled=SIDES)
"""All joints that a walker may have."""
