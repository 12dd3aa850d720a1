"""The compiled linear solver against dense linear algebra, and inside IPOPT against MUMPS."""

from __future__ import annotations

import os

import numpy as np
import pytest
from scipy import sparse

from pathwalker_cli.case import load_case
from pathwalker_cli.gait.first_mesh import tracked
from pathwalker_cli.gait.mesh import first
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp.kernels import kernels
from pathwalker_cli.nlp.stage_ldl import Elimination, StageFactors, in_order_of, stage_factors
from pathwalker_cli.ocp.collocation import CollocationProgram

pytestmark = pytest.mark.skipif(
    kernels() is None and bool(os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON")),
    reason="no compiler was there when the package was installed",
)


def factors() -> StageFactors:
    found = stage_factors()
    assert found is not None, "the kernels were not compiled"
    return found


def saddle(rng: np.random.Generator, unknowns: int, rows: int, density: float) -> np.ndarray:
    """Return [[H, A'], [A, 0]] with an indefinite H."""
    hessian = sparse.random_array((unknowns, unknowns), density=density, rng=rng).toarray()
    jacobian = sparse.random_array((rows, unknowns), density=density, rng=rng).toarray()
    jacobian[np.arange(rows), rng.permutation(unknowns)[:rows]] += 1.0
    corner = np.zeros((rows, rows))
    return np.block(
        [[hessian + hessian.T + np.diag(rng.normal(size=unknowns)), jacobian.T], [jacobian, corner]]
    )


def groups(rng: np.random.Generator, size: int, count: int) -> Elimination:
    """Return a random order in random groups: most groups have too few pivots of their own."""
    ends = np.sort(rng.choice(np.arange(1, size), count - 1, replace=False))
    return Elimination(
        rng.permutation(size).astype(np.int32), np.append(ends, size).astype(np.int32)
    )


@pytest.mark.parametrize("seed", range(25))
def test_solutions_and_inertia_are_those_of_dense_algebra(seed: int) -> None:
    rng = np.random.default_rng(seed)
    unknowns, rows = rng.integers(5, 120), 0
    rows = int(rng.integers(0, unknowns))
    matrix = saddle(rng, int(unknowns), rows, rng.uniform(0.02, 0.5))
    size = len(matrix)
    ldl = factors()
    assert ldl.factorise(sparse.csc_array(matrix), groups(rng, size, int(rng.integers(1, 6))))
    right = rng.normal(size=size)
    solution = ldl.solve(right)
    solution += ldl.solve(right - matrix @ solution)  # pivots are weak, as IPOPT refines
    scale = np.abs(matrix).max() * np.abs(solution).max()
    assert np.abs(matrix @ solution - right).max() < 1e-9 * scale
    assert ldl.report.negative == (np.linalg.eigvalsh(matrix) < 0).sum()


def test_slacks_are_eliminated_with_their_rows() -> None:
    rng = np.random.default_rng(3)
    core = saddle(rng, 20, 8, 0.3)
    size, count = len(core), 6
    matrix = np.zeros((size + 2 * count, size + 2 * count))
    matrix[:size, :size] = core
    for k in range(count):
        slack, row = size + 2 * k, size + 2 * k + 1
        matrix[slack, slack] = 10.0 ** rng.uniform(-8, 8)
        matrix[slack, row] = matrix[row, slack] = -1.0
        touched = rng.choice(20, 4, replace=False)
        matrix[row, touched] = matrix[touched, row] = rng.normal(size=4)
    order = groups(rng, len(matrix), 3)
    ldl = factors()
    assert ldl.factorise(sparse.csc_array(matrix), order)
    right = rng.normal(size=len(matrix))
    expected = np.linalg.solve(matrix, right)
    assert ldl.solve(right) == pytest.approx(expected, rel=1e-6, abs=1e-7)
    assert ldl.report.negative == (np.linalg.eigvalsh(matrix) < 0).sum()


def test_a_singular_matrix_is_refused() -> None:
    matrix = np.diag([1.0, 2.0, 0.0, 3.0])
    order = Elimination(np.arange(4, dtype=np.int32), np.array([2, 4], np.int32))
    assert not factors().factorise(sparse.csc_array(matrix), order)


def test_an_equal_pattern_with_other_values() -> None:
    rng = np.random.default_rng(5)
    ldl, order = factors(), None
    matrix = saddle(rng, 30, 10, 0.2)
    for factor in (1.0, -3.0, 0.01):
        order = order or groups(rng, 40, 4)
        assert ldl.factorise(sparse.csc_array(factor * matrix), order)
        right = rng.normal(size=40)
        assert factor * matrix @ ldl.solve(right) == pytest.approx(right, rel=1e-6, abs=1e-6)


@pytest.fixture(scope="module")
def solver() -> GaitSolver:
    changes = ("mesh.intervals=16", "mesh.refinements=0")
    return GaitSolver(load_case("mapd-orthosis", changes=changes))


def test_groups_are_small_whatever_the_mesh(solver: GaitSolver) -> None:
    largest = []
    for intervals in (16, 64):
        mesh = solver.config.mesh.model_copy(update={"intervals": intervals})
        meshes = first(solver.stride.durations, mesh)
        program = CollocationProgram(solver.blocks, solver.prediction, meshes)
        keys = np.concatenate(program.elimination_keys)
        order = in_order_of(keys)
        assert sorted(order.order.tolist()) == list(range(len(keys)))
        largest.append(np.diff(order.ends[:-1], prepend=0).max())
    assert largest[0] == largest[1]


def test_ipopt_finds_the_same_with_mumps(solver: GaitSolver) -> None:
    found = []
    for extra in ({}, {"linear_solver": "mumps"}):
        again = GaitSolver(solver.case.with_values({"solver.ipopt": {"max_iter": 1, **extra}}))
        _, result = tracked(again)
        found.append(result)
    ours, theirs = found
    assert ours.iterations == theirs.iterations
    assert ours.objective == pytest.approx(theirs.objective, rel=1e-4)
    assert ours.unknowns == pytest.approx(theirs.unknowns, abs=1e-3)


def test_a_nearly_singular_matrix_does_not_take_for_ever() -> None:
    rows = 400
    matrix = sparse.block_array(
        [[sparse.eye_array(100), None], [None, sparse.csc_array((rows, rows))]], format="csc"
    )
    order = Elimination(np.arange(500, dtype=np.int32), np.arange(50, 501, 50, dtype=np.int32))
    assert not factors().factorise(matrix, order)
