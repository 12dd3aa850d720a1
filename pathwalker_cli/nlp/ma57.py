"""The compiled LDL^T factors in the place of IPOPT's linear solver: they pose as MA57.

IPOPT loads linear solvers at run time by the names of the routines of HSL.  The library of kernels
answers to those of MA57 (`ma57id_`, `ma57ad_`, `ma57bd_`, `ma57cd_`, `ma57ed_` at the end of
`native/stage_ldl.cpp`).  Relied on, of IPOPT 3.14 as it comes with CasADi 3.8:

- the options `linear_solver=ma57` and `hsllib`, and the arguments of those five routines;
- where it looks for the state of a factorisation: INFO(1) 0 regular, 4 singular, negative an error;
  INFO(24) negative eigenvalues; INFO(25) rank; CNTL(1) the threshold of pivots;
- that it calls them in the thread that solves, so that `use` says which factors are meant;
- that its system holds first the unknowns without the fixed ones, then the slacks of inequality
  rows, the multipliers of equality rows and those of inequality rows;
- that it factorises the plain matrix first, and where its inertia is wrong again with a shifted
  diagonal: where the plain one failed the time before, it is refused unseen.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from pathwalker_cli.nlp.kernels import kernels_path
from pathwalker_cli.nlp.program import Program
from pathwalker_cli.nlp.stage_ldl import PIVOT_THRESHOLD, Elimination, in_order_of


def ma57_options() -> dict[str, Any]:
    """Return the options by which IPOPT takes the compiled factors for MA57."""
    return {
        "linear_solver": "ma57",
        "hsllib": str(kernels_path()),
        "ma57_pivtol": PIVOT_THRESHOLD,
    }


def ipopt_elimination(program: Program) -> Elimination | None:
    """Return the order of elimination of the systems that IPOPT solves for a program."""
    if program.elimination_keys is None:
        return None
    (unknowns, rows), (lower, upper) = program.elimination_keys, program.row_bounds
    free, equal = np.not_equal(*program.bounds), lower == upper
    return in_order_of(np.concatenate([unknowns[free], rows[~equal], rows[equal], rows[~equal]]))
