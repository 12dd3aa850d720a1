"""Recursive Newton-Euler dynamics over a topology, written out in CasADi.

All vectors are in world axes.  Successive revolute joints about the same axis rotate by the sum of
their angles, which keeps the graph of a planar model small: no product of rotations appears.
"""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from pathwalker_cli.model.backends.functions import (
    JOINT_ENTRIES,
    POINT_ENTRIES,
    SIGNATURES,
    Topology,
)

_PLANE = [0, 2]
_AXES = ca.SX.eye(3)


@dataclass(frozen=True)
class _Motion:
    """Motion of a joint frame; its rotation is `base` times a turn by `angle` about `axis`."""

    base: ca.SX
    axis: int | None
    angle: ca.SX
    direction: ca.SX
    offset: ca.SX
    position: ca.SX
    angular_velocity: ca.SX
    velocity: ca.SX
    angular_acceleration: ca.SX
    acceleration: ca.SX

    @property
    def rotation(self) -> ca.SX:
        """Rotation of the frame in the world, shape (3, 3)."""
        return self.base if self.axis is None else self.base @ _rotation(self.axis, self.angle)

    @property
    def acceleration_gradient(self) -> ca.SX:
        """Matrix A [1/s^2]: a point of the body at r from the origin accelerates by A r more."""
        w = self.angular_velocity
        return ca.skew(self.angular_acceleration) + w @ w.T - ca.dot(w, w) * _AXES


def describe() -> str:
    """Say what would run."""
    return f"Newton-Euler recursion in CasADi {ca.CasadiMeta.version()}"


def build(topology: Topology) -> dict[str, ca.Function]:
    """Return the functions of `SIGNATURES` for the bodies and fixed points of a topology."""
    nq = len(topology.joints)
    q, v, vdot = (ca.SX.sym(name, nq) for name in ("q", "v", "vdot"))
    n_joint, n_point = nq * len(JOINT_ENTRIES), len(topology.points) * len(POINT_ENTRIES)
    theta = ca.SX.sym("theta", n_joint + n_point)
    joints = ca.reshape(theta[:n_joint], len(JOINT_ENTRIES), nq)
    points = ca.reshape(theta[n_joint:], len(POINT_ENTRIES), len(topology.points))

    motions = _motions(topology, joints, q, v, vdot)
    tau = _forces(topology, joints, motions)
    carriers = [motions[joint] for joint in topology.point_joints]
    offsets = [motion.rotation @ points[:, i] for i, motion in enumerate(carriers)]

    def stacked(vectors: list[ca.SX]) -> ca.SX:
        return ca.vertcat(ca.SX(0, 1), *(vector[_PLANE] for vector in vectors))

    pairs = list(zip(carriers, offsets, strict=True))
    positions = stacked([motion.position + r for motion, r in pairs])
    masses = joints[JOINT_ENTRIES.index("mass"), :]
    moments = [
        mass * (motion.position + motion.rotation @ _centre_of_mass(joints[:, i]))
        for i, (mass, motion) in enumerate(zip(ca.horzsplit(masses), motions[1:], strict=True))
    ]
    expressions = {
        "inverse_dynamics": tau,
        "mass_matrix": ca.jacobian(tau, vdot),
        "bias": ca.substitute(tau, vdot, ca.SX.zeros(nq)),
        "point_positions": positions,
        "point_velocities": stacked(
            [motion.velocity + ca.cross(motion.angular_velocity, r) for motion, r in pairs]
        ),
        "point_accelerations": stacked(
            [motion.acceleration + motion.acceleration_gradient @ r for motion, r in pairs]
        ),
        "point_jacobian": ca.jacobian(positions, q),
        "centre_of_mass": sum(moments) / ca.sum2(masses),
    }
    symbols = {"q": q, "v": v, "vdot": vdot, "theta": theta}
    return {
        name: ca.Function(name, [symbols[argument] for argument in SIGNATURES[name]], [expression])
        for name, expression in expressions.items()
    }


