"""A gait as time series in physical terms, sampled at the collocation points of its motion."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cache, cached_property

import casadi as ca
import numpy as np

from pathwalker_cli.conventions import CONTACT_FORCES, COORDINATES
from pathwalker_cli.model.contact import phase_named
from pathwalker_cli.model.muscle import excitation_from_rate, generators
from pathwalker_cli.model.orthosis import OrthosisSide, orthosis_torque
from pathwalker_cli.model.walker import ANKLES, GENERATOR_ROWS, Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, quadrature_weights

__all__ = ["GaitSeries", "actuator_torques", "gait_series"]


@dataclass(frozen=True)
class GaitSeries:
    """One stride, n instants; SI units and radians, orders as in `conventions`.

    Args:
        walker: Who walks.
        motion: The motion that was sampled.
        time: Instants [s], shape (n,); the first is 0.
        phase: Name of the phase at each instant, n of them.
        q: Generalised coordinates, shape (n, 10).
        v: Generalised velocities, shape (n, 10).
        vdot: Generalised accelerations, shape (n, 10).
        activation: Activations, shape (n, 14).
        activation_rate: Their rates [1/s], shape (n, 14).
        force: Ground reaction forces on the body [N], shape (n, 8); zero without contact.
        reserve: Reserve forces [N, N m], shape (n, 10); zero in every accepted solution.
        muscle_torque: Torque of each generator [N m], shape (n, 14).
        orthosis_torque: Torques of the orthoses right, left [N m], shape (n, 2).
        stiffness: K_D right, left, K_P right, left [N m/rad], shape (4,); empty when barefoot.
    """

    walker: Walker
    motion: PhasedMotion
    time: np.ndarray
    phase: tuple[str, ...]
    q: np.ndarray
    v: np.ndarray
    vdot: np.ndarray
    activation: np.ndarray
    activation_rate: np.ndarray
    force: np.ndarray
    reserve: np.ndarray
    muscle_torque: np.ndarray
    orthosis_torque: np.ndarray
    stiffness: np.ndarray

    @cached_property
    def excitation(self) -> np.ndarray:
        """Neural excitations in [0, 1], shape (n, 14), from equation (2)."""
        return excitation_from_rate(self.activation_rate, self.activation)

    @cached_property
    def net_torque(self) -> np.ndarray:
        """Sum of muscle and orthosis torques per coordinate [N m], shape (n, 10)."""
        tau = np.zeros_like(self.q)
        for i, row in enumerate(GENERATOR_ROWS):
            tau[:, row] += self.muscle_torque[:, i]
        for i, row in enumerate(ANKLES):
            tau[:, row] += self.orthosis_torque[:, i]
        return tau

    @cached_property
    def contact_position(self) -> np.ndarray:
        """Positions of the contact points, x and z [m], shape (n, 4, 2)."""
        return np.array([self.walker.contact_points(q) for q in self.q])

    @cached_property
    def quadrature(self) -> np.ndarray:
        """Weights w [s] with sum(w * f) = integral of f over the stride, shape (n,).

        The rule of the Radau points, exact for polynomials of degree 2 d - 2 on every interval.
        """
        parts = [np.zeros(1)]
        for phase in self.motion.phases:
            steps = phase.duration * np.diff(phase.mesh)
            parts.append(np.outer(steps, quadrature_weights(phase.degree)[1]).ravel())
        return np.concatenate(parts)

    @property
    def duration(self) -> float:
        """Time of the stride [s]."""
        return float(self.time[-1])

    @property
    def distance(self) -> float:
        """Distance of the stride [m]."""
        return float(self.q[-1, 0] - self.q[0, 0])

    def column(self, coordinate: str) -> np.ndarray:
        """Return one generalised coordinate over time, shape (n,)."""
        return np.asarray(self.q[:, COORDINATES.index(coordinate)])

    def vertical_force(self, side: str) -> np.ndarray:
        """Return the vertical ground reaction force on a foot ("right", "left") [N], shape (n,)."""
        return self._foot_force(side, "z")

    def forward_force(self, side: str) -> np.ndarray:
        """Return the forward ground reaction force on a foot ("right", "left") [N], shape (n,)."""
        return self._foot_force(side, "x")

    def _foot_force(self, side: str, axis: str) -> np.ndarray:
        rows = [CONTACT_FORCES.index(f"{p}_{side[0]}_{axis}") for p in ("heel", "toe")]
        return np.asarray(self.force[:, rows].sum(axis=1))


def actuator_torques(walker: Walker) -> ca.Function:
    """Return the function (q, v, activation, stiffness) -> muscle (14,), orthosis (2,) torques.

    The stiffness is (K_D right, left, K_P right, left) [N m/rad], empty for a barefoot walker.
    """
    sides = walker.orthosis or ()
    general = _torques(len(sides))
    inputs = [ca.SX.sym(name, general.size1_in(i)) for i, name in enumerate("qvak")]
    numbers = np.array([value for side in sides for value in vars(side).values()])
    outputs = general.call([*inputs, walker.max_isometric_torque, numbers], True, False)
    return ca.Function("torques", inputs, outputs)


@cache
def _torques(sides: int) -> ca.Function:
    """Return the torques of any walker: strengths and orthosis parameters are inputs too."""
    q, v, a = (ca.SX.sym(name, size) for name, size in (("q", 10), ("v", 10), ("a", 14)))
    k, strength = ca.SX.sym("k", 2 * sides), ca.SX.sym("strength", len(GENERATOR_ROWS))
    numbers = ca.SX.sym("orthosis", sides * len(fields(OrthosisSide)))
    muscle = [
        g.torque(q[row], v[row], a[i], strength[i])
        for i, (g, row) in enumerate(zip(generators(), GENERATOR_ROWS, strict=True))
    ]
    worn = [OrthosisSide(*ca.vertsplit(part)) for part in _halves(numbers, sides)]
    orthosis = [
        orthosis_torque(side, q[row], k[i], k[i + 2])
        for i, (side, row) in enumerate(zip(worn, ANKLES, strict=False))
    ] or [ca.SX(0), ca.SX(0)]
    inputs = [q, v, a, k, strength, numbers]
    return ca.Function("torques", inputs, [ca.vertcat(*muscle), ca.vertcat(*orthosis)])


def _halves(numbers: ca.SX, sides: int) -> list[ca.SX]:
    """Return the orthosis parameters of each side."""
    return ca.vertsplit(numbers, numbers.numel() // sides) if sides else []


def gait_series(walker: Walker, motion: PhasedMotion) -> GaitSeries:
    """Return the time series of a motion at its collocation points.

    Args:
        walker: Who walks.
        motion: A motion of a gait problem: states (q, v), algebraic variables (accelerations,
            forces of the phase, reserves), smooth states (activations).
    """
    parts = [_phase_series(phase) for phase in motion.phases]
    starts = np.concatenate([[0.0], np.cumsum(motion.durations)])[:-1]
    time = np.concatenate([start + part["time"] for start, part in zip(starts, parts, strict=True)])
    names = tuple(p.name for p, part in zip(motion.phases, parts, strict=True) for _ in part["q"])
    columns = {
        key: np.concatenate([part[key] for part in parts]) for key in parts[0] if key != "time"
    }
    torques = actuator_torques(walker)
    first = _first_instant(walker, motion, torques)
    columns = {key: np.concatenate([first[key], value]) for key, value in columns.items()}
    stiffness = np.broadcast_to(motion.parameters[:, None], (motion.parameters.size, len(time) + 1))
    muscle, orthosis = torques.map(len(time) + 1)(
        columns["q"].T, columns["v"].T, columns["activation"].T, stiffness
    )
    return GaitSeries(
        walker=walker,
        motion=motion,
        time=np.concatenate([[0.0], time]),
        phase=(motion.phases[0].name, *names),
        muscle_torque=np.asarray(muscle).T,
        orthosis_torque=np.asarray(orthosis).T,
        stiffness=motion.parameters,
        **columns,
    )


def _phase_series(phase: PhaseMotion) -> dict[str, np.ndarray]:
    """Return the columns of one phase at its collocation points."""
    fractions = phase.point_fractions.ravel()
    n, count = len(COORDINATES), fractions.size
    active = list(phase_named(phase.name).indices)
    states = phase.inner_states.reshape(count, -1)
    algebraic = phase.algebraic.reshape(count, -1)
    force = np.zeros((count, len(CONTACT_FORCES)))
    force[:, active] = algebraic[:, n : n + len(active)]
    return {
        "time": phase.duration * fractions,
        "q": states[:, :n],
        "v": states[:, n:],
        "vdot": algebraic[:, :n],
        "activation": phase.smooth_at(fractions),
        "activation_rate": phase.controls_at(fractions),
        "force": force,
        "reserve": algebraic[:, n + len(active) :],
    }


def _first_instant(
    walker: Walker, motion: PhasedMotion, torques: ca.Function
) -> dict[str, np.ndarray]:
    """Return the columns at time 0, where there is no collocation point."""
    phase, n = motion.phases[0], len(COORDINATES)
    q, v, activation = phase.states[0, :n], phase.states[0, n:], phase.smooth[0]
    muscle, orthosis = (np.asarray(k) for k in torques(q, v, activation, motion.parameters))
    tau = walker.joint_torques(muscle, orthosis)
    vdot, force = walker.contact_dynamics(phase.name, q, v, tau)
    values = {
        "q": q,
        "v": v,
        "vdot": vdot,
        "activation": activation,
        "activation_rate": phase.controls[0],
        "force": force,
        "reserve": np.zeros(n),
    }
    return {key: value[None, :] for key, value in values.items()}
