"""Prove a solution: violations by name, active bounds, re-integration, and a second engine."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import casadi as ca
import numpy as np
import pinocchio as pin
from scipy.integrate import solve_ivp

from pathwalker_cli.conventions import CONTACT_POINTS, COORDINATES
from pathwalker_cli.model.walker import ANKLES, GENERATOR_ROWS, Walker
from pathwalker_cli.nlp.ipopt import NlpResult
from pathwalker_cli.nlp.taped import Columns
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.stride.series import GaitSeries, actuator_torques

__all__ = [
    "ActiveBound",
    "Reintegration",
    "Violation",
    "active_bounds",
    "equation_residual",
    "largest_violations",
    "reintegrate",
    "second_engine_residual",
]

_NEAR = 1e-2
"""Distance in solver units beyond which a bound is never called active."""
_PULL = 1e-5
"""Least multiplier of an active bound: without it the bound does not matter."""


_ACTIVE_BOUND: Final = re.compile(
    r"(?P<name>.+) (?P<side>lower|upper) (?P<value>[-+.\w]+)(?: in (?P<places>.+))?"
)


@dataclass(frozen=True)
class Violation:
    """One constraint or bound that is not met.

    Args:
        name: What and where.
        amount: By how much, in its own unit.
    """

    name: str
    amount: float


def largest_violations(
    program: CollocationProgram, result: NlpResult, count: int = 5
) -> tuple[Violation, ...]:
    """Return the largest violations in physical units, largest first; zero ones count too."""
    nlp, layout = program.program, program.layout
    lower, upper = program.bounds
    rows = np.maximum(nlp.lower - result.rows, result.rows - nlp.upper) * nlp.row_scale
    unknowns = np.maximum(lower - result.unknowns, result.unknowns - upper) * layout.scale
    both = np.nan_to_num(np.concatenate([rows, unknowns]), nan=np.inf, neginf=0.0).clip(0.0)
    found = []
    for i in np.argsort(-both, kind="stable")[:count]:
        name = nlp.row_name(int(i)) if i < nlp.rows else f"bound of {layout.names[i - nlp.rows]}"
        found.append(Violation(name, float(both[i])))
    return tuple(found)


@dataclass(frozen=True)
class ActiveBound:
    """A bound that holds the solution back.

    Args:
        name: Quantity, e.g. "knee_r" or "walking_speed".
        side: "lower" or "upper".
        value: The bound, in the unit of the quantity.
        places: Phases in which it is active; empty for the whole motion.
    """

    name: str
    side: str
    value: float
    places: tuple[str, ...]

    def __str__(self) -> str:
        """Return e.g. "knee_r lower 0.42 in left_flat, left_toe"."""
        where = f" in {', '.join(self.places)}" if self.places else ""
        return f"{self.name} {self.side} {self.value:.4g}{where}"

    @classmethod
    def parsed(cls, text: str) -> ActiveBound | None:
        """Return the bound of such a text as older runs have it, None if it is none."""
        match = _ACTIVE_BOUND.fullmatch(text)
        if match is None:
            return None
        places = match["places"]
        return cls(match["name"], match["side"], float(match["value"]),
                   tuple(places.split(", ")) if places else ())  # fmt: skip


def active_bounds(program: CollocationProgram, result: NlpResult) -> tuple[ActiveBound, ...]:
    """Return the inequality bounds that are active with a multiplier, grouped by name."""
    groups: dict[tuple[str, str, float], list[str]] = {}
    costs = program.blocks.problem.integrals
    for name, where, side, value in _active_entries(program, result):
        if name in costs:  # a running cost that stays zero holds nothing back
            continue
        phases = groups.setdefault((name, side, round(value, 9)), [])
        phase = "" if where in ("all phases", "the whole motion") else where.split(" ")[0]
        if phase and phase not in phases:
            phases.append(phase)
    return tuple(ActiveBound(*key, tuple(places)) for key, places in sorted(groups.items()))


def _active_entries(
    program: CollocationProgram, result: NlpResult
) -> Iterator[tuple[str, str, str, float]]:
    """Yield name, place, side and value of every active bound."""
    nlp, layout = program.program, program.layout
    lower, upper = program.bounds
    for side, limit, gap, pull in (
        ("lower", lower, result.unknowns - lower, -result.multipliers.unknowns),
        ("upper", upper, upper - result.unknowns, result.multipliers.unknowns),
    ):
        # along the barrier gap times multiplier is constant: active is where the multiplier wins
        hit = (gap < np.minimum(_NEAR, pull)) & (pull > _PULL) & (upper > lower)
        for i in np.flatnonzero(hit):
            name, where = layout.names[i].split(" in ", 1)
            yield name, where, side, float(limit[i] * layout.scale[i])
    for side, limit, gap, pull in (
        ("lower", nlp.lower, result.rows - nlp.lower, -result.multipliers.rows),
        ("upper", nlp.upper, nlp.upper - result.rows, result.multipliers.rows),
    ):
        hit = (gap < np.minimum(_NEAR, pull)) & (pull > _PULL) & (nlp.upper > nlp.lower)
        for i in np.flatnonzero(hit):
            name, where = nlp.row_place(int(i))
            yield name, where, side, float(limit[i] * nlp.row_scale[i])


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
        walker: The walker.
        motion: Its motion.
        tolerance: Relative tolerance of the integrator.
    """
    n, torques = len(COORDINATES), Columns(actuator_torques(walker))
    terms = Columns(walker.dynamics_terms)
    positions, velocities = [], []
    for phase in motion.phases:
        errors = _interval_errors(walker, torques, terms, phase, motion.parameters, tolerance)
        positions.append(errors[:, :n].max(axis=1))
        velocities.append(errors[:, n:].max(axis=1))
    return Reintegration(tuple(positions), tuple(velocities))


