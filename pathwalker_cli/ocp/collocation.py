"""Direct collocation: a multi-phase problem on a mesh becomes a nonlinear program.

Every interval carries Radau points; states and algebraic variables are unknown at the points,
smooth states and controls at the nodes.  Neighbouring intervals and phases share their node, so
continuity needs no rows.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from pathwalker_cli.ocp.blocks import Block, BlockProgram, Occurrences
from pathwalker_cli.ocp.frozen import FrozenTerms
from pathwalker_cli.ocp.layout import Layout
from pathwalker_cli.ocp.phased import (
    PhasedMotion,
    PhaseMotion,
    collocation_times,
    lagrange_weights,
    quadrature_weights,
)
from pathwalker_cli.ocp.problem import (
    INFINITY,
    MultiPhaseProblem,
    Phase,
    ProblemNumbers,
    Rows,
    Variables,
)

__all__ = ["CollocationBlocks", "CollocationProgram"]


def _differentiation(degree: int) -> np.ndarray:
    """Return the matrix from start and points of an interval to rates at the points."""
    times = collocation_times(degree)
    return lagrange_weights(np.concatenate([[0.0], times]), times, derivative=True)


@dataclass(frozen=True)
class _Unknown:
    """Solver unknowns and what they mean in physical units."""

    scaled: ca.SX
    value: ca.SX

    @classmethod
    def of(cls, variables: Variables, label: str) -> _Unknown:
        scaled = ca.SX.sym(label, variables.size)
        return cls(scaled, scaled * variables.scale)


@dataclass(frozen=True)
class _PhaseBlocks:
    """The blocks of one phase: rows at a point, within an interval, at the last instant."""

    residual: Block
    path: Block
    end: Block
    interval: Block


class CollocationBlocks:
    """The blocks of a problem for one collocation degree; they serve every mesh.

    Args:
        problem: The structure of the problem.
        degree: Number of Radau points in an interval.
    """

    def __init__(self, problem: MultiPhaseProblem, degree: int) -> None:
        self.problem = problem
        self.degree = degree
        self.phases = tuple(
            _PhaseBlocks(
                residual=self._point_block(phase, phase.residual, "residual"),
                path=self._point_block(phase, phase.path, "path"),
                end=self._point_block(phase, phase.end, "end"),
                interval=self._interval_block(phase),
            )
            for phase in problem.phases
        )
        self.node = self._node_block()
        self.boundary = self._boundary_block()
        self.sample = self._sample_block()

    def _point_block(self, phase: Phase, rows: Rows, label: str) -> Block:
        """Return rows at one collocation point; unknowns T, p, x, z, y0, u0, u1."""
        problem = self.problem
        duration, fraction, at = ca.SX.sym("T"), ca.SX.sym("fraction"), ca.SX.sym("at")
        p, x, z = self._unknowns(phase, "")
        y0, u0, u1 = (
            _Unknown.of(v, k)
            for v, k in ((problem.smooth, "y0"), (problem.controls, "u0"), (problem.controls, "u1"))
        )
        rise = u1.value - u0.value
        y = y0.value + duration * fraction * at * (u0.value + at / 2 * rise)
        u = u0.value + at * rise
        values = [x.value, z.value, y, u, p.value, problem.shared, problem.point_data]
        (result,), frozen = self._substituted(phase, [rows.value / rows.scale], values, "")
        unknowns = [duration, *(k.scaled for k in (p, x, z, y0, u0, u1))]
        data = ca.vertcat(fraction, at, problem.point_data)
        name = f"{phase.name}_{label}"
        return Block(name, ca.vertcat(*unknowns), data, problem.shared, result, frozen=frozen)

    def _unknowns(self, phase: Phase, tag: str) -> tuple[_Unknown, _Unknown, _Unknown]:
        return (
            _Unknown.of(self.problem.parameters, f"p{tag}"),
            _Unknown.of(self.problem.states, f"x{tag}"),
            _Unknown.of(phase.algebraic, f"z{tag}"),
        )

    def _substituted(
        self, phase: Phase, expressions: list[ca.SX], values: list[ca.SX], tag: str
    ) -> tuple[list[ca.SX], FrozenTerms]:
        """Return a phase's expressions with its symbols replaced by values."""
        problem = self.problem
        symbols = [
            problem.states.symbol,
            phase.algebraic.symbol,
            problem.smooth.symbol,
            problem.controls.symbol,
            problem.parameters.symbol,
            problem.shared,
            problem.point_data,
        ]
        frozen = phase.frozen
        inputs = [*symbols, frozen.symbol_vector]
        outer = ca.Function("expressions", inputs, expressions)
        if not any(ca.depends_on(k, frozen.symbol_vector) for k in expressions if k.numel()):
            unused = ca.SX.zeros(frozen.symbol_vector.numel())
            return outer.call([*values, unused], True, False), FrozenTerms()
        inner = ca.Function("meanings", symbols, [frozen.meaning_vector])
        renewed = ca.SX.sym(f"frozen{tag}", frozen.symbol_vector.numel())
        (meanings,) = inner.call(values, True, False)
        return outer.call([*values, renewed], True, False), FrozenTerms([renewed], [meanings])

    def _interval_block(self, phase: Phase) -> Block:
        """Return collocation, smooth-state and integral rows of one interval.

        Unknowns T, p, x0, (x_k, z_k) for all points, y0, u0, s0, y1, u1, s1.
        """
        problem, d = self.problem, self.degree
        differentiation = _differentiation(d)
        times, weights = quadrature_weights(d)
        duration, fraction = ca.SX.sym("T"), ca.SX.sym("fraction")
        step = duration * fraction
        p, x0, _ = self._unknowns(phase, "0")
        y0, u0, s0 = self._node("0")
        y1, u1, s1 = self._node("1")
        points = [self._unknowns(phase, str(k + 1))[1:] for k in range(d)]
        data = [ca.SX.sym(f"data{k}", problem.point_data.numel()) for k in range(d)]
        rise = u1.value - u0.value
        rows, gain, frozen = [], ca.SX.zeros(len(problem.integrals)), FrozenTerms()
        for k, (x, z) in enumerate(points):
            y = y0.value + step * times[k] * (u0.value + times[k] / 2 * rise)
            values = [x.value, z.value, y, u0.value + times[k] * rise, p.value]
            values += [problem.shared, data[k]]
            expressions = [phase.derivative, phase.integrands]
            (derivative, integrands), more = self._substituted(phase, expressions, values, str(k))
            slope = differentiation[k, 0] * x0.scaled
            for j, (other, _) in enumerate(points):
                slope += differentiation[k, j + 1] * other.scaled
            rows.append(slope - step * derivative / problem.states.scale)
            gain += weights[k] * integrands
            frozen = FrozenTerms(frozen.symbols + more.symbols, frozen.meanings + more.meanings)
        y_gain = step / 2 * (u0.value + u1.value) / problem.smooth.scale
        rows.append(y1.scaled - y0.scaled - y_gain)
        rows.append(s1.scaled - s0.scaled - step * gain / problem.integral_scale)
        unknowns = [duration, p.scaled, x0.scaled]
        unknowns += [k.scaled for pair in points for k in pair]
        unknowns += [k.scaled for k in (y0, u0, s0, y1, u1, s1)]
        return Block(
            f"{phase.name}_interval",
            ca.vertcat(*unknowns),
            ca.vertcat(fraction, *data),
            problem.shared,
            ca.vertcat(*rows),
            frozen=frozen,
        )

    def _node(self, tag: str) -> tuple[_Unknown, _Unknown, _Unknown]:
        problem = self.problem
        symbol = ca.SX.sym(f"s{tag}", len(problem.integrals))
        return (
            _Unknown.of(problem.smooth, f"y{tag}"),
            _Unknown.of(problem.controls, f"u{tag}"),
            _Unknown(symbol, symbol * problem.integral_scale),
        )

    def _node_block(self) -> Block:
        """Return the rows in y and u at a mesh node."""
        problem, rows = self.problem, self.problem.node_rows
        y, u, _ = self._node("")
        symbols = [problem.smooth.symbol, problem.controls.symbol, problem.shared]
        outer = ca.Function("node", symbols, [rows.value / rows.scale])
        value = outer(y.value, u.value, problem.shared)
        unknowns = ca.vertcat(y.scaled, u.scaled)
        return Block("node", unknowns, ca.SX(0, 1), problem.shared, value)

    def _sample_block(self) -> Block:
        """Return the objective at an instant inside an interval.

        Unknowns x0 and x at all points; data are their interpolation weights and the point data.
        """
        problem, count = self.problem, self.degree + 1
        states = [_Unknown.of(problem.states, f"x{k}") for k in range(count)]
        weights = ca.SX.sym("weights", count)
        value = sum(weights[k] * x.value for k, x in enumerate(states))
        (cost,) = ca.substitute([problem.sample], [problem.states.symbol], [value])
        unknowns = ca.vertcat(*(x.scaled for x in states))
        data = ca.vertcat(weights, problem.point_data)
        return Block("sample", unknowns, data, problem.shared, ca.SX(0, 1), cost)

    def _boundary_block(self) -> Block:
        """Return boundary rows and objective.

        Unknowns T of all phases, p, first x, y, u, last x, y, u, integrals.
        """
        problem, b = self.problem, self.problem.boundary
        groups = (problem.states, problem.smooth, problem.controls)
        p = _Unknown.of(problem.parameters, "p")
        first = [_Unknown.of(v, f"first{i}") for i, v in enumerate(groups)]
        last = [_Unknown.of(v, f"last{i}") for i, v in enumerate(groups)]
        integrals = self._node("")[2]
        symbols = [b.durations, problem.parameters.symbol, *b.first, *b.last, b.integrals]
        outer = ca.Function(
            "boundary", [*symbols, problem.shared], [b.rows.value / b.rows.scale, b.objective]
        )
        unknowns = [p, *first, *last, integrals]
        values = [b.durations, *(k.value for k in unknowns), problem.shared]
        rows, objective = outer.call(values, True, False)
        scaled = ca.vertcat(b.durations, *(k.scaled for k in unknowns))
        return Block("boundary", scaled, ca.SX(0, 1), problem.shared, rows, objective)


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

    def _row_bounds(
        self, rows: Rows, phase: str = "", at_end: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return scaled bounds of rows, from the numbers where they have an entry."""
        lower, upper = rows.lower.copy(), rows.upper.copy()
        for i, name in enumerate(rows.names):
            found = self.numbers.bounds.find(name, phase, at_end)
            if found is not None:
                lower[i], upper[i] = found
        return lower / rows.scale, upper / rows.scale

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
        lower, upper = self._row_bounds(rows, phase.name)
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
        lower, upper = self._row_bounds(phase.end, phase.name)
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
        lower, upper = self._row_bounds(rows)
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
        lower, upper = self._row_bounds(rows)
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
