"""What a shooting program starts from and ends with: values at nodes, and integration from them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, collocation_times
from pathwalker_cli.ocp.problem import ProblemNumbers
from pathwalker_cli.ocp.shooting_blocks import ShootingBlocks, ShootingProblem
from pathwalker_cli.ocp.shooting_steps import Edges, Slope, Step, adaptive_steps, fixed_steps


@dataclass(frozen=True)
class ShootingNodes:
    """Values at the nodes; everything in between follows from them by integration.

    Args:
        meshes: Node positions of every phase, from 0 to 1, shape (N + 1,) each.
        durations: Phase durations [s], shape (phases,).
        parameters: p, shape (np,).
        states: x at the nodes of every phase, shape (N + 1, nx) each.
        smooth: y at the nodes of every phase, shape (N + 1, ny) each.
        controls: e at the nodes of every phase, shape (N + 1, ne) each.
    """

    meshes: tuple[np.ndarray, ...]
    durations: np.ndarray
    parameters: np.ndarray
    states: tuple[np.ndarray, ...]
    smooth: tuple[np.ndarray, ...]
    controls: tuple[np.ndarray, ...]

    @classmethod
    def of(cls, shooting: ShootingProblem, motion: PhasedMotion) -> ShootingNodes:
        """Return the values of a motion at its nodes."""
        return cls(
            motion.meshes,
            motion.durations,
            motion.parameters,
            tuple(phase.states for phase in motion.phases),
            tuple(phase.smooth for phase in motion.phases),
            tuple(shooting.controls_of(phase.controls, phase.smooth) for phase in motion.phases),
        )


class Shooter:
    """Integrates the intervals of a shooting problem, each from its first node.

    Time runs from 0 to 1 in every interval; the state X is (x, y, running costs since the node).
    """

    def __init__(
        self, blocks: ShootingBlocks, numbers: ProblemNumbers, nodes: ShootingNodes
    ) -> None:
        self.blocks = blocks
        self.numbers = numbers
        self.nodes = nodes
        problem = blocks.problem
        self._nx, self._ny = problem.states.size, problem.smooth.size
        self._costs = len(problem.integrals)
        self._scale = np.concatenate(
            [problem.states.scale, problem.smooth.scale, np.full(self._costs, np.inf)]
        )

    def start(self, i: int, n: int) -> np.ndarray:
        """Return X at the first node of interval n of phase i, or at the last of n - 1."""
        nodes = self.nodes
        return np.concatenate([nodes.states[i][n], nodes.smooth[i][n], np.zeros(self._costs)])

    def dynamics(self, i: int, n: int, at: float, state: np.ndarray) -> tuple[np.ndarray, ...]:
        """Return z and dX/dt [1/s] in interval n of phase i."""
        nodes, mesh = self.nodes, self.nodes.meshes[i]
        left, right = nodes.controls[i][n : n + 2]
        x, y, _ = np.split(state, [self._nx, self._nx + self._ny])
        data = self.numbers.point_data(i, mesh[n] + at * (mesh[n + 1] - mesh[n]))
        e = left + at * (right - left)
        function = self.blocks.phases[i].dynamics
        outputs = function(x, y, e, nodes.parameters, self.numbers.shared, data)
        return tuple(np.asarray(k).ravel() for k in outputs)

    def slope(self, i: int, n: int) -> Slope:
        """Return the right-hand side of interval n of phase i, per length of the interval."""
        step = self.nodes.durations[i] * np.diff(self.nodes.meshes[i])[n]
        return lambda at, state: step * self.dynamics(i, n, at, state)[1]

    def steps(self, i: int, n: int, edges: np.ndarray) -> tuple[Step, ...]:
        """Return the steps of interval n of phase i between given edges."""
        return fixed_steps(self.slope(i, n), self.start(i, n), edges, self._scale)

    def ends(self, i: int, n: int, tolerance: float) -> np.ndarray:
        """Return edges of steps in interval n of phase i with errors below a tolerance."""
        start, span = self.start(i, n), (0.0, 1.0)
        steps = adaptive_steps(self.slope(i, n), start, span, self._scale, tolerance)
        return np.array([*(step.begin for step in steps), 1.0])

    def choose(self, tolerance: float) -> Edges:
        """Return edges of steps whose error estimates are below a tolerance."""
        counts = [len(mesh) - 1 for mesh in self.nodes.meshes]
        return tuple(
            tuple(self.ends(i, n, tolerance) for n in range(count))
            for i, count in enumerate(counts)
        )

    def defect(self, edges: Edges) -> float:
        """Return the largest gap between the end of an interval and its node, in scale units."""
        gaps = (steps[-1].end - self.start(i, n + 1) for i, n, steps in self._intervals(edges))
        return float(max(np.abs(gap / self._scale).max() for gap in gaps))

    def error(self, edges: Edges) -> float:
        """Return the largest error estimate of all steps, in units of the scales."""
        return max(step.error for _, _, steps in self._intervals(edges) for step in steps)

    def _intervals(self, edges: Edges) -> Iterator[tuple[int, int, tuple[Step, ...]]]:
        """Yield phase, interval and steps of all intervals."""
        for i, intervals in enumerate(edges):
            for n, ends in enumerate(intervals):
                yield i, n, self.steps(i, n, ends)

    def motion(self, edges: Edges, degree: int = 3) -> PhasedMotion:
        """Return the motion on a mesh of all steps, with Radau points in each, as if collocated."""
        costs = np.zeros(self._costs)
        phases = []
        for i, intervals in enumerate(edges):
            phases.append(self._phase_motion(i, intervals, costs, degree))
            costs = phases[-1].integrals[-1]
        return PhasedMotion(tuple(phases), self.nodes.parameters)

    def _phase_motion(
        self, i: int, intervals: tuple[np.ndarray, ...], costs: np.ndarray, degree: int
    ) -> PhaseMotion:
        mesh = self.nodes.meshes[i]
        positions, ends, rates, inner, algebraic = [], [], [], [], []
        for n, edges in enumerate(intervals):
            points = edges[:-1, None] + np.diff(edges)[:, None] * collocation_times(degree)
            state = np.concatenate([self.start(i, n)[: -self._costs], costs])
            for begin, row in zip(edges[:-1], points, strict=True):
                positions.append(mesh[n] + begin * (mesh[n + 1] - mesh[n]))
                ends.append(state)
                rates.append(self.dynamics(i, n, begin, state)[1])
                steps = fixed_steps(self.slope(i, n), state, np.array([begin, *row]), self._scale)
                inner.append([step.end for step in steps])
                pairs = zip(row, steps, strict=True)
                algebraic.append([self.dynamics(i, n, at, step.end)[0] for at, step in pairs])
                state = steps[-1].end
            costs = state[-self._costs :]
        last = np.concatenate([self.nodes.states[i][-1], self.nodes.smooth[i][-1], costs])
        rates.append(self.dynamics(i, len(intervals) - 1, 1.0, last)[1])
        states, smooth, integrals = self._split(np.array([*ends, last]))
        z = np.array(algebraic)
        phase = self.blocks.problem.phases[i]
        rest = np.zeros((*z.shape[:2], phase.algebraic.size - z.shape[2]))
        return PhaseMotion(
            name=phase.name,
            duration=float(self.nodes.durations[i]),
            mesh=np.array([*positions, 1.0]),
            states=states,
            smooth=smooth,
            controls=self._split(np.array(rates))[1],
            integrals=integrals,
            inner_states=self._split(np.array(inner))[0],
            algebraic=np.concatenate([z, rest], axis=2),
        )

    def _split(self, values: np.ndarray) -> list[np.ndarray]:
        """Return the parts of X along the last axis: x, y, running costs."""
        return np.split(values, [self._nx, self._nx + self._ny], axis=-1)
