"""Nonlinear programs assembled from many small, repeated blocks.

A block is one small SX function of a few unknowns; it occurs many times with other unknowns.  Its
Jacobian and Hessian are derived once, evaluated at all occurrences, and scattered into the sparse
derivatives of the whole.  Building therefore costs the same on every mesh.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.assembly import Assembly, Part, Source, mapped_functions
from pathwalker_cli.nlp.frozen import FrozenTerms
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape import Tape, patterns_of
from pathwalker_cli.nlp.taped import taped_functions


@dataclass(frozen=True)
class Expressions:
    """What a block computes.

    Args:
        unknowns: Its unknowns, SX of shape (n,).
        data: Numbers that differ from occurrence to occurrence, SX of shape (m,).
        shared: Numbers that all occurrences have in common, SX of shape (s,).
        constraints: Constraint rows, SX of shape (r,).
        objective: Its part of the objective, scalar SX.
        frozen: Stand-ins used in the expressions, see `FrozenTerms`.
    """

    unknowns: ca.SX
    data: ca.SX
    shared: ca.SX
    constraints: ca.SX
    objective: ca.SX = field(default_factory=lambda: ca.SX(0))
    frozen: FrozenTerms = field(default_factory=FrozenTerms)

    def functions(self, name: str) -> dict[str, ca.Function]:
        """Return the functions by kind.

        `values`: (unknowns, data, shared) -> constraints, objective; `jacobian`: the same ->
        Jacobian of constraints, gradient of objective; `hessian`: (..., lam_f, lam_g) -> upper
        Hessian of the Lagrangian.
        """
        x, objective, rows = self.unknowns, self.objective, self.constraints
        gradient = ca.sparsify(ca.gradient(objective, x))
        lam_f, lam_g = ca.SX.sym("lam_f"), ca.SX.sym("lam_g", rows.numel())
        lagrangian = lam_f * objective + ca.dot(lam_g, rows)
        hessian = ca.triu(ca.hessian(lagrangian, x)[0])
        return {
            "values": self._function(f"{name}_values", [rows, ca.sparsify(objective)]),
            "jacobian": self._function(f"{name}_jacobian", [ca.jacobian(rows, x), gradient]),
            "hessian": self._function(f"{name}_hessian", [hessian], lam_f, lam_g),
        }

    def _function(self, name: str, outputs: list[ca.SX], *more: ca.SX) -> ca.Function:
        """Return a function in which the frozen symbols are replaced by what they stand for."""
        inputs = [self.unknowns, self.data, self.shared, *more]
        if not self.frozen.symbols:
            return ca.Function(name, inputs, outputs)
        outer = ca.Function("frozen", [*inputs, self.frozen.symbol_vector], outputs)
        results = outer.call([*inputs, self.frozen.meaning_vector], True, False)
        return ca.Function(name, inputs, results)


class Block:
    """A small function that occurs many times in a nonlinear program.

    Args:
        build: Returns its expressions; called when somebody asks for what is not kept.
        kept: Number of rows and tapes by kind, where they are known; a block that does not matter
            has none.
    """

    def __init__(
        self,
        name: str,
        build: Callable[[], Expressions],
        kept: tuple[int, dict[str, Tape]] | None = None,
    ) -> None:
        self.name = name
        self.kept = kept
        self._build = build

    @cached_property
    def expressions(self) -> Expressions:
        """What it computes."""
        return self._build()

    @cached_property
    def rows(self) -> int:
        """Number of constraint rows."""
        return self.kept[0] if self.kept else int(self.expressions.constraints.numel())

    @cached_property
    def matters(self) -> bool:
        """Whether the block has rows or adds to the objective."""
        if self.kept:
            return bool(self.kept[1])
        return bool(self.rows) or not self.expressions.objective.is_zero()

    @cached_property
    def tapes(self) -> dict[str, Tape] | None:
        """Tapes of the functions by kind; None where one cannot be made."""
        if self.kept:
            return self.kept[1]
        tapes = {}
        for kind, function in self.functions.items():
            tape = Tape.of(function)
            if tape is None:
                return None
            tapes[kind] = tape
        return tapes

    @cached_property
    def functions(self) -> dict[str, ca.Function]:
        """The functions by kind, see `Expressions.functions`."""
        return self.expressions.functions(self.name)

    @property
    def patterns(self) -> dict[str, tuple[np.ndarray, ...]]:
        """Row and column of the nonzeros of every output, shape (nnz, 2) each, by kind."""
        if self.tapes is not None:
            return {kind: tape.patterns for kind, tape in self.tapes.items()}
        return {kind: patterns_of(function) for kind, function in self.functions.items()}


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
        labels: Where each occurrence is, e.g. "ascent at 40 % of the phase", count of them.
        times: Instants of the rows, shape (r, count) or broadcast to it; only differences within a
            series matter.
        weights: Quadrature weights of the rows, shape (r, count) or broadcast to it.
        series: Rows of the same series sample one function of time; r names, or none where every
            row is its own.
    """

    block: Block
    columns: np.ndarray
    data: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    row_scale: np.ndarray
    row_names: Sequence[str]
    labels: Sequence[str]
    times: np.ndarray | float = 0.0
    weights: np.ndarray | float = 1.0
    series: Sequence[str] = ()

    @property
    def count(self) -> int:
        """Number of occurrences."""
        return int(self.columns.shape[1])


