"""Derivatives that functions of a program return, as sparse matrices of SciPy."""

from __future__ import annotations

from typing import Final
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from scipy import sparse

_PATTERNS: Final[WeakKeyDictionary[ca.Function, tuple[np.ndarray, np.ndarray]]] = (
    WeakKeyDictionary()
)
"""Rows and beginnings of columns of the matrix that a function returns: reading them from CasADi
takes several times as long as its numbers."""


def matrix_of(function: ca.Function, value: ca.DM) -> sparse.csc_array:
    """Return the matrix that a function has just returned; it returns no other one beside it."""
    if function not in _PATTERNS:
        pattern = value.sparsity()
        _PATTERNS[function] = (
            np.array(pattern.row(), np.int32),
            np.array(pattern.colind(), np.int32),
        )
    rows, columns = _PATTERNS[function]
    return sparse.csc_array((np.array(value.nonzeros()), rows, columns), shape=value.shape)
