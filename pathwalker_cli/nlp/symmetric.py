"""Solve large sparse symmetric indefinite systems whose right hand sides are many."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import qdldl
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, gmres, splu

from pathwalker_cli.nlp.elimination import Elimination
from pathwalker_cli.nlp.stage_ldl import stage_factors

__all__ = ["SymmetricSystem"]

_REGULARISATIONS: Final = (1e-8, 1e-7, 1e-6, 1e-5)
"""Added to the diagonal so that factors without pivoting exist; the first that does is taken."""

_ACCURACY: Final = 1e-10
"""Residual relative to the right hand side at which a solution is good."""

_REFINEMENTS: Final = 30
"""Most steps of refinement."""

_GOOD_STEP: Final = 0.5
"""Share of the residual that a good step of refinement leaves at most."""


class SymmetricSystem:
    """Factors of a symmetric matrix [[H, A'], [A, -D]] with D >= 0.

    The factors L D L' are those of the compiled solver, or those of a slightly regularised matrix.
    Refinement with the matrix itself makes up for weak pivots and takes the regularisation out.

    Args:
        matrix: The matrix, shape (n, n).
        positive: Number of leading rows that belong to H.
        elimination: A good order of elimination, for the compiled solver; without it, or where it
            was not compiled, the matrix is regularised.
    """

    def __init__(self, matrix: Any, positive: int, elimination: Elimination | None = None) -> None:
        self._matrix = sparse.csc_array(matrix)
        self._factors = self._compiled(elimination)
        if self._factors is None:
            size = self._matrix.shape[0]
            signs = np.where(np.arange(size) < positive, 1.0, -1.0)
            self._factors = _factors(self._matrix, signs)

    def _compiled(self, elimination: Elimination | None) -> Any:
        """Return the compiled solver with factors, or None where there are none."""
        compiled = stage_factors()
        if compiled is None or elimination is None:
            return None
        return compiled if compiled.factorise(self._matrix, elimination) else None

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution for one right hand side, shape (n,)."""
        goal = _ACCURACY * max(float(np.abs(right).max(initial=0.0)), 1e-300)
        solution = np.zeros_like(right)
        residual, worst = right, np.inf
        for _ in range(_REFINEMENTS):
            size = float(np.abs(residual).max(initial=0.0))
            if size <= goal:
                return solution
            if size > _GOOD_STEP * worst:
                break
            solution = solution + self._factors.solve(residual)
            residual, worst = right - self._matrix @ solution, size
        return self._accelerated(right, goal)

    def _accelerated(self, right: np.ndarray, goal: float) -> np.ndarray:
        """Return the solution where plain refinement does not get there."""
        size = self._matrix.shape
        near = LinearOperator(size, matvec=lambda v: self._factors.solve(np.ravel(v)))
        solution, _ = gmres(self._matrix, right, M=near, rtol=1e-13, restart=60, maxiter=3)
        if np.abs(right - self._matrix @ solution).max() <= 1e3 * goal:
            return np.asarray(solution)
        self._factors = splu(self._matrix)
        return np.asarray(self._factors.solve(right))


def _factors(matrix: Any, signs: np.ndarray) -> Any:
    """Return an object that solves the matrix, nearly."""
    for amount in _REGULARISATIONS:
        regular = sparse.csc_matrix(matrix + sparse.diags_array(amount * signs))
        try:
            return qdldl.Solver(sparse.triu(regular, format="csc"), upper=True)
        except RuntimeError:
            continue
    return splu(matrix)
