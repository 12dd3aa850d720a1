"""Where every unknown of a multiple-shooting program stands in its vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.ocp.problem import BoundTable, Variables
from pathwalker_cli.ocp.shooting_blocks import ShootingProblem
from pathwalker_cli.ocp.shooting_steps import CASH_KARP
from pathwalker_cli.ocp.unknowns import PlaceBook

__all__ = ["ShootingLayout", "ShootingPlaces"]


@dataclass(frozen=True)
class ShootingPlaces:
    """Places of one phase with N intervals and M steps of s stages.

    Args:
        nodes: Numbers of the mesh nodes, shape (N + 1,).
        interval: Interval of each step, shape (M,).
        starts: First step of each interval, shape (N,).
        steps: Numbers of the ends of the steps, shape (M + 1,).
        states: x at the stages, shape (M, s, nx); the first stage is the start of the step.
        smooth: y at the stages, shape (M, s, ny).
        algebraic: z at the stages, shape (M, s, nz).
        last: z at the last instant of the phase, shape (nz,).
    """

    nodes: np.ndarray
    interval: np.ndarray
    starts: np.ndarray
    steps: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    algebraic: np.ndarray
    last: np.ndarray


@dataclass(frozen=True)
class ShootingLayout:
    """Places of all unknowns, ordered by time.

    Args:
        size: Number of unknowns.
        scale: Physical units per solver unit, shape (size,).
        names: Name of every unknown, for reports.
        durations: Phase durations, shape (phases,).
        parameters: Free parameters, shape (np,).
        states: x at the ends of all steps, shape (ends, nx).
        smooth: y at the ends of all steps, shape (ends, ny).
        integrals: Running costs at the ends of all steps, shape (ends, ni).
        controls: e at the nodes, shape (nodes, ne).
        phases: Places of each phase.
    """

    size: int
    scale: np.ndarray
    names: tuple[str, ...]
    durations: np.ndarray
    parameters: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    integrals: np.ndarray
    controls: np.ndarray
    phases: tuple[ShootingPlaces, ...]

    @classmethod
    def make(
        cls, shooting: ShootingProblem, edges: tuple[tuple[np.ndarray, ...], ...]
    ) -> ShootingLayout:
        """Return the layout for ends of steps in [0, 1], by phase and interval."""
        return _Builder(shooting).build(edges)

    def bounds(self, shooting: ShootingProblem, table: BoundTable) -> tuple[np.ndarray, np.ndarray]:
        """Return scaled lower and upper bounds of all unknowns.

        States, smooth states and controls are bounded at the nodes, algebraic variables there but
        for the start of a phase, where they continue those of the phase before.
        """
        lower, upper = np.full(self.size, -np.inf), np.full(self.size, np.inf)
        problem = shooting.problem

        def put(
            places: np.ndarray, names: tuple[str, ...], phase: str = "", end: bool = False
        ) -> None:
            lower[places], upper[places] = table.arrays(names, phase, end)

        put(self.parameters, problem.parameters.names)
        put(self.controls, shooting.controls.names)
        put(self.smooth[0], problem.smooth.names)
        for i, (phase, at) in enumerate(zip(problem.phases, self.phases, strict=True)):
            put(self.durations[i : i + 1], ("duration",), phase.name)
            ends = np.append(at.steps[at.starts[1:]], at.steps[-1])
            put(self.states[ends], problem.states.names, phase.name)
            put(self.smooth[ends], problem.smooth.names, phase.name)
            names = shooting.algebraic(phase).names
            put(at.algebraic[at.starts[1:], 0], names, phase.name)
            put(at.last, names, phase.name, end=True)
        put(self.states[0], problem.states.names, "first")
        lower[self.integrals[0]] = upper[self.integrals[0]] = 0.0
        return lower / self.scale, upper / self.scale


class _Builder(PlaceBook):
    """Hands out places in the order of time."""

    def __init__(self, shooting: ShootingProblem) -> None:
        super().__init__()
        self.shooting = shooting
        self.problem = shooting.problem
        self.ends: list[tuple[np.ndarray, ...]] = []
        self.controls: list[np.ndarray] = []

    def _take(self, variables: Variables, where: str) -> np.ndarray:
        return self.take(variables.names, variables.scale, where)

    def _end(self, where: str) -> None:
        """Take x, y and the running costs at the end of a step."""
        p = self.problem
        integrals = self.take(p.integrals, p.integral_scale, where)
        self.ends.append((self._take(p.states, where), self._take(p.smooth, where), integrals))

    def build(self, edges: tuple[tuple[np.ndarray, ...], ...]) -> ShootingLayout:
        problem, names = self.problem, [phase.name for phase in self.problem.phases]
        durations = [self.take(("duration",), np.ones(1), name) for name in names]
        parameters = self._take(problem.parameters, "all phases")
        start = f"{names[0]} at 0 % of the phase"
        self._end(start)
        self.controls.append(self._take(self.shooting.controls, start))
        phases = tuple(self._phase(i, intervals) for i, intervals in enumerate(edges))
        states, smooth, integrals = (np.array([end[k] for end in self.ends]) for k in range(3))
        return ShootingLayout(
            len(self.scale),
            np.array(self.scale),
            tuple(self.names),
            np.concatenate(durations),
            parameters,
            states,
            smooth,
            integrals,
            np.array(self.controls),
            phases,
        )

    def _phase(self, i: int, intervals: tuple[np.ndarray, ...]) -> ShootingPlaces:
        phase = self.problem.phases[i]
        algebraic = self.shooting.algebraic(phase)
        first_node, first_end = len(self.controls) - 1, len(self.ends) - 1
        states, smooth, z, interval = [], [], [], []
        for n, ends in enumerate(intervals):
            for k in range(len(ends) - 1):
                where = f"{phase.name} interval {n + 1} step {k + 1}"
                x, y, _ = self.ends[-1]
                inner = range(CASH_KARP.stages - 1)
                states.append([x, *(self._take(self.problem.states, where) for _ in inner)])
                smooth.append([y, *(self._take(self.problem.smooth, where) for _ in inner)])
                z.append([self._take(algebraic, where) for _ in range(CASH_KARP.stages)])
                interval.append(n)
                self._end(where)
            self.controls.append(self._take(self.shooting.controls, where))
        return ShootingPlaces(
            nodes=np.arange(first_node, len(self.controls)),
            interval=np.array(interval),
            starts=np.searchsorted(interval, np.arange(len(intervals))),
            steps=np.arange(first_end, len(self.ends)),
            states=np.array(states),
            smooth=np.array(smooth),
            algebraic=np.array(z),
            last=self._take(algebraic, f"{phase.name} at 100 % of the phase"),
        )
