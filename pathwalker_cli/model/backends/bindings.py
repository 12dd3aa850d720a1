"""Pinocchio's own CasADi bindings, which conda-forge ships and the pip wheels do not."""

from __future__ import annotations

from importlib import import_module
from types import ModuleType
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.errors import BackendError
from pathwalker_cli.model.backends.functions import (
    JOINT_ENTRIES,
    POINT_ENTRIES,
    SIGNATURES,
    Topology,
)

_PLANE = [0, 2]


def bindings() -> ModuleType:
    """Import `pinocchio.casadi`, or raise a `BackendError` that says how to get it."""
    try:
        return import_module("pinocchio.casadi")
    except ImportError as error:
        raise BackendError(
            "pinocchio.casadi does not import: the pip wheels of pin lack it; "
            "install pinocchio and casadi from conda-forge to use it"
        ) from error


def describe() -> str:
    """Say what would run, or raise a `BackendError`."""
    bindings()
    return f"CasADi bindings of Pinocchio {pin.__version__}"


def build(topology: Topology) -> dict[str, ca.Function]:
    """Return the functions of `SIGNATURES` for the bodies and fixed points of a topology."""
    nq = len(topology.joints)
    symbols = {name: ca.SX.sym(name, nq) for name in ("q", "v", "vdot")}
    symbols["theta"] = ca.SX.sym("theta", len(topology.body_names))
    expressions = evaluate(bindings(), topology, **symbols)
    return {
        name: ca.Function(name, [symbols[argument] for argument in arguments], [expressions[name]])
        for name, arguments in SIGNATURES.items()
    }


def evaluate(
    module: ModuleType, topology: Topology, q: Any, v: Any, vdot: Any, theta: Any
) -> dict[str, Any]:
    """Return the values of the functions of `SIGNATURES` by name, by Pinocchio's own algorithms.

    `module` is `pinocchio.casadi` for SX, `pinocchio` for numbers; `theta` holds all parameters, as
    in `Topology.body_names`; units are those of `RigidBodyFunctions`.
    """
    model = _model(module, topology, theta)
    data = model.createData()
    values: dict[str, Any] = {
        "inverse_dynamics": module.rnea(model, data, q, v, vdot),
        "mass_matrix": module.crba(model, data, q),
        "bias": module.nle(model, data, q, v),
        "centre_of_mass": module.centerOfMass(model, data, q),
    }
    stack = ca.vertcat if isinstance(theta, ca.SX) else lambda *rows: np.concatenate(rows)
    data = model.createData()
    module.forwardKinematics(model, data, q, v, vdot)
    module.computeJointJacobians(model, data, q)
    module.updateFramePlacements(model, data)
    frames = [model.getFrameId(point) for point in topology.points]
    axes = pin.LOCAL_WORLD_ALIGNED
    rows = {
        "point_positions": [data.oMf[f].translation for f in frames],
        "point_velocities": [module.getFrameVelocity(model, data, f, axes).linear for f in frames],
        "point_accelerations": [
            module.getFrameClassicalAcceleration(model, data, f, axes).linear for f in frames
        ],
        "point_jacobian": [module.getFrameJacobian(model, data, f, axes) for f in frames],
    }
    for name, of_points in rows.items():
        plane = (_PLANE, slice(None)) if name == "point_jacobian" else _PLANE
        values[name] = stack(*(row[plane] for row in of_points))
    return values


def _model(module: ModuleType, topology: Topology, theta: Any) -> Any:
    """Build the model of a topology with these parameters."""
    model = module.Model()
    model.gravity.linear = np.array(topology.gravity)
    n = len(JOINT_ENTRIES)
    for i, name in enumerate(topology.joints):
        entries = theta[i * n : (i + 1) * n]
        rotation = np.reshape(topology.rotations[i], (3, 3))
        joint = getattr(module, f"JointModel{topology.types[i]}")()
        placement = module.SE3(rotation, entries[:3])
        number = model.addJoint(topology.parents[i], joint, placement, name)
        # appending merges with a massless body: (m c) / max(m, eps) in every graph
        model.inertias[number] = module.Inertia(entries[3], entries[4:7], _symmetric(entries[7:]))
    positions = theta[len(topology.joints) * n :]
    for i, name in enumerate(topology.points):
        position = positions[i * len(POINT_ENTRIES) : (i + 1) * len(POINT_ENTRIES)]
        placement = module.SE3(np.eye(3), position)
        model.addFrame(
            module.Frame(name, topology.point_joints[i], 0, placement, pin.OP_FRAME), False
        )
    return model


def _symmetric(entries: Any) -> Any:
    """Return the matrix of the entries xx, xy, yy, xz, yz, zz."""
    flat = entries[[0, 1, 3, 1, 2, 4, 3, 4, 5]]
    return ca.reshape(flat, 3, 3) if isinstance(entries, ca.SX) else flat.reshape(3, 3)
