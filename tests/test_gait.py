"""The gait problem: structure, derivatives, starts, bounds and whole solves."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from scipy.linalg.lapack import dtrtri

from pathwalker_cli.case import Case
from pathwalker_cli.config import BoundsConfig, MeshConfig, StudyConfig, load_config
from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.recorded import recorded_stride
from pathwalker_cli.gait.solve import GaitSolver, solve_study
from pathwalker_cli.io.recordings import read_recording
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.patient import load_patient

CHILD = str(Path(__file__).parent / "data" / "child-10y" / "patient.yaml")


def _config(**changes: object) -> StudyConfig:
    return load_config("mapd-orthosis").model_copy(update=changes)


@pytest.fixture(scope="module")
def solver() -> GaitSolver:
    return GaitSolver(Case.of(_config()))


@pytest.fixture(scope="module")
def program(solver: GaitSolver) -> CollocationProgram:
    guess, costs = solver.parameter_guess(), len(solver.gait.costs.integrals)
    motion = solver.stride.motion(solver.walker, guess, meshing.uniform([2] * 8), 3, costs)
    numbers = solver.prediction
    return CollocationProgram(solver.blocks, numbers, motion.meshes)


def test_phases_touch_down_and_lift_off_once() -> None:
    following = PHASES[1:] + PHASES[:1]
    pairs = list(zip(PHASES, following, strict=True))
    down = [force.name for a, b in pairs for force in a.touched_down(b)]
    up = [force.name for a, b in pairs for force in a.lifted_off(b)]
    assert sorted(down) == ["heel_l_x", "heel_l_z", "heel_r_x", "heel_r_z", "toe_l_z", "toe_r_z"]
    assert sorted(up) == ["heel_l_z", "heel_r_z", "toe_l_x", "toe_l_z", "toe_r_x", "toe_r_z"]


def test_frozen_curves_give_the_torques_and_their_derivatives(solver: GaitSolver) -> None:
    """Residuals of the blocks against plain expressions, by value and by finite difference."""
    block = CollocationBlocks(solver.gait.build(), solver.blocks.degree).phases[4].residual
    value_of, jacobian_of, hessian_of = block.functions.values()
    rng = np.random.default_rng(5)
    x = 0.3 * rng.normal(size=block.expressions.unknowns.numel())
    data = np.concatenate([[0.1, 0.5], np.zeros(10)])
    shared = solver.prediction.shared
    jacobian = np.asarray(ca.DM(jacobian_of(x, data, shared)[0]))
    lam = rng.normal(size=block.rows)
    hessian = np.asarray(ca.DM(hessian_of(x, data, shared, 0.0, lam)))
    hessian = hessian + np.triu(hessian, 1).T
    h = 1e-6
    for k in rng.choice(x.size, 25, replace=False):
        e = h * (np.arange(x.size) == k)
        values = [np.asarray(value_of(x + s * e, data, shared)[0]).ravel() for s in (1, -1)]
        assert (values[0] - values[1]) / (2 * h) == pytest.approx(jacobian[:, k], abs=1e-5)
        slopes = [np.asarray(ca.DM(jacobian_of(x + s * e, data, shared)[0])) for s in (1, -1)]
        bend = (slopes[0] - slopes[1]).T @ lam / (2 * h)
        assert bend == pytest.approx(hessian[:, k], abs=1e-3)


def test_fast_torques_are_those_of_the_walker(solver: GaitSolver) -> None:
    rng = np.random.default_rng(2)
    walker = solver.walker.with_parameters([40, 50, 10, 20])
    for _ in range(20):
        q, v, a = 0.3 * rng.normal(size=10), 3 * rng.normal(size=10), rng.uniform(size=14)
        forces, tau = (np.asarray(k).ravel() for k in walker.force_function(q, v, a))
        muscle = solver.walker.muscle_torques(q, v, a)
        orthosis = solver.walker.orthosis_torques(q, (40, 50), (10, 20))
        assert forces == pytest.approx(np.concatenate([muscle, orthosis]), abs=1e-10)
        assert tau == pytest.approx(walker.joint_torques(muscle, orthosis), abs=1e-10)


def test_no_row_and_no_unknown_is_constrained_twice(program: CollocationProgram) -> None:
    """The Jacobian of equalities and fixed unknowns has full rank at a random point."""
    x = 0.3 * np.random.default_rng(1).normal(size=program.size)
    (lower, upper), (low, high) = program.bounds, program.row_bounds
    jacobian = np.asarray(ca.DM(program.functions["jac_g"](x, program.parameters)[1]))
    equal = jacobian[low == high][:, lower < upper]
    triangle = np.linalg.qr((equal / np.linalg.norm(equal, axis=1)[:, None]).T, mode="r")
    inverse, zeros = dtrtri(triangle)
    assert zeros == 0
    # a bound from below of the least singular value, in a tenth of the time that it takes
    assert 1.0 / np.linalg.norm(inverse) > 1e-9
    assert equal.shape[0] < equal.shape[1]


def test_motion_and_unknowns_are_inverse(program: CollocationProgram) -> None:
    x = np.random.default_rng(4).normal(size=program.size)
    assert program.to_unknowns(program.to_motion(x)) == pytest.approx(x, abs=1e-12)


def test_multipliers_carry_over_unchanged_to_the_same_mesh(program: CollocationProgram) -> None:
    from pathwalker_cli.nlp.result import Multipliers

    rng = np.random.default_rng(6)
    before = Multipliers(np.zeros(program.size), rng.normal(size=program.rows))
    after = transferred(program, before, program)
    assert after.rows == pytest.approx(before.rows, abs=1e-12)


def test_stylised_stride_stands_on_the_ground(solver: GaitSolver) -> None:
    for i, phase in enumerate(PHASES):
        for share in (0.1, 0.5, 0.9):
            points = solver.walker.contact_points(solver.stride.coordinates(i, share))
            for point in phase.points:
                row = ("heel_r", "toe_r", "heel_l", "toe_l").index(point.name)
                assert abs(points[row, 1]) < 0.02, (phase.name, point.name, share)


def test_recorded_stride_is_closed_and_begins_at_left_toe_off(solver: GaitSolver) -> None:
    recording = read_recording(solver.walker.patient, "barefoot", "3053171")
    stride = recorded_stride(solver.walker, recording)
    values = stride.trajectory.values
    assert values[-1, 1:] == pytest.approx(values[0, 1:], abs=5e-2)
    assert stride.durations.sum() == pytest.approx(stride.trajectory.duration)
    assert 0.4 < values[-1, 0] < 0.9
    left = [solver.walker.contact_points(q)[2:, 1].min() for q in values]
    assert np.mean(left[5:20]) > 0.01  # the left foot swings first


def test_the_fallback_speed_is_the_same_with_and_without_orthoses() -> None:
    patient = load_patient(CHILD)
    bare, shod = (build_walker(patient, condition) for condition in CONDITIONS)
    assert patient.leg_length == pytest.approx(bare.leg_length, abs=1e-9)
    assert shod.leg_length > bare.leg_length + 0.01, "the shoe lengthens the leg"
    least = [gait_bounds(w, BoundsConfig()).table.entries[("walking_speed",)] for w in (bare, shod)]
    assert least[0] == least[1]
    assert least[0][0] == pytest.approx(0.25 * np.sqrt(9.81 * bare.leg_length))


def test_bounds_come_from_barefoot_recordings_config_or_fallback(solver: GaitSolver) -> None:
    walker = solver.walker
    recorded = walker.patient.recorded["barefoot"].joint_ranges["knee_r"]
    table = gait_bounds(walker, BoundsConfig(joint_range_margin=0.1)).table
    assert table.find("knee_r") == pytest.approx((recorded[0] - 0.1, recorded[1] + 0.1))
    table = gait_bounds(walker, BoundsConfig(joint_ranges={"knee_r": (0.3, 1.2)})).table
    assert table.find("knee_r") == (0.3, 1.2)
    stranger = replace(walker, patient=walker.patient.model_copy(update={"recorded": {}}))
    bounds = gait_bounds(stranger, BoundsConfig())
    assert "fallback" in bounds.sources["knee_r"]
    assert "fallback" in bounds.sources["walking_speed"]


def test_a_recorded_start_without_recordings_is_refused() -> None:
    config = _config(patient=CHILD)
    start = config.start.model_copy(update={"gait": "recorded"})
    with pytest.raises(DataError, match="no barefoot recording of a whole stride"):
        GaitSolver(Case.of(config.model_copy(update={"start": start})))


def test_mesh_follows_durations_and_errors() -> None:
    meshes = meshing.by_duration(np.array([0.1, 0.3, 0.02]), 42, 3)
    assert [len(mesh) - 1 for mesh in meshes] == [10, 30, 3]
    errors = meshing.Reintegration(
        tuple(np.array([0.0] * (len(m) - 2) + [0.1]) for m in meshes),
        tuple(np.zeros(len(m) - 1) for m in meshes),
    )
    cheap = tuple(np.zeros(len(mesh) - 1, bool) for mesh in meshes)
    finer = meshing.refined(meshes, errors, cheap, MeshConfig())
    assert [len(mesh) - 1 for mesh in finer] == [13, 33, 6]
    dear = (np.arange(10) < 2, *cheap[1:])
    finer = meshing.refined(meshes, errors, dear, MeshConfig())
    assert [len(mesh) - 1 for mesh in finer] == [15, 33, 6]
    assert all(np.all(np.diff(mesh) > 0) for mesh in finer)


def test_an_unfinished_solve_is_sealed_and_names_what_is_violated() -> None:
    config = _config()
    solver = config.solver.model_copy(update={"max_iterations": 3})
    mesh = config.mesh.model_copy(update={"intervals": 16, "refinements": 0})
    solution = solve_study(config.model_copy(update={"solver": solver, "mesh": mesh}))
    assert solution.status == "the iteration limit was reached"
    with pytest.raises(NotConvergedError, match="did not converge"):
        _ = solution.series
    assert solution.violations[0].amount > 1e-3
    assert " in " in solution.violations[0].name
    assert "% of the phase" in solution.violations[0].name


@pytest.mark.slow
@pytest.mark.parametrize("changes", [{}, {"patient": CHILD}, {"problem": "mapd-barefoot"}])
def test_full_solve(changes: dict[str, str]) -> None:
    solution = solve_study(_config(**changes))
    assert solution.converged
    assert solution.violations[0].amount < 1e-6
    assert solution.second_engine < 1e-6
    assert solution.reintegration.worst_position < 1e-3
    assert solution.reintegration.worst_velocity < 1e-2
    series = solution.series
    assert series.force[:, 1::2].min() > -1e-6
    least = solution.bounds.table.entries[("walking_speed",)][0]
    assert series.distance / series.duration > least - 1e-6
