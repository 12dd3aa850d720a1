"""What every back end is given, a model's topology and numbers, and the functions that it delivers.

The numbers (masses, centres of mass, inertias, placements, contact points) are the parameters
`theta` of the symbolic functions, so that one graph serves every patient of the same topology.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.errors import BackendError

SIGNATURES = {
    "inverse_dynamics": ("q", "v", "vdot", "theta"),
    "mass_matrix": ("q", "theta"),
    "bias": ("q", "v", "theta"),
    "point_positions": ("q", "theta"),
    "point_velocities": ("q", "v", "theta"),
    "point_accelerations": ("q", "v", "vdot", "theta"),
    "point_jacobian": ("q", "theta"),
    "centre_of_mass": ("q", "theta"),
}
"""Arguments of every function, in order."""

# Shifting the model, or moving it at a constant velocity, changes none of these.
_TRANSLATION_INVARIANT = (
    "inverse_dynamics", "mass_matrix", "bias", "point_accelerations", "point_jacobian",
)  # fmt: skip

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

RADIUS = "radius"
"""Last parameter of a point, behind those of all others: radius of its circle [m]."""


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
    def body_names(self) -> tuple[str, ...]:
        """Names of the parameters that a back end knows, e.g. "hip_r.mass", "heel_r.position.x"."""
        of_joints = (f"{joint}.{entry}" for joint in self.joints for entry in JOINT_ENTRIES)
        of_points = (f"{point}.{entry}" for point in self.points for entry in POINT_ENTRIES)
        return (*of_joints, *of_points)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters in order: `body_names`, then radii, e.g. "heel_r.radius"."""
        return (*self.body_names, *(f"{point}.{RADIUS}" for point in self.points))

    @property
    def turns(self) -> np.ndarray:
        """Which hinges about y turn the body of each point: entries 0 and 1, shape (n, nq)."""
        matrix = np.zeros((len(self.points), len(self.joints)))
        for row, joint in zip(matrix, self.point_joints, strict=True):
            while joint:
                row[joint - 1] = self.types[joint - 1] == "RY"
                joint = self.parents[joint - 1]
        return matrix

    @property
    def n_root_translations(self) -> int:
        """Number of leading coordinates that only shift the whole model."""
        count = 0
        for kind, parent in zip(self.types, self.parents, strict=True):
            if not kind.startswith("P") or parent != count:
                break
            count += 1
        return count


def all_parameters(
    model: pin.Model, points: Sequence[str], radii: Sequence[float] | np.ndarray = ()
) -> np.ndarray:
    """Return the values of `Topology.parameter_names`, zeros included; no radii: all are 0."""
    symmetric = ((0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2))
    values = [
        np.concatenate(
            [placement.translation, [body.mass], body.lever, body.inertia[symmetric]], axis=0
        )
        for placement, body in zip(model.jointPlacements[1:], model.inertias[1:], strict=True)
    ]
    values += [_frame(model, point).placement.translation for point in points]
    return np.concatenate([*values, radii if len(radii) else np.zeros(len(points))])


def _frame(model: pin.Model, name: str) -> pin.Frame:
    if not model.existFrame(name):
        frames = ", ".join(frame.name for frame in model.frames)
        raise BackendError(f"the model has no frame {name!r}; it has {frames}")
    return model.frames[model.getFrameId(name)]


@dataclass(frozen=True)
class RigidBodyFunctions:
    """Dynamics and kinematics of a model as `casadi.Function`s on SX.

    Arguments are generalised coordinates `q` [m, rad], velocities `v` [m/s, rad/s], accelerations
    `vdot` [m/s^2, rad/s^2], each of shape (nq,), and model parameters `theta`.  Quantities of
    points are in world axes, x and z per point, stacked: shape (2 n,).  A point with a radius is
    what does not move while its circle rolls on level ground, see `rolling`.

    Attributes:
        backend: Name of the back end that built the functions.
        nq: Number of coordinates, and of velocities.
        inverse_dynamics: (q, v, vdot, theta) -> generalised forces [N, N m], shape (nq,).
        mass_matrix: (q, theta) -> mass matrix [kg, kg m, kg m^2], shape (nq, nq).
        bias: (q, v, theta) -> Coriolis, centrifugal and gravity forces [N, N m], shape (nq,).
        point_positions: (q, theta) -> positions of the points [m].
        point_velocities: (q, v, theta) -> velocities of the points [m/s].
        point_accelerations: (q, v, vdot, theta) -> their time derivative [m/s^2], without gravity.
        point_jacobian: (q, theta) -> derivative of the positions by q, shape (2 n, nq).
        centre_of_mass: (q, theta) -> centre of mass [m], shape (3,).
        parameters: Values of `theta` of the model they were built from.
        parameter_names: Names of the entries of `theta`, e.g. "hip_r.mass".
        topology: What is fixed in the graphs.
    """

    backend: str
    nq: int
    inverse_dynamics: ca.Function
    mass_matrix: ca.Function
    bias: ca.Function
    point_positions: ca.Function
    point_velocities: ca.Function
    point_accelerations: ca.Function
    point_jacobian: ca.Function
    centre_of_mass: ca.Function
    parameters: np.ndarray
    parameter_names: tuple[str, ...]
    topology: Topology

    def parameters_for(
        self, model: pin.Model, radii: Sequence[float] | np.ndarray = ()
    ) -> np.ndarray:
        """Return the values of `theta` for another model of the same topology, with these radii.

        Raises:
            BackendError: The topology differs, or the model needs an entry that is folded away.
        """
        if Topology.of(model, self.topology.points) != self.topology:
            raise BackendError(
                "the model has other joints, parents, rotations or gravity than the one the "
                "functions were built from; build functions for it with rigid_body_functions()"
            )
        return parameters_of(model, self.topology.points, self.parameter_names, radii)