def _interval_errors(
    walker: Walker,
    torques: Columns,
    terms: Columns,
    phase: PhaseMotion,
    stiffness: np.ndarray,
    tolerance: float,
) -> np.ndarray:
    """Return the absolute errors of q and v at the end of every interval, shape (N, 20).

    All intervals of a phase are integrated side by side, each over its own share of time.
    """
    n, count = len(COORDINATES), phase.intervals
    starts, steps = phase.mesh[:-1], np.diff(phase.mesh)
    parameters = np.tile(np.asarray(stiffness)[:, None], count)

    def rate(share: float, stacked: np.ndarray) -> np.ndarray:
        state = stacked.reshape(count, 2 * n)
        q, v = state[:, :n], state[:, n:]
        activation = phase.smooth_at(starts + steps * share)
        muscle, orthosis = torques(q.T, v.T, activation.T, parameters)
        tau = np.zeros((n, count))
        np.add.at(tau, list(GENERATOR_ROWS), np.asarray(muscle))
        np.add.at(tau, list(ANKLES), np.asarray(orthosis))
        vdot, _ = walker.contact_dynamics_series(phase.name, q, v, tau.T, terms)
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
    orthosis curves.
    """
    walker = series.walker
    model, data = walker.model, walker.model.createData()
    worst = 0.0
    for k in range(len(series.time)):
        q = np.array(series.q[k])
        muscle = walker.muscle_torques(q, series.v[k], series.activation[k])
        stiffness = series.stiffness if series.stiffness.size else np.ones(4)
        orthosis = walker.orthosis_torques(q, stiffness[:2], stiffness[2:])
        needed = pin.rnea(model, data, q, np.array(series.v[k]), np.array(series.vdot[k]))
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for i, point in enumerate(CONTACT_POINTS):
            jacobian = pin.getFrameJacobian(
                model, data, model.getFrameId(point), pin.LOCAL_WORLD_ALIGNED
            )
            needed = needed - jacobian[[0, 2]].T @ series.force[k, 2 * i : 2 * i + 2]
        residual = needed - walker.joint_torques(muscle, orthosis) - series.reserve[k]
        worst = max(worst, float(np.abs(residual).max()))
    return worst


def equation_residual(series: GaitSeries, walker: Walker) -> float:
    """Return the largest violation of the equations of motion by a walker's own back end [N, N m].

    Args:
        series: The stride.
        walker: The same walker, of any back end.
    """
    body, n = walker.rigid_body, len(COORDINATES)
    q, v, vdot, force = (ca.SX.sym(name, k) for name, k in (("q", n), ("v", n), ("a", n), ("f", 8)))
    theta = ca.DM(body.parameters)
    balance = body.inverse_dynamics(q, v, vdot, theta) - body.point_jacobian(q, theta).T @ force
    needed = ca.Function("needed", [q, v, vdot, force], [balance]).map(len(series.time))
    found = np.asarray(needed(series.q.T, series.v.T, series.vdot.T, series.force.T)).T
    return float(np.abs(found - series.net_torque - series.reserve).max())
