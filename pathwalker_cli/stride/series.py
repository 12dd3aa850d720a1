"""A gait as time series in physical terms, sampled at the collocation points of its motion."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from pathwalker_cli.model.elements.muscle import excitation_from_rate
from pathwalker_cli.model.skeleton import Side
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, quadrature_weights


class Sampled:
    """What is known of every walk that was sampled at instants: who walked when, and how."""

    walker: Walker
    time: np.ndarray
    q: np.ndarray

    @property
    def duration(self) -> float:
        """Time that it takes [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def distance(self) -> float:
        """Distance that it covers [m]."""
        return float(self.q[-1, 0] - self.q[0, 0])

    @cached_property
    def contact_position(self) -> np.ndarray:
        """Where the places of the pattern touch the ground, or would: x and z [m], (n, k, 2)."""
        return self.walker.contact_points(self.q)

    def column(self, coordinate: str) -> np.ndarray:
        """Return one generalised coordinate over time, shape (n,)."""
        return np.asarray(self.q[:, self.walker.skeleton.index(coordinate)])

    def cuff_shift(self, side: Side) -> np.ndarray:
        """Return how far the cuff of a side is off its place on the leg, see `Cuff.shift`; [m].

        Across the shank and along it, shape (n, 2).
        """
        walker = self.walker
        state = walker.state(self.q.T, 0.0 * self.q.T, [None] * len(walker.muscles))
        return np.stack(walker.device.cuffs[side].shift(state, walker.values), axis=1)


@dataclass(frozen=True)
class GaitSeries(Sampled):
    """One stride, n instants; SI units and radians, orders as in `conventions`.

    Args:
        walker: Who walks, with the numbers that the motion was found with.
        motion: The motion that was sampled.
        time: Instants [s], shape (n,); the first is 0.
        phase: Name of the phase at each instant, n of them.
        q: Generalised coordinates, shape (n, 10).
        v: Generalised velocities, shape (n, 10).
        vdot: Generalised accelerations, shape (n, 10).
        activation: Activations, shape (n, 14).
        activation_rate: Their rates [1/s], shape (n, 14).
        force: Ground reaction forces on the body in the order of `walker.pattern.forces` [N],
            shape (n, 8); zero without contact.
        reserve: Reserve forces [N, N m], shape (n, 10); zero in every accepted solution.
        element_force: Forces of all elements [N m] in the order of `walker.elements`, (n, k).
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
    element_force: np.ndarray

    def __repr__(self) -> str:
        """Return who walks how far, and how finely it was sampled."""
        walk = f"{self.distance:.2f} m in {self.duration:.2f} s"
        return f"GaitSeries({self.walker!r}, {walk}, {len(self.time)} instants)"

    @cached_property
    def excitation(self) -> np.ndarray:
        """Neural excitations in [0, 1], shape (n, 14), from equation (2)."""
        return excitation_from_rate(self.activation_rate, self.activation)

    @cached_property
    def muscle_torque(self) -> np.ndarray:
        """Torque of each muscle torque generator [N m], shape (n, 14)."""
        return self.element_force[:, self.walker.columns(self.walker.muscles)]

    @cached_property
    def orthosis_torque(self) -> np.ndarray:
        """Torques of the orthoses right, left [N m], shape (n, 2); zero where none is worn."""
        return self.walker.device_torques(self.element_force)

    @cached_property
    def cuff_force(self) -> np.ndarray:
        """Forces of the cuffs on the legs [N], (n, 4); see `Walker.cuff_forces`."""
        return self.walker.cuff_forces(self.q, self.v, self.element_force)

    @cached_property
    def passive_torque(self) -> dict[str, np.ndarray]:
        """Torque of passive tissue by coordinate [N m], each (n,); empty without tissue."""
        tissue = self.walker.tissue
        names = [name for element in tissue for name in element.coordinates]
        columns = self.element_force[:, self.walker.columns(tissue)].T
        sums: dict[str, np.ndarray] = {}
        for name, column in zip(names, columns, strict=True):
            sums[name] = sums[name] + column if name in sums else column
        return sums

    @property
    def stiffness(self) -> np.ndarray:
        """K_D right, left, K_P right, left [N m/rad], shape (4,); empty when barefoot."""
        return self.walker.stiffness

    @cached_property
    def element_power(self) -> np.ndarray:
        """Power of every force of `element_force` [W], shape (n, k)."""
        walker = self.walker
        rows = [walker.skeleton.index(name) for e in walker.elements for name in e.coordinates]
        return self.element_force * self.v[:, rows]

    @cached_property
    def net_torque(self) -> np.ndarray:
        """Sum of the forces of all elements per coordinate [N m], shape (n, 10)."""
        return self.walker.generalised_forces(self.element_force)

    @cached_property
    def joint_torque(self) -> np.ndarray:
        """The same as the joints of the body feel it, (n, 10); see `Walker.joint_torques_of`."""
        return self.walker.joint_torques_of(self.net_torque)

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

    def vertical_force(self, side: str) -> np.ndarray:
        """Return the vertical ground reaction force on a foot ("right", "left") [N], shape (n,)."""
        return self._foot_force(side, "z")

    def forward_force(self, side: str) -> np.ndarray:
        """Return the forward ground reaction force on a foot ("right", "left") [N], shape (n,)."""
        return self._foot_force(side, "x")

    def _foot_force(self, side: str, axis: str) -> np.ndarray:
        forces = self.walker.pattern.forces
        rows = [i for i, f in enumerate(forces) if f.point.side == side and f.axis == axis]
        return np.asarray(self.force[:, rows].sum(axis=1))


def gait_series(walker: Walker, motion: PhasedMotion) -> GaitSeries:
    """Return the time series of a motion at its collocation points.

    Args:
        walker: Who walks; its unknowns take the values of the motion's parameters.
        motion: A motion of a gait problem: states (q, v), algebraic variables (accelerations,
            forces of the phase, reserves), smooth states (activations).
    """
    walker = walker.with_parameters(motion.parameters)
    parts = [_phase_series(walker, phase) for phase in motion.phases]
    starts = np.concatenate([[0.0], np.cumsum(motion.durations)])[:-1]
    time = np.concatenate([start + part["time"] for start, part in zip(starts, parts, strict=True)])
    names = tuple(p.name for p, part in zip(motion.phases, parts, strict=True) for _ in part["q"])
    first = _first_instant(walker, motion)
    columns = {key: np.concatenate([first[key], *(part[key] for part in parts)]) for key in first}
    return GaitSeries(
        walker=walker,
        motion=motion,
        time=np.concatenate([[0.0], time]),
        phase=(motion.phases[0].name, *names),
        element_force=walker.element_forces(columns["q"], columns["v"], columns["activation"]),
        **columns,
    )


def _phase_series(walker: Walker, phase: PhaseMotion) -> dict[str, np.ndarray]:
    """Return the columns of one phase at its collocation points."""
    fractions = phase.point_fractions.ravel()
    n, count = walker.skeleton.size, fractions.size
    active = walker.pattern.indices(walker.pattern.phase(phase.name).forces)
    states = phase.inner_states.reshape(count, -1)
    algebraic = phase.algebraic.reshape(count, -1)
    force = np.zeros((count, len(walker.pattern.forces)))
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


def _first_instant(walker: Walker, motion: PhasedMotion) -> dict[str, np.ndarray]:
    """Return the columns at time 0, where there is no collocation point."""
    phase, n = motion.phases[0], walker.skeleton.size
    q, v, activation = phase.states[0, :n], phase.states[0, n:], phase.smooth[0]
    tau = walker.generalised_forces(walker.element_forces(q, v, activation))
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
