"""Solve a nonlinear program with IPOPT, with live progress and a clean stop."""

from __future__ import annotations

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from types import FrameType
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.machine import keep_freed_memory, use_one_blas_thread
from pathwalker_cli.nlp.stage_ldl import stage_factors
from pathwalker_cli.ocp.collocation import CollocationProgram

__all__ = [
    "IpoptSettings",
    "Multipliers",
    "NlpResult",
    "NlpSolver",
    "ProgressReport",
    "solve_program",
    "warm_pushes",
]


@dataclass(frozen=True)
class IpoptSettings:
    """Settings of one solve.

    Args:
        tolerance: Optimality tolerance `tol`.
        constraint_tolerance: Largest violation accepted, `constr_viol_tol`.
        max_iterations: Iteration limit.
        initial_barrier: Start of the barrier parameter `mu_init`.
        warm_start: Whether to start from the given multipliers and close to the bounds.
        extra: Further options by their IPOPT name; they win over the rest.
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
            "print_level": 0,
            "sb": "yes",
            "tol": self.tolerance,
            "constr_viol_tol": self.constraint_tolerance,
            "acceptable_iter": 0,
            "max_iter": self.max_iterations,
            "mu_init": self.initial_barrier,
            "mu_strategy": "monotone",
            "nlp_scaling_method": "none",
            "linear_system_scaling": "none",
            "linear_solver": "mumps",
            "mumps_pivtol": 1e-4,
        }
        if not self.warm_start:
            # barrier problems are only a path to the solution: few of them are enough
            options["mu_linear_decrease_factor"] = 0.05
        else:
            options["warm_start_init_point"] = "yes"
            # a start on a bound is moved off it by about what the barrier would ask for
            push = min(1e-4, 0.1 * self.initial_barrier)
            options |= warm_pushes(push)
        return {**options, **self.extra}


def warm_pushes(distance: float) -> dict[str, Any]:
    """Return options that move a warm start this far off its bounds [solver units]."""
    kinds = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac", "mult_bound_push")
    return {f"warm_start_{kind}": distance for kind in kinds}


@dataclass(frozen=True)
class Multipliers:
    """Multipliers of the bounds on the unknowns and of the rows."""

    unknowns: np.ndarray
    rows: np.ndarray


@dataclass(frozen=True)
class ProgressReport:
    """One iteration as it is shown.

    Args:
        iteration: Number of the iteration.
        objective: Value of the objective.
        infeasibility: Largest scaled violation of rows.
        elapsed: Seconds since the solve began.
    """

    iteration: int
    objective: float
    infeasibility: float
    elapsed: float


@dataclass(frozen=True)
class NlpResult:
    """What IPOPT returned.

    Args:
        status: "converged" or the reason why not, in words.
        unknowns: Scaled unknowns.
        rows: Scaled values of the rows.
        objective: Value of the objective.
        multipliers: Multipliers.
        iterations: Number of iterations.
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


