"""Direct collocation: a multi-phase problem on a mesh becomes a nonlinear program.

Neighbouring intervals and phases share their node, so continuity needs no rows.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pathwalker_cli.nlp.blocks import BlockProgram, Occurrences
from pathwalker_cli.nlp.elimination import Elimination, elimination_of
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.layout import Layout
from pathwalker_cli.ocp.phased import (
    PhasedMotion,
    PhaseMotion,
    collocation_times,
    lagrange_weights,
    quadrature_weights,
)
from pathwalker_cli.ocp.problem import INFINITY, ProblemNumbers, Rows

__all__ = ["CollocationProgram"]


class CollocationProgram:
    """A problem with its numbers on one mesh.

    Args:
        blocks: The blocks of the problem.
        numbers: The numbers of the problem.
        meshes: Node positions of every phase, from 0 to 1.
    """

    def __init__(
        self,
        blocks: CollocationBlocks,
        numbers: ProblemNumbers,
        meshes: tuple[np.ndarray, ...],
    ) -> None:
        self.blocks = blocks
        self.numbers = numbers
        self.meshes = meshes
        problem = blocks.problem
        self.layout = Layout.make(problem, meshes, blocks.degree)
        occurrences = [
            *self._phase_occurrences(),
            self._node_rows(),
            self._boundary_rows(),
            self._samples(),
        ]
        self.program = BlockProgram(self.layout.size, occurrences, problem.shared.numel())

    @property
    def parameters(self) -> np.ndarray:
        """Parameter vector of the nonlinear program."""
        return self.program.parameters(self.numbers.shared)

    def _phase_occurrences(self) -> list[Occurrences]:
        return [
            occurrence
            for i in range(len(self.meshes))
            for occurrence in (
                self._interval_rows(i),
                self._point_rows(i, "residual"),
                self._point_rows(i, "path"),
                self._end_rows(i),
            )
        ]

    def _label(self, i: int, fraction: float) -> str:
        return f"{self.blocks.problem.phases[i].name} at {100 * fraction:.0f} % of the phase"

    def _point_columns(self, i: int) -> np.ndarray:
        """Return the unknowns of every point of a phase, shape (n, N * d)."""
        layout, d = self.layout, self.blocks.degree
        places = layout.phases[i]
        count = len(self.meshes[i]) - 1
        once = np.concatenate([[layout.durations[i]], layout.parameters])
        columns = []
        for n in range(count):
            left, right = places.nodes[n], places.nodes[n + 1]
            for k in range(d):
                point = [places.inner_states[n, k], places.algebraic[n, k]]
                ends = [layout.smooth[left], layout.controls[left], layout.controls[right]]
                columns.append(np.concatenate([once, *point, *ends]))
        return np.array(columns).T

    @cached_property
    def _points(self) -> tuple[tuple[np.ndarray, np.ndarray], ...]:
        """Fractions (N, d) and data (2 + m, N, d) of the points of every phase."""
        return tuple(self._point_data(i) for i in range(len(self.meshes)))

    def _point_data(self, i: int) -> tuple[np.ndarray, np.ndarray]:
        """Return fractions of the phase (N, d) and data (2 + m, N, d) of its points."""
        mesh, times = self.meshes[i], collocation_times(self.blocks.degree)
        steps = np.diff(mesh)
        fractions = mesh[:-1, None] + steps[:, None] * times
        data = np.array([[self.numbers.point_data(i, f) for f in row] for row in fractions])
        head = np.array(np.broadcast_arrays(steps[:, None], times[None, :]))
        return fractions, np.concatenate([head, np.moveaxis(data, -1, 0)])

    def _point_weights(self, i: int) -> np.ndarray:
        """Return the quadrature weights of the points of a phase, shape (N, d)."""
        _, weights = quadrature_weights(self.blocks.degree)
        return np.asarray(np.diff(self.meshes[i])[:, None] * weights)

    def _point_rows(self, i: int, kind: str) -> Occurrences:
        phase = self.blocks.problem.phases[i]
        rows: Rows = getattr(phase, kind)
        fractions, data = self._points[i]
        count = fractions.size
        lower, upper = self.numbers.bounds.of_rows(rows, phase.name)
        lower, upper = (np.tile(k[:, None], count) for k in (lower, upper))
        fixed = [k for k, name in enumerate(rows.names) if name in phase.fixed_at_end]
        lower[fixed, -1], upper[fixed, -1] = -INFINITY, INFINITY
        return Occurrences(
            getattr(self.blocks.phases[i], kind),
            self._point_columns(i),
            data.reshape(len(data), -1),
            lower,
            upper,
            rows.scale,
            rows.names,
            [self._label(i, f) for f in fractions.ravel()],
            times=np.tile(fractions.ravel(), (len(rows.names), 1)),
            weights=np.tile(self._point_weights(i).ravel(), (len(rows.names), 1)),
        )

    def _end_rows(self, i: int) -> Occurrences:
        phase = self.blocks.problem.phases[i]
        _, data = self._points[i]
        lower, upper = self.numbers.bounds.of_rows(phase.end, phase.name)
        return Occurrences(
            self.blocks.phases[i].end,
            self._point_columns(i)[:, -1:],
            data[:, -1, -1:],
            lower[:, None],
            upper[:, None],
            phase.end.scale,
            phase.end.names,
            [self._label(i, 1.0)],
        )

    def _interval_rows(self, i: int) -> Occurrences:
        problem, layout, d = self.blocks.problem, self.layout, self.blocks.degree
        places, mesh = layout.phases[i], self.meshes[i]
        count = len(mesh) - 1
        columns = []
        for n in range(count):
            left, right = places.nodes[n], places.nodes[n + 1]
            parts = [[layout.durations[i]], layout.parameters, layout.states[left]]
            for k in range(d):
                parts += [places.inner_states[n, k], places.algebraic[n, k]]
            for node in (left, right):
                parts += [layout.smooth[node], layout.controls[node], layout.integrals[node]]
            columns.append(np.concatenate(parts))
        _, data = self._points[i]
        points = np.moveaxis(data[2:], 0, -1).reshape(count, -1)
        names = [f"{s} rate at point {k + 1}" for k in range(d) for s in problem.states.names]
        names += [f"{s} rate" for s in problem.smooth.names]
        names += [f"integral {s}" for s in problem.integrals]
        zeros = np.zeros((len(names), count))
        tail = (problem.smooth.scale, problem.integral_scale)
        nx, rest = problem.states.size, problem.smooth.size + len(problem.integrals)
        times, radau = quadrature_weights(d)
        points_at = mesh[:-1, None] + np.diff(mesh)[:, None] * times
        return Occurrences(
            self.blocks.phases[i].interval,
            np.array(columns).T,
            np.concatenate([np.diff(mesh)[None, :], points.T]),
            zeros,
            zeros,
            np.concatenate([np.tile(problem.states.scale, d), *tail]),
            names,
            [self._label(i, f) for f in mesh[:-1]],
            times=np.concatenate(
                [np.repeat(points_at.T, nx, axis=0), np.tile(mesh[1:], (rest, 1))]
            ),
            weights=np.repeat([*radau, *[1.0] * rest], [nx] * d + [1] * rest)[:, None]
            * np.ones(count),
            series=tuple(name.split(" at point ")[0] for name in names),
        )

    def _node_rows(self) -> Occurrences:
        rows, layout = self.blocks.problem.node_rows, self.layout
        lower, upper = self.numbers.bounds.of_rows(rows)
        count = len(layout.smooth)
        labels, times, weights = [""] * count, np.zeros(count), np.zeros(count)
        for i, places in enumerate(layout.phases):
            steps = np.diff(self.meshes[i])
            weights[places.nodes[:-1]] += steps / 2
            weights[places.nodes[1:]] += steps / 2
            times[places.nodes] = i + self.meshes[i]
            for node, fraction in zip(places.nodes, self.meshes[i], strict=True):
                labels[node] = self._label(i, fraction)
        return Occurrences(
            self.blocks.node,
            np.concatenate([layout.smooth, layout.controls], axis=1).T,
            np.zeros((0, count)),
            np.tile(lower[:, None], count),
            np.tile(upper[:, None], count),
            rows.scale,
            rows.names,
            labels,
            times=np.tile(times, (len(rows.names), 1)),
            weights=np.tile(weights, (len(rows.names), 1)),
        )

    def _samples(self) -> Occurrences:
        """Return the instants at which the motion is compared with something."""
        samples = self.numbers.samples
        nodes = np.concatenate([[0.0], collocation_times(self.blocks.degree)])
        columns, data = [], []
        for sample in samples:
            mesh, places = self.meshes[sample.phase], self.layout.phases[sample.phase]
            n = int(np.clip(np.searchsorted(mesh, sample.fraction, "right") - 1, 0, len(mesh) - 2))
            local = (sample.fraction - mesh[n]) / (mesh[n + 1] - mesh[n])
            states = [self.layout.states[places.nodes[n]], *places.inner_states[n]]
            columns.append(np.concatenate(states))
            weights = lagrange_weights(nodes, np.array([local]))[0]
            data.append(np.concatenate([weights, sample.data]))
        none = np.zeros((0, len(samples)))
        return Occurrences(
            self.blocks.sample,
            np.array(columns).T if samples else none,
            np.array(data).T if samples else none,
            none,
            none,
            np.zeros(0),
            (),
            [self._label(sample.phase, sample.fraction) for sample in samples],
        )

    def _boundary_rows(self) -> Occurrences:
        rows, layout = self.blocks.problem.boundary.rows, self.layout
        lower, upper = self.numbers.bounds.of_rows(rows)
        ends = [
            array[node]
            for node in (0, -1)
            for array in (layout.states, layout.smooth, layout.controls)
        ]
        columns = np.concatenate([layout.durations, layout.parameters, *ends, layout.integrals[-1]])
        return Occurrences(
            self.blocks.boundary,
            columns[:, None],
            np.zeros((0, 1)),
            lower[:, None],
            upper[:, None],
            rows.scale,
            rows.names,
            ["the whole motion"],
        )

    @property
    def elimination(self) -> Elimination:
        """Order in which a Newton step's unknowns are eliminated."""
        return elimination_of(self)

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of all unknowns."""
        return self.layout.bounds(self.blocks.problem, self.numbers.bounds)

    def to_unknowns(self, motion: PhasedMotion) -> np.ndarray:
        """Return the scaled unknowns of a motion on this mesh and degree."""
        values = np.zeros(self.layout.size)
        values[self.layout.parameters] = motion.parameters
        values[self.layout.durations] = motion.durations
        for places, phase in zip(self.layout.phases, motion.phases, strict=True):
            nodes = places.nodes
            values[self.layout.states[nodes]] = phase.states
            values[self.layout.smooth[nodes]] = phase.smooth
            values[self.layout.controls[nodes]] = phase.controls
            values[self.layout.integrals[nodes]] = phase.integrals
            values[places.inner_states] = phase.inner_states
            values[places.algebraic] = phase.algebraic
        return values / self.layout.scale

    def to_motion(self, unknowns: np.ndarray) -> PhasedMotion:
        """Return the motion that scaled unknowns stand for."""
        values, layout = unknowns * self.layout.scale, self.layout
        phases = []
        for i, places in enumerate(layout.phases):
            nodes = places.nodes
            phases.append(
                PhaseMotion(
                    name=self.blocks.problem.phases[i].name,
                    duration=float(values[layout.durations[i]]),
                    mesh=self.meshes[i],
                    states=values[layout.states[nodes]],
                    smooth=values[layout.smooth[nodes]],
                    controls=values[layout.controls[nodes]],
                    integrals=values[layout.integrals[nodes]],
                    inner_states=values[places.inner_states],
                    algebraic=values[places.algebraic],
                )
            )
        return PhasedMotion(tuple(phases), values[layout.parameters])
