"""How an optimum answers a change of its problem, from the KKT system there: no solve needed.

Unknowns x and multipliers lam of an optimum follow any number p of the problem (Fiacco 1976) by

    (H + S) dx + J' dlam = -d(grad L)/dp + S dl/dp,    J dx - D dlam = db/dp - dg/dp,

with H and J the second derivatives of the Lagrangian L and the first ones of the rows g, and l and
b the bounds that x and g press on.  S (multiplier / gap) and D (gap / multiplier) are what is left
of the barrier at its end: an active bound moves x with it, an inactive one does nothing.

The free parameters of the program are kept apart: the system is factorised with
them fixed, and what is left is the small Hessian of the optimal cost in them.

References:
    Fiacco AV (1976). Sensitivity analysis for nonlinear programming using penalty methods.
    Mathematical Programming 10:287-311.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any, Final, NamedTuple

import numpy as np
from scipy import sparse

from pathwalker_cli.nlp.matrices import matrix_of
from pathwalker_cli.nlp.program import Program, limits
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.nlp.stage_ldl import SymmetricSystem, in_order_of

_REGULARISATION: Final = 1e-10
"""Added to the zero block, so that rows which say the same twice do no harm."""

_DOUBTFUL: Final = 10.0
"""Ratio of multiplier and gap, or its inverse, below which activity is not certain."""

_INACTIVE: Final = 1e-9
"""Ratio of multiplier and gap below which a row may be left out."""

_LEAST_GAP: Final = 1e-12
"""Gap that counts at least: the ratio stays finite where a bound is met exactly or missed."""


@dataclass(frozen=True)
class Answer:
    """Derivatives by one number of the problem.

    Args:
        cost: Derivative of the optimal cost.
        unknowns: Derivative of the scaled unknowns, shape (n,).
        rows: Derivative of the multipliers of the rows, shape (m,).
    """

    cost: float
    unknowns: np.ndarray
    rows: np.ndarray

    def plus(self, other: Answer, amount: float) -> Answer:
        """Return the answer when another number changes with this one."""
        return Answer(
            self.cost + amount * other.cost,
            self.unknowns + amount * other.unknowns,
            self.rows + amount * other.rows,
        )


@dataclass(frozen=True)
class NewtonStep:
    """A Newton step from a point near an optimum, not at it; free parameters stay.

    Args:
        unknowns: The point that it leads to, scaled, shape (n,).
        by_unknowns: What every unknown adds to the change of the cost, shape (n,).
        by_rows: What every row adds to it, shape (m,); the sum of all is the value of
            L + r d / 2 less the cost, with the step d and the residuals r of the conditions of
            optimality.
    """

    unknowns: np.ndarray
    by_unknowns: np.ndarray
    by_rows: np.ndarray


class _FirstOrder(NamedTuple):
    """Objective, gradient of the Lagrangian (n,) and rows (m,), or derivatives of these."""

    objective: float
    gradient: np.ndarray
    rows: np.ndarray

    def slope_to(self, other: _FirstOrder, span: float) -> _FirstOrder:
        """Return the difference to another one over a span."""
        return _FirstOrder(
            (other.objective - self.objective) / span,
            (other.gradient - self.gradient) / span,
            (other.rows - self.rows) / span,
        )


@dataclass(frozen=True)
class _Change:
    """What a number of the problem changes while unknowns and multipliers stay, per unit.

    Args:
        objective: Objective, with rows and bounds weighted by their multipliers.
        gradient: Gradient of the Lagrangian, shape (n,).
        rows: Rows minus the bounds that they press on, shape (m,).
        bounds: Bounds that the unknowns press on, shape (n,).
    """

    objective: float
    gradient: np.ndarray
    rows: np.ndarray
    bounds: np.ndarray


class KktSystem:
    """The KKT system of a program at its optimum.

    Args:
        result: Its solution; the tighter its tolerance, the clearer what is active.
    """

    def __init__(self, program: Program, result: NlpResult) -> None:
        self.program = program
        self.result = result
        self._functions = program.functions
        n = program.size
        values = np.concatenate([result.unknowns, result.rows])
        self._ratios = _ratio(values, *limits(program), result.multipliers.stacked)
        self._bound_ratio, row_ratio = self._ratios[:n], self._ratios[n:]
        equality = np.equal(*program.row_bounds)
        self._rows = np.flatnonzero(equality | (row_ratio > _INACTIVE))
        self._row_slack = np.where(equality, 0.0, 1.0 / np.maximum(row_ratio, _INACTIVE))
        fixed = np.equal(*program.bounds)
        self.free = program.free_parameters[~fixed[program.free_parameters]]
        """Places of the free parameters."""
        fixed[program.free_parameters] = True
        self._fixed, self._moving = np.flatnonzero(fixed), np.flatnonzero(~fixed)
        self.active = int((self._ratios > 1.0).sum())
        """Number of active inequalities."""
        doubtful = (self._ratios > 1.0 / _DOUBTFUL) & (self._ratios < _DOUBTFUL)
        self.doubtful = int(doubtful.sum())
        """Number of inequalities that are neither clearly active nor clearly inactive."""

    def changed(self, other: KktSystem) -> int:
        """Return how many inequalities are clearly active in this system or the other alone."""
        mine, theirs = self._ratios, other._ratios
        gone = (mine > _DOUBTFUL) & (theirs < 1.0 / _DOUBTFUL)
        come = (theirs > _DOUBTFUL) & (mine < 1.0 / _DOUBTFUL)
        return int((gone | come).sum())

    def answer(self, below: Program, above: Program, step: float) -> Answer:
        """Return the derivatives by a number of the problem; free parameters follow it.

        The number is one step lower in the program `below` and one higher in `above`.
        """
        low, high = (self._first_order_at(program.parameters) for program in (below, above))
        moved = self._pressed_by(above) - self._pressed_by(below)
        return self._following(low.slope_to(high, 2.0 * step), moved / (2.0 * step))

    def towards(self, other: Program, share: float) -> Answer:
        """Return the changes on the way to a program of other numbers, to first order.

        Derivatives are taken over this share of the way; free parameters follow.
        """
        here, there = self.program.parameters, other.parameters
        near = self._first_order_at(here + share * (there - here))
        moved = self._pressed_by(other) - self._pressed_by(self.program)
        return self._following(self._own_first_order.slope_to(near, share), moved)

    @cached_property
    def step(self) -> NewtonStep:
        """The Newton step from here, a point near an optimum."""
        multipliers = self.result.multipliers
        _, gradient, rows = self._own_first_order
        lower, upper = self.program.row_bounds
        # a row that is met and not pressed on has no residual
        missed = np.where(rows > upper, rows - upper, np.minimum(rows - lower, 0.0))
        residual = gradient + multipliers.unknowns
        residual[self._fixed] = 0.0
        change = _Change(0.0, residual, missed, np.zeros(len(residual)))
        answer = self._answer(change)
        along = multipliers.rows + answer.rows / 2.0
        return NewtonStep(
            self.result.unknowns + answer.unknowns,
            residual * answer.unknowns / 2.0,
            missed * along,
        )

    @cached_property
    def parameter_answers(self) -> tuple[Answer, ...]:
        """Derivatives by every free parameter (scaled), the others held."""
        n, m = len(self.result.unknowns), len(self.result.rows)
        answers = []
        for place, gradient in zip(self.free, self.parameter_gradient.tolist(), strict=True):
            bounds = np.zeros(n)
            bounds[place] = 1.0
            answers.append(self._answer(_Change(gradient, np.zeros(n), np.zeros(m), bounds)))
        return tuple(answers)

    @cached_property
    def parameter_hessian(self) -> np.ndarray:
        """Second derivatives of the optimal cost in the free parameters (scaled)."""
        columns = [self._pull(answer) for answer in self.parameter_answers]
        matrix = np.array(columns).reshape(len(self.free), len(self.free))
        return (matrix + matrix.T) / 2.0

    def held(self, which: int) -> Answer:
        """Return the derivatives by one free parameter (scaled) while the others follow."""
        others = self._others(which)
        pull = self.parameter_hessian[others, which]
        return self._followed(self.parameter_answers[which], pull, others)

    def curvature(self, which: int) -> float:
        """Return the second derivative of the cost in one free parameter while others follow."""
        others = self._others(which)
        coupling = self.parameter_hessian[others, which]
        own = self.parameter_hessian[which, which]
        return float(own + coupling @ self._follow(coupling, others))

    def _others(self, which: int) -> list[int]:
        return [i for i in range(len(self.free)) if i != which]

    def _follow(self, pull: np.ndarray, which: list[int]) -> np.ndarray:
        """Return how some free parameters follow a pull on them, their bounds in the way."""
        matrix = self.parameter_hessian + np.diag(self._bound_ratio[self.free])
        return -np.linalg.solve(matrix[np.ix_(which, which)], pull)

    def _followed(self, answer: Answer, pull: np.ndarray, which: list[int]) -> Answer:
        """Return an answer in which some free parameters follow."""
        for i, amount in zip(which, self._follow(pull, which), strict=True):
            answer = answer.plus(self.parameter_answers[i], float(amount))
        return answer

    @cached_property
    def parameter_gradient(self) -> np.ndarray:
        """First derivatives of the optimal cost in the free parameters (scaled)."""
        return np.asarray(self._own_first_order.gradient[self.free])

    @cached_property
    def _own_first_order(self) -> _FirstOrder:
        return self._first_order_at(self.program.parameters)

    def _first_order_at(self, p: np.ndarray) -> _FirstOrder:
        """Return objective, gradient of the Lagrangian and rows at the optimum, of numbers p."""
        x = self.result.unknowns
        objective, gradient = self._functions["grad_f"](x, p)
        rows, jacobian = self._rows_at(x, p)
        lagrangian = np.asarray(gradient).ravel() + jacobian.T @ self.result.multipliers.rows
        return _FirstOrder(float(objective), lagrangian, rows)

    def _rows_at(self, x: np.ndarray, p: np.ndarray) -> tuple[np.ndarray, sparse.csc_array]:
        """Return the rows (m,) and their Jacobian (m, n)."""
        function = self._functions["jac_g"]
        rows, jacobian = function(x, p)
        return np.asarray(rows).ravel(), matrix_of(function, jacobian)

    def _pressed_by(self, program: Program) -> np.ndarray:
        """Return the bounds of a program that unknowns and rows press on, shape (n + m,)."""
        return _pressed(self.result.multipliers.stacked, *limits(program))

    def _following(self, slope: _FirstOrder, moved: np.ndarray) -> Answer:
        """Return the derivatives while all free parameters follow.

        Args:
            slope: Derivatives at fixed unknowns and multipliers.
            moved: Those of the bounds that unknowns and rows press on, shape (n + m,).
        """
        multipliers, size = self.result.multipliers, self.program.size
        bounds, rows = moved[:size], slope.rows - moved[size:]
        weighted = slope.objective + multipliers.rows @ rows - multipliers.unknowns @ bounds
        change = _Change(float(weighted), slope.gradient, rows, bounds)
        answer = self._answer(change)
        pull = self._pull(answer) + change.gradient[self.free]
        return self._followed(answer, pull, list(range(len(self.free))))

    def _answer(self, change: _Change) -> Answer:
        """Return the derivatives, free parameters moving as `change.bounds` says."""
        hessian, jacobian = self._second_order
        unknowns = np.zeros(len(self.result.unknowns))
        unknowns[self._fixed] = change.bounds[self._fixed]
        push = np.where(np.isfinite(change.bounds), change.bounds, 0.0) * self._bound_ratio
        upper = (push - change.gradient - hessian @ unknowns)[self._moving]
        lower = (-change.rows - jacobian @ unknowns)[self._rows]
        solved = self.factors.solve(np.concatenate([upper, lower]))
        unknowns[self._moving] = solved[: len(self._moving)]
        rows = np.zeros(len(self.result.rows))
        rows[self._rows] = solved[len(self._moving) :]
        return Answer(change.objective, unknowns, rows)

    def _pull(self, answer: Answer) -> np.ndarray:
        """Return the derivatives of the gradient in the free parameters along an answer."""
        hessian, jacobian = self._second_order
        return np.asarray((hessian @ answer.unknowns + jacobian.T @ answer.rows)[self.free])

    @cached_property
    def _second_order(self) -> tuple[Any, Any]:
        """Hessian of the Lagrangian (n, n) and Jacobian of the rows (m, n)."""
        x, p = self.result.unknowns, self.program.parameters
        function = self._functions["hess_lag"]
        triangle = matrix_of(function, function(x, p, 1.0, self.result.multipliers.rows))
        _, jacobian = self._rows_at(x, p)
        return (triangle + sparse.triu(triangle, 1).T).tocsr(), jacobian.tocsr()

    @cached_property
    def factors(self) -> SymmetricSystem:
        """The factorised system, free parameters fixed; what takes longest of all answers."""
        hessian, jacobian = self._second_order
        barrier = sparse.diags_array(self._bound_ratio[self._moving])
        h = hessian[self._moving][:, self._moving] + barrier
        a = jacobian[self._rows][:, self._moving]
        d = sparse.diags_array(-_REGULARISATION - self._row_slack[self._rows])
        order, keys = None, self.program.elimination_keys
        if keys is not None:
            order = in_order_of(np.concatenate([keys[0][self._moving], keys[1][self._rows]]))
        return SymmetricSystem(sparse.block_array([[h, a.T], [a, d]]), len(self._moving), order)


def _ratio(
    values: np.ndarray, lower: np.ndarray, upper: np.ndarray, multipliers: np.ndarray
) -> np.ndarray:
    """Return multiplier over gap of every inequality; 0 where the bounds leave no freedom."""
    gap = np.where(multipliers > 0.0, upper - values, values - lower)
    ratio = np.abs(multipliers) / np.maximum(gap, _LEAST_GAP)
    return np.asarray(np.where((upper > lower) & np.isfinite(gap), ratio, 0.0))


def _pressed(multipliers: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the bound on the side that the multiplier stands for; 0 where there is none."""
    side = np.where(multipliers > 0.0, upper, lower)
    return np.asarray(np.where(np.isfinite(side), side, 0.0))
