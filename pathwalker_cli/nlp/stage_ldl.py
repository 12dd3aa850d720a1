"""Solve large sparse symmetric indefinite systems in an order of elimination known beforehand.

`StageFactors` are the compiled factors (`native/stage_ldl.cpp`), `SymmetricSystem` a system solved
to the last digits by them, or by a library where they were not compiled.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np
import qdldl
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, gmres, splu

from pathwalker_cli.nlp.kernels import kernels

PIVOT_THRESHOLD: Final = 1e-6
"""Least share of a column's largest entry that a pivot has; refinement makes up for weak pivots."""

_REGULARISATIONS: Final = (1e-8, 1e-7, 1e-6, 1e-5)
"""Added to the diagonal so that factors without pivoting exist; the first that does is taken."""

_ACCURACY: Final = 1e-10
"""Residual relative to the right hand side at which a solution is good."""

_REFINEMENTS: Final = 30
"""Most steps of refinement."""

_GOOD_STEP: Final = 0.5
"""Share of the residual that a good step of refinement leaves at most."""

_GMRES: Final = {"rtol": 1e-13, "restart": 60, "maxiter": 3}
"""Where plain refinement does not get there: as far as GMRES gets in 180 directions."""

_GMRES_SLACK: Final = 1e3
"""How many times the residual of a good solution its own may be."""


@dataclass(frozen=True)
class Elimination:
    """Order of elimination of a symmetric system of n unknowns.

    Args:
        order: All unknowns in the order of elimination, shape (n,).
        ends: Where in `order` each group of unknowns ends, shape (groups,).
    """

    order: np.ndarray
    ends: np.ndarray


def in_order_of(keys: np.ndarray) -> Elimination:
    """Return the order of unknowns with these keys of group and place within it, shape (n, 2)."""
    order = np.lexsort(keys.T[::-1])
    ends = np.append(np.flatnonzero(np.diff(keys[order, 0])) + 1, len(order))
    return Elimination(order.astype(np.int32), ends.astype(np.int32))


@cache
def _library() -> ctypes.CDLL | None:
    """Return the library with the signatures of its functions declared."""
    library = kernels()
    if library is None:
        return None
    integers = np.ctypeslib.ndpointer(np.int32, flags="C")
    numbers = np.ctypeslib.ndpointer(np.float64, flags="C")
    handle, integer = ctypes.c_void_p, ctypes.c_int
    library.stage_ldl_new.restype = handle
    for name, arguments in {
        "new": [integer, integers, integer, integers],
        "free": [handle],
        "use": [handle],
        "analyse": [handle, integer, integer, integers, integers],
        "factorise": [handle, numbers, ctypes.c_double],
        "solve": [handle, integer, numbers],
        "report": [handle, numbers],
    }.items():
        getattr(library, f"stage_ldl_{name}").argtypes = arguments
    return library


def stage_factors() -> StageFactors | None:
    """Return a solver for the systems of one program, or None where it was not compiled."""
    library = _library()
    return None if library is None else StageFactors(library)


@dataclass(frozen=True)
class FactorReport:
    """Figures of a factorisation.

    Args:
        negative: Negative eigenvalues.
        delayed: Columns that found no pivot in their own group.
        operations: Multiplications and additions.
        count: Factorisations since the order was set.
    """

    negative: float
    delayed: float
    operations: float
    count: float


class StageFactors:
    """LDL^T factors of the systems that IPOPT meets in programs of one structure."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self._elimination = Elimination(np.zeros(0, np.int32), np.zeros(0, np.int32))
        self._solver = ctypes.c_void_p(None)
        self._free: Callable[[], Any] = lambda: None

    def begin(self, elimination: Elimination) -> None:
        """Answer to IPOPT in this thread; what is known of an equal pattern is kept."""
        self._order(elimination)
        self._library.stage_ldl_use(self._solver)

    def factorise(self, matrix: Any, elimination: Elimination) -> bool:
        """Factorise a sparse symmetric matrix of shape (n, n); return whether it is regular."""
        self._order(elimination)
        lower = sparse.tril(matrix, format="coo")
        rows, columns = ((k + 1).astype(np.int32) for k in (lower.row, lower.col))
        known = self._library.stage_ldl_analyse(
            self._solver, lower.shape[0], lower.nnz, rows, columns
        )
        if not known:
            raise ValueError("the order does not fit the matrix")
        values = np.ascontiguousarray(lower.data, float)
        return bool(self._library.stage_ldl_factorise(self._solver, values, PIVOT_THRESHOLD))

    def solve(self, right: np.ndarray) -> np.ndarray:
        """Return the solution for one right hand side, shape (n,)."""
        solution = np.array(right, float)
        self._library.stage_ldl_solve(self._solver, 1, solution)
        return solution

    @property
    def report(self) -> FactorReport:
        """What the last factorisation met."""
        figures = np.zeros(4)
        self._library.stage_ldl_report(self._solver, figures)
        return FactorReport(*figures.tolist())

    def _order(self, elimination: Elimination) -> None:
        order, ends, known = elimination.order, elimination.ends, self._elimination
        if not (np.array_equal(known.order, order) and np.array_equal(known.ends, ends)):
            solver = self._library.stage_ldl_new(len(order), order, len(ends), ends)
            self._solver, self._elimination = ctypes.c_void_p(solver), elimination
            self._free()
            self._free = weakref.finalize(self, self._library.stage_ldl_free, self._solver)


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
        compiled = None if elimination is None else stage_factors()
        self._factors: Any = compiled
        if not (elimination and compiled and compiled.factorise(self._matrix, elimination)):
            signs = np.where(np.arange(self._matrix.shape[0]) < positive, 1.0, -1.0)
            self._factors = _regularised(self._matrix, signs)

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
        solution, _ = gmres(self._matrix, right, M=near, **_GMRES)
        if np.abs(right - self._matrix @ solution).max() <= _GMRES_SLACK * goal:
            return np.asarray(solution)
        self._factors = splu(self._matrix)
        return np.asarray(self._factors.solve(right))


def _regularised(matrix: Any, signs: np.ndarray) -> Any:
    """Return factors of nearly the same matrix, with more of these signs on its diagonal."""
    for amount in _REGULARISATIONS:
        regular = sparse.csc_matrix(matrix + sparse.diags_array(amount * signs))
        try:
            return qdldl.Solver(sparse.triu(regular, format="csc"), upper=True)
        except RuntimeError:
            continue
    return splu(matrix)
