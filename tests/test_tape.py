"""The compiled interpreter against CasADi's virtual machine."""

from __future__ import annotations

import gc
import os
from collections.abc import Callable, Mapping

import casadi as ca
import numpy as np
import pytest

from pathwalker_cli.case import load_case
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp import blocks
from pathwalker_cli.nlp.blocks import Block, BlockProgram, Expressions, Occurrences
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.tape import OPERATIONS, Tape
from pathwalker_cli.ocp.collocation import CollocationProgram

COUNTS = (1, 7, 8, 9, 17)
ARGUMENTS = {"nlp": 2, "grad_f": 2, "jac_g": 2, "hess_lag": 4}

UNARY: dict[str, Callable] = {
    "NEG": lambda x: -x,
    "SQ": lambda x: x * x,
    "TWICE": lambda x: 2 * x,
    "INV": lambda x: 1 / x,
    "NOT": ca.logic_not,
    "FABS": ca.fabs,
    "SQRT": ca.sqrt,
    "EXP": ca.exp,
    "LOG": ca.log,
    "CONSTPOW": lambda x: x**2.7,
    "SIN": ca.sin,
    "COS": ca.cos,
    "TAN": ca.tan,
    "ASIN": ca.asin,
    "ACOS": ca.acos,
    "ATAN": ca.atan,
    "SINH": ca.sinh,
    "COSH": ca.cosh,
    "TANH": ca.tanh,
    "ASINH": ca.asinh,
    "ACOSH": ca.acosh,
    "ATANH": ca.atanh,
    "FLOOR": ca.floor,
    "CEIL": ca.ceil,
    "ERF": ca.erf,
    "LOG1P": ca.log1p,
    "EXPM1": ca.expm1,
    "SIGN": ca.sign,
}
BINARY: dict[str, Callable] = {
    "ADD": lambda x, y: x + y,
    "SUB": lambda x, y: x - y,
    "MUL": lambda x, y: x * y,
    "DIV": lambda x, y: x / y,
    "LT": lambda x, y: x < y,
    "LE": lambda x, y: x <= y,
    "EQ": lambda x, y: x == y,
    "NE": lambda x, y: x != y,
    "AND": ca.logic_and,
    "OR": ca.logic_or,
    "IF_ELSE_ZERO": lambda x, y: ca.if_else(x, y, 0),
    "POW": lambda x, y: x**y,
    "ATAN2": ca.atan2,
    "FMIN": ca.fmin,
    "FMAX": ca.fmax,
    "FMOD": ca.fmod,
    "COPYSIGN": ca.copysign,
    "HYPOT": ca.hypot,
}
SPECIAL = (0.0, -0.0, 1.0, -1.0, 0.5, 2.5, -2.5, np.inf, -np.inf, np.nan)

