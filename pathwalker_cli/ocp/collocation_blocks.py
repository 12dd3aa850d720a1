"""The blocks of direct collocation: rows at a point, within an interval, at a node, at the ends.

Every interval carries Radau points; states and algebraic variables are unknown at the points,
smooth states and controls at the nodes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.blocks import Block, Expressions
from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.nlp.tape import Tape
from pathwalker_cli.ocp.phased import collocation_times, lagrange_weights, quadrature_weights
from pathwalker_cli.ocp.problem import MultiPhaseProblem, Phase
from pathwalker_cli.ocp.transcription import Unknown, boundary_expressions


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
        degree: Number of Radau points in an interval.
        kept: Rows and tapes by name of all blocks that matter, if they are known.
    """

    def __init__(
        self,
        problem: MultiPhaseProblem,
        degree: int,
        kept: Mapping[str, tuple[int, dict[str, Tape]]] | None = None,
    ) -> None:
        self.problem = problem
        self.degree = degree
        self._kept = kept
        self.blocks: list[Block] = []
        self.phases = tuple(self._phase_blocks(phase) for phase in problem.phases)
        self.node = self._block("node", self._node_block)
        ends = partial(boundary_expressions, problem, problem.controls)
        self.boundary = self._block("boundary", ends)
        self.sample = self._block("sample", self._sample_block)

    def _block(self, name: str, build: Callable[[], Expressions]) -> Block:
        """Return a block of this name, and note it."""
        kept = None if self._kept is None else self._kept.get(name, (0, {}))
        self.blocks.append(Block(name, build, kept))
        return self.blocks[-1]

    def _phase_blocks(self, phase: Phase) -> _PhaseBlocks:
        points = {
            kind: self._block(f"{phase.name}_{kind}", partial(self._point_block, phase, kind))
            for kind in ("residual", "path", "end")
        }
        interval = self._block(f"{phase.name}_interval", partial(self._interval_block, phase))
        return _PhaseBlocks(**points, interval=interval)

    def _point_block(self, phase: Phase, kind: str) -> Expressions:
        """Return rows at one collocation point; unknowns T, p, x, z, y0, u0, u1."""
        problem, rows = self.problem, getattr(phase, kind)
        duration, fraction, at = ca.SX.sym("T"), ca.SX.sym("fraction"), ca.SX.sym("at")
        p, x, z = self._unknowns(phase, "")
        y0, u0, u1 = (
            Unknown.of(v, k)
            for v, k in ((problem.smooth, "y0"), (problem.controls, "u0"), (problem.controls, "u1"))
        )
        rise = u1.value - u0.value
        y = y0.value + duration * fraction * at * (u0.value + at / 2 * rise)
        u = u0.value + at * rise
        values = [x.value, z.value, y, u, p.value, problem.shared, problem.point_data]
        values.append(ca.SX.nan(z.value.numel()))  # rows do not know the rate of z
        (result,), frozen = problem.substituted(phase, [rows.value / rows.scale], values)
        unknowns = [duration, *(k.scaled for k in (p, x, z, y0, u0, u1))]
        data = ca.vertcat(fraction, at, problem.point_data)
        return Expressions(ca.vertcat(*unknowns), data, problem.shared, result, frozen=frozen)

    def _unknowns(self, phase: Phase, tag: str) -> tuple[Unknown, Unknown, Unknown]:
        return (
            Unknown.of(self.problem.parameters, f"p{tag}"),
            Unknown.of(self.problem.states, f"x{tag}"),
            Unknown.of(phase.algebraic, f"z{tag}"),
        )

    def _interval_block(self, phase: Phase) -> Expressions:
        """Return collocation, smooth-state and integral rows of one interval.

        Unknowns T, p, x0, (x_k, z_k) for all points, y0, u0, s0, y1, u1, s1.
        """
        problem, d = self.problem, self.degree
        times, weights = quadrature_weights(d)
        nodes = np.concatenate([[0.0], collocation_times(d)])
        differentiation = lagrange_weights(nodes, nodes[1:], derivative=True)
        among_points = lagrange_weights(times, times, derivative=True)
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
            changes = zip(among_points[k], points, strict=True)
            z_rate = sum(w * other.value for w, (_, other) in changes) / step
            values += [problem.shared, data[k], z_rate]
            expressions = [phase.derivative, phase.integrands]
            (derivative, integrands), more = problem.substituted(phase, expressions, values, str(k))
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
        return Expressions(
            ca.vertcat(*unknowns),
            ca.vertcat(fraction, *data),
            problem.shared,
            ca.vertcat(*rows),
            frozen=frozen,
        )

    def _node(self, tag: str) -> tuple[Unknown, Unknown, Unknown]:
        problem = self.problem
        symbol = ca.SX.sym(f"s{tag}", len(problem.integrals))
        return (
            Unknown.of(problem.smooth, f"y{tag}"),
            Unknown.of(problem.controls, f"u{tag}"),
            Unknown(symbol, symbol * problem.integral_scale),
        )

    def _node_block(self) -> Expressions:
        """Return the rows in y and u at a mesh node."""
        problem, rows = self.problem, self.problem.node_rows
        y, u, _ = self._node("")
        symbols = [problem.smooth.symbol, problem.controls.symbol, problem.shared]
        outer = ca.Function("node", symbols, [rows.value / rows.scale])
        value = outer(y.value, u.value, problem.shared)
        unknowns = ca.vertcat(y.scaled, u.scaled)
        return Expressions(unknowns, ca.SX(0, 1), problem.shared, value)

    def _sample_block(self) -> Expressions:
        """Return the objective at an instant inside an interval.

        Unknowns x0 and x at all points; data are their interpolation weights and the point data.
        """
        problem, count = self.problem, self.degree + 1
        states = [Unknown.of(problem.states, f"x{k}") for k in range(count)]
        weights = ca.SX.sym("weights", count)
        value = sum(weights[k] * x.value for k, x in enumerate(states))
        (cost,) = ca.substitute([problem.sample], [problem.states.symbol], [value])
        unknowns = ca.vertcat(*(x.scaled for x in states))
        data = ca.vertcat(weights, problem.point_data)
        return Expressions(unknowns, data, problem.shared, ca.SX(0, 1), cost)
