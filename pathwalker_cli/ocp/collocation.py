"""Direct collocation: a multi-phase problem on a mesh becomes a nonlinear program.

Neighbouring intervals and phases share their node, so continuity needs no rows.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pathwalker_cli.nlp.blocks import Occurrences
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.elimination import StageKeys
from pathwalker_cli.ocp.layout import NODE, Bounded, Layout, PhasePlaces, collocation_layout
from pathwalker_cli.ocp.phased import (
    PhasedMotion,
    PhaseMotion,
    collocation_times,
    lagrange_weights,
    quadrature_weights,
)
from pathwalker_cli.ocp.problem import ProblemNumbers
from pathwalker_cli.ocp.transcription import Transcription


class CollocationProgram(Transcription[PhasePlaces]):
    """A problem with its numbers on one mesh.

    Args:
        meshes: Node positions of every phase, from 0 to 1.
        layout: Places of the unknowns, if they are known.
    """

    def __init__(
        self,
        blocks: CollocationBlocks,
        numbers: ProblemNumbers,
        meshes: tuple[np.ndarray, ...],
        layout: Layout[PhasePlaces] | None = None,
    ) -> None:
        self.blocks = blocks
        layout = layout or collocation_layout(blocks.problem, meshes, blocks.degree)
        super().__init__(blocks.problem, numbers, meshes, layout)

    def with_numbers(self, numbers: ProblemNumbers) -> CollocationProgram:
        """Return the program with other numbers; both evaluate the same functions."""
        program = CollocationProgram(self.blocks, numbers, self.meshes, self.layout)
        program.functions = self.functions
        return program

    def _occurrences(self) -> list[Occurrences]:
        phases = [
            occurrence
            for i in range(len(self.meshes))
            for occurrence in (
                self._interval_rows(i),
                self._point_rows(i, "residual"),
                self._point_rows(i, "path"),
                self._end_rows(i),
            )
        ]
        boundary = self._boundary_rows(self.blocks.boundary)
        return [*phases, self._node_rows(), boundary, self._samples()]

    def _bounded(self) -> list[Bounded]:
        problem, layout = self.problem, self.layout
        found = [
            Bounded(layout.smooth, problem.smooth.names),
            Bounded(layout.controls, problem.controls.names),
            Bounded(layout.integrals, problem.integrals),
        ]
        for phase, places in zip(problem.phases, layout.phases, strict=True):
            names, last = phase.algebraic.names, places.algebraic[-1, -1]
            found.append(Bounded(places.inner_states, problem.states.names, phase.name))
            found.append(Bounded(places.algebraic, names, phase.name))
            found.append(Bounded(last, names, phase.name, end=True))
        return found

    @cached_property
    def elimination_keys(self) -> tuple[np.ndarray, np.ndarray]:
        """Group, and place within it, of every unknown (n, 2) and row (m, 2)."""
        return StageKeys(self.layout, self.blocks, self.rows, self.rows_of).keys()

    def _once(self, i: int, count: int) -> np.ndarray:
        """Return the places of duration and free parameters, shape (count, 1 + np)."""
        once = np.append(self.layout.durations[i], self.layout.parameters)
        return np.tile(once, (count, 1))

    def _point_columns(self, i: int) -> np.ndarray:
        """Return the unknowns of every point of a phase, shape (n, N * d)."""
        layout, places = self.layout, self.layout.phases[i]
        left, right = (np.repeat(k, self.blocks.degree) for k in _ends(places))
        parts = [self._once(i, len(left))]
        parts += [k.reshape(len(left), -1) for k in (places.inner_states, places.algebraic)]
        parts += [layout.smooth[left], layout.controls[left], layout.controls[right]]
        return np.concatenate(parts, axis=1).T

    @cached_property
    def _points(self) -> list[tuple[np.ndarray, np.ndarray]]:
        """Fractions (N, d) and data (2 + m, N, d) of the points of every phase."""
        times, found = collocation_times(self.blocks.degree), []
        for i, mesh in enumerate(self.meshes):
            steps = np.diff(mesh)[:, None]
            fractions = mesh[:-1, None] + steps * times
            data = np.array([[self.numbers.point_data(i, f) for f in row] for row in fractions])
            head = np.array(np.broadcast_arrays(steps, times))
            found.append((fractions, np.concatenate([head, np.moveaxis(data, -1, 0)])))
        return found

    def _point_rows(self, i: int, kind: str) -> Occurrences:
        """Return the residual or path rows at all points of a phase."""
        phase, (fractions, data) = self.problem.phases[i], self._points[i]
        _, weights = quadrature_weights(self.blocks.degree)
        return self._rows_at(
            getattr(self.blocks.phases[i], kind),
            getattr(phase, kind),
            self._point_columns(i),
            [self._label(i, f) for f in fractions.ravel()],
            phase.name,
            phase.fixed_at_end,
            data.reshape(len(data), -1),
            times=fractions.ravel(),
            weights=(np.diff(self.meshes[i])[:, None] * weights).ravel(),
        )

    def _end_rows(self, i: int) -> Occurrences:
        phase, block, label = self.problem.phases[i], self.blocks.phases[i].end, self._label(i, 1.0)
        columns, data = self._point_columns(i)[:, -1:], self._points[i][1][:, -1, -1:]
        return self._rows_at(block, phase.end, columns, [label], phase.name, data=data)

    def _interval_rows(self, i: int) -> Occurrences:
        problem, d, mesh = self.problem, self.blocks.degree, self.meshes[i]
        count = len(mesh) - 1
        fractions, data = self._points[i]
        points = np.moveaxis(data[2:], 0, -1).reshape(count, -1)
        names = [f"{s} rate at point {k + 1}" for k in range(d) for s in problem.states.names]
        names += [f"{s} rate" for s in problem.smooth.names]
        names += [f"integral {s}" for s in problem.integrals]
        zeros = np.zeros((len(names), count))
        tail = (problem.smooth.scale, problem.integral_scale)
        nx, rest = problem.states.size, problem.smooth.size + len(problem.integrals)
        _, radau = quadrature_weights(d)
        weights = np.repeat([*radau, *[1.0] * rest], [nx] * d + [1] * rest)
        ends = np.tile(mesh[1:], (rest, 1))
        return Occurrences(
            self.blocks.phases[i].interval,
            self._interval_columns(i),
            np.concatenate([np.diff(mesh)[None, :], points.T]),
            zeros,
            zeros,
            np.concatenate([np.tile(problem.states.scale, d), *tail]),
            names,
            [self._label(i, f) for f in mesh[:-1]],
            times=np.concatenate([np.repeat(fractions.T, nx, axis=0), ends]),
            weights=weights[:, None],
            series=tuple(name.split(" at point ")[0] for name in names),
        )

    def _interval_columns(self, i: int) -> np.ndarray:
        """Return the unknowns of every interval of a phase, shape (n, N)."""
        layout, places = self.layout, self.layout.phases[i]
        left, right = _ends(places)
        parts = [self._once(i, len(left)), layout.states[left]]
        for k in range(self.blocks.degree):
            parts += [places.inner_states[:, k], places.algebraic[:, k]]
        for node in (left, right):
            parts += [layout.smooth[node], layout.controls[node], layout.integrals[node]]
        return np.concatenate(parts, axis=1).T

    def _node_rows(self) -> Occurrences:
        layout = self.layout
        count = len(layout.smooth)
        labels, times, weights = [""] * count, np.zeros(count), np.zeros(count)
        for i, (mesh, places) in enumerate(zip(self.meshes, layout.phases, strict=True)):
            for nodes in _ends(places):
                weights[nodes] += np.diff(mesh) / 2
            times[places.nodes] = i + mesh
            for node, fraction in zip(places.nodes, mesh, strict=True):
                labels[node] = self._label(i, fraction)
        columns = np.concatenate([layout.smooth, layout.controls], axis=1).T
        block, rows = self.blocks.node, self.problem.node_rows
        return self._rows_at(block, rows, columns, labels, times=times, weights=weights)

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

    def to_unknowns(self, motion: PhasedMotion) -> np.ndarray:
        """Return the scaled unknowns of a motion on this mesh and degree."""
        values = np.zeros(self.layout.size)
        values[self.layout.parameters] = motion.parameters
        values[self.layout.durations] = motion.durations
        for places, phase in zip(self._places, motion.phases, strict=True):
            for name, where in places.items():
                values[where] = getattr(phase, name)
        return values / self.layout.scale

    def to_motion(self, unknowns: np.ndarray) -> PhasedMotion:
        """Return the motion that scaled unknowns stand for."""
        values = unknowns * self.layout.scale
        phases = tuple(
            PhaseMotion(
                name=phase.name,
                duration=float(duration),
                mesh=mesh,
                **{name: values[where] for name, where in places.items()},
            )
            for phase, duration, mesh, places in zip(
                self.problem.phases,
                values[self.layout.durations],
                self.meshes,
                self._places,
                strict=True,
            )
        )
        return PhasedMotion(phases, values[self.layout.parameters])

    @cached_property
    def _places(self) -> list[dict[str, np.ndarray]]:
        """Places of the unknowns of every phase, by field of a `PhaseMotion`."""
        return [
            {name: getattr(self.layout, name)[places.nodes] for name in NODE}
            | {"inner_states": places.inner_states, "algebraic": places.algebraic}
            for places in self.layout.phases
        ]


def _ends(places: PhasePlaces) -> tuple[np.ndarray, np.ndarray]:
    """Return the nodes at which the intervals of a phase begin and end, shape (N,) each."""
    return places.nodes[:-1], places.nodes[1:]
