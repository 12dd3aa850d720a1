"""Nonlinear programs assembled from many small, repeated blocks.

A block is one small SX function of a few unknowns; it occurs many times with other unknowns.  Its
Jacobian and Hessian are derived once, mapped over all occurrences, and scattered into the sparse
derivatives of the whole.  Building therefore costs the same on every mesh.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from pathwalker_cli.ocp.frozen import FrozenTerms

__all__ = ["Block", "BlockProgram", "Occurrences"]


@dataclass(frozen=True)
class Block:
    """A small function that occurs many times in a nonlinear program.

    Args:
        name: Name for reports.
        unknowns: Its unknowns, SX of shape (n,).
        data: Numbers that differ from occurrence to occurrence, SX of shape (m,).
        shared: Numbers that all occurrences have in common, SX of shape (s,).
        constraints: Constraint rows, SX of shape (r,).
        objective: Its part of the objective, scalar SX.
        frozen: Stand-ins used in the expressions, see `FrozenTerms`.
    """

    name: str
    unknowns: ca.SX
    data: ca.SX
    shared: ca.SX
    constraints: ca.SX
    objective: ca.SX = field(default_factory=lambda: ca.SX(0))
    frozen: FrozenTerms = field(default_factory=FrozenTerms)

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return int(self.constraints.numel())

    @property
    def matters(self) -> bool:
        """Whether the block has rows or adds to the objective."""
        return bool(self.rows) or self.has_objective

    @property
    def has_objective(self) -> bool:
        """Whether the block adds to the objective."""
        return not self.objective.is_zero()

    @cached_property
    def values(self) -> ca.Function:
        """Function (unknowns, data, shared) -> constraints, objective."""
        return self._function("values", [self.constraints, self.objective], [])

    @cached_property
    def jacobian(self) -> ca.Function:
        """Function (unknowns, data, shared) -> Jacobian of constraints, gradient of objective."""
        return self._function("jacobian", self._first_derivatives, [])

    @cached_property
    def hessian(self) -> ca.Function:
        """Function (unknowns, data, shared, lam_f, lam_g) -> upper Hessian of the Lagrangian."""
        lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", self.rows)
        lagrangian = lam_f * self.objective + ca.dot(lam_g, self.constraints)
        hessian = ca.triu(ca.hessian(lagrangian, self.unknowns)[0])
        return self._function("hessian", [hessian], [lam_f, lam_g])

    @cached_property
    def _first_derivatives(self) -> list[ca.SX]:
        gradient = ca.gradient(self.objective, self.unknowns)
        return [ca.jacobian(self.constraints, self.unknowns), ca.sparsify(gradient)]

    def _function(self, kind: str, outputs: list[ca.SX], more: list[ca.SX]) -> ca.Function:
        """Return a function in which the frozen symbols are replaced by what they stand for."""
        inputs = [self.unknowns, self.data, self.shared, *more]
        name = f"{self.name}_{kind}"
        if not self.frozen.symbols:
            return ca.Function(name, inputs, outputs)
        outer = ca.Function("frozen", [*inputs, self.frozen.symbol_vector], outputs)
        results = outer.call([*inputs, self.frozen.meaning_vector], True, False)
        return ca.Function(name, inputs, results)


@dataclass(frozen=True)
class Occurrences:
    """Where a block occurs.

    Args:
        block: The block.
        columns: Index of each local unknown in the program, shape (n, count).
        data: Numbers of each occurrence, shape (m, count).
        lower: Lower bounds of the rows, shape (r, count).
        upper: Upper bounds of the rows, shape (r, count).
        row_scale: Physical units per row unit, shape (r,).
        row_names: Names of the rows, r of them.
        labels: Where each occurrence is, e.g. "left_flat at 40 %", count of them.
        times: Instant of every row, shape (r, count); only differences within a series matter.
        weights: Quadrature weight of every row, shape (r, count).
        series: Rows of the same series sample one function of time; r names.
    """

    block: Block
    columns: np.ndarray
    data: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    row_scale: np.ndarray
    row_names: Sequence[str]
    labels: Sequence[str]
    times: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    weights: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    series: Sequence[str] = ()

    def __post_init__(self) -> None:
        """Let rows that stand at one instant only, or alone, be their own series."""
        shape = (self.block.rows, self.count)
        for name, default in (("times", 0.0), ("weights", 1.0)):
            if not getattr(self, name).size:
                object.__setattr__(self, name, np.full(shape, default))
        if not self.series:
            object.__setattr__(self, "series", tuple(map(str, range(self.block.rows))))

    @property
    def count(self) -> int:
        """Number of occurrences."""
        return int(self.columns.shape[1])


class BlockProgram:
    """A nonlinear program: minimise f(x; p) subject to bounds on x and g(x; p).

    The parameters p are the shared numbers followed by the data of all occurrences.

    Args:
        size: Number of unknowns.
        occurrences: All blocks with their places; the rows of g follow their order.
        shared_size: Number of shared numbers.
    """

    def __init__(self, size: int, occurrences: Sequence[Occurrences], shared_size: int) -> None:
        self.size = size
        self.occurrences = tuple(o for o in occurrences if o.count and o.block.matters)
        self.shared_size = shared_size
        self.lower = self._stack([o.lower for o in self.occurrences])
        self.upper = self._stack([o.upper for o in self.occurrences])
        sizes = [o.block.rows * o.count for o in self.occurrences]
        self._row_offsets = np.concatenate([[0], np.cumsum(sizes)]).astype(int)
        data_sizes = [o.data.size for o in self.occurrences]
        self._data_offsets = shared_size + np.concatenate([[0], np.cumsum(data_sizes)]).astype(int)

    @staticmethod
    def _stack(arrays: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate([array.ravel(order="F") for array in arrays] or [np.zeros(0)])

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return int(self._row_offsets[-1])

    def parameters(self, shared: np.ndarray) -> np.ndarray:
        """Return the parameter vector p for these shared numbers."""
        return np.concatenate([shared, self._stack([o.data for o in self.occurrences])])

    def row_name(self, row: int) -> str:
        """Return what a row of g is and where, e.g. "toe_l height in right_toe at 40 %"."""
        name, where = self.row_place(row)
        return f"{name} in {where}"

    def row_place(self, row: int) -> tuple[str, str]:
        """Return the name of a row of g and where it stands."""
        which = int(np.searchsorted(self._row_offsets, row, side="right")) - 1
        occurrence = self.occurrences[which]
        instance, local = divmod(row - self._row_offsets[which], occurrence.block.rows)
        return occurrence.row_names[local], occurrence.labels[instance]

    @property
    def row_scale(self) -> np.ndarray:
        """Physical units per unit of every row."""
        return np.concatenate([np.tile(o.row_scale, o.count) for o in self.occurrences])

    def functions(self) -> dict[str, ca.Function]:
        """Return `nlp`, `grad_f`, `jac_g` and `hess_lag` in the form that `casadi.nlpsol` takes."""
        x, p = ca.MX.sym("x", self.size), ca.MX.sym("p", int(self._data_offsets[-1]))
        lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", self.rows)
        g, f = self._values(x, p)
        jacobian, gradient = self._first_order(x, p)
        hessian = self._second_order(x, p, lam_f, lam_g)
        names = {"x": x, "p": p}
        return {
            "nlp": ca.Function("nlp", [x, p], [f, g], ["x", "p"], ["f", "g"]),
            "grad_f": ca.Function("grad_f", [x, p], [f, gradient], list(names), ["f", "grad_f_x"]),
            "jac_g": ca.Function("jac_g", [x, p], [g, jacobian], list(names), ["g", "jac_g_x"]),
            "hess_lag": ca.Function(
                "hess_lag",
                [x, p, lam_f, lam_g],
                [hessian],
                ["x", "p", "lam_f", "lam_g"],
                ["triu_hess_gamma_x_x"],
            ),
        }

    def _inputs(self, i: int, x: ca.MX, p: ca.MX) -> list[ca.MX]:
        """Return unknowns, data and shared numbers of all occurrences of block i, one a column."""
        o = self.occurrences[i]
        unknowns = ca.reshape(x[o.columns.ravel(order="F").tolist()], *o.columns.shape)
        data = p[int(self._data_offsets[i]) : int(self._data_offsets[i + 1])]
        shared = p[: self.shared_size]
        return [unknowns, ca.reshape(data, *o.data.shape), shared]

    def _mapped(self, function: ca.Function, count: int) -> ca.Function:
        """Return a function mapped over columns; the shared numbers (input 2, lam_f) are not."""
        fixed = [2] + ([3] if function.n_in() > 3 else [])
        return function.map(f"{function.name()}_{count}", "serial", count, fixed, [])

    def _values(self, x: ca.MX, p: ca.MX) -> tuple[ca.MX, ca.MX]:
        rows, objective = [], ca.MX(0)
        for i, o in enumerate(self.occurrences):
            g, f = self._mapped(o.block.values, o.count)(*self._inputs(i, x, p))
            rows.append(ca.vec(g))
            if o.block.has_objective:
                objective += ca.sum2(f)
        return ca.vertcat(*rows), objective

    def _first_order(self, x: ca.MX, p: ca.MX) -> tuple[ca.MX, ca.MX]:
        entries, row_of, column_of = [], [], []
        gradient = ca.MX.zeros(self.size)
        for i, o in enumerate(self.occurrences):
            function = o.block.jacobian
            rows, columns = (np.array(k, int) for k in function.sparsity_out(0).get_triplet())
            blocks, slopes = self._mapped(function, o.count)(*self._inputs(i, x, p))
            entries.append(ca.vec(blocks).nz[:])
            offsets = self._row_offsets[i] + o.block.rows * np.arange(o.count)
            row_of.append((rows[:, None] + offsets).ravel(order="F"))
            column_of.append(o.columns[columns].ravel(order="F"))
            if o.block.has_objective:
                where = o.columns[np.array(function.sparsity_out(1).row(), int)].ravel(order="F")
                gradient += _scatter(where, self.size) @ ca.vec(slopes).nz[:]
        jacobian = _place(ca.vertcat(*entries), row_of, column_of, (self.rows, self.size))
        return jacobian, gradient

    def _second_order(self, x: ca.MX, p: ca.MX, lam_f: ca.MX, lam_g: ca.MX) -> ca.MX:
        entries, row_of, column_of = [], [], []
        for i, o in enumerate(self.occurrences):
            function = o.block.hessian
            rows, columns = (np.array(k, int) for k in function.sparsity_out(0).get_triplet())
            if not rows.size:
                continue
            lam = lam_g[int(self._row_offsets[i]) : int(self._row_offsets[i + 1])]
            inputs = [*self._inputs(i, x, p), lam_f, ca.reshape(lam, o.block.rows, o.count)]
            entries.append(ca.vec(self._mapped(function, o.count)(*inputs)).nz[:])
            first, second = o.columns[rows], o.columns[columns]
            row_of.append(np.minimum(first, second).ravel(order="F"))
            column_of.append(np.maximum(first, second).ravel(order="F"))
        return _place(ca.vertcat(*entries), row_of, column_of, (self.size, self.size))


def _scatter(where: np.ndarray, size: int) -> ca.DM:
    """Return the 0/1 matrix that adds entry k of a vector into position where[k]."""
    count = len(where)
    return ca.DM.triplet(where.tolist(), list(range(count)), ca.DM.ones(count), size, count)


def _place(
    entries: ca.MX, rows: list[np.ndarray], columns: list[np.ndarray], shape: tuple[int, int]
) -> ca.MX:
    """Return the sparse matrix with these entries; entries at the same place are added."""
    place = np.concatenate(columns) * shape[0] + np.concatenate(rows)
    unique, inverse = np.unique(place, return_inverse=True)
    pattern = ca.Sparsity.triplet(
        *shape, (unique % shape[0]).tolist(), (unique // shape[0]).tolist()
    )
    if len(unique) == len(place):
        values = entries[np.argsort(inverse).tolist()]
    else:
        values = _scatter(inverse, len(unique)) @ entries
    return ca.MX(pattern, values)
