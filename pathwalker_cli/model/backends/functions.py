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

PLACE_ENTRIES = ("placement.x", "placement.z", "com.x", "com.z")
"""What of a joint in the x-z plane and of its body is another where the joint is moved."""

POINT_ENTRIES = tuple(f"position.{axis}" for axis in "xyz")
"""Parameters of a point, in order: its position in the frame of its joint [m]."""

RADIUS, ROUNDNESS = "radius", "roundness"
"""What stands behind the parameters of all joints and points: radius of the circle of every point
[m], and the roundness of every sole [-]; see `touching`."""


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
        soles: Whether the points of one body are the ends of a sole: one contact, not several.
    """

    joints: tuple[str, ...]
    types: tuple[str, ...]
    parents: tuple[int, ...]
    rotations: tuple[tuple[float, ...], ...]
    points: tuple[str, ...]
    point_joints: tuple[int, ...]
    gravity: tuple[float, float, float]
    soles: bool = False

    @classmethod
    def of(cls, model: pin.Model, points: Sequence[str], soles: bool = False) -> Topology:
        """Read the topology of a model.

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
            soles=soles,
        )

    @property
    def contacts(self) -> tuple[tuple[int, ...], ...]:
        """Numbers of the points that make each contact: every one, or those of one body."""
        if not self.soles:
            return tuple((i,) for i in range(len(self.points)))
        bodies = dict.fromkeys(self.point_joints)
        return tuple(
            tuple(i for i, joint in enumerate(self.point_joints) if joint == body)
            for body in bodies
        )

    @property
    def depth_first(self) -> bool:
        """Whether the joints that each one moves follow it at once."""
        above = [0]  # joints that may still get a child
        for number, parent in enumerate(self.parents, 1):
            while above[-1] != parent:
                above.pop()
                if not above:
                    return False
            above.append(number)
        return True

    @property
    def body_names(self) -> tuple[str, ...]:
        """Names of the parameters that a back end knows, e.g. "hip_r.mass", "heel_r.position.x"."""
        of_joints = (f"{joint}.{entry}" for joint in self.joints for entry in JOINT_ENTRIES)
        of_points = (f"{point}.{entry}" for point in self.points for entry in POINT_ENTRIES)
        return (*of_joints, *of_points)

    @property
    def parameter_names(self) -> tuple[str, ...]:
        """Names of all parameters in order: `body_names`, then e.g. "heel_r.radius"."""
        radii = (f"{point}.{RADIUS}" for point in self.points)
        soles = (group for group in self.contacts if len(group) > 1)
        bodies = (self.joints[self.point_joints[group[0]] - 1] for group in soles)
        rounded = (f"{body}.{ROUNDNESS}" for body in bodies)
        return (*self.body_names, *radii, *rounded)

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
    model: pin.Model, points: Sequence[str], shapes: Sequence[float] = ()
) -> np.ndarray:
    """Return the values of `Topology.parameter_names`, zeros included.

    `shapes` are radii [m] and roundnesses [-] of the contacts; none: all are points.
    """
    symmetric = ((0, 0, 1, 0, 1, 2), (0, 1, 1, 2, 2, 2))
    values = [
        np.concatenate(
            [placement.translation, [body.mass], body.lever, body.inertia[symmetric]], axis=0
        )
        for placement, body in zip(model.jointPlacements[1:], model.inertias[1:], strict=True)
    ]
    values += [_frame(model, point).placement.translation for point in points]
    return np.concatenate([*values, shapes if len(shapes) else np.zeros(len(points))])


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
    points are those of contacts, see `touching`, in world axes, x and z each, stacked: (2 n,).

    Attributes:
        backend: Name of the back end that built the functions.
        nq: Number of coordinates, and of velocities.
        inverse_dynamics: (q, v, vdot, theta) -> generalised forces [N, N m], shape (nq,).
        mass_matrix: (q, theta) -> mass matrix [kg, kg m, kg m^2], shape (nq, nq).
        bias: (q, v, theta) -> Coriolis, centrifugal and gravity forces [N, N m], shape (nq,).
        point_positions: (q, theta) -> where the contacts touch level ground, or would [m].
        point_velocities: (q, v, theta) -> velocities of the bodies there [m/s].
        point_accelerations: (q, v, vdot, theta) -> their time derivative [m/s^2], without gravity.
        point_jacobian: (q, theta) -> derivative of these velocities by v, shape (2 n, nq).
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

    def parameters_for(self, model: pin.Model, shapes: Sequence[float] = ()) -> np.ndarray:
        """Return the values of `theta` for another model of the same topology, with these shapes.

        Raises:
            BackendError: The topology differs, or the model needs an entry that is folded away.
        """
        if Topology.of(model, self.topology.points, self.topology.soles) != self.topology:
            raise BackendError(
                "the model has other joints, parents, rotations or gravity than the one the "
                "functions were built from; build functions for it with rigid_body_functions()"
            )
        return parameters_of(model, self.topology, self.parameter_names, shapes)


