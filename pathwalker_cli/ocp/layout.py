"""Where every unknown of a collocation program stands in its vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.ocp.problem import BoundTable, MultiPhaseProblem
from pathwalker_cli.ocp.unknowns import PlaceBook

__all__ = ["Layout", "PhasePlaces"]


@dataclass(frozen=True)
class PhasePlaces:
    """Places of one phase with N intervals of d points.

    Args:
        nodes: Node numbers, shape (N + 1,).
        inner_states: x at the points, shape (N, d, nx); the last point is the next node.
        algebraic: z at the points, shape (N, d, nz).
    """

    nodes: np.ndarray
    inner_states: np.ndarray
    algebraic: np.ndarray


@dataclass(frozen=True)
class Layout:
    """Places of all unknowns, ordered by time.

    Args:
        size: Number of unknowns.
        scale: Physical units per solver unit, shape (size,).
        names: Name of every unknown, for reports.
        durations: Phase durations, shape (phases,).
        parameters: Free parameters, shape (np,).
        states: x at the nodes, shape (nodes, nx).
        smooth: y at the nodes, shape (nodes, ny).
        controls: u at the nodes, shape (nodes, nu).
        integrals: Running costs at the nodes, shape (nodes, ni).
        phases: Places of each phase.
    """

    size: int
    scale: np.ndarray
    names: tuple[str, ...]
    durations: np.ndarray
    parameters: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    controls: np.ndarray
    integrals: np.ndarray
    phases: tuple[PhasePlaces, ...]

    @classmethod
    def make(
        cls, problem: MultiPhaseProblem, meshes: tuple[np.ndarray, ...], degree: int
    ) -> Layout:
        """Return the layout of a problem on a mesh."""
        return _Builder(problem).build(meshes, degree)

    def bounds(
        self, problem: MultiPhaseProblem, table: BoundTable
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return scaled lower and upper bounds of all unknowns."""
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)

        def put(
            places: np.ndarray, names: tuple[str, ...], phase: str = "", end: bool = False
        ) -> None:
            low, high = table.arrays(names, phase, end)
            lower[places], upper[places] = low, high

        put(self.parameters, problem.parameters.names)
        put(self.smooth, problem.smooth.names)
        put(self.controls, problem.controls.names)
        for i, (phase, places) in enumerate(zip(problem.phases, self.phases, strict=True)):
            put(self.durations[i : i + 1], ("duration",), phase.name)
            put(places.inner_states, problem.states.names, phase.name)
            put(places.algebraic, phase.algebraic.names, phase.name)
            put(places.algebraic[-1, -1], phase.algebraic.names, phase.name, end=True)
        put(self.states[0], problem.states.names, "first")
        put(self.integrals, problem.integrals)
        lower[self.integrals[0]] = upper[self.integrals[0]] = 0.0
        return lower / self.scale, upper / self.scale


class _Builder(PlaceBook):
    """Hands out places in the order of time."""

    def __init__(self, problem: MultiPhaseProblem) -> None:
        super().__init__()
        self.problem = problem

    def build(self, meshes: tuple[np.ndarray, ...], degree: int) -> Layout:
        problem = self.problem
        durations = np.concatenate(
            [self.take(("duration",), np.ones(1), phase.name) for phase in problem.phases]
        )
        parameters = self.take(problem.parameters.names, problem.parameters.scale, "all phases")
        nodes = [self._node(f"{problem.phases[0].name} at 0 % of the phase")]
        phases = []
        for phase, mesh in zip(problem.phases, meshes, strict=True):
            first, inner, algebraic = len(nodes) - 1, [], []
            for n in range(len(mesh) - 1):
                where = f"{phase.name} at {100 * mesh[n + 1]:.0f} % of the phase"
                points = [
                    self.take(problem.states.names, problem.states.scale, where)
                    for _ in range(degree - 1)
                ]
                algebraic.append(
                    [
                        self.take(phase.algebraic.names, phase.algebraic.scale, where)
                        for _ in range(degree)
                    ]
                )
                nodes.append(self._node(where))
                inner.append([*points, nodes[-1][0]])
            numbers = np.arange(first, len(nodes))
            phases.append(PhasePlaces(numbers, np.array(inner), np.array(algebraic)))
        states, smooth, controls, integrals = (
            np.array([node[k] for node in nodes]) for k in range(4)
        )
        return Layout(
            len(self.scale),
            np.array(self.scale),
            tuple(self.names),
            durations,
            parameters,
            states,
            smooth,
            controls,
            integrals,
            tuple(phases),
        )

    def _node(self, where: str) -> tuple[np.ndarray, ...]:
        """Return places of x, y, u and the running costs of a node."""
        p = self.problem
        return (
            self.take(p.states.names, p.states.scale, where),
            self.take(p.smooth.names, p.smooth.scale, where),
            self.take(p.controls.names, p.controls.scale, where),
            self.take(p.integrals, p.integral_scale, where),
        )
