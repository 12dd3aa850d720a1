"""The compiled linear solver that knows the order of elimination (native/stage_ldl.cpp).

IPOPT finds linear solvers at run time by the names of the routines of HSL; the library answers to
those of MA57.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from typing import Any, Final

import numpy as np
from scipy import sparse

from pathwalker_cli.nlp.elimination import Elimination
from pathwalker_cli.nlp.kernels import kernels, kernels_path

__all__ = ["FactorReport", "StageFactors", "stage_factors"]

_THRESHOLD: Final = 1e-6
"""Least share of a column's largest entry that a pivot has; residuals are refined by IPOPT."""


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
    """LDL^T factors of the systems that IPOPT meets in programs of one structure.

    Args:
        library: The compiled library.
    """

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        self._elimination = Elimination(np.zeros(0, np.int32), np.zeros(0, np.int32))
        self._solver = ctypes.c_void_p(None)
        self._free: Callable[[], Any] = lambda: None

    @property
    def ipopt_options(self) -> dict[str, Any]:
        """Options that make IPOPT work with these factors."""
        return {
            "linear_solver": "ma57",
            "hsllib": str(kernels_path()),
            "ma57_pivtol": _THRESHOLD,
        }

    def begin(self, elimination: Elimination) -> None:
        """Get ready for a solve in this thread; what is known of an equal pattern is kept."""
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
        return bool(self._library.stage_ldl_factorise(self._solver, values, _THRESHOLD))

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

    @property
    def negative(self) -> int:
        """Number of negative eigenvalues of the last matrix."""
        return int(self.report.negative)

    def _order(self, elimination: Elimination) -> None:
        if not self._elimination.equals(elimination):
            order, ends = elimination.order, elimination.ends
            solver = self._library.stage_ldl_new(len(order), order, len(ends), ends)
            self._solver, self._elimination = ctypes.c_void_p(solver), elimination
            self._free()
            self._free = weakref.finalize(self, self._library.stage_ldl_free, self._solver)
