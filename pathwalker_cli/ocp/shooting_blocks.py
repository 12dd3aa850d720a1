"""The blocks of a multiple-shooting program: one stage, one step, one instant, the boundary.

Inside a shooting interval an explicit Runge-Kutta scheme solves

    dx/dt = f(x, z, y, p),   dy/dt = g(e, y),   with z from 0 = r(x, z, y, p),

where r is linear in z.  Its stages are unknowns of the program and their formulae are rows
(lifting, Albersmeyer and Diehl 2010): the linear solver of the optimiser eliminates them, the rows
stay small, and the map over an interval is the same as if they were computed one after the other.

References:
    Bock, H.G., Plitt, K.J. (1984) A multiple shooting algorithm for direct solution of optimal
        control problems. IFAC Proceedings 17(2), 1603-1608.
    Albersmeyer, J., Diehl, M. (2010) The lifted Newton method and its application in
        optimization. SIAM J. Optim. 20, 1655-1684.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.blocks import Block, Expressions
from pathwalker_cli.ocp.problem import MultiPhaseProblem, Phase, Variables
from pathwalker_cli.ocp.shooting_steps import CASH_KARP
from pathwalker_cli.ocp.transcription import Unknown, boundary_expressions


@dataclass(frozen=True)
class ShootingProblem:
    """A problem whose smooth states are driven through an equation of their own.

    Args:
        problem: The structure; residuals are linear in the algebraic variables, residuals and
            path rows know neither controls nor point data, and running costs no rates of z.  Its
            controls u = dy/dt become g(e, y) in the running costs and e in the boundary rows; its
            rows at nodes are left out, as bounds on e and y take their place.
        controls: e, piecewise linear and continuous.
        rate: Returns dy/dt for (e, y, rounding): g itself for rounding 0; where g has a kink, a
            rounding > 0 makes it smooth.
        controls_of: Returns e for (dy/dt, y), arrays; the inverse of g, for a start.
    """

    problem: MultiPhaseProblem
    controls: Variables
    rate: Callable[[ca.SX, ca.SX, ca.SX | float], ca.SX]
    controls_of: Callable[[np.ndarray, np.ndarray], np.ndarray]

    def algebraic(self, phase: Phase) -> Variables:
        """Return the algebraic variables that the residuals of a phase determine.

        They are the first ones; those behind are zero.
        """
        z, count = phase.algebraic, len(phase.residual.names)
        return Variables(z.symbol[:count], z.names[:count], z.scale[:count])


@dataclass(frozen=True)
class PhaseBlocks:
    """The blocks of one phase, and its dynamics as a function of numbers.

    Args:
        residual: The equations for z at a stage; unknowns p, x, y, z.
        path: Path rows at a node; unknowns p, x, y, z.
        end: Rows at the last instant; unknowns p, x, y, z.
        step: The Runge-Kutta step; unknowns T, p, states and algebraic variables of the stages, y
            of the stages, e at both nodes of the interval, and running costs, x, y, running costs
            at the end.
        dynamics: Function (x, y, e, p, shared, point data) -> z, d(x, y, running costs)/dt.
    """

    residual: Block
    path: Block
    end: Block
    step: Block
    dynamics: ca.Function


class ShootingBlocks:
    """The blocks of a shooting problem; they serve every mesh and every choice of steps."""

    def __init__(self, shooting: ShootingProblem) -> None:
        self.shooting = shooting
        self.problem = shooting.problem
        ends = partial(boundary_expressions, self.problem, shooting.controls)
        self.boundary = Block("boundary", ends)
        self.phases = tuple(map(self._phase_blocks, self.problem.phases))

    def _phase_blocks(self, phase: Phase) -> PhaseBlocks:
        points = {
            kind: Block(f"{phase.name}_{kind}", partial(self._point, phase, kind))
            for kind in ("residual", "path", "end")
        }
        step = Block(f"{phase.name}_step", partial(self._step, phase))
        return PhaseBlocks(**points, step=step, dynamics=self._dynamics(phase))

    def _padded(self, phase: Phase, z: Any) -> Any:
        """Return all algebraic variables: zeros behind those that are solved for."""
        return ca.vertcat(z, type(z).zeros(phase.algebraic.size - z.numel()))

    def _point(self, phase: Phase, kind: str) -> Expressions:
        """Return rows at one instant."""
        problem, rows = self.problem, getattr(phase, kind)
        p = Unknown.of(problem.parameters, "p")
        x, y = Unknown.of(problem.states, "x"), Unknown.of(problem.smooth, "y")
        z = Unknown.of(self.shooting.algebraic(phase), "z")
        nothing = [ca.SX.zeros(problem.controls.size), p.value, problem.shared]
        nothing += [ca.SX.zeros(problem.point_data.numel()), ca.SX.nan(phase.algebraic.size)]
        values = [x.value, self._padded(phase, z.value), y.value, *nothing]
        (result,), frozen = problem.substituted(phase, [rows.value / rows.scale], values)
        unknowns = ca.vertcat(p.scaled, x.scaled, y.scaled, z.scaled)
        return Expressions(unknowns, ca.SX(0, 1), problem.shared, result, frozen=frozen)

    def _step(self, phase: Phase) -> Expressions:
        """Return the formulae of stages 2 to s and of the end of one step.

        Data: share of the phase that the step takes, where it begins and how long it is as shares
        of its interval, rounding, and the point data of every stage.
        """
        problem, pair = self.problem, CASH_KARP
        algebraic = self.shooting.algebraic(phase)
        duration, share, begin, width, rounding = (
            ca.SX.sym(k) for k in ("T", "share", "begin", "width", "rounding")
        )
        p = Unknown.of(problem.parameters, "p")
        x, y, z = (
            [Unknown.of(variables, f"{name}{k}") for k in range(pair.stages)]
            for name, variables in (("x", problem.states), ("y", problem.smooth), ("z", algebraic))
        )
        left, right = (Unknown.of(self.shooting.controls, f"e{k}") for k in range(2))
        x_end, y_end = Unknown.of(problem.states, "x_end"), Unknown.of(problem.smooth, "y_end")
        before, after = (ca.SX.sym(f"s{k}", len(problem.integrals)) for k in range(2))
        data = [ca.SX.sym(f"data{k}", problem.point_data.numel()) for k in range(pair.stages)]
        slope = ca.Function(
            "slope", self.problem.inputs(phase), [phase.derivative, phase.integrands]
        )
        slopes: list[tuple[ca.SX, ca.SX, ca.SX]] = []
        for k in range(pair.stages):
            e = left.value + (begin + width * pair.times[k]) * (right.value - left.value)
            rate = self.shooting.rate(e, y[k].value, rounding)
            values = [x[k].value, self._padded(phase, z[k].value), y[k].value, rate, p.value]
            values += [problem.shared, data[k], ca.SX.nan(phase.algebraic.size)]
            f, cost = slope.call(values, True, False)
            slopes.append((f, rate, cost))
        step = duration * share
        rows = []
        targets = [*zip(x[1:], y[1:], strict=True), (x_end, y_end)]
        for weights, (x_k, y_k) in zip([*pair.matrix[1:], pair.weights], targets, strict=True):
            gain = [
                sum(w * part[i] for w, part in zip(weights, slopes, strict=True) if w)
                for i in range(2)
            ]
            rows.append(x_k.scaled - x[0].scaled - step * gain[0] / problem.states.scale)
            rows.append(y_k.scaled - y[0].scaled - step * gain[1] / problem.smooth.scale)
        cost = sum(w * part[2] for w, part in zip(pair.weights, slopes, strict=True) if w)
        rows.append(after - before - step * cost / problem.integral_scale)
        stages = [k.scaled for stage in zip(x, y, z, strict=True) for k in stage]
        ends = [left.scaled, right.scaled, before, x_end.scaled, y_end.scaled, after]
        return Expressions(
            ca.vertcat(duration, p.scaled, *stages, *ends),
            ca.vertcat(share, begin, width, rounding, *data),
            problem.shared,
            ca.vertcat(*rows),
        )

    def _linear_system(self, phase: Phase) -> ca.Function:
        """Return the function (x, y, p, shared) -> matrix, constant of r = matrix z + constant."""
        frozen, residual = phase.frozen, phase.residual.value
        symbols = self.problem.inputs(phase)
        x, z, y, u, p, shared, data, _ = symbols
        matrix = ca.jacobian(residual, self.shooting.algebraic(phase).symbol)
        outer = ca.Function("outer", [*symbols, frozen.symbol_vector], [matrix, residual])
        inner = ca.Function("meanings", symbols, [frozen.meaning_vector])
        at_zero = [x, 0 * z, y, 0 * u, p, shared, 0 * data, 0 * z]
        meanings = inner.call(at_zero, True, False)
        outputs = outer.call([*at_zero, *meanings], True, False)
        return ca.Function("system", [x, y, p, shared], outputs)

    def _dynamics(self, phase: Phase) -> ca.Function:
        """Return the explicit differential equation with the linear system for z solved."""
        symbols, e = self.problem.inputs(phase), self.shooting.controls.symbol
        y_symbol = self.problem.smooth.symbol
        rate = ca.Function("rate", [e, y_symbol], [self.shooting.rate(e, y_symbol, 0.0)])
        slope = ca.Function("slope", symbols, [phase.derivative, phase.integrands])
        sizes = [symbols[0].numel(), symbols[2].numel(), e.numel()]
        sizes += [symbol.numel() for symbol in symbols[4:7]]
        inputs: list[Any] = [ca.MX.sym("input", size) for size in sizes]
        x, y, e, p, shared, data = inputs
        matrix, constant = self._linear_system(phase)(x, y, p, shared)
        z = -ca.solve(matrix, constant, "qr")
        y_rate = rate(e, y)
        unknown = ca.DM.nan(phase.algebraic.size)
        x_rate, cost = slope(x, self._padded(phase, z), y, y_rate, p, shared, data, unknown)
        outputs = [z, ca.vertcat(x_rate, y_rate, cost)]
        return ca.Function(f"{phase.name}_dynamics", inputs, outputs)
