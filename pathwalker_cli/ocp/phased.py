"""Motion in phases: the form in which guesses, iterates and solutions are kept."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np


def collocation_times(degree: int) -> np.ndarray:
    """Return the Radau points of an interval [0, 1], the last one at 1, shape (degree,)."""
    return np.array(ca.collocation_points(degree, "radau"))


def quadrature_weights(degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the Radau points of [0, 1] and their quadrature weights, shape (degree,) each."""
    times = collocation_times(degree)
    moments = np.vander(times, degree, increasing=True).T
    return times, np.linalg.solve(moments, 1 / np.arange(1, degree + 1))


def collocation_points(mesh: np.ndarray, degree: int) -> np.ndarray:
    """Return the positions of the Radau points of all N intervals of a mesh, shape (N, degree)."""
    return np.asarray(mesh[:-1, None] + np.diff(mesh)[:, None] * collocation_times(degree))


def lagrange_weights(nodes: np.ndarray, at: np.ndarray, derivative: bool = False) -> np.ndarray:
    """Return the matrix that evaluates an interpolating polynomial, shape (len(at), len(nodes))."""
    columns = []
    for i, node in enumerate(nodes):
        others = np.delete(nodes, i)
        basis = np.poly1d(others, r=True) / np.prod(node - others)
        columns.append(basis.deriv()(at) if derivative else basis(at))
    return np.column_stack(columns)


@dataclass(frozen=True)
class PhaseMotion:
    """One phase on its mesh of N intervals with d collocation points each.

    Args:
        duration: Length [s].
        mesh: Node positions in the phase, from 0 to 1, shape (N + 1,).
        states: x at the nodes, shape (N + 1, nx).
        smooth: y at the nodes, shape (N + 1, ny).
        controls: u at the nodes, shape (N + 1, nu).
        integrals: Running costs at the nodes, shape (N + 1, ni).
        inner_states: x at the collocation points, shape (N, d, nx); the last is the next node.
        algebraic: z at the collocation points, shape (N, d, nz).
    """

    name: str
    duration: float
    mesh: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    controls: np.ndarray
    integrals: np.ndarray
    inner_states: np.ndarray
    algebraic: np.ndarray

    @property
    def intervals(self) -> int:
        """Number of mesh intervals N."""
        return len(self.mesh) - 1

    @property
    def degree(self) -> int:
        """Number of collocation points in an interval."""
        return int(self.inner_states.shape[1])

    @property
    def point_fractions(self) -> np.ndarray:
        """Positions of the collocation points in the phase, shape (N, d)."""
        return collocation_points(self.mesh, self.degree)

    def locate(self, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return interval numbers and local positions in [0, 1] of fractions of the phase."""
        interval = np.clip(
            np.searchsorted(self.mesh, fractions, "right") - 1, 0, self.intervals - 1
        )
        local = (fractions - self.mesh[interval]) / np.diff(self.mesh)[interval]
        return interval, local

    def states_at(self, fractions: np.ndarray, derivative: bool = False) -> np.ndarray:
        """Return x (or dx/dt) at fractions of the phase, shape (m, nx)."""
        interval, local = self.locate(fractions)
        nodes = np.concatenate([[0.0], collocation_times(self.degree)])
        weights = lagrange_weights(nodes, local, derivative)
        values = np.concatenate([self.states[:-1, None], self.inner_states], axis=1)
        result = np.einsum("mk,mkn->mn", weights, values[interval])
        steps = self.duration * np.diff(self.mesh)[interval]
        return result / steps[:, None] if derivative else result

    def smooth_at(self, fractions: np.ndarray) -> np.ndarray:
        """Return y at fractions of the phase: the exact integral of u, shape (m, ny)."""
        interval, local = self.locate(fractions)
        step = (self.duration * np.diff(self.mesh)[interval] * local)[:, None]
        u0, u1 = self.controls[interval], self.controls[interval + 1]
        return np.asarray(self.smooth[interval] + step * (u0 + local[:, None] / 2 * (u1 - u0)))

    def controls_at(self, fractions: np.ndarray) -> np.ndarray:
        """Return u at fractions of the phase, shape (m, nu)."""
        interval, local = self.locate(fractions)
        u0, u1 = self.controls[interval], self.controls[interval + 1]
        return np.asarray(u0 + local[:, None] * (u1 - u0))

    def algebraic_at(self, fractions: np.ndarray) -> np.ndarray:
        """Return z at fractions of the phase from the polynomial of its points, shape (m, nz)."""
        interval, local = self.locate(fractions)
        weights = lagrange_weights(collocation_times(self.degree), local)
        return np.asarray(np.einsum("mk,mkn->mn", weights, self.algebraic[interval]))

    def resampled(self, mesh: np.ndarray, degree: int) -> PhaseMotion:
        """Return the same motion on another mesh."""
        points = collocation_points(mesh, degree).ravel()
        shape = (len(mesh) - 1, degree, -1)
        interval, local = self.locate(mesh)
        integrals = (
            self.integrals[interval] + local[:, None] * np.diff(self.integrals, axis=0)[interval]
        )
        return PhaseMotion(
            name=self.name,
            duration=self.duration,
            mesh=mesh,
            states=self.states_at(mesh),
            smooth=self.smooth_at(mesh),
            controls=self.controls_at(mesh),
            integrals=integrals,
            inner_states=self.states_at(points).reshape(shape),
            algebraic=self.algebraic_at(points).reshape(shape),
        )


def joined(name: str, parts: Sequence[PhaseMotion]) -> PhaseMotion:
    """Return phases that follow each other as one phase."""
    ends = np.cumsum([part.duration for part in parts])
    pieces = [
        (e + p.duration * (p.mesh[1:] - 1.0)) / ends[-1] for e, p in zip(ends, parts, strict=True)
    ]

    def at_nodes(key: str) -> np.ndarray:
        first, *others = (getattr(part, key) for part in parts)
        return np.concatenate([first, *(values[1:] for values in others)])

    return PhaseMotion(
        name=name,
        duration=float(ends[-1]),
        mesh=np.concatenate([[0.0], *pieces]),
        **{key: at_nodes(key) for key in ("states", "smooth", "controls", "integrals")},
        inner_states=np.concatenate([part.inner_states for part in parts]),
        algebraic=np.concatenate([part.algebraic for part in parts]),
    )


@dataclass(frozen=True)
class PhasedMotion:
    """All phases and the free parameters.

    Args:
        phases: The phases in order.
        parameters: p, shape (np,).
    """

    phases: tuple[PhaseMotion, ...]
    parameters: np.ndarray

    @cached_property
    def durations(self) -> np.ndarray:
        """Phase durations [s], shape (number of phases,)."""
        return np.array([phase.duration for phase in self.phases])

    @property
    def duration(self) -> float:
        """Total time [s]."""
        return float(self.durations.sum())

    @property
    def intervals(self) -> int:
        """Number of mesh intervals over all phases."""
        return sum(phase.intervals for phase in self.phases)

    @property
    def meshes(self) -> tuple[np.ndarray, ...]:
        """Node positions of every phase."""
        return tuple(phase.mesh for phase in self.phases)

    def resampled(self, meshes: tuple[np.ndarray, ...], degree: int) -> PhasedMotion:
        """Return the same motion on other meshes, one for each phase."""
        phases = tuple(
            phase.resampled(mesh, degree) for phase, mesh in zip(self.phases, meshes, strict=True)
        )
        return PhasedMotion(phases, self.parameters)
