"""Prove a solution: re-integration, and a second engine."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from pathwalker_cli.model.compliance import ground_force
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.nlp.taped import Columns
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.stride.ground import touched
from pathwalker_cli.stride.series import GaitSeries


@dataclass(frozen=True)
class Reintegration:
    """How well an independent integrator meets the next node from each node.

    Args:
        position: Largest error of q at the end of every interval [rad, m], per phase.
        velocity: Largest error of v at the end of every interval [rad/s, m/s], per phase.
    """

    position: tuple[np.ndarray, ...]
    velocity: tuple[np.ndarray, ...]

    @property
    def worst_position(self) -> float:
        """Largest error of q over all intervals [rad, m]."""
        return float(max(errors.max() for errors in self.position))

    @property
    def worst_velocity(self) -> float:
        """Largest error of v over all intervals [rad/s, m/s]."""
        return float(max(errors.max() for errors in self.velocity))


def reintegrate(walker: Walker, motion: PhasedMotion, tolerance: float = 1e-9) -> Reintegration:
    """Integrate every mesh interval anew with DOP853.

    Accelerations come from the contact-constrained dynamics of the walker, not from the
    unknowns of the program; activations follow from their rates.

    Args:
        walker: The walker; its unknowns take the values of the motion's parameters.
        motion: Its motion.
        tolerance: Relative tolerance of the integrator.
    """
    walker = walker.with_parameters(motion.parameters)
    n, forces = walker.skeleton.size, Columns(walker.force_function)
    terms = Columns(walker.dynamics_terms)
    positions, velocities = [], []
    for phase in motion.phases:
        errors = _interval_errors(walker, forces, terms, phase, tolerance)
        positions.append(errors[:, :n].max(axis=1))
        velocities.append(errors[:, n:].max(axis=1))
    return Reintegration(tuple(positions), tuple(velocities))


def _interval_errors(
    walker: Walker,
    forces: Columns,
    terms: Columns,
    phase: PhaseMotion,
    tolerance: float,
) -> np.ndarray:
    """Return the absolute errors of q and v at the end of every interval, shape (N, 20).

    All intervals of a phase are integrated side by side, each over its own share of time.
    """
    n, count = walker.skeleton.size, phase.intervals
    starts, steps = phase.mesh[:-1], np.diff(phase.mesh)

    def rate(share: float, stacked: np.ndarray) -> np.ndarray:
        state = stacked.reshape(count, 2 * n)
        q, v = state[:, :n], state[:, n:]
        activation = phase.smooth_at(starts + steps * share)
        _, tau = forces(q.T, v.T, activation.T)
        vdot, _ = walker.contact_dynamics_series(phase.name, q, v, np.asarray(tau).T, terms)
        return np.asarray(phase.duration * steps[:, None] * np.hstack([v, vdot])).ravel()

    inside = 1 - 1e-12  # the end itself belongs to the next interval
    solution = solve_ivp(
        rate,
        (0.0, inside),
        phase.states[:-1].ravel(),
        method="DOP853",
        rtol=tolerance,
        atol=0.1 * tolerance,
    )
    if not solution.success:
        return np.full((count, 2 * n), np.inf)
    return np.abs(solution.y[:, -1].reshape(count, 2 * n) - phase.states[1:])


def second_engine_residual(series: GaitSeries) -> float:
    """Return the largest violation of the equations of motion in numeric Pinocchio [N, N m].

    Independent of the symbolic functions: `pin.rnea`, frame Jacobians, and the NumPy muscle and
    orthosis curves.  What gives way must also be pushed by as much as its law says.
    """
    walker = series.walker
    model, data = walker.model, walker.model.createData()
    elements = walker.element_forces(series.q, series.v, series.activation)
    given = walker.generalised_forces(elements) + series.reserve
    worst = 0.0
    for k in range(len(series.time)):
        q, v = np.array(series.q[k]), np.array(series.v[k])
        needed = pin.rnea(model, data, q, v, np.array(series.vdot[k]))
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        forces = zip(
            walker.pattern.points,
            touched(walker, data),
            series.force[k].reshape(-1, 2),
            strict=True,
        )
        for point, place, force in forces:
            jacobian = pin.getFrameJacobian(model, data, place.frame, pin.LOCAL_WORLD_ALIGNED)
            forward, _, upward = place.arm
            rows = jacobian[[0, 2]] + np.outer((upward, -forward), jacobian[4])
            needed = needed - rows.T @ force
            if point in walker.pattern.yielding:
                forward, up = (rows @ v).tolist()
                known = walker.values, walker.weight, walker.friction
                law = ground_force(point, place.position[2], (forward, up), *known)
                worst = max(worst, float(np.abs(force - law).max()))
        worst = max(worst, float(np.abs(needed - given[k]).max()))
    return worst


def equation_residual(series: GaitSeries, walker: Walker) -> float:
    """Return how far a walker's own back end misses the equations of motion at most [N, N m]."""
    body, n = walker.rigid_body, walker.skeleton.size
    sizes = {"q": n, "v": n, "vdot": n, "force": len(walker.pattern.forces)}
    q, v, vdot, force = (ca.SX.sym(name, k) for name, k in sizes.items())
    theta = ca.DM(body.parameters)
    balance = body.inverse_dynamics(q, v, vdot, theta) - body.point_jacobian(q, theta).T @ force
    needed = ca.Function("needed", [q, v, vdot, force], [balance]).map(len(series.time))
    found = np.asarray(needed(series.q.T, series.v.T, series.vdot.T, series.force.T)).T
    return float(np.abs(found - series.net_torque - series.reserve).max())
