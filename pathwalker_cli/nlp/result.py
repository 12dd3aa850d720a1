"""The end of a solve, whichever solver it was: unknowns, multipliers, status."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Multipliers:
    """Multipliers of the bounds on the unknowns and of the rows."""

    unknowns: np.ndarray
    rows: np.ndarray

    @property
    def stacked(self) -> np.ndarray:
        """Those of all unknowns and then of all rows, shape (n + m,)."""
        return np.concatenate([self.unknowns, self.rows])


@dataclass(frozen=True)
class NlpResult:
    """How a solve of a nonlinear program ended.

    Args:
        status: "converged" or the reason why not, in words.
        unknowns: Scaled unknowns.
        rows: Scaled values of the rows.
        seconds: Wall seconds of the solve.
        seconds_functions: Wall seconds in function evaluations.
    """

    status: str
    unknowns: np.ndarray
    rows: np.ndarray
    objective: float
    multipliers: Multipliers
    iterations: int
    seconds: float
    seconds_functions: float

    @property
    def converged(self) -> bool:
        """Whether the tolerances were met."""
        return self.status == "converged"
