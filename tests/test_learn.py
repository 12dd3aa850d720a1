"""Learning from recordings: priors, targets, derivatives, known truth, files, refusals."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner, Result

from pathwalker_cli.case import Case, load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.config.learnt import Learnt, Prior
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.studies.base import base_case, load_study, resolver_of
from pathwalker_cli.studies.learn import LearnStudy, plan
from pathwalker_cli.studies.learn.fit import Learner, descend
from pathwalker_cli.studies.learn.targets import Target, residuals, targets_of
from pathwalker_cli.studies.neighbours import Journal
from pathwalker_cli.studies.run import run_study

NUMBERS = (
    "numbers={examination.knee_extension.right: {prior: -20, spread: 10, range: [-60, 10]}, "
    "tissue.damping: {prior: 0.2, factor: 2.0, range: [0.01, 2.0]}, "
    "cost.goals.time: {prior: 0.5, factor: 3.0, range: [0.02, 10.0]}}"
)
SMOKE = (
    "set={learnt: null, model.feet: points, mesh.intervals: [2, 2, 2, 2, 2, 2, 2, 2], "
    "mesh.refinements: 0, "
    "cost.goals: {steady_trunk: 1.5, upright_trunk: 4.5, level_foot: 2.0}, "
    "cost.acceleration_weight: 0.05, cost.activation_power: 2, solver.tolerance: 1.0e-7}"
)
CHANGES = (NUMBERS, SMOKE)


@pytest.fixture(scope="module")
def study() -> LearnStudy:
    """Return a study of three numbers on a coarse mesh."""
    return load_study("learn", LearnStudy, CHANGES)


@pytest.fixture(scope="module")
def run(study: LearnStudy, tmp_path_factory: pytest.TempPathFactory) -> Run:
    """Return the prediction at the priors."""
    folder = tmp_path_factory.mktemp("learn") / "base"
    run_study(base_case(study), folder)
    return load_run(folder)


@pytest.fixture(scope="module")
def recorded() -> RecordedGait:
    """Return the barefoot recordings of the shipped patient."""
    recordings = recorded_gait(load_case("mapd-barefoot").walker())
    assert recordings is not None
    return recordings


def learner(study: LearnStudy, run: Run, targets: tuple[Target, ...], folder: Path) -> Learner:
    """Return what predicts for numbers and holds it against targets."""
    resolver = resolver_of(run)
    return Learner(study.numbers, run.case, targets, resolver, Journal(folder, run, resolver), str)


# Priors and files


@pytest.mark.parametrize(
    "prior",
    [
        Prior(prior=45.0, spread=30.0, range=(5.0, 100.0)),
        Prior(prior=0.2, factor=2.2, range=(0.01, 2.0)),
    ],
)
def test_values_and_deviations_are_inverse(prior: Prior) -> None:
    assert prior.value(0.0) == pytest.approx(prior.prior)
    for deviations in (-1.3, 0.4, 2.0):
        assert prior.deviations(prior.value(deviations)) == pytest.approx(deviations)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ({"prior": 1.0, "range": [0.0, 2.0]}, "neither spread nor factor"),
        ({"prior": 1.0, "spread": 1.0, "factor": 2.0, "range": [0.0, 2.0]}, "both spread and"),
        ({"prior": 3.0, "spread": 1.0, "range": [0.0, 2.0]}, "outside its range"),
        ({"prior": 1.0, "factor": 2.0, "range": [0.0, 2.0]}, "positive numbers only"),
    ],
)
def test_priors_that_make_no_sense_are_refused(words: dict[str, object], message: str) -> None:
    result = CliRunner().invoke(
        cli, ["learn", "learn", "--set", f"numbers={json.dumps({'tissue.damping': words})}"]
    )
    assert result.exit_code == 2
    assert message in result.output
    assert "Traceback" not in result.output


def test_the_shipped_learnt_numbers_are_read_and_inside_their_ranges() -> None:
    config = load_config("predict-orthosis")
    assert config.learnt is not None
    for place, number in config.learnt.numbers.items():
        assert number.range[0] < number.learnt < number.range[1], place
    assert config.numbers["tissue.damping"] == config.learnt.values["tissue.damping"]
    assert config.cost.goals["time"] == config.learnt.values["cost.goals.time"]
    assert config.condition != config.learnt.condition


def test_what_a_config_says_itself_stands_over_what_was_learnt() -> None:
    config = load_config("predict-barefoot", changes=("cost.goals.time=0.9",))
    assert config.cost.goals["time"] == 0.9
    assert config.learnt is not None
    assert config.cost.goals["level_foot"] == config.learnt.values["cost.goals.level_foot"]


def test_draws_stay_in_ranges_and_follow_the_covariance() -> None:
    learnt = load_config("predict-orthosis").learnt
    assert learnt is not None
    roots = np.linalg.cholesky(np.array(learnt.covariance))
    rng = np.random.default_rng(0)
    drawn = [learnt.at(roots @ row) for row in rng.standard_normal((400, len(learnt.numbers)))]
    for i, (place, number) in enumerate(learnt.numbers.items()):
        values = np.array([each[place] for each in drawn])
        assert (number.range[0] <= values).all(), place
        assert (values <= number.range[1]).all(), place
        spread = np.std([number.deviations(value) for value in values])
        assert spread == pytest.approx(np.sqrt(learnt.covariance[i][i]), rel=0.25), place


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("covariance=[[1.0]]", "covariance of another size"),
        ("numbers={}", "numbers"),
    ],
)
def test_a_damaged_set_is_refused(change: str, message: str, tmp_path: Path) -> None:
    content = load_config("predict-orthosis").learnt
    assert content is not None
    plain = content.model_dump(mode="json", exclude_none=True)
    key, _, value = change.partition("=")
    plain[key] = json.loads(value)
    (tmp_path / "learnt.yaml").write_text(json.dumps(plain), encoding="utf-8")
    words = ["check", "predict-orthosis", "--set", f"learnt={tmp_path / 'learnt.yaml'}"]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    assert message in result.output


def test_a_missing_set_is_refused() -> None:
    result = CliRunner().invoke(cli, ["check", "predict-orthosis", "--set", "learnt=none.yaml"])
    assert result.exit_code == 2
    assert "none.yaml, which does not exist" in result.output


# Targets


def test_a_recorded_mean_misses_nothing_and_the_spread_is_the_childs_own(
    recorded: RecordedGait,
) -> None:
    targets = {t.name: t for t in targets_of(recorded, {"angles": 1.0, "walk": 1.0})}
    assert len(targets) == 14
    knee = targets["angle_knee_right"]
    lines = np.array([knee.of(stride) for stride in recorded.of("stride", "right")])
    assert lines.mean(axis=0) == pytest.approx(knee.mean)
    assert knee.spread == pytest.approx(np.hypot(np.sqrt(lines.var(axis=0, ddof=1).mean()), 3.0))
    assert targets["walking_speed"].mean[0] == pytest.approx(0.636, abs=1e-3)


def test_forces_that_were_not_measured_and_single_trials_are_no_trouble(
    recorded: RecordedGait,
) -> None:
    names = [trial.name for trial in recorded.trials]
    weights = {"angles": 1.0, "forces": 1.0, "moments": 1.0, "walk": 1.0}
    one = targets_of(recorded, weights, without=names[1:])
    assert {t.group for t in one} >= {"angles"}
    assert all(np.isfinite(t.spread) and t.spread > 0.0 for t in one)
    angles = targets_of(recorded, {"angles": 1.0})
    assert {t.group for t in angles} == {"angles"}


def test_every_curve_counts_once_whatever_its_points(recorded: RecordedGait) -> None:
    target = targets_of(recorded, {"angles": 1.0})[2]
    off = replace(target, of=lambda stride: target.mean + target.spread)
    stride = recorded.of("stride", "right")[0]
    assert float(np.sum(off.residual(stride) ** 2)) == pytest.approx(target.weight**2)


# Derivatives and truth


def test_slopes_are_those_of_solves(
    study: LearnStudy, run: Run, recorded: RecordedGait, tmp_path: Path
) -> None:
    targets = targets_of(recorded, dict(study.weights))
    predictions = learner(study, run, targets, tmp_path)
    at = np.zeros(3)
    slopes = predictions.slopes(at)
    # bounds become active a little further off, and bend the way
    for i, step in enumerate(0.004 * np.eye(3)):
        above, below = (predictions.misfit(at + sign * step) for sign in (1.0, -1.0))
        difference = (above - below) / 0.008
        scale = np.linalg.norm(difference)
        assert np.linalg.norm(slopes[:, i] - difference) < 0.1 * scale


def test_known_numbers_are_found_within_the_stated_uncertainty(
    study: LearnStudy, run: Run, recorded: RecordedGait, tmp_path: Path
) -> None:
    """Strides of known numbers stand in for recorded ones; the priors pull away from them."""
    truth = np.array([-1.0, 0.5, -0.4])
    recordings = targets_of(recorded, dict(study.weights))
    made = learner(study, run, recordings, tmp_path / "truth")
    stride = stride_of(made.optimum(truth).series)
    targets = tuple(replace(t, mean=t.of(stride)) for t in recordings)
    predictions = learner(study, run, targets, tmp_path / "steps")
    end = descend(predictions, np.zeros(3), study.steps, study.precision)
    deviations = np.sqrt(np.diag(np.linalg.inv(end.jac.T @ end.jac)))
    assert (np.abs(end.x - truth) < 2.0 * deviations).all()
    assert np.sum(residuals(targets, stride_of(predictions.optimum(end.x).series)) ** 2) < 0.5


# The command


@pytest.fixture(scope="module")
def learnt(run: Run, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Result]:
    """Return the folder of a short call, and what it printed."""
    out = tmp_path_factory.mktemp("learnt")
    return out, call(run, out)


def call(run: Run, out: Path, *more: str) -> Result:
    words = ["learn", "learn", "--set", NUMBERS, "--set", "set={}", "--set", "steps=4"]
    return CliRunner().invoke(cli, [*words, "--run", str(run.folder), "--out", str(out), *more])


def test_the_command_writes_what_a_config_takes(learnt: tuple[Path, Result]) -> None:
    out, result = learnt
    assert result.exit_code == 0, result.output
    for words in ("own cycles", "trials left out one by one", "told by", "ranges that hold"):
        assert words in result.output
    summary = json.loads((out / "learn.json").read_text(encoding="utf-8"))
    assert set(summary["numbers"]) == {
        "examination.knee_extension.right", "tissue.damping", "cost.goals.time",
    }  # fmt: skip
    assert 0.0 < summary["left_out"]["own"] < summary["left_out"]["learnt"]
    config = load_config("predict-orthosis", changes=(f"learnt={out / 'learnt.yaml'}",))
    assert isinstance(config.learnt, Learnt)
    assert config.numbers["tissue.damping"] == summary["numbers"]["tissue.damping"]["learnt"]


def test_one_trial_is_enough_and_cannot_be_left_out(
    run: Run, recorded: RecordedGait, tmp_path: Path
) -> None:
    others = ", ".join(trial.name for trial in recorded.trials[1:])
    result = call(run, tmp_path / "out", "--set", f"without=[{others}]")
    assert result.exit_code == 0, result.output
    assert "left out" not in result.output
    summary = json.loads((tmp_path / "out" / "learn.json").read_text(encoding="utf-8"))
    assert summary["left_out"] is None


def test_a_second_call_solves_nothing_again(learnt: tuple[Path, Result], run: Run) -> None:
    out, first = learnt
    files = {path: path.stat().st_mtime_ns for path in (out / "steps").iterdir()}
    again = call(run, out)
    assert again.exit_code == 0
    assert {path: path.stat().st_mtime_ns for path in (out / "steps").iterdir()} == files
    told = [line for line in first.output.splitlines() if "told" in line or "misfit by" in line]
    assert all(line in again.output for line in told)


def test_a_run_that_does_not_weigh_a_goal_is_refused(tmp_path: Path) -> None:
    changes = ("learnt=null", "mesh.intervals=[10, 5, 10, 5]", "mesh.refinements=0")
    case = load_case("predict-barefoot", changes=(*changes, "cost.activation_power=2"))
    run_study(case, tmp_path / "run")
    words = ["learn", "learn", "--run", str(tmp_path / "run"), "--set", "set={}"]
    result = CliRunner().invoke(cli, [*words, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2, result.output
    assert "does not weigh 'time'" in result.output
    result = CliRunner().invoke(cli, [*words, "--set", "condition=orthosis"])
    assert result.exit_code == 2, result.output
    assert "condition: is orthosis, but the run is barefoot" in result.output


def test_the_condition_says_which_walks_are_learnt_from() -> None:
    study = load_study("learn", LearnStudy, ("condition=orthosis",))
    case = base_case(study)
    assert case.config.condition == "orthosis"
    assert case.config.problem == "mapd-orthosis"
    assert "orthosis trials" in plan(study, GaitSolver(case)).does
    assert base_case(load_study("learn", LearnStudy)).config.condition == "barefoot"


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (("without=[T99]",), "'T99', which does not exist"),
        (("numbers={tissue.dampin: {prior: 1, spread: 1, range: [0, 2]}}",), "tissue.damping"),
        (("set={learnt: null, patient: sreenivasa2017-healthy}",), "no recordings to learn from"),
        (("set={learnt: null, variation.scale: {body_mass: 1.6}}",), "times the weight of this"),
    ],
)
def test_what_cannot_be_learnt_is_refused(
    changes: tuple[str, ...], message: str, tmp_path: Path
) -> None:
    words = [word for change in changes for word in ("--set", change)]
    result = CliRunner().invoke(cli, ["learn", "learn", *words, "--out", str(tmp_path / "out")])
    assert result.exit_code == 2, result.output
    assert message in result.output
    assert not (tmp_path / "out" / "learnt.yaml").exists()


def test_recordings_without_a_whole_cycle_of_both_sides_are_refused(
    recorded: RecordedGait, tmp_path: Path
) -> None:
    names = ", ".join(trial.name for trial in recorded.trials)
    words = ["--set", f"without=[{names}]", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(cli, ["learn", "learn", *words])
    assert result.exit_code == 2
    assert "do not show a whole gait cycle of both sides" in result.output


def test_a_run_keeps_what_was_learnt(tmp_path: Path) -> None:
    case = load_case("predict-barefoot")
    assert isinstance(case, Case)
    learnt = case.config.learnt
    assert learnt is not None
    text = case.config.model_dump(mode="json")
    assert text["learnt"]["numbers"].keys() == learnt.numbers.keys()
    assert case.walker().values["tissue.damping"] == learnt.values["tissue.damping"]