needs_kernels = pytest.mark.skipif(
    kernels() is None and bool(os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON")),
    reason="no compiled kernels, and PATHWALKER_ALLOW_PURE_PYTHON is set",
)


def without_kernels(monkeypatch: pytest.MonkeyPatch, program: BlockProgram) -> Mapping:
    """Return the functions of a program where no kernels were compiled."""
    same = BlockProgram(program.size, program.occurrences, program._shared)
    with monkeypatch.context() as patch:
        patch.setattr(blocks, "kernels", lambda: None)
        return same.functions


def assert_same(taped: Mapping, mapped: Mapping, inputs: list, rtol: float) -> None:
    for name, number in ARGUMENTS.items():
        ours, theirs = taped[name], mapped[name]
        assert isinstance(ours, ca.Callback)
        assert not isinstance(theirs, ca.Callback)
        assert ours.name_in() == theirs.name_in()
        assert ours.name_out() == theirs.name_out()
        pairs = zip(ours.call(inputs[:number]), theirs.call(inputs[:number]), strict=True)
        for got, wanted in pairs:
            assert got.sparsity() == wanted.sparsity()
            got, wanted = np.array(got.nonzeros()), np.array(wanted.nonzeros())
            scale = np.abs(wanted).max(initial=0.0)
            np.testing.assert_allclose(got, wanted, rtol=rtol, atol=rtol * scale, err_msg=name)


def occurrences(block: Block, columns: np.ndarray, data: np.ndarray) -> Occurrences:
    count = columns.shape[1]
    zeros = np.zeros((block.rows, count))
    names = [f"row {k}" for k in range(block.rows)]
    labels = [str(k) for k in range(count)]
    return Occurrences(block, columns, data, zeros, zeros, np.ones(block.rows), names, labels)


def block_of(unknowns: ca.SX, rows: ca.SX, cost: ca.SX | None = None) -> Block:
    """Return a block without data and shared numbers."""
    none, cost = ca.SX(0, 1), ca.SX(0) if cost is None else cost
    return Block("block", lambda: Expressions(unknowns, none, none, rows, cost))


def random_block(rng: np.random.Generator, name: str, objective: bool) -> Block:
    """Return a block whose random expressions use data and shared numbers too."""
    unknowns, data, shared = ca.SX.sym("x", 5), ca.SX.sym("d", 2), ca.SX.sym("s", 3)
    known = [*ca.vertsplit(unknowns), *ca.vertsplit(data), *ca.vertsplit(shared), ca.SX(1.7)]
    smooth = [ca.sin, ca.cos, ca.tanh, ca.atan, lambda x: x * x, lambda x: 1 / (2 + ca.cos(x))]
    for _ in range(60):
        x, y = (known[i] for i in rng.integers(0, len(known), 2))
        options = [x + y, x - y, x * y, ca.fmax(x, y), ca.if_else(x < y, x, y),
                   smooth[rng.integers(len(smooth))](x)]  # fmt: skip
        known.append(ca.tanh(options[rng.integers(len(options))]))
    cost = ca.sumsqr(ca.vertcat(*known[-3:])) if objective else ca.SX(0)
    rows = ca.vertcat(*known[-8:-4], shared[0])
    return Block(name, lambda: Expressions(unknowns, data, shared, rows, cost))


def test_the_kernels_are_compiled() -> None:
    if os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON"):
        pytest.skip("PATHWALKER_ALLOW_PURE_PYTHON is set")
    assert kernels() is not None


def test_every_operation_is_tested() -> None:
    plain = {"CONST", "INPUT", "OUTPUT", "ASSIGN"}
    assert set(OPERATIONS) == plain | UNARY.keys() | BINARY.keys()


@needs_kernels
@pytest.mark.parametrize("name", [*UNARY, *BINARY])
def test_an_operation_agrees_to_the_last_bit(name: str) -> None:
    rng = np.random.default_rng(3)
    normal = rng.normal(size=(2, 40))
    pairs = np.array(np.meshgrid(SPECIAL, SPECIAL)).reshape(2, -1)
    values = np.concatenate([normal, np.abs(normal), 3 * normal, pairs], axis=1)
    x = ca.SX.sym("x", 2)
    result = UNARY[name](x[0]) if name in UNARY else BINARY[name](x[0], x[1])
    block = block_of(x, result)
    codes = Tape.of(block.functions["values"]).code[:, 0]
    assert OPERATIONS.index(name) in codes
    columns = np.arange(values.size).reshape(values.shape, order="F")
    program = BlockProgram(
        values.size, [occurrences(block, columns, np.zeros((0, values.shape[1])))], np.zeros(0)
    )
    unknowns = values.ravel(order="F")
    got = np.asarray(program.functions["nlp"](unknowns, [])[1]).ravel()
    wanted = np.asarray(block.functions["values"].map(values.shape[1])(values, [], [])[0]).ravel()
    np.testing.assert_array_equal(got, wanted)


@needs_kernels
@pytest.mark.parametrize("count", COUNTS)
def test_programs_agree_for_every_filling_of_lanes(
    count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, size = np.random.default_rng(count), 40
    parts = []
    for name, number in (("first", count), ("second", 3), ("third", count + 1)):
        # unknowns are shared, so that Hessian and gradient entries of several blocks meet
        columns = np.array([rng.permutation(size)[:5] for _ in range(number)]).T
        block = random_block(rng, name, objective=name != "second")
        parts.append(occurrences(block, columns, rng.normal(size=(2, number))))
    program = BlockProgram(size, parts, rng.normal(size=3))
    multipliers = rng.normal(size=program.rows)
    inputs = [rng.normal(size=size), program.parameters, 0.7, multipliers]
    assert_same(program.functions, without_kernels(monkeypatch, program), inputs, 1e-13)


@needs_kernels
def test_an_unknown_operation_takes_the_other_path() -> None:
    x = ca.SX.sym("x", 2)
    assert ca.erfinv(x).shape == (2, 1)
    odd = block_of(x, ca.erfinv(x))
    assert Tape.of(odd.functions["values"]) is None
    parts = [occurrences(odd, np.arange(6).reshape(2, 3), np.zeros((0, 3)))]
    functions = BlockProgram(6, parts, np.zeros(0)).functions
    assert not any(isinstance(f, ca.Callback) for f in functions.values())
    values = np.linspace(-0.5, 0.5, 6)
    got = np.asarray(functions["nlp"](values, [])[1]).ravel()
    wanted = np.asarray(ca.erfinv(ca.DM(values))).reshape(2, 3).ravel(order="F")
    np.testing.assert_allclose(got, wanted, rtol=1e-15)


@needs_kernels
@pytest.mark.parametrize("name", ["mapd-barefoot", "mapd-orthosis"])
def test_gait_programs_agree(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    changes = ("mesh.intervals=9", "mesh.refinements=0")
    solver = GaitSolver(load_case(name, changes=changes))
    config, stride = solver.config, solver.stride
    meshes = meshing.first(stride.durations[: len(solver.gait.phases)], config.mesh)
    program = CollocationProgram(solver.blocks, solver.prediction, meshes)
    stiffness, costs = solver.parameter_guess(), len(solver.gait.costs.integrals)
    motion = stride.motion(solver.walker, stiffness, meshes, config.mesh.degree, costs)
    rng = np.random.default_rng(1)
    unknowns = program.to_unknowns(motion) + 0.01 * rng.normal(size=program.size)
    inputs = [unknowns, program.parameters, 1.3, rng.normal(size=program.rows)]
    mapped = without_kernels(monkeypatch, program)
    assert_same(program.functions, mapped, inputs, 1e-12)


@needs_kernels
def test_solvers_take_them() -> None:
    """Minimise x0^2 + x1^2 with x0 + x1 = 2, by functions that only the mapping keeps alive."""
    x = ca.SX.sym("x", 2)
    row, cost = x[0] + x[1] - 2, ca.sumsqr(x)
    block = block_of(x, row, cost)
    parts = [occurrences(block, np.arange(2)[:, None], np.zeros((0, 1)))]
    functions = BlockProgram(2, parts, np.zeros(0)).functions
    gc.collect()
    options = {"ipopt": {"print_level": 0, "sb": "yes"}, "print_time": False, "calc_lam_p": False}
    options |= {key: functions[key] for key in ("grad_f", "jac_g", "hess_lag")}
    solver = ca.nlpsol("solver", "ipopt", functions["nlp"], options)
    solution = solver(x0=[3.0, -4.0], lbg=0, ubg=0)
    np.testing.assert_allclose(np.asarray(solution["x"]).ravel(), [1.0, 1.0], atol=1e-7)
    assert solver.stats()["iter_count"] <= 2