_REASONS = {
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

Observer = Callable[[ProgressReport], None]


class _Watcher(ca.Callback):
    """Reports every iteration and stops when it is told to."""

    def __init__(self, program: CollocationProgram, observer: Observer | None) -> None:
        ca.Callback.__init__(self)
        nlp = program.program
        self._sizes = (nlp.size, nlp.rows, program.parameters.size)
        self._observer = observer
        self.begin(program)
        self.construct("watcher", {})

    def begin(self, program: CollocationProgram) -> None:
        """Get ready for a solve with the bounds of this program."""
        self._lower, self._upper = program.program.lower, program.program.upper
        self._start = time.perf_counter()
        self.iteration = -1
        self.stop = False

    def get_n_in(self) -> int:
        return int(ca.nlpsol_n_out())

    def get_n_out(self) -> int:
        return 1

    def get_name_in(self, i: int) -> str:
        return str(ca.nlpsol_out(i))

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        size, rows, parameters = self._sizes
        name = ca.nlpsol_out(i)
        count = {"f": 1, "x": size, "lam_x": size, "g": rows, "lam_g": rows}.get(name, parameters)
        return ca.Sparsity.dense(count)

    def eval(self, arguments: Sequence[ca.DM]) -> list[int]:
        self.iteration += 1
        if self._observer is not None:
            g = np.asarray(arguments[2]).ravel()
            below, above = self._lower - g, g - self._upper
            worst = max(below.max(initial=0.0), above.max(initial=0.0), 0.0)
            elapsed = time.perf_counter() - self._start
            report = ProgressReport(self.iteration, float(arguments[1]), float(worst), elapsed)
            self._observer(report)
        return [int(self.stop)]


@contextmanager
def _interruptible(watcher: _Watcher) -> Iterator[None]:
    """Let Ctrl-C end the solve after the current iteration; a second one interrupts at once."""

    def handler(number: int, frame: FrameType | None) -> None:
        if watcher.stop:
            if callable(previous):
                previous(number, frame)
            raise KeyboardInterrupt
        watcher.stop = True

    try:
        previous = signal.signal(signal.SIGINT, handler)
    except ValueError:  # not in the main thread: leave the signal alone
        yield
        return
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


class NlpSolver:
    """IPOPT for programs of one structure: built once, called with many numbers and starts.

    Args:
        program: A program of the structure.
        settings: Settings of all solves.
        observer: Called after every iteration.
    """

    def __init__(
        self,
        program: CollocationProgram,
        settings: IpoptSettings,
        observer: Observer | None = None,
    ) -> None:
        use_one_blas_thread()
        keep_freed_memory()
        # held: IPOPT does not keep functions alive that are written in Python
        self._functions = functions = program.program.functions()
        self._watcher = _Watcher(program, observer)
        self._factors = None
        if program.elimination is not None and "linear_solver" not in settings.extra:
            self._factors = stage_factors()
        options: dict[str, Any] = {
            "ipopt": settings.as_options() | (self._factors.ipopt_options if self._factors else {}),
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
        program: CollocationProgram,
        start: np.ndarray,
        multipliers: Multipliers | None = None,
    ) -> NlpResult:
        """Minimise a program of the structure.

        Args:
            program: The program.
            start: Scaled unknowns to start from.
            multipliers: Multipliers to start from, for a warm start.

        Returns:
            The last iterate, converged or not.
        """
        lower, upper = program.bounds
        arguments: dict[str, Any] = {
            "x0": start,
            "p": program.parameters,
            "lbx": lower,
            "ubx": upper,
            "lbg": program.program.lower,
            "ubg": program.program.upper,
        }
        if multipliers is not None:
            arguments |= {"lam_x0": multipliers.unknowns, "lam_g0": multipliers.rows}
        self._watcher.begin(program)
        began = time.perf_counter()
        if self._factors is not None:
            self._factors.begin(program.elimination)
        with _interruptible(self._watcher):
            solution = self._solver(**arguments)
        seconds = time.perf_counter() - began
        stats = self._solver.stats()
        status = stats["return_status"]
        return NlpResult(
            status=_REASONS.get(status, status.replace("_", " ").lower()),
            unknowns=np.asarray(solution["x"]).ravel(),
            rows=np.asarray(solution["g"]).ravel(),
            objective=float(solution["f"]),
            multipliers=Multipliers(
                np.asarray(solution["lam_x"]).ravel(), np.asarray(solution["lam_g"]).ravel()
            ),
            iterations=int(stats["iter_count"]),
            seconds=seconds,
            seconds_functions=sum(
                value for key, value in stats.items() if key.startswith("t_wall_nlp_")
            ),
        )


def solve_program(
    program: CollocationProgram,
    start: np.ndarray,
    settings: IpoptSettings,
    multipliers: Multipliers | None = None,
    observer: Observer | None = None,
) -> NlpResult:
    """Minimise a program once; see `NlpSolver`."""
    return NlpSolver(program, settings, observer).solve(program, start, multipliers)