def _motions(topology: Topology, joints: ca.SX, q: ca.SX, v: ca.SX, vdot: ca.SX) -> list[_Motion]:
    """Return the motions of the world and of every joint frame, without gravity."""
    zero = ca.SX.zeros(3)
    motions = [_Motion(_AXES, None, ca.SX(0), *[zero] * 7)]
    for i, (kind, number) in enumerate(zip(topology.types, topology.parents, strict=True)):
        parent, axis, turns = motions[number], "XYZ".index(kind[1]), kind[0] == "R"
        placement = np.reshape(topology.rotations[i], (3, 3))
        direction = (parent.rotation @ placement)[:, axis]
        spin, slide = (direction, zero) if turns else (zero, direction)
        offset = parent.rotation @ joints[:3, i] + slide * q[i]
        w = parent.angular_velocity
        motions.append(
            _Motion(
                *_orientation(parent, placement, axis if turns else None, q[i]),
                direction=direction,
                offset=offset,
                position=parent.position + offset,
                angular_velocity=w + spin * v[i],
                velocity=parent.velocity + ca.cross(w, offset) + slide * v[i],
                angular_acceleration=parent.angular_acceleration
                + spin * vdot[i]
                + ca.cross(w, spin) * v[i],
                acceleration=parent.acceleration
                + parent.acceleration_gradient @ offset
                + slide * vdot[i]
                + 2 * ca.cross(w, slide) * v[i],
            )
        )
    return motions


def _orientation(
    parent: _Motion, placement: np.ndarray, axis: int | None, angle: ca.SX
) -> tuple[ca.SX, int | None, ca.SX]:
    """Return `base`, `axis` and `angle` of a joint that turns about `axis` (None: it does not)."""
    aligned = np.array_equal(placement, np.eye(3))
    if axis is None:
        still = (parent.base, parent.axis, parent.angle)
        return still if aligned else (parent.rotation @ placement, None, ca.SX(0))
    if aligned and parent.axis in (None, axis):
        return parent.base, axis, parent.angle + angle
    return parent.rotation @ placement, axis, angle


def _forces(topology: Topology, joints: ca.SX, motions: list[_Motion]) -> ca.SX:
    """Return the generalised forces that the motions take, shape (nq,)."""
    gravity = ca.SX(topology.gravity)
    forces = [ca.SX.zeros(3) for _ in motions]
    moments = [ca.SX.zeros(3) for _ in motions]  # about the origin of each joint frame
    tau = []
    for number in range(len(topology.joints), 0, -1):
        motion, body, parent = motions[number], joints[:, number - 1], topology.parents[number - 1]
        arm = motion.rotation @ _centre_of_mass(body)
        acceleration = motion.acceleration + motion.acceleration_gradient @ arm
        force = body[JOINT_ENTRIES.index("mass")] * (acceleration - gravity)
        forces[number] += force
        moments[number] += _spin_moment(motion, _inertia(body)) + ca.cross(arm, force)
        load = moments if topology.types[number - 1][0] == "R" else forces
        tau.append(ca.dot(motion.direction, load[number]))
        forces[parent] += forces[number]
        moments[parent] += moments[number] + ca.cross(motion.offset, forces[number])
    return ca.vertcat(*reversed(tau))


def _spin_moment(motion: _Motion, inertia: ca.SX) -> ca.SX:
    """Return Euler's moment about the centre of mass [N m]; `inertia` is in the joint frame."""
    rotation, w = motion.rotation, motion.angular_velocity
    momentum = rotation @ (inertia @ (rotation.T @ w))
    return rotation @ (inertia @ (rotation.T @ motion.angular_acceleration)) + ca.cross(w, momentum)


def _centre_of_mass(body: ca.SX) -> ca.SX:
    at = JOINT_ENTRIES.index("com.x")
    return body[at : at + 3]


def _inertia(body: ca.SX) -> ca.SX:
    xx, xy, yy, xz, yz, zz = ca.vertsplit(body[JOINT_ENTRIES.index("inertia.xx") :])
    return ca.blockcat([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _rotation(axis: int, angle: ca.SX) -> ca.SX:
    """Return the rotation by `angle` about axis 0, 1 or 2, shape (3, 3)."""
    generator = ca.skew(_AXES[:, axis])
    return _AXES + ca.sin(angle) * generator + (1 - ca.cos(angle)) * (generator @ generator)
