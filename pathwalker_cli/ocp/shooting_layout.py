"""Where every unknown of a multiple-shooting program stands in its vector."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.ocp.layout import Layout, PlaceBook
from pathwalker_cli.ocp.problem import Phase
from pathwalker_cli.ocp.shooting_blocks import ShootingProblem
from pathwalker_cli.ocp.shooting_steps import CASH_KARP, Edges


@dataclass(frozen=True)
class ShootingPlaces:
    """Places of one phase with N intervals and M steps of s stages.

    Args:
        nodes: Numbers of the mesh nodes, shape (N + 1,).
        interval: Interval of each step, shape (M,).
        starts: First step of each interval, shape (N,).
        steps: Numbers of the ends of the steps, shape (M + 1,).
        states: x at the stages, shape (M, s, nx); the first stage is the start of the step.
        smooth: y at the stages, shape (M, s, ny).
        algebraic: z at the stages, shape (M, s, nz).
        last: z at the last instant of the phase, shape (nz,).
    """

    nodes: np.ndarray
    interval: np.ndarray
    starts: np.ndarray
    steps: np.ndarray
    states: np.ndarray
    smooth: np.ndarray
    algebraic: np.ndarray
    last: np.ndarray


def shooting_layout(shooting: ShootingProblem, edges: Edges) -> Layout[ShootingPlaces]:
    """Return the places of all unknowns, ordered by time."""
    problem = shooting.problem
    book = PlaceBook(problem, shooting.controls)
    start = f"{problem.phases[0].name} at 0 % of the phase"
    book.take_node(start, *_END, "controls")
    pairs = zip(problem.phases, edges, strict=True)
    return book.layout([_places(shooting, book, *pair) for pair in pairs])


_END = ("integrals", "states", "smooth")
"""What stands at the end of every step, in this order."""


def _places(
    shooting: ShootingProblem, book: PlaceBook, phase: Phase, intervals: tuple[np.ndarray, ...]
) -> ShootingPlaces:
    """Take places for the steps and nodes of a phase."""
    problem, algebraic, ends = shooting.problem, shooting.algebraic(phase), book.nodes["states"]
    first_node, first_end = len(book.nodes["controls"]) - 1, len(ends) - 1
    states, smooth, z, interval = [], [], [], []
    for n, edges in enumerate(intervals):
        for k in range(len(edges) - 1):
            where = f"{phase.name} interval {n + 1} step {k + 1}"
            inner = range(CASH_KARP.stages - 1)
            states.append([ends[-1], *(book.take(problem.states, where) for _ in inner)])
            before = book.nodes["smooth"][-1]
            smooth.append([before, *(book.take(problem.smooth, where) for _ in inner)])
            z.append([book.take(algebraic, where) for _ in range(CASH_KARP.stages)])
            interval.append(n)
            book.take_node(where, *_END)
        book.take_node(where, "controls")
    return ShootingPlaces(
        nodes=np.arange(first_node, len(book.nodes["controls"])),
        interval=np.array(interval),
        starts=np.searchsorted(interval, np.arange(len(intervals))),
        steps=np.arange(first_end, len(ends)),
        states=np.array(states),
        smooth=np.array(smooth),
        algebraic=np.array(z),
        last=book.take(algebraic, f"{phase.name} at 100 % of the phase"),
    )
