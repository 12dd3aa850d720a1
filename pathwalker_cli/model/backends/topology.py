"""What a back end needs to know of a `pin.Model`: its topology, and its numbers as one vector.

The numbers (masses, centres of mass, inertias, placements, contact points) are the parameters
`theta` of the symbolic functions, so that one graph serves every patient of the same topology.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from pathwalker_cli.errors import BackendError

JOINT_TYPES = ("RX", "RY", "RZ", "PX", "PY", "PZ")
"""Supported joints: revolute about and prismatic along the axes of the joint frame."""

JOINT_ENTRIES = (
    *(f"placement.{axis}" for axis in "xyz"),
    "mass",
    *(f"com.{axis}" for axis in "xyz"),
    *(f"inertia.{axes}" for axes in ("xx", "xy", "yy", "xz", "yz", "zz")),
)
"""Parameters of a moving joint, in order: translation from its parent joint [m], mass [kg], centre
of mass [m] and inertia about it [kg m^2] of the body it moves, in the axes of the joint frame."""

POINT_ENTRIES = tuple(f"position.{axis}" for axis in "xyz")
"""Parameters of a point, in order: its position in the frame of its joint [m]."""


@dataclass(frozen=True)
class Topology:
    """All of a `pin.Model` that is fixed in the graph; equal topologies share one graph.

    Attributes:
        joints: Names of the moving joints in order.
        types: Type of each joint, one of `JOINT_TYPES`.
        parents: Number of each joint's parent, counting from 1; 0 is the world.
        rotations: Rotation of each joint frame in its parent's, nine entries row by row [-].
        points: Names of the point frames.
        point_joints: Number of the joint that carries each point.
        gravity: Gravitational acceleration in world axes [m/s^2].
    """

    joints: tuple[str, ...]
    types: tuple[str, ...]
    parents: tuple[int, ...]
    rotations: tuple[tuple[float, ...], ...]
    points: tuple[str, ...]
    point_joints: tuple[int, ...]
    gravity: tuple[float, float, float]

    @classmethod
    def of(cls, model: pin.Model, points: Sequence[str]) -> Topology:
        """Read the topology of a model.

        Args:
            model: Model whose joints are all of `JOINT_TYPES`.
            points: Names of frames of the model.

        Raises:
            BackendError: A joint is of another type, a point is no frame of the model, or the
                model has rotor inertia.
        """
        types = tuple(joint.shortname().removeprefix("JointModel") for joint in model.joints[1:])
        for name, kind in zip(model.names[1:], types, strict=True):
            if kind not in JOINT_TYPES:
                raise BackendError(
                    f"joint {name!r} is of type {kind}; allowed: {', '.join(JOINT_TYPES)}"
                )
        if np.any(model.armature):
            raise BackendError("the model has rotor inertia (armature); set it to zero")
        return cls(
            joints=tuple(model.names[1:]),
            types=types,
            parents=tuple(model.parents[1:]),
            rotations=tuple(
                tuple(placement.rotation.ravel().tolist())
                for placement in model.jointPlacements[1:]
            ),
            points=tuple(points),
            point_joints=tuple(_frame(model, point).parentJoint for point in points),
            gravity=tuple(model.gravity.linear.tolist()),
        )

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters in order, e.g. "hip_r.placement.z" or "heel_r.position.x"."""
        of_joints = (f"{joint}.{entry}" for joint in self.joints for entry in JOINT_ENTRIES)
        of_points = (f"{point}.{entry}" for point in self.points for entry in POINT_ENTRIES)
        return (*of_joints, *of_points)

    @property
    def n_root_translations(self) -> int:
        """Number of leading coordinates that only shift the whole model."""
        count = 0
        for kind, parent in zip(self.types, self.parents, strict=True):
            if not kind.startswith("P") or parent != count:
                break
            count += 1
        return count


def all_parameters(model: pin.Model, points: Sequence[str]) -> np.ndarray:
    """Return the values of `Topology.parameter_names`, zeros included."""
    symmetric = ((0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2))
    values = [
        np.concatenate(
            [placement.translation, [body.mass], body.lever, body.inertia[symmetric]], axis=0
        )
        for placement, body in zip(model.jointPlacements[1:], model.inertias[1:], strict=True)
    ]
    values += [_frame(model, point).placement.translation for point in points]
    return np.concatenate(values)


def _frame(model: pin.Model, name: str) -> pin.Frame:
    if not model.existFrame(name):
        frames = ", ".join(frame.name for frame in model.frames)
        raise BackendError(f"the model has no frame {name!r}; it has {frames}")
    return model.frames[model.getFrameId(name)]
