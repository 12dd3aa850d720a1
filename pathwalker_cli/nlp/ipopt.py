"""Solve a nonlinear program with IPOPT, with live progress and a clean stop."""

from __future__ import annotations

import time
from dataclasses import dataclass, field
from typing import Any, Final

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.ma57 import ipopt_elimination, ma57_options
from pathwalker_cli.nlp.machine import keep_freed_memory, use_one_blas_thread
from pathwalker_cli.nlp.program import Program
from pathwalker_cli.nlp.result import Multipliers, NlpResult
from pathwalker_cli.nlp.stage_ldl import stage_factors
from pathwalker_cli.nlp.watch import Observer, Watcher, interruptible

_METHOD: Final = {
    "mu_strategy": "monotone",
    # programs come scaled; scaling by gradients at the start would depend on the start
    "nlp_scaling_method": "none",
    "linear_system_scaling": "none",
    # a loose tolerance is no solution
    "acceptable_iter": 0,
    # where the compiled factors are not used
    "linear_solver": "mumps",
    "mumps_pivtol": 1e-4,
}
"""Options of all solves."""

_BARRIER_DECREASE: Final = 0.05
"""Of a cold start.  Barrier problems are only a path to the solution: few of them are enough."""

_BARRIER_TOLERANCE: Final = 10.0
"""Of IPOPT (`barrier_tol_factor`): error at which it leaves a barrier, as a multiple of it."""

_LARGEST_PUSH, _PUSH_SHARE = 1e-4, 0.1
"""Warm starts on a bound are moved off it by about what the barrier would ask for: by this share of
the barrier parameter, and no further than the first [solver units]."""


@dataclass(frozen=True)
class IpoptSettings:
    """Settings of one solve.

    Args:
        tolerance: Optimality tolerance `tol`.
        constraint_tolerance: Largest violation accepted, `constr_viol_tol`.
        max_iterations: Iteration limit.
        initial_barrier: Start of the barrier parameter `mu_init`.
        warm_start: Whether to start from the given multipliers and close to the bounds.
        extra: Further options by their IPOPT name; they win over the rest. `linear_solver`, and
            options of MUMPS, take the place of the compiled linear solver.
    """

    tolerance: float = 1e-6
    constraint_tolerance: float = 1e-8
    max_iterations: int = 500
    initial_barrier: float = 0.1
    warm_start: bool = False
    extra: dict[str, Any] = field(default_factory=dict)

    def as_options(self) -> dict[str, Any]:
        """Return the options by their IPOPT name."""
        options: dict[str, Any] = {
            **_METHOD,
            "print_level": 0,
            "sb": "yes",
            "tol": self.tolerance,
            "constr_viol_tol": self.constraint_tolerance,
            "max_iter": self.max_iterations,
            "mu_init": self.initial_barrier,
        }
        if self.warm_start:
            options["warm_start_init_point"] = "yes"
            options |= warm_pushes(min(_LARGEST_PUSH, _PUSH_SHARE * self.initial_barrier))
        else:
            options["mu_linear_decrease_factor"] = _BARRIER_DECREASE
        return {**options, **self.extra}


def last_barrier(tolerance: float) -> float:
    """Return the barrier parameter with which a solve to this tolerance ends.

    A warm start that begins with it needs no steps from one barrier to the next.
    """
    return tolerance / (1.0 + _BARRIER_TOLERANCE)


def warm_pushes(distance: float) -> dict[str, Any]:
    """Return options that move a warm start this far off its bounds [solver units]."""
    kinds = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    return {f"warm_start_{kind}": distance for kind in kinds}


_REASONS: Final = {
    "Solve_Succeeded": "converged",
    "Solved_To_Acceptable_Level": "stopped at a loose tolerance",
    "Infeasible_Problem_Detected": "no feasible point was found near the start",
    "Search_Direction_Becomes_Too_Small": "the search direction became too small",
    "Diverging_Iterates": "the iterates diverged",
    "User_Requested_Stop": "stopped by the user",
    "Maximum_Iterations_Exceeded": "the iteration limit was reached",
    "Restoration_Failed": "feasibility could not be restored",
    "Error_In_Step_Computation": "no step could be computed",
    "Invalid_Number_Detected": "a function returned an invalid number",
    "Insufficient_Memory": "memory ran out",
}


class NlpSolver:
    """IPOPT for programs of one structure: built once, called with many numbers and starts."""

    def __init__(
        self,
        program: Program,
        settings: IpoptSettings,
        observer: Observer | None = None,
    ) -> None:
        use_one_blas_thread()
        keep_freed_memory()
        # held: IPOPT does not keep functions alive that are written in Python
        self._functions = functions = program.functions
        self._watcher = Watcher(program, observer)
        other = any(key.startswith(("linear_solver", "mumps_")) for key in settings.extra)
        known = program.elimination_keys is not None and not other
        self._factors = stage_factors() if known else None
        options: dict[str, Any] = {
            "ipopt": settings.as_options()
            | (ma57_options() | settings.extra if self._factors else {}),
            "print_time": False,
            "error_on_fail": False,
            "iteration_callback": self._watcher,
            "calc_lam_p": False,
            "no_nlp_grad": True,
            **{key: functions[key] for key in ("grad_f", "jac_g", "hess_lag")},
        }
        self._solver = ca.nlpsol("solver", "ipopt", functions["nlp"], options)

    def solve(
        self,
        program: Program,
        start: np.ndarray,
        multipliers: Multipliers | None = None,
    ) -> NlpResult:
        """Minimise a program from scaled unknowns; return the last iterate, converged or not."""
        arguments: dict[str, Any] = {"x0": start, "p": program.parameters}
        arguments |= dict(zip(("lbx", "ubx"), program.bounds, strict=True))
        arguments |= dict(zip(("lbg", "ubg"), program.row_bounds, strict=True))
        if multipliers is not None:
            arguments |= {"lam_x0": multipliers.unknowns, "lam_g0": multipliers.rows}
        self._watcher.begin(program)
        began = time.perf_counter()
        elimination = ipopt_elimination(program) if self._factors else None
        if self._factors and elimination:
            self._factors.begin(elimination)
        with interruptible(self._watcher):
            solution = self._solver(**arguments)
        seconds = time.perf_counter() - began
        stats = self._solver.stats()
        status = stats["return_status"]
        arrays = {key: np.asarray(value).ravel() for key, value in solution.items()}
        return NlpResult(
            status=_REASONS.get(status, status.replace("_", " ").lower()),
            unknowns=arrays["x"],
            rows=arrays["g"],
            objective=float(solution["f"]),
            multipliers=Multipliers(arrays["lam_x"], arrays["lam_g"]),
            iterations=int(stats["iter_count"]),
            seconds=seconds,
            seconds_functions=sum(
                value for key, value in stats.items() if key.startswith("t_wall_nlp_")
            ),
        )


def solve_program(
    program: Program,
    start: np.ndarray,
    settings: IpoptSettings,
    multipliers: Multipliers | None = None,
    observer: Observer | None = None,
) -> NlpResult:
    """Minimise a program once; see `NlpSolver`."""
    return NlpSolver(program, settings, observer).solve(program, start, multipliers)