def parameters_of(
    model: pin.Model,
    points: Sequence[str],
    names: Sequence[str],
    radii: Sequence[float] | np.ndarray = (),
) -> np.ndarray:
    """Return the named parameters of a model, shape (len(names),), read-only.

    Args:
        model: Model of the topology the names were made for.
        points: Names of the point frames.
        names: Names of parameters, see `RigidBodyFunctions.parameter_names`.
        radii: Radii of the points [m]; none: all are 0.

    Raises:
        BackendError: A name does not exist, or a parameter that is not named is not zero: the
            functions that go with the names take it for zero.
    """
    known = Topology.of(model, points).parameter_names
    values = dict(zip(known, all_parameters(model, points, radii).tolist(), strict=True))
    if unknown := [name for name in names if name not in values]:
        raise BackendError(f"the model has no parameter {', '.join(unknown)}")
    named = set(names)
    if lost := [name for name, value in values.items() if value != 0.0 and name not in named]:
        raise BackendError(
            f"{', '.join(lost)} must be zero as in the model the functions were built from; "
            "build functions for this model with rigid_body_functions()"
        )
    result = np.array([values[name] for name in names])
    result.setflags(write=False)
    return result


def rolling(topology: Topology, fixed: Mapping[str, ca.Function]) -> dict[str, ca.Function]:
    """Let every point roll on a circle that is fixed to its body and touches the ground there.

    With the turn `t` of the body about +y, of speed w, the centre of a circle of radius r stands
    r (sin t, cos t) from the point.  It rolls without slipping while the forward speed of its
    centre is r w, and touches the ground at height 0 where the centre is at height r: what stays
    is the point plus r (sin t - t, cos t - 1).  Without radius that is the point itself.

    Args:
        topology: Topology of the model; frames of joints are parallel where all angles are 0.
        fixed: The functions of `SIGNATURES` with `theta` as in `Topology.body_names`.

    Returns:
        The same with `theta` as in `Topology.parameter_names`.
    """
    nq, count = len(topology.joints), len(topology.body_names)
    symbols = {name: ca.SX.sym(name, nq) for name in ("q", "v", "vdot")}
    symbols["theta"] = ca.SX.sym("theta", len(topology.parameter_names))
    body = {**symbols, "theta": symbols["theta"][:count]}
    radius, turns = symbols["theta"][count:], ca.SX(ca.sparsify(ca.DM(topology.turns)))
    turn, speed, change = (turns @ symbols[name] for name in ("q", "v", "vdot"))
    sine, cosine = radius * ca.sin(turn), radius * (ca.cos(turn) - 1.0)
    rolled = {
        "point_positions": (sine - radius * turn, cosine),
        "point_velocities": (cosine * speed, -sine * speed),
        "point_accelerations": (
            cosine * change - sine * speed**2,
            -sine * change - (cosine + radius) * speed**2,
        ),
        "point_jacobian": tuple(
            ca.repmat(factor, 1, nq) * turns for factor in (cosine, -sine)
        ),
    }  # fmt: skip
    result = {}
    for name, arguments in SIGNATURES.items():
        value = fixed[name](*(body[argument] for argument in arguments))
        if name in rolled and topology.points:
            pairs = zip(*(ca.vertsplit(rows) for rows in rolled[name]), strict=True)
            value += ca.vertcat(*(row for pair in pairs for row in pair))
        result[name] = ca.Function(name, [symbols[argument] for argument in arguments], [value])
    return result


def fold(
    topology: Topology, full: Mapping[str, ca.Function], nonzero: Sequence[bool]
) -> dict[str, ca.Function]:
    """Specialise functions of all parameters to those that are not structurally zero.

    CasADi drops the terms that the zeros annihilate, so the graphs get smaller.

    Args:
        topology: Topology of the model.
        full: The functions of `SIGNATURES` with `theta` as in `Topology.parameter_names`.
        nonzero: Which of these parameters stay symbols.
    """
    nq = len(topology.joints)
    symbols = {name: ca.SX.sym(name, nq) for name in ("q", "v", "vdot")}
    symbols["theta"] = ca.SX.sym("theta", sum(nonzero))
    everywhere = {**symbols, "theta": ca.SX.zeros(len(nonzero))}
    everywhere["theta"][np.flatnonzero(nonzero).tolist()] = symbols["theta"]
    invariant = dict(everywhere)
    for name in ("q", "v"):
        invariant[name] = ca.vertcat(
            ca.SX.zeros(topology.n_root_translations), symbols[name][topology.n_root_translations :]
        )
    result = {}
    for name, arguments in SIGNATURES.items():
        values = invariant if name in _TRANSLATION_INVARIANT else everywhere
        value = ca.cse(full[name](*(values[argument] for argument in arguments)))
        value = value if value.is_column() else ca.sparsify(value)
        inputs = [symbols[argument] for argument in arguments]
        result[name] = ca.Function(name, inputs, [value], list(arguments), [name])
    return result
