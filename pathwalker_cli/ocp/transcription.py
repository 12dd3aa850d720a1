"""What collocation and multiple shooting share: scaled unknowns, bounds, rows at the ends."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.blocks import Block, BlockProgram, Expressions, Occurrences
from pathwalker_cli.ocp.layout import Bounded, Layout
from pathwalker_cli.ocp.problem import (
    INFINITY,
    MultiPhaseProblem,
    ProblemNumbers,
    Rows,
    Variables,
)

P = TypeVar("P")


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


def boundary_expressions(problem: MultiPhaseProblem, controls: Variables) -> Expressions:
    """Return boundary rows and objective.

    Unknowns T of all phases, p, first x, y, controls, last x, y, controls, running costs.
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
    return Expressions(scaled, ca.SX(0, 1), problem.shared, rows, objective)


class Transcription(BlockProgram, Generic[P]):
    """A problem with its numbers on a mesh as a nonlinear program; satisfies `nlp.program.Program`.

    Args:
        meshes: Node positions of every phase, from 0 to 1.
    """

    def __init__(
        self,
        problem: MultiPhaseProblem,
        numbers: ProblemNumbers,
        meshes: tuple[np.ndarray, ...],
        layout: Layout[P],
    ) -> None:
        self.problem = problem
        self.numbers = numbers
        self.meshes = meshes
        self.layout = layout
        super().__init__(layout.size, self._occurrences(), numbers.shared)

    def _occurrences(self) -> list[Occurrences]:
        """Return the blocks in the order of their rows."""
        raise NotImplementedError

    def _bounded(self) -> list[Bounded]:
        """Return which unknowns have bounds beside durations, parameters and first states."""
        raise NotImplementedError

    @cached_property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of all unknowns."""
        return self.layout.bounds(self.problem, self.numbers.bounds, self._bounded())

    @property
    def elimination_keys(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Group, and place within it, of every unknown and row; None: no order is known."""
        return None

    @property
    def scale(self) -> np.ndarray:
        """Physical units per unit of every unknown."""
        return self.layout.scale

    @property
    def free_parameters(self) -> np.ndarray:
        """Places of the problem's free parameters."""
        return self.layout.parameters

    def unknown_place(self, i: int) -> tuple[str, str]:
        """Return the name of an unknown and where it stands."""
        return self.layout.names[i]

    def _label(self, i: int, fraction: float) -> str:
        return f"{self.problem.phases[i].name} at {100 * fraction:.0f} % of the phase"

    def _boundary_rows(self, block: Block) -> Occurrences:
        """Return the occurrence of a boundary block, see `boundary_expressions`."""
        rows, layout = self.problem.boundary.rows, self.layout
        arrays = (layout.states, layout.smooth, layout.controls)
        ends = [array[k] for k in (0, -1) for array in arrays]
        columns = np.concatenate([layout.durations, layout.parameters, *ends, layout.integrals[-1]])
        return self._rows_at(block, rows, columns[:, None], ["the whole motion"])

    def _rows_at(
        self,
        block: Block,
        rows: Rows,
        columns: np.ndarray,
        labels: list[str],
        phase: str = "",
        free_at_end: tuple[str, ...] = (),
        data: np.ndarray | None = None,
        times: np.ndarray | float = 0.0,
        weights: np.ndarray | float = 1.0,
    ) -> Occurrences:
        """Return rows of the problem at these columns.

        Args:
            block: Their block.
            rows: The rows.
            columns: Unknowns of every occurrence, shape (n, count).
            labels: Where each occurrence is, count of them.
            phase: Phase under which their bounds are looked up.
            free_at_end: Rows that are not bounded at the last occurrence.
            data: Numbers of each occurrence, shape (m, count); none if left out.
            times: See `Occurrences`.
            weights: See `Occurrences`.
        """
        count = len(labels)
        limits = self.numbers.bounds.of_rows(rows, phase)
        lower, upper = (np.tile(k[:, None], count) for k in limits)
        free = [k for k, name in enumerate(rows.names) if name in free_at_end]
        lower[free, -1], upper[free, -1] = -INFINITY, INFINITY
        data = np.zeros((0, count)) if data is None else data
        about = (rows.scale, rows.names, labels, times, weights)
        return Occurrences(block, columns, data, lower, upper, *about)
