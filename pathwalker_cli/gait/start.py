"""Where the search begins: a stride to track, as a motion in phases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from pathwalker_cli.conventions import GENERATORS
from pathwalker_cli.gait import choices
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, collocation_points
from pathwalker_cli.trajectory import Trajectory


@dataclass(frozen=True)
class ReferenceStride:
    """One stride to track in the first stage of a solve.

    Args:
        name: Where it comes from, for records.
        trajectory: The coordinates of the walker over one stride from left toe-off on.
        durations: Durations of the phases of the walker's pattern [s], shape (k,).
    """

    name: str
    trajectory: Trajectory
    durations: np.ndarray

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.trajectory.time, self.trajectory.values)

    @cached_property
    def _starts(self) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def coordinates(self, phase: int, fraction: np.ndarray | float, order: int = 0) -> np.ndarray:
        """Return q, or its time derivative of that order, at a fraction of a phase."""
        time = self._starts[phase] + np.asarray(fraction) * self.durations[phase]
        return np.asarray(self._spline(time, order))

    def motion(
        self,
        walker: Walker,
        parameters: np.ndarray,
        meshes: tuple[np.ndarray, ...],
        degree: int,
        integrals: int,
    ) -> PhasedMotion:
        """Return a start on a mesh: this stride, level activations, weight on the feet.

        Parameters are those of the walker's unknowns, shape (k,).
        """
        rest = degree, integrals
        phases = tuple(self._phase(walker, i, mesh, *rest) for i, mesh in enumerate(meshes))
        return PhasedMotion(phases, np.asarray(parameters, float))

    def _phase(
        self, walker: Walker, i: int, mesh: np.ndarray, degree: int, integrals: int
    ) -> PhaseMotion:
        contact, count, weight = walker.pattern.phases[i], len(mesh), walker.weight
        bearing = [force.bears for force in contact.forces]
        # accelerations before the forces, reserves behind them
        still = np.zeros(walker.skeleton.size)
        algebraic = [still, np.where(bearing, weight / sum(bearing), 0.0), still]

        def states(at: np.ndarray) -> np.ndarray:
            return np.concatenate([self.coordinates(i, at), self.coordinates(i, at, 1)], axis=-1)

        return PhaseMotion(
            name=contact.name,
            duration=float(self.durations[i]),
            mesh=mesh,
            states=states(mesh),
            smooth=np.full((count, len(GENERATORS)), choices.START_ACTIVATION),
            controls=np.zeros((count, len(GENERATORS))),
            integrals=np.zeros((count, integrals)),
            inner_states=states(collocation_points(mesh, degree)),
            algebraic=np.tile(np.concatenate(algebraic), (count - 1, degree, 1)),
        )
