"""Direct multiple shooting: a shooting problem on a mesh becomes a nonlinear program.

Every mesh interval is an initial value problem from its own node; the controls are linear in it.
Error-controlled Runge-Kutta steps lead from node to node (`shooting_steps`), as rows of the program
(`shooting_blocks`).  Bounds and path rows stand at the nodes.
"""

from __future__ import annotations

import numpy as np

from pathwalker_cli.nlp.blocks import Occurrences
from pathwalker_cli.ocp.layout import Bounded
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import ProblemNumbers
from pathwalker_cli.ocp.shooting_blocks import ShootingBlocks
from pathwalker_cli.ocp.shooting_layout import ShootingPlaces, shooting_layout
from pathwalker_cli.ocp.shooting_motion import Shooter, ShootingNodes
from pathwalker_cli.ocp.shooting_steps import CASH_KARP, Edges
from pathwalker_cli.ocp.transcription import Transcription


class ShootingProgram(Transcription[ShootingPlaces]):
    """A shooting problem with its numbers on one mesh and one choice of steps.

    Steps of unequal number do not make groups of one size: IPOPT's own solver finds an order.

    Args:
        meshes: Node positions of every phase, from 0 to 1.
        edges: Ends of the steps in every interval, from 0 to 1, by phase and interval.
        rounding: How far kinks of the smooth states' equation are rounded off.
    """

    def __init__(
        self,
        blocks: ShootingBlocks,
        numbers: ProblemNumbers,
        meshes: tuple[np.ndarray, ...],
        edges: Edges,
        rounding: float = 0.0,
    ) -> None:
        self.blocks = blocks
        self.edges = edges
        self.rounding = rounding
        layout = shooting_layout(blocks.shooting, edges)
        super().__init__(blocks.problem, numbers, meshes, layout)

    def _occurrences(self) -> list[Occurrences]:
        found = [self._boundary_rows(self.blocks.boundary)]
        for i in range(len(self.meshes)):
            found += [self._residual_rows(i), self._step_rows(i), self._path_rows(i)]
            found.append(self._end_rows(i))
        return found

    def _bounded(self) -> list[Bounded]:
        """Return what is bounded at the nodes.

        Algebraic variables are not at the start of a phase, where they continue those of the phase
        before.
        """
        problem, shooting, layout = self.problem, self.blocks.shooting, self.layout
        found = [
            Bounded(layout.controls, shooting.controls.names),
            Bounded(layout.smooth[0], problem.smooth.names),
        ]
        for phase, at in zip(problem.phases, layout.phases, strict=True):
            ends = np.append(at.steps[at.starts[1:]], at.steps[-1])
            z = shooting.algebraic(phase).names
            found.append(Bounded(layout.states[ends], problem.states.names, phase.name))
            found.append(Bounded(layout.smooth[ends], problem.smooth.names, phase.name))
            found.append(Bounded(at.algebraic[at.starts[1:], 0], z, phase.name))
            found.append(Bounded(at.last, z, phase.name, end=True))
        return found

    def _residual_rows(self, i: int) -> Occurrences:
        """Return the equations for z at all stages and at the last instant of a phase."""
        phase, layout, at = self.problem.phases[i], self.layout, self.layout.phases[i]
        stages = [np.moveaxis(k, -1, 0).reshape(k.shape[-1], -1) for k in
                  (at.states, at.smooth, at.algebraic)]  # fmt: skip
        last = self._last_columns(i)
        parameters = np.tile(layout.parameters[:, None], stages[0].shape[1])
        columns = np.concatenate([np.concatenate([parameters, *stages]), last], axis=1)
        labels = [
            f"{phase.name} interval {n + 1} stage {k + 1}"
            for n in at.interval
            for k in range(CASH_KARP.stages)
        ]
        labels.append(self._label(i, 1.0))
        block = self.blocks.phases[i].residual
        return self._rows_at(block, phase.residual, columns, labels, phase.name)

    def _last_columns(self, i: int) -> np.ndarray:
        """Return the unknowns p, x, y, z of the last instant of a phase, shape (n, 1)."""
        layout, at = self.layout, self.layout.phases[i]
        end = at.steps[-1]
        parts = [layout.parameters, layout.states[end], layout.smooth[end], at.last]
        return np.concatenate(parts)[:, None]

    def _path_rows(self, i: int) -> Occurrences:
        """Return the path rows at all nodes but the first, where those of the phase before hold."""
        phase, layout, at = self.problem.phases[i], self.layout, self.layout.phases[i]
        inner = at.starts[1:]
        parts = [at.states[inner, 0], at.smooth[inner, 0], at.algebraic[inner, 0]]
        parameters = np.tile(layout.parameters, (len(inner), 1))
        columns = np.concatenate([np.concatenate([parameters, *parts], axis=1).T,
                                  self._last_columns(i)], axis=1)  # fmt: skip
        labels = [self._label(i, fraction) for fraction in self.meshes[i][1:]]
        block, free = self.blocks.phases[i].path, phase.fixed_at_end
        return self._rows_at(block, phase.path, columns, labels, phase.name, free)

    def _end_rows(self, i: int) -> Occurrences:
        phase, block = self.problem.phases[i], self.blocks.phases[i].end
        columns, labels = self._last_columns(i), [self._label(i, 1.0)]
        return self._rows_at(block, phase.end, columns, labels, phase.name)

    def _step_rows(self, i: int) -> Occurrences:
        """Return the formulae of all steps of a phase."""
        problem, mesh, at = self.problem, self.meshes[i], self.layout.phases[i]
        data, labels = [], []
        for m, n in enumerate(at.interval):
            begin, end = self.edges[i][n][m - at.starts[n] :][:2]
            length = mesh[n + 1] - mesh[n]
            points = mesh[n] + length * (begin + (end - begin) * CASH_KARP.times)
            given = [self.numbers.point_data(i, fraction) for fraction in points]
            step = [length * (end - begin), begin, end - begin, self.rounding]
            data.append(np.concatenate([step, *given]))
            labels.append(f"{problem.phases[i].name} interval {n + 1} step {m - at.starts[n] + 1}")
        where = [f"stage {k + 2}" for k in range(CASH_KARP.stages - 1)] + ["end"]
        groups = (problem.states, problem.smooth)
        names = [f"{s} at {k}" for k in where for group in groups for s in group.names]
        scale = np.tile(np.concatenate([group.scale for group in groups]), CASH_KARP.stages)
        zeros = np.zeros((len(names) + len(problem.integrals), len(data)))
        return Occurrences(
            self.blocks.phases[i].step,
            self._step_columns(i),
            np.array(data).T,
            zeros,
            zeros,
            np.concatenate([scale, problem.integral_scale]),
            [*names, *(f"integral {s}" for s in problem.integrals)],
            labels,
        )

    def _step_columns(self, i: int) -> np.ndarray:
        """Return the unknowns of every step of a phase, shape (n, M)."""
        layout, at = self.layout, self.layout.phases[i]
        once = np.append(layout.durations[i], layout.parameters)
        parts = [np.tile(once, (len(at.interval), 1))]
        for k in range(CASH_KARP.stages):
            parts += [at.states[:, k], at.smooth[:, k], at.algebraic[:, k]]
        parts += [layout.controls[at.nodes[at.interval + k]] for k in range(2)]
        left, right = at.steps[:-1], at.steps[1:]
        parts += [layout.integrals[left], layout.states[right], layout.smooth[right]]
        return np.concatenate([*parts, layout.integrals[right]], axis=1).T

    def from_nodes(self, nodes: ShootingNodes) -> np.ndarray:
        """Return scaled unknowns for values at the nodes, integrated in between."""
        problem, layout = self.problem, self.layout
        shooter = Shooter(self.blocks, self.numbers, nodes)
        values = np.zeros(layout.size)
        values[layout.durations] = nodes.durations
        values[layout.parameters] = nodes.parameters
        splits = np.cumsum([problem.states.size, problem.smooth.size])
        total = np.zeros(len(problem.integrals))
        for i, at in enumerate(layout.phases):
            values[layout.controls[at.nodes]] = nodes.controls[i]
            for n, first in enumerate(at.starts):
                steps = shooter.steps(i, n, self.edges[i][n])
                for m, step in enumerate(steps, start=first):
                    x, y, _ = np.split(step.stages, splits, axis=1)
                    times = step.begin + step.width * CASH_KARP.times
                    values[at.states[m]], values[at.smooth[m]] = x, y
                    values[at.algebraic[m]] = [
                        shooter.dynamics(i, n, time, state)[0]
                        for time, state in zip(times, step.stages, strict=True)
                    ]
                    values[layout.integrals[at.steps[m + 1]]] = total + step.end[splits[1] :]
                total = total + steps[-1].end[splits[1] :]
            last = np.concatenate([nodes.states[i][-1], nodes.smooth[i][-1], total])
            values[layout.states[at.steps[-1]]] = nodes.states[i][-1]
            values[layout.smooth[at.steps[-1]]] = nodes.smooth[i][-1]
            values[at.last] = shooter.dynamics(i, len(at.starts) - 1, 1.0, last)[0]
        return values / layout.scale

    def nodes(self, unknowns: np.ndarray) -> ShootingNodes:
        """Return the values at the nodes."""
        values, layout = unknowns * self.layout.scale, self.layout
        ends = [np.append(at.steps[at.starts], at.steps[-1]) for at in layout.phases]
        return ShootingNodes(
            self.meshes,
            values[layout.durations],
            values[layout.parameters],
            tuple(values[layout.states[k]] for k in ends),
            tuple(values[layout.smooth[k]] for k in ends),
            tuple(values[layout.controls[at.nodes]] for at in layout.phases),
        )

    def to_motion(self, unknowns: np.ndarray) -> PhasedMotion:
        """Return the motion, integrated from the nodes, with one interval for every step."""
        return Shooter(self.blocks, self.numbers, self.nodes(unknowns)).motion(self.edges)