class BlockProgram:
    """The rows, objective and derivatives of a nonlinear program that is made of blocks.

    The parameters p are the shared numbers followed by the data of all occurrences.

    Args:
        size: Number of unknowns.
        occurrences: All blocks with their places; the rows of g follow their order.
        shared: The shared numbers.
    """

    def __init__(self, size: int, occurrences: Sequence[Occurrences], shared: np.ndarray) -> None:
        self.size = size
        self.occurrences = tuple(o for o in occurrences if o.count and o.block.matters)
        self._shared = shared
        sizes = [o.block.rows * o.count for o in self.occurrences]
        self._row_offsets = np.cumsum([0, *sizes])
        self._data_offsets = np.cumsum([len(shared), *(o.data.size for o in self.occurrences)])

    @property
    def rows(self) -> int:
        """Number of constraint rows."""
        return int(self._row_offsets[-1])

    @cached_property
    def row_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Scaled lower and upper bounds of all rows."""
        lower = _stacked([o.lower for o in self.occurrences])
        return lower, _stacked([o.upper for o in self.occurrences])

    @property
    def row_scale(self) -> np.ndarray:
        """Physical units per unit of every row."""
        return np.concatenate([np.tile(o.row_scale, o.count) for o in self.occurrences])

    @property
    def parameters(self) -> np.ndarray:
        """The parameter vector p."""
        return np.concatenate([self._shared, _stacked([o.data for o in self.occurrences])])

    def row_place(self, i: int) -> tuple[str, str]:
        """Return the name of a row of g and where it stands."""
        which = int(np.searchsorted(self._row_offsets, i, side="right")) - 1
        occurrence = self.occurrences[which]
        instance, local = divmod(i - self._row_offsets[which], occurrence.block.rows)
        return occurrence.row_names[local], occurrence.labels[instance]

    def rows_of(self, block: Block) -> np.ndarray:
        """Return the rows of g that a block stands for, shape (rows, occurrences)."""
        i = next(i for i, o in enumerate(self.occurrences) if o.block is block)
        return self._row_offsets[i] + _numbered((block.rows, self.occurrences[i].count))

    @cached_property
    def functions(self) -> Mapping[str, ca.Function]:
        """`nlp`, `grad_f`, `jac_g` and `hess_lag` in the form that `casadi.nlpsol` takes.

        They live as long as this program or the mapping does; a solver alone does not keep them.
        """
        tapes = [o.block.tapes for o in self.occurrences] if kernels() is not None else [None]
        known = [of_block for of_block in tapes if of_block is not None]
        if len(known) < len(tapes):
            return self.plain_functions()
        return taped_functions(self._assembly, known)

    def plain_functions(self) -> Mapping[str, ca.Function]:
        """Return the same from expressions derived anew, for CasADi's virtual machine."""
        return mapped_functions(self._assembly, [o.block.functions for o in self.occurrences])

    @cached_property
    def _assembly(self) -> Assembly:
        parts = [
            Part(o.block.patterns, o.count, self._sources(i, o))
            for i, o in enumerate(self.occurrences)
        ]
        return Assembly(self.size, int(self._data_offsets[-1]), self.rows, parts)

    def _sources(self, i: int, o: Occurrences) -> tuple[Source, ...]:
        """Return where the inputs of block i come from."""
        return (
            Source("x", o.columns),
            Source("p", self._data_offsets[i] + _numbered(o.data.shape)),
            Source("p", np.arange(len(self._shared))[:, None]),
            Source("lam_f", np.zeros((1, 1), int)),
            Source("lam_g", self._row_offsets[i] + _numbered(o.lower.shape)),
        )


def _stacked(arrays: Sequence[np.ndarray]) -> np.ndarray:
    """Return arrays one after the other, each occurrence by occurrence."""
    return np.concatenate([array.ravel(order="F") for array in arrays] or [np.zeros(0)])


def _numbered(shape: tuple[int, ...]) -> np.ndarray:
    """Return the places of an array in its stacked form, shape as given."""
    return np.arange(np.prod(shape)).reshape(shape, order="F")
