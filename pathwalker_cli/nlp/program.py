"""What this layer solves: the questions that it asks of a nonlinear program."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import casadi as ca
import numpy as np


class Program(Protocol):
    """Minimise f(x; p) subject to bounds on the n unknowns x and on the m rows g(x; p).

    Everything is in solver units.  A class satisfies this by having these members; it need not
    know of this layer.
    """

    @property
    def size(self) -> int:
        """Number of unknowns n."""

    @property
    def rows(self) -> int:
        """Number of rows m."""

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the unknowns, shape (n,) each."""

    @property
    def row_bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper bounds of the rows, shape (m,) each."""

    @property
    def parameters(self) -> np.ndarray:
        """The numbers p."""

    @property
    def scale(self) -> np.ndarray:
        """Physical units per solver unit of the unknowns, shape (n,)."""

    @property
    def row_scale(self) -> np.ndarray:
        """Physical units per solver unit of the rows, shape (m,)."""

    @property
    def free_parameters(self) -> np.ndarray:
        """Places of the few unknowns that stand in rows everywhere; see `KktSystem`."""

    @property
    def elimination_keys(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Group, and place within it, of every unknown (n, 2) and row (m, 2) in a Newton step.

        None where no order of elimination is known beforehand.
        """

    @property
    def functions(self) -> Mapping[str, ca.Function]:
        """`nlp`, `grad_f`, `jac_g` and `hess_lag` as `casadi.nlpsol` takes them."""

    def plain_functions(self) -> Mapping[str, ca.Function]:
        """Return the same from expressions derived anew, for CasADi's virtual machine."""

    def unknown_place(self, i: int) -> tuple[str, str]:
        """Return the name of an unknown and where it stands."""

    def row_place(self, i: int) -> tuple[str, str]:
        """Return the name of a row and where it stands."""


def limits(program: Program) -> tuple[np.ndarray, np.ndarray]:
    """Return lower and upper bounds of all unknowns and then all rows, shape (n + m,) each."""
    lower, upper = map(np.concatenate, zip(program.bounds, program.row_bounds, strict=True))
    return lower, upper
