"""The symbolic functions of a rigid-body model that every back end delivers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.errors import BackendError
from pathwalker_cli.model.backends.topology import Topology, all_parameters

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


@dataclass(frozen=True)
class RigidBodyFunctions:
    """Dynamics and kinematics of a model as `casadi.Function`s on SX.

    Arguments are generalised coordinates `q` [m, rad], velocities `v` [m/s, rad/s], accelerations
    `vdot` [m/s^2, rad/s^2], each of shape (nq,), and model parameters `theta`.  Quantities of
    points are in world axes, x and z per point, stacked: shape (2 n,).

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

    def parameters_for(self, model: pin.Model) -> np.ndarray:
        """Return the values of `theta` for another model of the same topology.

        Raises:
            BackendError: The topology differs, or the model needs an entry that is folded away.
        """
        if Topology.of(model, self.topology.points) != self.topology:
            raise BackendError(
                "the model has other joints, parents, rotations or gravity than the one the "
                "functions were built from; build functions for it with rigid_body_functions()"
            )
        return parameters_of(model, self.topology.points, self.parameter_names)


def parameters_of(model: pin.Model, points: Sequence[str], names: Sequence[str]) -> np.ndarray:
    """Return the named parameters of a model, shape (len(names),), read-only.

    Args:
        model: Model of the topology the names were made for.
        points: Names of the point frames.
        names: Names of parameters, see `RigidBodyFunctions.parameter_names`.

    Raises:
        BackendError: A name does not exist, or a parameter that is not named is not zero: the
            functions that go with the names take it for zero.
    """
    known = Topology.of(model, points).parameter_names
    values = dict(zip(known, all_parameters(model, points).tolist(), strict=True))
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
