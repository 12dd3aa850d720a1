"""Evaluation of a gait: on published motions, in closed form, and against a run's own metrics."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from helpers import stylised_series, walker_of
from pathwalker_cli.conventions import SIDES, Condition
from pathwalker_cli.errors import DataError
from pathwalker_cli.evaluation.differences import (
    FORCE_RMS,
    JOINTS,
    force_rms,
    recorded_rms_mean_cycle,
    recorded_rms_one_trial,
    rms_mean_cycle,
    rms_one_trial,
)
from pathwalker_cli.evaluation.evaluate import (
    Evaluation,
    Row,
    compared,
    evaluate_gait,
    gait_changes,
)
from pathwalker_cli.evaluation.norms import PROFILE
from pathwalker_cli.evaluation.paper import paper_number
from pathwalker_cli.evaluation.recorded import (
    RecordedGait,
    Spread,
    article_stride,
    recorded_gait,
    recorded_numbers,
    reference_stride,
    spread,
)
from pathwalker_cli.evaluation.tables import change_lines
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.measures import ankle_line, measures_in, metrics_of
from pathwalker_cli.stride.stride import POINTS, NotKnownError, Stride, stride_of
from published_motions import needs_published, published_gait, sampled_gait, sparse_gait

CHILD = Path(__file__).parent / "data" / "child-10y"
PREDICTIONS = ("mapd-barefoot", "mapd-orthosis")

# Degrees: pelvis, hip, knee, ankle, as the published files give them with the article's program.
ONE_TRIAL = {
    "ls-barefoot": (0.830, 1.515, 2.426, 2.639),
    "mapd-barefoot": (7.568, 12.949, 13.666, 12.218),
    "mapd-orthosis": (8.482, 14.479, 16.108, 8.284),
}

# The same against the average of all shipped recordings, which the article's text names; measured.
MEAN_CYCLE = {
    "ls-barefoot": (4.65, 5.80, 4.44, 2.93),
    "mapd-barefoot": (2.79, 6.10, 11.93, 7.91),
    "mapd-orthosis": (8.44, 8.68, 14.06, 5.00),
}


@cache
def recordings(condition: Condition) -> RecordedGait:
    """Return the shipped recordings."""
    found = recorded_gait(walker_of(condition))
    assert found is not None
    return found


@cache
def made_gait(condition: Condition = "orthosis") -> Stride:
    """Return the stylised gait."""
    return stride_of(stylised_series(condition), "made", f"mapd-{condition}")


@cache
def made_evaluation(condition: Condition) -> Evaluation:
    """Return the stylised gait beside the recordings."""
    return evaluate_gait(made_gait(condition), recorded=recordings(condition))


def numbers_of(gait: Stride) -> dict[str, float]:
    """Return what a gait says by itself, by key beside recordings."""
    values = {measure.key: measure.of(gait) for measure in measures_in("evaluate")}
    return {key: value for key, value in values.items() if value is not None}


def degrees(found: dict[str, float]) -> list[float]:
    """Return the root mean squares of the four joints that the article prints [deg]."""
    return [float(np.rad2deg(found[joint])) for joint in ("pelvis", "hip", "knee", "ankle")]


# Published motions


@pytest.mark.parametrize("problem", PREDICTIONS)
def test_a_few_published_instants_give_the_printed_steps_and_speed(problem: str) -> None:
    numbers = numbers_of(sparse_gait(problem))
    for quantity in ("step_length_left", "step_length_right", "walking_speed"):
        printed = paper_number(problem, quantity)
        assert printed is not None
        truncated = f"{int(numbers[quantity] / printed.step) * printed.step:.2f}"
        if (problem, quantity) == ("mapd-orthosis", "walking_speed"):
            truncated = f"{numbers[quantity]:.2f}"  # 0.6174: the one that is rounded
        assert truncated == printed.text, (quantity, numbers[quantity])
        assert printed.agrees(numbers[quantity])


def test_a_few_published_instants_give_step_lengths_and_speeds() -> None:
    barefoot, orthosis = (numbers_of(sparse_gait(problem)) for problem in PREDICTIONS)
    assert barefoot["step_length_left"] == pytest.approx(0.3740, abs=5e-5)
    assert barefoot["step_length_right"] == pytest.approx(0.2985, abs=5e-5)
    assert barefoot["walking_speed"] == pytest.approx(0.6098, abs=5e-5)
    assert orthosis["step_length_left"] == pytest.approx(0.3248, abs=5e-5)
    assert orthosis["step_length_right"] == pytest.approx(0.4172, abs=5e-5)
    assert orthosis["walking_speed"] == pytest.approx(0.6174, abs=5e-5)


@pytest.mark.parametrize(
    "gait_of", [sparse_gait, pytest.param(published_gait, marks=needs_published)]
)
def test_published_knees_extend_as_the_article_says(gait_of: Callable[[str], Stride]) -> None:
    barefoot, orthosis = (numbers_of(gait_of(problem)) for problem in PREDICTIONS)
    key = "min_stance_knee_flexion"
    found = [np.rad2deg(x[f"{key}_{side}"]) for x in (barefoot, orthosis) for side in SIDES]
    np.testing.assert_allclose(found, [34.37, 34.38, 25.11, 26.07], atol=5e-3)
    for side, change in zip(SIDES, (-9.26, -8.30), strict=True):
        difference = orthosis[f"{key}_{side}"] - barefoot[f"{key}_{side}"]
        assert np.rad2deg(difference) == pytest.approx(change, abs=5e-3)
        printed = paper_number("change", f"{key}_{side}")
        assert printed is not None
        assert printed.agrees(difference)


def test_twelve_published_instants_come_near_the_printed_rms_differences() -> None:
    stride = article_stride(recordings("orthosis"))
    assert stride is not None
    found = degrees(rms_one_trial(sampled_gait(), stride))
    np.testing.assert_allclose(found, [8.48, 14.48, 16.11, 8.28], atol=0.08)


@needs_published
@pytest.mark.parametrize("problem", ONE_TRIAL)
def test_published_files_give_the_printed_rms_differences(problem: str) -> None:
    condition: Condition = "orthosis" if "orthosis" in problem else "barefoot"
    stride = article_stride(recordings(condition))
    assert stride is not None
    found = rms_one_trial(published_gait(problem), stride)
    np.testing.assert_allclose(degrees(found), ONE_TRIAL[problem], atol=6e-4)
    for joint in ("pelvis", "hip", "knee", "ankle"):
        printed = paper_number(problem, f"rms_one_trial_{joint}")
        assert printed is not None
        assert f"{np.rad2deg(found[joint]):.2f}" == printed.text


@needs_published
@pytest.mark.parametrize("problem", MEAN_CYCLE)
def test_what_the_article_says_it_compared_with_gives_other_numbers(problem: str) -> None:
    """The average of the recorded cycles, in per cent of the cycle: its text, not its program."""
    condition: Condition = "orthosis" if "orthosis" in problem else "barefoot"
    found = rms_mean_cycle(published_gait(problem), recordings(condition))
    np.testing.assert_allclose(degrees(found), MEAN_CYCLE[problem], atol=6e-3)
    printed = paper_number(problem, "rms_one_trial_hip")
    assert printed is not None
    assert not printed.agrees(found["hip"])


@needs_published
def test_published_files_agree_with_the_instants_kept_here() -> None:
    for problem in PREDICTIONS:
        full, sparse = numbers_of(published_gait(problem)), numbers_of(sparse_gait(problem))
        for key, value in sparse.items():
            assert full[key] == pytest.approx(value, abs=2e-5), key


@needs_published
def test_published_fit_has_the_effort_and_forces_of_its_files() -> None:
    numbers = numbers_of(published_gait("ls-barefoot"))
    assert numbers["effort_per_distance"] == pytest.approx(4.75, abs=5e-3)
    found = force_rms(published_gait("ls-barefoot"), recordings("barefoot"))
    # Printed: 68.24 N; which trials were averaged and how is not said.
    assert found["rms_vertical_force_stance"] == pytest.approx(72.1, abs=0.05)
    assert found["rms_vertical_force_cycle"] == pytest.approx(54.5, abs=0.05)


# Closed form


def shifted(offset: float) -> Stride:
    """Return a gait whose angles lie a constant above a recorded stride [rad]."""
    stride = article_stride(recordings("barefoot"))
    assert stride is not None
    return replace(
        sparse_gait("mapd-barefoot"),
        time=stride.time,
        phase=("right_flat",) * stride.time.size,
        q=stride.q + offset,
    )


def test_a_constant_offset_is_its_own_rms_difference() -> None:
    gait = shifted(0.1)
    stride = article_stride(recordings("barefoot"))
    assert stride is not None
    found = rms_one_trial(gait, stride)
    assert found.keys() == JOINTS.keys()
    np.testing.assert_allclose(list(found.values()), 0.1, rtol=1e-12)


def test_between_coarse_instants_angles_are_interpolated_and_after_the_end_they_stand() -> None:
    stride = article_stride(recordings("barefoot"))
    assert stride is not None
    ramp = replace(stride, q=stride.time[:, None] * np.ones(10))
    gait = shifted(0.0)
    ends = gait.time[[0, -1]]
    straight = replace(gait, time=ends, phase=gait.phase[:2], q=ends[:, None] * np.ones(10))
    assert max(rms_one_trial(straight, ramp).values()) == pytest.approx(0.0, abs=1e-12)
    half = replace(straight, time=0.5 * ends, q=0.5 * straight.q)
    beyond = np.maximum(stride.time[:-4] - 0.5 * ends[1], 0.0)
    expected = float(np.sqrt(np.mean(beyond**2)))
    assert rms_one_trial(half, ramp)["hip"] == pytest.approx(expected)


def test_stances_and_cycles_begin_with_the_strike_and_go_on_at_the_beginning() -> None:
    gait = made_gait()
    clock = gait.time[:, None]
    for side in SIDES:
        cycle = gait.over_cycle(clock, side)[:, 0]
        assert cycle[0] == pytest.approx(gait.strike(side))
        assert cycle[-1] == pytest.approx(gait.strike(side))
        assert cycle.max() <= gait.duration
        stance = gait.over_stance(clock, side)[:, 0]
        assert stance[0] == pytest.approx(gait.strike(side))
        assert stance[-1] == pytest.approx((gait.toe_off(side) - 1e-12) % gait.duration)
    assert gait.mean(np.ones((gait.time.size, 2))) == pytest.approx([1.0, 1.0])


def test_the_line_of_a_spring_has_its_stiffness() -> None:
    angle = np.sin(np.linspace(0.0, 3.0, POINTS))
    slope, offset = ankle_line(np.stack([angle, 42.0 * angle - 3.0], axis=1))
    assert (slope, offset) == pytest.approx((42.0, -3.0))


def test_a_spread_knows_what_lies_inside() -> None:
    found = spread([1.0, 2.0, 6.0])
    assert found == Spread(3.0, 1.0, 6.0, 3, pytest.approx(7.0**0.5))
    assert [found.position(x) for x in (0.9, 1.0, 6.0, 6.1)] == ["below", "in", "in", "above"]
    assert spread([]) is None


def test_gaits_of_wrong_shape_are_refused() -> None:
    gait = made_gait()
    for wrong in ({"q": gait.q[1:]}, {"phase": ("swing",) * gait.time.size},
                  {"time": gait.time[::-1]}, {"force": {"right": gait.q}}):  # fmt: skip
        with pytest.raises(ValueError, match=r"."):
            replace(gait, **wrong)


# Against a run's own metrics


@pytest.mark.parametrize("condition", ["barefoot", "orthosis"])
def test_numbers_are_those_of_the_run_itself(condition: Condition) -> None:
    numbers, own = numbers_of(made_gait(condition)), metrics_of(made_gait(condition))
    for key in ("walking_speed", "stride_time", "step_length_right", "step_length_left",
                "stance_share_right", "stance_share_left", "min_stance_knee_flexion_right",
                "min_stance_knee_flexion_left"):  # fmt: skip
        assert numbers[key] == pytest.approx(own[key], rel=1e-9), key
    for side in SIDES:
        peak = own[f"peak_vertical_force_{side}_body_weights"]
        assert numbers[f"peak_vertical_force_{side}"] == pytest.approx(peak)
        extension = f"ankle_extension_{side[0]}"
        activation = numbers[f"peak_ankle_extension_activation_{side}"]
        assert activation == pytest.approx(own["peak_activation"][extension])
        assert (
            numbers.get(f"dorsiflexion_stiffness_{side}") == own[f"dorsiflexion_stiffness_{side}"]
        )


# Recordings


def test_recorded_numbers_are_those_of_the_patients_file() -> None:
    for condition in ("barefoot", "orthosis"):
        found = recorded_numbers(recordings(condition))
        known = recordings(condition).walker.patient.recorded
        assert known is not None
        block = known[condition]
        assert found["walking_speed"].mean == pytest.approx(block.walking_speed.mean, abs=6e-4)
        for side in SIDES:
            steps = found[f"step_length_{side}"]
            limits = getattr(block.step_length, side)
            assert (steps.low, steps.high) == pytest.approx((limits.min, limits.max), abs=6e-4)


def test_measured_stances_alone_tell_of_forces_and_torques() -> None:
    counts = {"barefoot": (4, 5), "orthosis": (6, 7)}
    for condition, wanted in counts.items():
        found = recordings(condition)  # type: ignore[arg-type]
        assert tuple(len(found.stance_forces(side)) for side in SIDES) == wanted
        assert tuple(len(found.ankle_profiles(side)) for side in SIDES) == wanted
        for side in SIDES:
            forces = found.stance_forces(side)
            assert forces.shape[1:] == (POINTS, 2)
            assert 0.8 < forces[:, :, 1].max() / found.walker.weight < 1.5


def test_the_mean_cycle_differs_from_itself_by_nothing() -> None:
    found = recordings("orthosis")
    assert all(each.low > 0.0 for each in recorded_rms_mean_cycle(found).values())
    stride = reference_stride(found)
    assert stride is not None
    assert stride.name == "3053141"
    assert recorded_rms_one_trial(found, stride)["knee"].count == 7


def test_the_reference_stride_begins_at_the_toe_off() -> None:
    found = recordings("barefoot")
    own, article = reference_stride(found), article_stride(found)
    assert own is not None
    assert article is not None
    assert own.time.size == article.time.size + 1
    np.testing.assert_array_equal(own.q[1:], article.q)
    other = next(t.name for t in found.trials if t.name in ("3053173", "3053180", "3053182"))
    assert other != own.name
    with pytest.raises(DataError, match="no barefoot recording 'walk'; allowed: 3053171"):
        reference_stride(found, "walk")


def test_other_recordings_have_no_stride_of_the_article() -> None:
    found = recordings("barefoot")
    stranger = replace(found.walker, patient=found.walker.patient.model_copy(update={"id": "x"}))
    assert article_stride(replace(found, walker=stranger)) is None
    named = reference_stride(replace(found, walker=stranger))
    assert named is not None
    assert named.name != "3053171"


# The whole evaluation


def rows_of(evaluation: Evaluation) -> dict[str, Row]:
    """Return the rows by the keys of their measures."""
    return {row.measure.key: row for row in evaluation.rows}


@pytest.mark.parametrize("condition", ["barefoot", "orthosis"])
def test_every_quantity_has_a_row(condition: Condition) -> None:
    evaluation = made_evaluation(condition)
    keys = [row.measure.key for row in evaluation.rows]
    wanted = [m.key for m in compared() if condition == "orthosis" or "stiffness" not in m.key]
    assert keys == wanted
    for row in evaluation.rows:
        assert row.value is not None
        assert np.isfinite(row.value)
    for key in (*FORCE_RMS, "step_length_left", "rms_mean_cycle_knee", "rms_one_trial_hip",
                "peak_vertical_force_right", "ankle_torque_slope_stance_left"):  # fmt: skip
        assert rows_of(evaluation)[key].position in ("below", "in", "above")
    assert not [note for note in evaluation.notes if "typical children" not in note]
    assert evaluation.find("colour") is None


def test_the_article_stands_beside_its_own_patient_and_problem() -> None:
    evaluation = made_evaluation("orthosis")
    speed = rows_of(evaluation)["walking_speed"]
    assert (str(speed.paper), str(speed.paper_recorded)) == ("0.62", "0.70-0.98")
    other = evaluate_gait(replace(made_gait(), problem="mapd-ws-orthosis"),
                          recorded=recordings("orthosis"))  # fmt: skip
    assert str(rows_of(other)["walking_speed"].paper) == "0.77"
    assert rows_of(other)["rms_one_trial_hip"].paper is None


def test_changes_are_differences_of_values_and_of_recorded_means() -> None:
    barefoot, orthosis = made_evaluation("barefoot"), made_evaluation("orthosis")
    changes = {change.measure.key: change for change in gait_changes(barefoot, orthosis)}
    every = (*measures_in("evaluate"), *PROFILE)
    assert list(changes) == [m.key for m in every if "stiffness" not in m.key]
    knee = changes["min_stance_knee_flexion_right"]
    assert knee.value == knee.orthosis - knee.barefoot
    # The patient walked with straighter knees in the orthoses.
    assert np.rad2deg(knee.recorded) == pytest.approx(-4.9, abs=0.1)
    assert str(knee.paper) == "-9.26"
    assert str(changes["peak_ankle_extension_torque_left"].paper) == "falls"
    assert changes["stride_time"].paper is None


def test_a_column_of_which_nothing_is_known_is_left_out() -> None:
    changes = gait_changes(made_evaluation("barefoot"), made_evaluation("orthosis"))
    full = [line.split() for line in change_lines(changes)][1]
    assert full == ["barefoot", "orthosis", "change", "[%]", "recorded", "paper", "unit"]
    bare = [replace(change, recorded=None, paper=None) for change in changes]
    head = [line.split() for line in change_lines(bare)][1]
    assert head == ["barefoot", "orthosis", "change", "[%]", "unit"]


def test_without_recordings_the_rest_is_still_there() -> None:
    gait = replace(made_gait(), walker=build_walker(load_patient(CHILD), "orthosis"))
    evaluation = evaluate_gait(gait)
    assert evaluation.recorded is None
    assert rows_of(evaluation)["walking_speed"].value == gait.walking_speed
    assert all(row.recorded is None and row.paper is None for row in evaluation.rows)
    assert len(evaluation.notes) == 1
    assert "has no orthosis recordings" in evaluation.notes[0]


def test_recordings_without_forces_still_tell_of_angles() -> None:
    found = recordings("barefoot")
    blind = tuple(replace(t, forces=None, tau=None, stances=()) for t in found.trials)
    evaluation = evaluate_gait(made_gait("barefoot"), recorded=replace(found, trials=blind))
    assert rows_of(evaluation)["rms_mean_cycle_knee"].recorded is not None
    assert rows_of(evaluation)["peak_vertical_force_right"].recorded is None
    assert all(row.value is None for row in evaluation.rows if row.measure.key in FORCE_RMS)
    assert len(evaluation.notes) == 3
    assert all("not compared" in note for note in evaluation.notes[1:])


def test_a_motion_without_torques_gives_what_it_has() -> None:
    numbers = numbers_of(sparse_gait("mapd-orthosis"))
    assert "peak_vertical_force_right" not in numbers
    assert "effort_per_distance" not in numbers
    with pytest.raises(NotKnownError):
        sparse_gait("mapd-orthosis").ankle_profile("left")
