"""The problems as values: what each one sets, fits of recordings, steps, and several starts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from pathwalker_cli import build_walker, load_patient
from pathwalker_cli.case import Case, load_case
from pathwalker_cli.config import StudyConfig, load_config, smoke_version
from pathwalker_cli.conventions import COORDINATES, GENERATORS, mirror_permutation, mirrored
from pathwalker_cli.errors import ConfigError, DataError
from pathwalker_cli.gait.recorded import passage_samples, recorded_passage
from pathwalker_cli.gait.shooting import solve_by_shooting
from pathwalker_cli.gait.solve import GaitSolver, solve_study
from pathwalker_cli.gait.starts import solve_from_starts, spread_starts
from pathwalker_cli.gait.symmetry import asymmetries
from pathwalker_cli.io.recordings import read_recording
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.elements.muscle import activation_rate, excitation_from_rate
from pathwalker_cli.stride.verify import reintegrate

PATIENT, HEALTHY = "sreenivasa2017-patient", "sreenivasa2017-healthy"


def test_problems_bring_their_own_defaults() -> None:
    fast = StudyConfig(problem="mapd-ws-orthosis", patient=PATIENT)
    assert fast.cost.walking_speed_weight == 2.0
    slow = {
        "problem": "mapd-ws-orthosis",
        "patient": PATIENT,
        "cost": {"walking_speed_weight": 1.0},
    }
    assert StudyConfig.model_validate(slow).cost.walking_speed_weight == 1.0
    fit = StudyConfig(problem="ls-barefoot", patient=PATIENT)
    assert (fit.fits, fit.cost.effort_weight, fit.start.gait) == (True, 0.0, "recorded")
    assert StudyConfig(problem="mapd-healthy", patient=HEALTHY).half_cycle


def test_a_fit_needs_a_whole_recording() -> None:
    with pytest.raises(ValidationError, match="synthetic start"):
        StudyConfig.model_validate({"problem": "ls-barefoot", "patient": PATIENT,
                                    "start": {"gait": "synthetic"}})  # fmt: skip
    with pytest.raises(ConfigError, match="half cycle"):
        load_config("ls-barefoot", changes=("half_cycle=true",))


def test_half_a_cycle_needs_equal_sides() -> None:
    assert asymmetries(build_walker(load_patient(HEALTHY))) == []
    assert "strengths" in asymmetries(build_walker(load_patient(PATIENT)))
    case = load_case("mapd-barefoot", changes=("half_cycle=true",))
    with pytest.raises(ConfigError, match="half a cycle, but strengths"):
        GaitSolver(case)


def test_mirroring_twice_changes_nothing() -> None:
    for names in (COORDINATES, GENERATORS):
        order = mirror_permutation(names)
        assert np.array_equal(order[order], np.arange(len(names)))
    assert mirrored("heel_r_x") == "heel_l_x"
    assert mirrored("dorsiflexion_stiffness_left") == "dorsiflexion_stiffness_right"
    half = len(PHASES) // 2
    for phase, other in zip(PHASES[:half], PHASES[half:], strict=True):
        assert {mirrored(force) for force in phase.force_names} == set(other.force_names)


def test_symbolic_excitation_is_the_inverse_of_the_activation_rate() -> None:
    import casadi as ca

    rate, a = ca.SX.sym("rate"), ca.SX.sym("a")
    function = ca.Function("e", [rate, a], [excitation_from_rate(rate, a)])
    for excitation, activation in ((0.0, 0.4), (0.3, 0.4), (0.4, 0.4), (0.9, 0.4), (1.0, 0.0)):
        value = function(activation_rate(excitation, activation), activation)
        assert float(value) == pytest.approx(excitation, abs=1e-12)


def test_a_passage_keeps_the_recorded_frames_and_times() -> None:
    patient = load_patient(PATIENT)
    recording = read_recording(patient, "barefoot", "3053171")
    passage = recorded_passage(build_walker(patient), recording)
    assert passage.durations.shape == (8,)
    assert passage.durations.sum() == pytest.approx(passage.trajectory.time[-1])
    assert (passage.durations > 0.015).all()
    samples = passage_samples(passage)
    assert len(samples) == len(passage.trajectory.time)
    begin = int(np.argmin(abs(recording.motion.time - float(passage.name.split()[-2]))))
    angles = recording.motion.values[begin : begin + len(samples), 2:]
    assert np.allclose([sample.data[2:] for sample in samples], angles)
    right = replace(recording, events=tuple(e for e in recording.events if e.side == "right"))
    with pytest.raises(DataError, match="no stride from left toe-off"):
        recorded_passage(build_walker(patient), right)


def test_a_coarse_fit_stays_near_the_recording() -> None:
    solution = solve_study(smoke_version(load_config("ls-barefoot")))
    assert solution.converged
    terms = solution.cost_terms
    assert sum(terms.values()) == pytest.approx(solution.cost, rel=1e-6)
    assert terms["fit"] < 3.0
    assert [p.duration for p in solution.last_motion.phases] == pytest.approx(
        GaitSolver(load_case("ls-barefoot")).stride.durations.tolist()
    )


def test_one_step_gives_a_whole_symmetric_stride() -> None:
    solution = solve_study(smoke_version(load_config("mapd-healthy")))
    assert solution.converged
    motion = solution.last_motion
    assert [phase.name for phase in motion.phases] == [phase.name for phase in PHASES]
    order = mirror_permutation(COORDINATES)
    first, middle = motion.phases[0].states[0, :10], motion.phases[4].states[0, :10]
    assert np.allclose(middle[1:], first[order][1:], atol=1e-8)
    assert np.allclose(motion.phases[-1].states[-1, 1:10], first[1:], atol=1e-8)
    assert sum(solution.cost_terms.values()) == pytest.approx(solution.cost, rel=1e-6)
    again = reintegrate(solution.walker, motion)
    half = len(PHASES) // 2
    for one, other in zip(again.position[:half], again.position[half:], strict=True):
        assert np.allclose(one, other, rtol=1e-3, atol=1e-9)


def test_starts_are_spread_and_repeatable() -> None:
    changes = ("starts=4", "start.seed=7", "start.gait=synthetic")
    config = smoke_version(load_config("mapd-orthosis", changes=changes))
    solver = GaitSolver(Case.of(config))
    studies = [case.config for case in spread_starts(solver)]
    assert studies == [case.config for case in spread_starts(solver)]
    assert studies[0].start == config.start
    assert all(study.starts == 1 for study in studies)
    lower, upper = solver.bounds.table.find("dorsiflexion_stiffness_left") or (0.0, 0.0)
    springs = [
        study.start.free["orthosis.stiffness_guess.dorsiflexion.left"] for study in studies[1:]
    ]
    assert all(lower <= value <= upper for value in springs)
    assert len({round(study.start.knee_flexion, 6) for study in studies}) == len(studies)
    solver.case = solver.case.with_values({"start.seed": 8})
    assert spread_starts(solver)[1].config != studies[1]


def test_the_other_typical_walks_come_before_the_spread() -> None:
    case = load_case("mapd-orthosis", changes=("starts=5",))
    starts = [each.config.start for each in spread_starts(GaitSolver(case))]
    kinds = [(start.gait, start.walk) for start in starts]
    assert kinds == [("typical", 0), ("typical", 1), ("typical", 2), *2 * [("synthetic", 0)]]
    case = load_case("mapd-orthosis", changes=("starts=2", "start.walk=2"))
    assert [each.config.start.walk for each in spread_starts(GaitSolver(case))] == [2, 0]


def test_shooting_solves_predictions_only() -> None:
    case = load_case("ls-barefoot", changes=("transcription=multiple-shooting",))
    with pytest.raises(ConfigError, match="fits a recording"):
        solve_by_shooting(GaitSolver(case))


@pytest.mark.slow
def test_the_best_of_several_starts_is_the_result() -> None:
    config = smoke_version(load_config("mapd-barefoot", changes=("starts=3",)))
    found: list[int] = []
    solution = solve_from_starts(Case.of(config), lambda optimum: found.append(optimum.start))
    assert sorted(found) == [0, 1, 2]
    costs = [optimum.cost for optimum in solution.optima if optimum.converged]
    assert costs == sorted(costs)
    assert solution.cost == pytest.approx(costs[0], rel=1e-9)
