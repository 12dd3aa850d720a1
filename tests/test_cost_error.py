"""The estimated discretisation error of a cost against the cost on finer meshes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pathwalker_cli.gait import mesh
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.cost_error import cost_error
from pathwalker_cli.ocp.phased import PhasedMotion
from test_collocation import at_rest, double_integrator


def solved(intervals: int) -> tuple[CollocationProgram, NlpResult]:
    """Return the textbook problem with force^4 as cost, on so many intervals a phase.

    The optimal force goes with the cube root of time, which no polynomial follows.
    """
    problem, numbers = double_integrator(power=4)
    start = at_rest(problem, intervals, 3)
    program = CollocationProgram(CollocationBlocks(problem, 3), numbers, start.meshes)
    return program, solve_program(program, program.to_unknowns(start), IpoptSettings(1e-10))


@pytest.mark.parametrize("intervals", [2, 4, 8])
def test_the_estimate_is_about_what_halving_the_intervals_changes(intervals: int) -> None:
    program, result = solved(intervals)
    change = solved(2 * intervals)[1].objective - result.objective
    estimate = cost_error(program, result)
    assert estimate is not None
    assert abs(change) > 1e-7 * result.objective
    assert 1 / 3 < estimate.total / change < 3


def test_the_step_leads_towards_the_motion_on_the_finer_mesh() -> None:
    program, result = solved(3)
    fine, there = solved(6)
    estimate = cost_error(program, result)
    assert estimate is not None
    assert estimate.motion is not None
    here = program.to_motion(result.unknowns).resampled(fine.meshes, 3)
    before, after = (
        np.abs(fine.to_unknowns(motion) - there.unknowns).max()
        for motion in (here, estimate.motion)
    )
    assert before > 1e-3
    assert after < 0.3 * before


def test_the_shares_point_to_where_the_force_is_not_smooth() -> None:
    estimate = cost_error(*solved(6))
    assert estimate is not None
    first, second = (np.abs(part) for part in estimate.shares)
    assert first.argmax() == 5
    assert second.argmax() == 0
    assert first[-1] > 20 * first[:-2].sum()


def test_a_step_that_is_no_small_correction_is_no_estimate() -> None:
    program, result = solved(2)
    still = program.to_unknowns(at_rest(program.problem, 2, 3))
    assert cost_error(program, replace(result, unknowns=still, objective=0.0)) is None


def test_a_step_that_leaves_a_phase_no_time_leads_to_no_motion(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    program, result = solved(3)
    real = CollocationProgram.to_motion

    def turned_back(on: CollocationProgram, unknowns: np.ndarray) -> PhasedMotion:
        motion = real(on, unknowns)
        phases = (replace(motion.phases[0], duration=-0.1), *motion.phases[1:])
        return motion if on is program else replace(motion, phases=phases)

    monkeypatch.setattr(CollocationProgram, "to_motion", turned_back)
    estimate = cost_error(program, result)
    assert estimate is not None
    assert estimate.motion is None


def test_an_optimum_that_the_mesh_holds_exactly_has_no_error() -> None:
    problem, numbers = double_integrator()
    start = at_rest(problem, 3, 3)
    program = CollocationProgram(CollocationBlocks(problem, 3), numbers, start.meshes)
    result = solve_program(program, program.to_unknowns(start), IpoptSettings(tolerance=1e-9))
    estimate = cost_error(program, result)
    assert estimate is not None
    assert abs(estimate.total) < 1e-7 * result.objective


def test_intervals_are_split_until_the_others_matter_little() -> None:
    shares = (np.array([-4.0, 0.5, 0.1]), np.array([3.0, -0.2]))
    assert [part.tolist() for part in mesh.costly(shares, 1.0)] == [
        [True, False, False],
        [True, False],
    ]
    assert not any(part.any() for part in mesh.costly(shares, 8.0))
