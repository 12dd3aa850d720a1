"""In which order the unknowns of a collocation program's Newton systems are eliminated.

The system of an interior-point step holds the free unknowns, the slacks of inequality rows, and the
multipliers of equality and inequality rows.  Everything that belongs to one collocation point is
eliminated with it, then what is left of its interval, then the node at which the interval begins;
what ties first and last instant together comes last.  All groups are small, whatever the mesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from pathwalker_cli.ocp.collocation import CollocationProgram

__all__ = ["Elimination", "elimination_of", "in_order_of", "stage_keys"]


@dataclass(frozen=True)
class Elimination:
    """Order of elimination of a symmetric system of n unknowns.

    Args:
        order: All unknowns in the order of elimination, shape (n,).
        ends: Where in `order` each group of unknowns ends, shape (groups,).
    """

    order: np.ndarray
    ends: np.ndarray

    def equals(self, other: Elimination) -> bool:
        """Return whether order and groups are the same."""
        mine, theirs = (self.order, self.ends), (other.order, other.ends)
        return all(map(np.array_equal, mine, theirs))


def elimination_of(program: CollocationProgram) -> Elimination:
    """Return the order for the systems that IPOPT solves for a program.

    IPOPT takes fixed unknowns out and orders the rest: unknowns, slacks, multipliers of equality
    rows, multipliers of inequality rows.
    """
    unknowns, rows = stage_keys(program)
    lower, upper = program.bounds
    equal = program.program.lower == program.program.upper
    free = lower != upper
    return in_order_of(np.concatenate([unknowns[free], rows[~equal], rows[equal], rows[~equal]]))


def in_order_of(keys: np.ndarray) -> Elimination:
    """Return the order of unknowns with these keys of group and place within it, shape (n, 2)."""
    order = np.lexsort(keys.T[::-1])
    ends = np.append(np.flatnonzero(np.diff(keys[order, 0])) + 1, len(order))
    return Elimination(order.astype(np.int32), ends.astype(np.int32))


def stage_keys(program: CollocationProgram) -> tuple[np.ndarray, np.ndarray]:
    """Return group, and place within it, of every unknown (n, 2) and every row (m, 2)."""
    return _Places(program).keys()


class _Places:
    """Group of every unknown and row, and place within it: shape (., 2).

    Within a group, unknowns alternate with the rows that fix them, so that pivots of order 2 stand
    side by side.
    """

    def __init__(self, program: CollocationProgram) -> None:
        self._program = program
        self._layout = program.layout
        self._degree = program.blocks.degree
        self._stages = self._degree + 2
        self._last = self._stages * sum(len(mesh) - 1 for mesh in program.meshes)
        self._unknowns = np.full((program.layout.size, 2), (self._last, 0))
        self._rows = np.full((program.program.rows, 2), (self._last, 0))

    def keys(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the keys of unknowns and rows."""
        begin = 0
        for i, places in enumerate(self._layout.phases):
            count = len(self._program.meshes[i]) - 1
            group = self._stages * (begin + np.arange(count))
            self._points(i, places.algebraic, group)
            self._intervals(i, places.inner_states, group)
            self._nodes(i, places.nodes[:-1], group + self._stages - 1)
            begin += count
        return self._unknowns, self._rows

    def _points(self, i: int, algebraic: np.ndarray, group: np.ndarray) -> None:
        program, blocks = self._program.program, self._program.blocks.phases[i]
        groups = (group[:, None] + np.arange(self._degree)).ravel()
        self._put(self._unknowns, algebraic.reshape(len(groups), -1).T, groups, 0)
        for block in (blocks.residual, blocks.path):
            if block.matters:
                self._put(self._rows, program.rows_of(block), groups, 1)

    def _intervals(self, i: int, inner: np.ndarray, group: np.ndarray) -> None:
        rows = self._program.program.rows_of(self._program.blocks.phases[i].interval)
        count = (self._degree - 1) * inner.shape[2]
        groups = group + self._degree
        self._put(self._unknowns, inner[:, :-1].reshape(len(inner), -1).T, groups, 0)
        self._put(self._rows, rows[:count], groups, 1)
        self._put(self._rows, rows[count:], groups + 1, 1)

    def _nodes(self, i: int, nodes: np.ndarray, groups: np.ndarray) -> None:
        layout, blocks = self._layout, self._program.blocks
        parts = (layout.states, layout.smooth, layout.integrals, layout.controls)
        columns = np.concatenate([part[nodes] for part in parts], axis=1).T
        self._put(self._unknowns, columns, groups, 0)
        if blocks.node.matters:
            rows = self._program.program.rows_of(blocks.node)[:, nodes]
            self._put(self._rows, rows, groups, 1)
        end = blocks.phases[i].end
        if end.matters and i + 1 < len(self._layout.phases):
            rows = self._program.program.rows_of(end)
            self._put(self._rows, rows, groups[-1:] + self._stages, 2)

    @staticmethod
    def _put(keys: np.ndarray, places: np.ndarray, groups: np.ndarray, side: int) -> None:
        """Give the places (k, count) the groups (count,), in the order of their first index."""
        keys[places, 0] = groups
        keys[places, 1] = 3 * np.arange(len(places))[:, None] + side