def parameters_of(
    model: pin.Model,
    topology: Topology,
    names: Sequence[str],
    shapes: Sequence[float] = (),
) -> np.ndarray:
    """Return the named parameters of a model, shape (len(names),), read-only.

    Names are of `RigidBodyFunctions.parameter_names`, shapes as for `all_parameters`.

    Raises:
        BackendError: A name does not exist, or a parameter that is not named is not zero: the
            functions that go with the names take it for zero.
    """
    every = all_parameters(model, topology.points, shapes)
    values = dict(zip(topology.parameter_names, every.tolist(), strict=True))
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


def touching(topology: Topology, fixed: Mapping[str, ca.Function]) -> dict[str, ca.Function]:
    """Let the feet touch level ground with round bodies instead of fixed points.

    Every point carries a circle that touches level ground there where the body has not turned: its
    lowest point stands r (sin t, cos t - 1) from the point when the body has turned by t about +y.
    Under a sole the lowest points z_i of its circles blend to one,
    z = mean(z_i) - log(mean(exp(-k (z_i - mean(z_i))))) / k, at the mean place with these weights:
    one convex body that may roll from its rear to its front end.  With k = 4 c / L its radius is
    L c + r where it lies flat, L the distance of its ends and c its roundness; with c = infinity
    it is flat.  A contact rolls without slipping while the point of the body that touches the
    ground stands still; its velocity, not that of the moving place, is the contact's.

    Args:
        topology: Topology of the model; frames of joints are parallel where all angles are 0.
        fixed: The functions of `SIGNATURES` with `theta` as in `Topology.body_names`, of points.

    Returns:
        The same of contacts, with `theta` as in `Topology.parameter_names`.
    """
    nq, count, n = len(topology.joints), len(topology.body_names), len(topology.points)
    symbols = {name: ca.SX.sym(name, nq) for name in ("q", "v", "vdot")}
    symbols["theta"] = theta = ca.SX.sym("theta", len(topology.parameter_names))
    body = {**symbols, "theta": theta[:count]}
    values = {name: fixed[name](*(body[a] for a in given)) for name, given in SIGNATURES.items()}
    if not topology.depth_first:  # Pinocchio's composite bodies take columns side by side
        values["mass_matrix"] = ca.jacobian(values["inverse_dynamics"], symbols["vdot"])
    radius, roundness = theta[count : count + n], theta[count + n :]
    turns = ca.SX(ca.sparsify(ca.DM(topology.turns)))
    turn = turns @ symbols["q"]
    low = [radius[i] * ca.vertcat(ca.sin(turn[i]), ca.cos(turn[i]) - 1.0) for i in range(n)]
    places = ca.reshape(values["point_positions"], 2, n)
    at = len(topology.joints) * len(JOINT_ENTRIES)
    ends = ca.reshape(theta[at:count], len(POINT_ENTRIES), n)
    rows: dict[str, list[ca.SX]] = {name: [] for name in values if name.startswith("point")}
    for number, group in enumerate(topology.contacts):
        first, spin, shift = group[0], turns[group[0], :], low[group[0]]
        if len(group) > 1:
            length = ca.norm_2(ends[:, group[-1]] - ends[:, first])
            touched = ca.horzcat(*(places[:, i] + low[i] - places[:, first] for i in group))
            shift = _blended(touched, 4.0 * roundness[number] / length)
        arm, turned = ca.vertcat(shift[1], -shift[0]), ca.jtimes(shift, symbols["q"], symbols["v"])
        speed, change = spin @ symbols["v"], spin @ symbols["vdot"]
        moved = {
            "point_positions": shift,
            "point_velocities": arm * speed,
            "point_accelerations": arm * change + ca.vertcat(turned[1], -turned[0]) * speed,
            "point_jacobian": arm @ spin,
        }
        for name, more in moved.items():
            rows[name].append(values[name][2 * first : 2 * first + 2, :] + more)
    values |= {name: ca.vertcat(*each) for name, each in rows.items() if each}
    return {
        name: ca.Function(name, [symbols[argument] for argument in given], [values[name]])
        for name, given in SIGNATURES.items()
    }


def _blended(places: ca.SX, sharpness: ca.SX) -> ca.SX:
    """Return the lowest point of a sole under some of its points, both (x, z), shape (2, k)."""
    heights = places[1, :]
    middle = ca.sum2(heights) / heights.numel()
    shares = ca.exp(-sharpness * (heights - middle))
    total = ca.sum2(shares)
    forward = ca.dot(places[0, :], shares) / total
    return ca.vertcat(forward, middle - ca.log(total / heights.numel()) / sharpness)


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
