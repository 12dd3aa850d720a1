"""Functions of a nonlinear program that CasADi's virtual machine evaluates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.assembly import FUNCTIONS, KINDS, Assembly, Part, Placement

__all__ = ["mapped_functions"]

_SHARED = (2, 3)
"""Inputs of a block that are the same at all occurrences: shared numbers and lam_f."""


def mapped_functions(
    assembly: Assembly, blocks: Sequence[Mapping[str, ca.Function]]
) -> dict[str, ca.Function]:
    """Return the functions of a program, block functions mapped over all occurrences.

    Args:
        assembly: The program.
        blocks: Functions of all kinds by block.
    """
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
