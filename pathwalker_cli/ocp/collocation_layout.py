"""Where every unknown of a collocation program stands in its vector."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.ocp.layout import Layout, PlaceBook
from pathwalker_cli.ocp.problem import MultiPhaseProblem

__all__ = ["NODE", "PhasePlaces", "collocation_layout"]

NODE: Final = ("states", "smooth", "controls", "integrals")
"""What stands at every node, in this order."""


@dataclass(frozen=True)
class PhasePlaces:
    """Places of one phase with N intervals of d points.

    Args:
        nodes: Node numbers, shape (N + 1,).
        inner_states: x at the points, shape (N, d, nx); the last point is the next node.
        algebraic: z at the points, shape (N, d, nz).
    """

    nodes: np.ndarray
    inner_states: np.ndarray
    algebraic: np.ndarray


def collocation_layout(
    problem: MultiPhaseProblem, meshes: tuple[np.ndarray, ...], degree: int
) -> Layout[PhasePlaces]:
    """Return the places of all unknowns, ordered by time."""
    book, phases = PlaceBook(problem, problem.controls), []
    book.take_node(f"{problem.phases[0].name} at 0 % of the phase", *NODE)
    for phase, mesh in zip(problem.phases, meshes, strict=True):
        first, inner, algebraic = len(book.nodes["states"]) - 1, [], []
        for end in mesh[1:]:
            where = f"{phase.name} at {100 * end:.0f} % of the phase"
            points = [book.take(problem.states, where) for _ in range(degree - 1)]
            algebraic.append([book.take(phase.algebraic, where) for _ in range(degree)])
            book.take_node(where, *NODE)
            inner.append([*points, book.nodes["states"][-1]])
        nodes = np.arange(first, len(book.nodes["states"]))
        phases.append(PhasePlaces(nodes, np.array(inner), np.array(algebraic)))
    return book.layout(phases)
