"""What every transcription needs: scaled unknowns, their places in a vector, the boundary rows."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.blocks import Block
from pathwalker_cli.ocp.problem import MultiPhaseProblem, Variables

__all__ = ["PlaceBook", "Unknown", "boundary_block"]


@dataclass(frozen=True)
class Unknown:
    """Solver unknowns and what they mean in physical units."""

    scaled: ca.SX
    value: ca.SX

    @classmethod
    def of(cls, variables: Variables, label: str) -> Unknown:
        """Return fresh unknowns for these variables."""
        scaled = ca.SX.sym(label, variables.size)
        return cls(scaled, scaled * variables.scale)


class PlaceBook:
    """Hands out places of unknowns in a vector, one after the other.

    Args:
        scale: Physical units per solver unit of all unknowns so far.
        names: Their names.
    """

    def __init__(self) -> None:
        self.scale: list[float] = []
        self.names: list[str] = []

    def take(self, names: tuple[str, ...], scale: np.ndarray, where: str) -> np.ndarray:
        """Return places for these unknowns."""
        start = len(self.scale)
        self.scale += [float(value) for value in scale]
        self.names += [f"{name} in {where}" for name in names]
        return np.arange(start, len(self.scale))


def boundary_block(problem: MultiPhaseProblem, controls: Variables) -> Block:
    """Return boundary rows and objective.

    Unknowns T of all phases, p, first x, y, controls, last x, y, controls, running costs.

    Args:
        problem: The problem.
        controls: What stands in the place of its controls.
    """
    b, groups = problem.boundary, (problem.states, problem.smooth, controls)
    p = Unknown.of(problem.parameters, "p")
    ends = [Unknown.of(v, f"{end}{i}") for end in ("first", "last") for i, v in enumerate(groups)]
    costs = ca.SX.sym("s", len(problem.integrals))
    unknowns = [p, *ends, Unknown(costs, costs * problem.integral_scale)]
    symbols = [b.durations, problem.parameters.symbol, *b.first, *b.last, b.integrals]
    outer = ca.Function(
        "boundary", [*symbols, problem.shared], [b.rows.value / b.rows.scale, b.objective]
    )
    values = [b.durations, *(k.value for k in unknowns), problem.shared]
    rows, objective = outer.call(values, True, False)
    scaled = ca.vertcat(b.durations, *(k.scaled for k in unknowns))
    return Block("boundary", scaled, ca.SX(0, 1), problem.shared, rows, objective)
