"""What the numerical layer relies on in other libraries, told apart in docs/numerics.md.

A test fails here when a new version of a library breaks what is relied on: the message names the
module to mend.
"""

from __future__ import annotations

import os
import platform
import re
import subprocess
import sys
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
import qdldl
from scipy import sparse

from pathwalker_cli.nlp import machine, tape
from pathwalker_cli.nlp.ipopt import IpoptSettings, NlpSolver, solve_program
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.nlp.stage_ldl import Elimination
from pathwalker_cli.nlp.tape import OPERATIONS, Tape
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from test_collocation import at_rest, double_integrator

CASADI, IPOPT = "3.8.", "3.14."
NEW_VERSION = (
    "another version than the fences were written for: read docs/numerics.md#what-is-relied-on, "
    "see that all tests of this file hold, then name it here and there"
)

needs_kernels = pytest.mark.skipif(
    kernels() is None and bool(os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON")),
    reason="no compiled kernels, and PATHWALKER_ALLOW_PURE_PYTHON is set",
)


def textbook(fastest: float = np.inf, nonlinear: bool = False) -> tuple[CollocationProgram, Any]:
    """Return a program with fixed unknowns, equality and inequality rows, and a start."""
    problem, numbers = double_integrator(nonlinear)
    bounds = numbers.bounds.replace({("forward",): (-10.0, fastest)})
    start = at_rest(problem, 3, 3)
    blocks = CollocationBlocks(problem, 3)
    program = CollocationProgram(blocks, replace(numbers, bounds=bounds), start.meshes)
    return program, program.to_unknowns(start)


def test_the_versions_are_those_that_the_fences_were_written_for(
    capfd: pytest.CaptureFixture[str],
) -> None:
    solve_program(*textbook(), IpoptSettings(extra={"print_level": 5}))
    version = re.search(r"This is Ipopt version (\S+?),", capfd.readouterr().out)
    assert version is not None, "IPOPT does not say which version it is"
    assert ca.CasadiMeta.version().startswith(CASADI), NEW_VERSION
    assert version[1].startswith(IPOPT), NEW_VERSION


# CasADi's serialised graphs: nlp/tape.py


def some_function() -> ca.Function:
    """Return a function with constants, inputs, outputs, unary and binary operations."""
    x, y = ca.SX.sym("x", 3), ca.SX.sym("y", 2)
    rows = ca.vertcat(ca.sin(x[0]) * y[1] + 0.5, x[2] / 7.25, x[1], ca.fmax(y[0], x[0]))
    return ca.Function("some", [x, y], [rows, ca.jacobian(rows, x)])


def test_instructions_stand_in_the_serialised_function_as_casadi_tells_them() -> None:
    function = some_function()
    found = tape._instructions(function)
    mend = "nlp/tape.py: CasADi writes functions in another form; without tapes solves are slow"
    assert found is not None, mend
    told = b"".join(tape._record(function, i) for i in range(function.n_instructions()))
    assert found.tobytes() == told, mend


class Rewritten:
    """A function as another version of CasADi might serialise it."""

    def __init__(self, function: ca.Function, change: Any) -> None:
        self._function, self._change = function, change

    def serialize(self) -> str:
        return self._change(self._function.serialize())

    def __getattr__(self, name: str) -> Any:
        return getattr(self._function, name)


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text[2:],
        lambda text: "",
        lambda text: text[: len(text) // 4 * 2],
        lambda text: "".join(text[k : k + 2][::-1] for k in range(0, len(text), 2)),
    ],
    ids=["moved", "empty", "cut", "letters swapped"],
)
def test_another_form_is_noticed(change: Any) -> None:
    function = some_function()
    found = tape._instructions(Rewritten(function, change))
    assert found is None or found.tobytes() == tape._instructions(function).tobytes()


def test_operations_have_one_number_each() -> None:
    ids = [getattr(ca, f"OP_{name}") for name in OPERATIONS]
    assert len({*ids}) == len(ids)
    assert max(ids) < len(tape._CODES), "nlp/tape.py: the table of operations is too short"


# Posing as MA57: nlp/ma57.py


def solved(program: CollocationProgram, start: Any, **extra: Any) -> tuple[NlpSolver, NlpResult]:
    solver = NlpSolver(program, IpoptSettings(tolerance=1e-9, extra=extra))
    return solver, solver.solve(program, start)


@needs_kernels
@pytest.mark.parametrize("fastest", [np.inf, 1.3])
def test_ipopt_takes_the_compiled_factors_for_ma57(fastest: float) -> None:
    program, start = textbook(fastest)
    (solver, ours), (_, mumps) = (
        solved(program, start, **extra) for extra in ({}, {"linear_solver": "mumps"})
    )
    mend = "nlp/ma57.py: IPOPT does not call MA57 as it did"
    assert ours.converged, f"{mend}: {ours.status}"
    assert solver._factors is not None
    assert solver._factors.report.count >= ours.iterations, mend
    assert ours.iterations == mumps.iterations, f"{mend}: inertia or steps are others"
    assert ours.unknowns == pytest.approx(mumps.unknowns, abs=1e-6)
    report = solver._factors.report
    assert report.negative == program.rows, f"{mend}: multipliers stand elsewhere"
    assert report.delayed < 0.1 * program.rows, f"{mend}: its system is arranged in another way"


