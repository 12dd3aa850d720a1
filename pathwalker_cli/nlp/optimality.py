"""First-order conditions of a solution, evaluated outside the solver that found it.

Objective, rows and their derivatives come from CasADi's virtual machine and from expressions that
are derived anew, not from kept tapes or compiled kernels.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.nlp.matrices import matrix_of
from pathwalker_cli.nlp.program import Program, limits
from pathwalker_cli.nlp.result import Multipliers

_MEAN_MULTIPLIER: Final = 100.0
"""Mean multiplier up to which IPOPT measures stationarity as it is (its s_max)."""


@dataclass(frozen=True)
class Optimality:
    """How well a point meets the first-order conditions, in solver units.

    Args:
        cost: Value of the objective.
        infeasibility: Largest violation of a row or bound.
        stationarity: Largest entry of the gradient of the Lagrangian, scaled as IPOPT does.
        complementarity: Largest product of a multiplier and the gap to its bound, scaled as well.
        wrong_sign: Largest multiplier that pushes a row or unknown out of its bounds, scaled.
    """

    cost: float
    infeasibility: float
    stationarity: float
    complementarity: float
    wrong_sign: float


def optimality(program: Program, unknowns: np.ndarray, multipliers: Multipliers) -> Optimality:
    """Return how well a point and its multipliers meet the first-order conditions.

    Unknowns are scaled; multipliers are positive at upper bounds.
    """
    functions = program.plain_functions()
    cost, gradient = functions["grad_f"](unknowns, program.parameters)
    rows, jacobian = functions["jac_g"](unknowns, program.parameters)
    rows, jacobian = np.asarray(rows).ravel(), matrix_of(functions["jac_g"], jacobian)
    lagrangian = np.asarray(gradient).ravel() + jacobian.T @ multipliers.rows
    lagrangian = lagrangian + multipliers.unknowns
    values = np.concatenate([unknowns, rows])
    (lower, upper), both = limits(program), multipliers.stacked
    scale = max(_MEAN_MULTIPLIER, float(np.abs(both).mean())) / _MEAN_MULTIPLIER
    gap = np.where(both > 0.0, upper - values, values - lower)
    bounded = (lower < upper) & np.isfinite(gap)
    wrong = (lower < upper) & ~np.isfinite(gap)
    return Optimality(
        cost=float(cost),
        infeasibility=float(np.maximum(lower - values, values - upper).max(initial=0.0)),
        stationarity=float(np.abs(lagrangian).max()) / scale,
        complementarity=float(np.abs(both[bounded] * gap[bounded]).max(initial=0.0)) / scale,
        wrong_sign=float(np.abs(both[wrong]).max(initial=0.0)) / scale,
    )
