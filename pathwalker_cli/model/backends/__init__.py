"""Back ends that turn a `pin.Model` into symbolic rigid-body functions.

In order of preference: "pinocchio.casadi" (Pinocchio's own bindings, from conda-forge), "compiled"
(Pinocchio's C++ algorithms, compiled when this package was installed) and "direct" (the recursive
Newton-Euler algorithm written in CasADi).  All deliver the same functions.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import MappingProxyType

import casadi as ca
import numpy as np
import pinocchio as pin

from pathwalker_cli.errors import BackendError
from pathwalker_cli.model.backends import bindings, compiled, direct
from pathwalker_cli.model.backends.functions import (
    PLACE_ENTRIES,
    RigidBodyFunctions,
    Topology,
    all_parameters,
    fold,
    touching,
)

_MODULES = MappingProxyType({"pinocchio.casadi": bindings, "compiled": compiled, "direct": direct})
"""Each says by `describe` what would run, or raises what is missing, and has `build`."""

BACKENDS = tuple(_MODULES)
"""Names of all back ends in order of preference."""


@dataclass(frozen=True)
class BackendReport:
    """State of one back end.

    Attributes:
        name: One of `BACKENDS`.
        available: Whether it can be used here.
        detail: What would run, or what is missing and how to get it.
    """

    name: str
    available: bool
    detail: str


def backend_report() -> tuple[BackendReport, ...]:
    """Return the state of every back end, in order of preference."""
    return tuple(_report(name) for name in BACKENDS)


def available_backends() -> tuple[str, ...]:
    """Return the names of the back ends that can be used here, in order of preference."""
    return tuple(report.name for report in backend_report() if report.available)


def rigid_body_functions(
    model: pin.Model,
    points: Sequence[str],
    backend: str = "auto",
    shapes: Sequence[float] = (),
    soles: bool = False,
    moved: Sequence[str] = (),
) -> RigidBodyFunctions:
    """Build the symbolic dynamics and kinematics of a planar model.

    Parameters that are exactly zero in the model are structural zeros of the graphs.  Models of
    equal topology and zeros share the functions; only `parameters` differ.

    Args:
        model: Model in the x-z plane of revolute and prismatic joints along the axes.
        points: Names of the frames whose motion is wanted, e.g. contact points.
        backend: One of `BACKENDS`, or "auto" for the first one available.
        shapes: Radius of the circle of each point [m], then roundness of each sole; none: points.
        soles: Whether the points of one body are the ends of a sole, see `functions.touching`.
        moved: Names of joints whose place in the plane, and whose body's centre of mass, stay
            symbols where they are zero.

    Raises:
        BackendError: The back end does not exist or cannot be used here, or the model has joints
            or points that are not supported.
    """
    name = available_backends()[0] if backend == "auto" else backend
    if name not in BACKENDS:
        allowed = ", ".join(("auto", *available_backends()))
        raise BackendError(f"there is no back end {name!r}; available: {allowed}")
    topology = Topology.of(model, points, soles)
    parameters = all_parameters(model, points, shapes)
    kept = {f"{joint}.{entry}" for joint in moved for entry in PLACE_ENTRIES}
    names = np.array([name in kept for name in topology.parameter_names])
    nonzero = tuple(((parameters != 0.0) | names).tolist())
    values = parameters[np.array(nonzero, dtype=bool)]
    values.setflags(write=False)
    named = zip(topology.parameter_names, nonzero, strict=True)
    return RigidBodyFunctions(
        backend=name,
        nq=model.nq,
        parameters=values,
        parameter_names=tuple(parameter for parameter, kept in named if kept),
        topology=topology,
        **_folded(name, topology, nonzero),
    )


@lru_cache(maxsize=32)
def _folded(
    name: str, topology: Topology, nonzero: tuple[bool, ...]
) -> MappingProxyType[str, ca.Function]:
    report = _report(name)
    if not report.available:
        others = ", ".join(available_backends())
        raise BackendError(
            f"back end {name!r} is not available: {report.detail}; or use one of auto, {others}"
        )
    full = touching(topology, _MODULES[name].build(topology))
    return MappingProxyType(fold(topology, full, nonzero))


def _report(name: str) -> BackendReport:
    try:
        return BackendReport(name, True, _MODULES[name].describe())
    except BackendError as error:
        return BackendReport(name, False, str(error))