@needs_kernels
def test_where_the_cost_bends_down_ipopt_shifts_as_with_mumps() -> None:
    program, start = textbook(nonlinear=True)
    start = start + 0.5 * np.random.default_rng(2).normal(size=start.size)
    (_, ours), (_, mumps) = (
        solved(program, start, **extra) for extra in ({}, {"linear_solver": "mumps"})
    )
    assert ours.converged
    assert mumps.converged
    assert ours.objective == pytest.approx(mumps.objective, rel=1e-8)


@needs_kernels
def test_an_order_for_another_system_ends_the_solve(monkeypatch: pytest.MonkeyPatch) -> None:
    program, start = textbook()
    short = Elimination(np.arange(5, dtype=np.int32), np.array([5], np.int32))
    monkeypatch.setattr("pathwalker_cli.nlp.ipopt.ipopt_elimination", lambda program: short)
    _, result = solved(program, start)
    assert not result.converged, "nlp/ma57.py: IPOPT overlooks that the order does not fit"


# Watching the iterations: nlp/watch.py


def test_every_iteration_is_told_with_its_own_figures() -> None:
    told: list[ProgressReport] = []
    program, start = textbook(1.3)
    result = solve_program(program, start, IpoptSettings(), observer=told.append)
    mend = "nlp/watch.py: CasADi hands over iterates in another way"
    assert [report.iteration for report in told] == list(range(result.iterations + 1)), mend
    assert told[-1].objective == pytest.approx(result.objective, rel=1e-12), mend
    lower, upper = program.row_bounds
    rows = np.asarray(program.functions["nlp"](start, program.parameters)[1]).ravel()
    missed = np.maximum(lower - rows, rows - upper).max()
    assert told[0].infeasibility == pytest.approx(missed, rel=1e-2), mend
    assert told[-1].infeasibility < 1e-8, mend


def test_a_watcher_ends_the_solve() -> None:
    program, start = textbook(1.3)

    def stop(report: ProgressReport) -> bool:
        return report.iteration == 2

    solver = NlpSolver(program, IpoptSettings(), stop)
    result = solver.solve(program, start)
    assert result.status == "stopped by the user", "nlp/watch.py: IPOPT does not stop when asked to"
    assert result.iterations == 2


def test_ipopt_says_how_it_ended_and_how_long_functions_took() -> None:
    result = solve_program(*textbook(), IpoptSettings(max_iterations=1))
    assert result.status == "the iteration limit was reached", "nlp/ipopt.py: other words"
    assert 0.0 < result.seconds_functions < result.seconds, "nlp/ipopt.py: other statistics"


# Memory and threads: nlp/machine.py


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="mallopt is glibc's")
def test_freed_memory_can_be_kept() -> None:
    assert machine.keep_freed_memory(), "nlp/machine.py: glibc refuses the parameters of mallopt"


THREADS = """
import os
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from test_fences import textbook
before = len(os.listdir("/proc/self/task"))
assert solve_program(*textbook(), IpoptSettings(extra={"linear_solver": "mumps"})).converged
print(len(os.listdir("/proc/self/task")) - before)
"""


@pytest.mark.skipif(not os.path.isdir("/proc/self/task"), reason="threads are counted in /proc")
def test_ipopt_starts_no_threads() -> None:
    environment = {k: v for k, v in os.environ.items() if k != "OPENBLAS_NUM_THREADS"}
    folder = os.path.dirname(__file__)
    environment["PYTHONPATH"] = os.pathsep.join([folder, *sys.path])
    command = [sys.executable, "-c", THREADS]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["0"], "nlp/machine.py: IPOPT's BLAS does not heed its variable"


# Factors without the kernels: nlp/stage_ldl.py


def test_qdldl_says_where_there_are_no_factors() -> None:
    singular = sparse.csc_matrix([[0.0, 1.0], [1.0, 0.0]])
    with pytest.raises(RuntimeError):
        qdldl.Solver(sparse.triu(singular, format="csc"), upper=True)


@needs_kernels
def test_functions_in_python_are_read_by_their_buffers() -> None:
    """Missing arguments are zeros, and results that nobody wants are left out."""
    program, start = textbook(1.3)
    taped, plain = program.functions, program.plain_functions()
    assert isinstance(taped["jac_g"], ca.Callback), "nlp/taped.py: no tapes"
    for name in taped:
        ours, theirs = (
            functions[name](x=start, p=program.parameters, **more)
            for functions in (taped, plain)
            for more in [{"lam_f": 1.0} if name == "hess_lag" else {}]
        )
        assert ours.keys() == theirs.keys()
        for key in ours:
            assert np.allclose(np.array(ours[key]), np.array(theirs[key]), rtol=1e-12), name
    assert Tape.of(some_function()) is not None
