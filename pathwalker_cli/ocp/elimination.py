"""In which order the unknowns of a collocation program's Newton systems are eliminated.

Everything that belongs to one collocation point is eliminated with it, then what is left of its
interval, then the node at which the interval begins; what ties first and last instant together
comes last.  All groups are small, whatever the mesh.  Slacks go with their rows.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from pathwalker_cli.nlp.blocks import Block
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.layout import Layout, PhasePlaces

RowsOf = Callable[[Block], np.ndarray]


class StageKeys:
    """Group of every unknown and row, and place within it: shape (., 2).

    Within a group, unknowns alternate with the rows that fix them, so that pivots of order 2 stand
    side by side.

    Args:
        rows: Number of rows.
        rows_of: Returns the rows that a block stands for, shape (rows, occurrences).
    """

    def __init__(
        self, layout: Layout[PhasePlaces], blocks: CollocationBlocks, rows: int, rows_of: RowsOf
    ) -> None:
        self._layout, self._blocks, self._rows_of = layout, blocks, rows_of
        self._degree = blocks.degree
        self._stages = self._degree + 2
        last = self._stages * sum(len(places.algebraic) for places in layout.phases)
        self._unknowns = np.full((layout.size, 2), (last, 0))
        self._rows = np.full((rows, 2), (last, 0))

    def keys(self) -> tuple[np.ndarray, np.ndarray]:
        """Return the keys of unknowns and rows."""
        begin = 0
        for i, places in enumerate(self._layout.phases):
            count = len(places.algebraic)
            group = self._stages * (begin + np.arange(count))
            self._points(i, places.algebraic, group)
            self._intervals(i, places.inner_states, group)
            self._nodes(i, places.nodes[:-1], group + self._stages - 1)
            begin += count
        return self._unknowns, self._rows

    def _points(self, i: int, algebraic: np.ndarray, group: np.ndarray) -> None:
        blocks = self._blocks.phases[i]
        groups = (group[:, None] + np.arange(self._degree)).ravel()
        self._put(self._unknowns, algebraic.reshape(len(groups), -1).T, groups, 0)
        for block in (blocks.residual, blocks.path):
            if block.matters:
                self._put(self._rows, self._rows_of(block), groups, 1)

    def _intervals(self, i: int, inner: np.ndarray, group: np.ndarray) -> None:
        rows = self._rows_of(self._blocks.phases[i].interval)
        count = (self._degree - 1) * inner.shape[2]
        groups = group + self._degree
        self._put(self._unknowns, inner[:, :-1].reshape(len(inner), -1).T, groups, 0)
        self._put(self._rows, rows[:count], groups, 1)
        self._put(self._rows, rows[count:], groups + 1, 1)

    def _nodes(self, i: int, nodes: np.ndarray, groups: np.ndarray) -> None:
        layout, blocks = self._layout, self._blocks
        parts = (layout.states, layout.smooth, layout.integrals, layout.controls)
        columns = np.concatenate([part[nodes] for part in parts], axis=1).T
        self._put(self._unknowns, columns, groups, 0)
        if blocks.node.matters:
            rows = self._rows_of(blocks.node)[:, nodes]
            self._put(self._rows, rows, groups, 1)
        end = blocks.phases[i].end
        if end.matters and i + 1 < len(self._layout.phases):
            rows = self._rows_of(end)
            self._put(self._rows, rows, groups[-1:] + self._stages, 2)

    @staticmethod
    def _put(keys: np.ndarray, places: np.ndarray, groups: np.ndarray, side: int) -> None:
        """Give the places (k, count) the groups (count,), in the order of their first index."""
        keys[places, 0] = groups
        keys[places, 1] = 3 * np.arange(len(places))[:, None] + side
