"""How functions of small, repeated blocks make up the functions of a nonlinear program."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import casadi as ca
import numpy as np

KINDS: Final = {"values": ("g1", "11"), "jacobian": ("gx", "x1"), "hessian": ("xx",)}
"""The block functions and the axes of their outputs: rows g, unknowns x or a single number."""

FUNCTIONS: Final = {
    "nlp": (("x", "p"), {"f": ("values", 1), "g": ("values", 0)}),
    "grad_f": (("x", "p"), {"f": ("values", 1), "grad_f_x": ("jacobian", 1)}),
    "jac_g": (("x", "p"), {"g": ("values", 0), "jac_g_x": ("jacobian", 0)}),
    "hess_lag": (("x", "p", "lam_f", "lam_g"), {"triu_hess_gamma_x_x": ("hessian", 0)}),
}
"""Arguments and results of the program's functions; a result sums one output of all blocks."""

_SHARED: Final = (2, 3)
"""Inputs of a block that are the same at all occurrences: shared numbers and lam_f."""


@dataclass(frozen=True)
class Source:
    """Where an input of a block comes from.

    Args:
        argument: Argument of the program's functions.
        elements: Elements of it, shape (n, count), or (n, 1) if all occurrences share them.
    """

    argument: str
    elements: np.ndarray


@dataclass(frozen=True)
class Part:
    """A block with its places in a program.

    Args:
        patterns: Row and column of the nonzeros of every output, shape (nnz, 2) each, by kind.
        count: How often it occurs.
        sources: Unknowns, data, shared numbers, lam_f and lam_g.
    """

    patterns: Mapping[str, Sequence[np.ndarray]]
    count: int
    sources: tuple[Source, ...]

    def inputs(self, kind: str) -> tuple[Source, ...]:
        """Return where the inputs of the function of this kind come from."""
        return self.sources if kind == "hessian" else self.sources[:3]

    def places(self, kind: str, output: int) -> tuple[np.ndarray, np.ndarray]:
        """Return row and column of all nonzeros of an output, shape (nnz, count) each."""
        axes = KINDS[kind][output]
        along = {
            "x": self.sources[0].elements,
            "g": self.sources[-1].elements,
            "1": np.zeros((1, self.count), int),
        }
        rows, columns = self.patterns[kind][output].T
        first, second = along[axes[0]][rows], along[axes[1]][columns]
        if axes == "xx":
            return np.minimum(first, second), np.maximum(first, second)
        return first, second


@dataclass(frozen=True)
class Placement:
    """Where one output of every block goes in one result; what meets there is added.

    Args:
        sparsity: Pattern of the result.
        positions: Nonzero of the result for every nonzero of the output, shape (nnz, count), by
            block.
    """

    sparsity: ca.Sparsity
    positions: tuple[np.ndarray, ...]

    @classmethod
    def make(
        cls,
        shape: tuple[int, int],
        places: Sequence[tuple[np.ndarray, np.ndarray]],
        dense: bool,
    ) -> Placement:
        """Return the placement of entries at these rows and columns.

        Args:
            shape: Shape of the result.
            places: Row and column of every entry, shape (nnz, count) each, by block.
            dense: Whether the result also has places for what is always zero.
        """
        wanted = [rows + shape[0] * columns for rows, columns in places]
        if dense:
            return cls(ca.Sparsity.dense(*shape), tuple(wanted))
        flat = np.concatenate([np.zeros(0, int), *(place.ravel() for place in wanted)])
        unique, inverse = np.unique(flat, return_inverse=True)
        where = (unique % shape[0]).tolist(), (unique // shape[0]).tolist()
        parts = np.split(inverse, np.cumsum([place.size for place in wanted])[:-1])
        positions = (part.reshape(place.shape) for part, place in zip(parts, wanted, strict=True))
        return cls(ca.Sparsity.triplet(*shape, *where), tuple(positions))


@dataclass(frozen=True)
class Assembly:
    """All blocks of a program.

    Args:
        size: Number of unknowns.
        parameters: Number of parameters.
        rows: Number of rows.
    """

    size: int
    parameters: int
    rows: int
    parts: Sequence[Part]

    @property
    def arguments(self) -> dict[str, int]:
        """Lengths of the arguments of the program's functions."""
        return {"x": self.size, "p": self.parameters, "lam_f": 1, "lam_g": self.rows}

    @cached_property
    def placements(self) -> dict[str, tuple[Placement, ...]]:
        """Where the outputs of the blocks go, by kind of function."""
        sizes = {"x": self.size, "g": self.rows, "1": 1}
        return {
            kind: tuple(
                Placement.make(
                    (sizes[axes[0]], sizes[axes[1]]),
                    [part.places(kind, output) for part in self.parts],
                    dense="1" in axes,
                )
                for output, axes in enumerate(outputs)
            )
            for kind, outputs in KINDS.items()
        }


def mapped_functions(
    assembly: Assembly, blocks: Sequence[Mapping[str, ca.Function]]
) -> dict[str, ca.Function]:
    """Return the functions of a program, evaluated by CasADi's virtual machine."""
    symbols = {name: ca.MX.sym(name, size) for name, size in assembly.arguments.items()}
    outputs = {
        kind: [
            _outputs(part, kind, block[kind], symbols)
            for part, block in zip(assembly.parts, blocks, strict=True)
        ]
        for kind in KINDS
    }
    functions = {}
    for name, (arguments, results) in FUNCTIONS.items():
        expressions = [
            _sum(assembly.placements[kind][k], [of_part[k] for of_part in outputs[kind]])
            for kind, k in results.values()
        ]
        given = [symbols[argument] for argument in arguments]
        functions[name] = ca.Function(name, given, expressions, list(arguments), list(results))
    return functions


def _outputs(
    part: Part, kind: str, function: ca.Function, symbols: Mapping[str, ca.MX]
) -> list[ca.MX]:
    """Return the outputs of a block, those of all occurrences side by side."""
    inputs = [
        ca.reshape(symbols[source.argument][source.elements.ravel("F").tolist()],
                   *source.elements.shape)
        for source in part.inputs(kind)
    ]  # fmt: skip
    shared = [k for k in _SHARED if k < len(inputs)]
    name = f"{function.name()}_{part.count}"
    return function.map(name, "serial", part.count, shared, []).call(inputs)


def _sum(placement: Placement, outputs: Sequence[ca.MX]) -> ca.MX:
    """Return the result that outputs of all blocks add up to."""
    entries = ca.vertcat(*(ca.vec(output).nz[:] for output in outputs if output.nnz()))
    where = np.concatenate([np.zeros(0, int), *(p.ravel("F") for p in placement.positions)])
    count, size = len(where), placement.sparsity.nnz()
    if np.array_equal(np.sort(where), np.arange(size)):
        return ca.MX(placement.sparsity, entries[np.argsort(where).tolist()])
    ones = ca.DM.ones(count)
    adding = ca.DM.triplet(where.tolist(), list(range(count)), ones, size, count)
    return ca.MX(placement.sparsity, adding @ entries)
