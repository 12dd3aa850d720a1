"""Derivatives of an optimum from its KKT system, against a textbook problem and random systems."""

from __future__ import annotations

from typing import cast

import numpy as np
import pytest
from scipy import sparse

from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum, Resolver, warm_start_for
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.nlp.kkt import KktSystem
from pathwalker_cli.nlp.stage_ldl import SymmetricSystem
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.problem import BoundTable, ProblemNumbers
from pathwalker_cli.studies.measures import measures
from test_collocation import at_rest, double_integrator

STEP = 1e-4


def saddle(size: int, rows: int, seed: int) -> sparse.csc_array:
    """Return a random matrix [[H, A'], [A, 0]] with an indefinite H."""
    rng = np.random.default_rng(seed)
    h = rng.normal(size=(size, size)) * (rng.random((size, size)) < 0.1)
    a = rng.normal(size=(rows, size)) * (rng.random((rows, size)) < 0.3)
    block = [[h + h.T + np.diag(rng.normal(size=size)), a.T], [a, np.zeros((rows, rows))]]
    return sparse.csc_array(np.block(block))


@pytest.mark.parametrize("seed", range(5))
def test_indefinite_systems_are_solved_to_the_last_digits(seed: int) -> None:
    matrix = saddle(60, 25, seed)
    right = np.random.default_rng(seed).normal(size=85)
    found = SymmetricSystem(matrix, 60).solve(right)
    assert np.abs(matrix @ found - right).max() < 1e-7 * np.abs(right).max()
    assert np.allclose(found, np.linalg.solve(matrix.toarray(), right), rtol=1e-6, atol=1e-6)


def test_rows_that_say_the_same_twice_do_no_harm() -> None:
    h, a = sparse.eye_array(3), sparse.csc_array([[1.0, 1.0, 0.0], [1.0, 1.0, 0.0]])
    d = -1e-10 * sparse.eye_array(2)
    system = SymmetricSystem(sparse.block_array([[h, a.T], [a, d]]), 3)
    found = system.solve(np.array([0.0, 0.0, 1.0, 2.0, 2.0]))
    assert found[:3] == pytest.approx([1.0, 1.0, 1.0], abs=1e-6)


class Textbook:
    """A unit mass is moved by 1 m in 1 s: effort 12 m^2 / T^3, force m (6 - 12 t) (closed form)."""

    def __init__(self, **bounds: tuple[float, float]) -> None:
        self.problem, self.numbers = double_integrator()
        self.bounds = {(name,): pair for name, pair in bounds.items()}
        self.blocks = CollocationBlocks(self.problem, 3)
        self.start = at_rest(self.problem, 3, 3)
        self.solved = self.program()
        settings = IpoptSettings(tolerance=1e-10)
        x = self.solved.to_unknowns(self.start)
        self.result = solve_program(self.solved, x, settings)
        assert self.result.converged

    def program(self, mass: float = 1.0, duration: float = 0.5) -> CollocationProgram:
        """Return the program of a mass [kg] and a length of each phase [s]."""
        entries = {**self.numbers.bounds.entries, **self.bounds}
        entries[("duration",)] = (duration, duration)
        numbers = ProblemNumbers(np.array([mass]), BoundTable(entries), self.numbers.point_data)
        return CollocationProgram(self.blocks, numbers, self.start.meshes)


def test_derivatives_by_a_number_are_those_of_the_closed_form() -> None:
    book = Textbook()
    system = KktSystem(book.solved, book.result)
    found = system.answer(book.program(1.0 - STEP), book.program(1.0 + STEP), STEP)
    assert found.cost == pytest.approx(24.0, rel=1e-6)
    motion = book.solved.to_motion(found.unknowns)
    for i, phase in enumerate(motion.phases):
        time = 0.5 * (i + phase.point_fractions)
        assert phase.algebraic[:, :, 1] == pytest.approx(6.0 - 12.0 * time, abs=1e-5)
        assert phase.algebraic[:, :, 0] == pytest.approx(0.0 * time, abs=1e-5)


def test_derivatives_by_a_bound_are_those_of_the_closed_form() -> None:
    book = Textbook()
    system = KktSystem(book.solved, book.result)
    pair = book.program(duration=0.5 - STEP), book.program(duration=0.5 + STEP)
    assert system.answer(*pair, STEP).cost == pytest.approx(2.0 * -36.0, rel=1e-5)


def test_derivatives_hold_where_inequalities_are_active() -> None:
    book = Textbook(forward=(-np.inf, 1.3))  # the free optimum reaches 1.5 m/s
    system = KktSystem(book.solved, book.result)
    assert system.active >= 2
    found = system.answer(book.program(1.0 - STEP), book.program(1.0 + STEP), STEP)
    assert found.cost == pytest.approx(2.0 * book.result.objective, rel=1e-5)
    assert system.changed(system) == 0


def optimum_in(book: Textbook, program: CollocationProgram) -> Optimum:
    """Return the solution of a textbook problem in the program of other numbers."""
    return Optimum(cast("GaitSolver", None), program, book.result)


def test_the_way_to_a_neighbour_misses_its_rows_by_the_second_order() -> None:
    book = Textbook()
    here = optimum_in(book, book.solved)
    plain, first = [], []
    for distance in (1.02, 1.01):
        there = optimum_in(book, book.program(distance))
        plain.append(there.missed)
        first.append(here.towards(there).missed)
    assert plain[0] == pytest.approx(2.0 * plain[1], rel=0.1)
    assert first[0] < 0.1 * plain[0]


def test_a_warm_start_goes_further_off_its_bounds_the_more_it_misses() -> None:
    book = Textbook()
    barriers = [
        warm_start_for(optimum_in(book, program)).barrier
        for program in (
            book.program(1.001),
            book.program(1.005),
            book.program(duration=0.8),
            book.program(2.0),
        )
    ]
    assert barriers == [None, 1e-6, 1e-6, 1e-5]


@pytest.mark.slow
def test_derivatives_of_a_gait_agree_with_solves() -> None:
    config = smoke_version(load_config("mapd-orthosis"))
    case = Case.of(with_values(config, {"solver.tolerance": 1e-6}))
    solution = GaitSolver(case).solve()
    resolver = Resolver(case, solution.last_motion, solution.nlp.multipliers, 1e-9)
    around = Neighbourhood(resolver)
    step, compared = 5e-4, 0
    for name, found, change in (
        ("mass", around.by_factor("body_mass"), "body_mass"),
        ("strength", around.by_factor("strengths"), "strengths"),
    ):
        ends = [
            resolver.resolve(case.with_values({"variation.scale": {change: 1.0 + sign * step}}))
            for sign in (-1.0, 1.0)
        ]
        if any(around.changed_activity(end) for end in ends):
            continue
        below, above = (measures(end) for end in ends)
        low, high = measures(found.below), measures(found.above)
        for key in ("cost", "effort_per_distance", "step_length_right", "stride_time"):
            expected = (above[key] - below[key]) / (2.0 * step)
            own = (high[key] - low[key]) / (2.0 * found.step)
            assert own == pytest.approx(expected, rel=1e-2, abs=1e-4), (name, key)
            compared += 1
    assert compared, "the active set changed in all cases: nothing was compared"
