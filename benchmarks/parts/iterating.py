"""What an iteration costs, by IPOPT's own clock, and what the functions of a program do."""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any, Final

import casadi as ca
import numpy as np

from pathwalker_cli.case import load_case
from pathwalker_cli.gait.first_mesh import tracked
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp import blocks
from pathwalker_cli.nlp.assembly import FUNCTIONS
from pathwalker_cli.nlp.ipopt import IpoptSettings, NlpSolver
from pathwalker_cli.ocp.collocation import CollocationProgram

TALK: Final = {"print_level": 5, "print_timing_statistics": "yes"}
TIMING: Final = re.compile(
    r"^\s*(?P<name>[A-Za-z][A-Za-z0-9 ]*?)\.*:\s+(?P<cpu>[-+.\deE]+)"
    r"\s+\(sys:\s+(?P<sys>[-+.\deE]+)\s+wall:\s+(?P<wall>[-+.\deE]+)\)",
    re.MULTILINE,
)
SIZES: Final = {
    "iterations": "Number of Iterations",
    "unknowns": "Total number of variables",
    "equalities": "Total number of equality constraints",
    "inequalities": "Total number of inequality constraints",
    "equality_nonzeros": "Number of nonzeros in equality constraint Jacobian",
    "inequality_nonzeros": "Number of nonzeros in inequality constraint Jacobian",
    "hessian_nonzeros": "Number of nonzeros in Lagrangian Hessian",
}


def steps(
    problem: str,
    intervals: int,
    variant: str,
    iterations: int,
    tracking: int,
    repetitions: int,
) -> dict[str, Any]:
    """Return what the first iterations of the first mesh take.

    Args:
        problem: Name of a shipped problem.
        intervals: Intervals of the mesh.
        variant: "shipped", "mumps" or "casadi" (its virtual machine evaluates the functions).
        iterations: Iterations to measure.
        tracking: Iterations of the stage before, which leads there.
        repetitions: How often they are measured.
    """
    mesh = (f"mesh.intervals={intervals}", "mesh.refinements=0")
    case = load_case(problem, changes=(*mesh, f"solver.max_iterations={tracking}"))
    solver, config = GaitSolver(case), case.config
    program, result = tracked(solver)
    motion = replace(program.to_motion(result.unknowns), parameters=solver.parameter_guess())
    if variant == "casadi":
        blocks.kernels = lambda: None
    program = CollocationProgram(solver.blocks, solver.prediction, motion.meshes)
    functions = program.functions
    if variant == "casadi" and type(functions["hess_lag"]) is not ca.Function:
        raise RuntimeError("the program does not ask `blocks.kernels` for tapes any more")
    settings = solver.settings(config.solver.tolerance, config.solver.first_barrier)
    extra = {**settings.extra, **TALK, **({"linear_solver": "mumps"} if variant == "mumps" else {})}
    settings = replace(settings, max_iterations=iterations, extra=extra)
    start = program.to_unknowns(motion)
    parts = [_solved(program, settings, start) for _ in range(repetitions)]
    return {"parts": parts, "functions": _functions(program, start)}


def _solved(
    program: CollocationProgram, settings: IpoptSettings, start: np.ndarray
) -> dict[str, float]:
    """Return seconds per iteration by part, sizes and the work of the factorisation."""
    solver = NlpSolver(program, settings)
    with captured() as text:
        solver.solve(program, start)
    found = statistics_of(text[0])
    factors = getattr(solver, "_factors", None)
    if factors is not None and hasattr(factors, "report"):
        report = factors.report
        found |= {
            "factorisations": report.count / found["iterations"],
            "operations": report.operations,
            "delayed": report.delayed,
            "flops": report.count * report.operations / found["iterations"],
        }
    return found


@contextmanager
def captured() -> Iterator[list[str]]:
    """Catch what is written to standard output, in Python or below; the list gets the text."""
    text: list[str] = []
    sys.stdout.flush()
    with tempfile.TemporaryFile() as file:
        kept = os.dup(1)
        os.dup2(file.fileno(), 1)
        try:
            yield text
        finally:
            sys.stdout.flush()
            os.dup2(kept, 1)
            os.close(kept)
        file.seek(0)
        text.append(file.read().decode(errors="replace"))


def statistics_of(text: str) -> dict[str, float]:
    """Return sizes, and CPU seconds per iteration by part, of IPOPT's report.

    Raises:
        ValueError: If the report lacks them.
    """
    found = {}
    for key, name in SIZES.items():
        match = re.search(rf"^{name}\.*:\s*(\d+)", text, re.MULTILINE)
        if match is None:
            raise ValueError(f"IPOPT did not report: {name}")
        found[key] = float(match[1])
    times = {m["name"]: float(m["cpu"]) + float(m["sys"]) for m in TIMING.finditer(text)}
    missing = {"OverallAlgorithm", "Function Evaluations", "LinearSystemBackSolve"} - set(times)
    if missing or not found["iterations"]:
        raise ValueError(f"IPOPT's timing statistics lack {sorted(missing) or 'iterations'}")
    back = times["LinearSystemBackSolve"]
    # MUMPS does not report its factorisation apart: it is what is left of the linear systems
    symbolic = times.get("LinearSystemSymbolicFactorization", 0.0)
    left = times.get("StdAugSystemSolverMultiSolve", 0.0) - back - symbolic
    factorisation = times.get("LinearSystemFactorization", 0.0) or left
    whole, functions = times["OverallAlgorithm"] - symbolic, times["Function Evaluations"]
    parts = {
        "whole": whole,
        "in_functions": functions,
        "in_factorisation": factorisation,
        "in_back_solves": back,
        "in_rest": whole - functions - factorisation - back,
    }
    found["analysis"] = symbolic
    return found | {key: seconds / found["iterations"] for key, seconds in parts.items()}


def _functions(program: CollocationProgram, start: np.ndarray) -> dict[str, dict[str, float]]:
    """Return CPU seconds of one call of every function, and instructions at all occurrences."""
    given = {
        "x": start,
        "p": program.parameters,
        "lam_f": np.ones(1),
        "lam_g": np.ones(program.rows),
    }
    return {
        name: {
            "seconds": _seconds(function, [given[key] for key in FUNCTIONS[name][0]]),
            "instructions": float(_instructions(program, name)),
        }
        for name, function in program.functions.items()
    }


def _seconds(function: ca.Function, arguments: list[np.ndarray], budget: float = 0.4) -> float:
    """Return the median CPU seconds of a call."""
    buffer: Any
    buffer, call = function.buffer()
    arguments = [np.ascontiguousarray(argument, float) for argument in arguments]
    results = [np.zeros(max(function.nnz_out(k), 1)) for k in range(function.n_out())]
    for k, argument in enumerate(arguments):
        buffer.set_arg(k, argument.data)
    for k, result in enumerate(results):
        buffer.set_res(k, result.data)
    call()
    seconds: list[float] = []
    while not seconds or (sum(seconds) < budget and len(seconds) < 500):
        began = time.process_time()
        call()
        seconds.append(time.process_time() - began)
    return float(np.median(seconds))


def _instructions(program: CollocationProgram, name: str) -> int:
    """Return the instructions that a function of the program runs at all occurrences."""
    kinds = {kind for kind, _ in FUNCTIONS[name][1].values()}
    return sum(
        o.count * int(o.block.functions[kind].n_instructions())
        for o in program.occurrences
        for kind in kinds
    )
