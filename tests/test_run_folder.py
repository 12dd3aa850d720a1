"""Run folders: all or nothing when written, read back with suspicion."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from helpers import STIFFNESS
from pathwalker_cli.case import config_text
from pathwalker_cli.config import load_config, with_values
from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait.motion_file import read_motion, write_motion
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.trajectory_csv import read_trajectory
from pathwalker_cli.ocp.violations import Violation
from pathwalker_cli.results import run_folder
from pathwalker_cli.results.run_folder import (
    ENTRIES,
    Run,
    check_target,
    load_run,
    warm_start_run,
    write_run,
)

MadeSolution = Callable[..., GaitSolution]
FIELDS = ("mesh", "states", "smooth", "controls", "integrals", "inner_states", "algebraic")


@pytest.fixture(autouse=True)
def _no_figures(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """Leave the figures out, which take most of the time, unless a test is about them."""
    if "figures" not in request.node.name:
        monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())


@pytest.fixture
def run(tmp_path: Path, made_solution: MadeSolution) -> Path:
    """Return the folder of a converged run."""
    write_run(tmp_path / "run", made_solution(), ["line 1", "line 2"])
    return tmp_path / "run"


def refusal(read: Callable[[], Any]) -> str:
    """Return the one sentence with which something is refused."""
    with pytest.raises(DataError) as caught:
        read()
    assert "\n" not in str(caught.value)
    return str(caught.value)


def left_over(folder: Path) -> list[str]:
    """Return the names of temporary files."""
    return [path.name for path in folder.rglob("*") if path.name.endswith(".tmp")]


def test_a_run_comes_back_exactly(run: Path, made_solution: MadeSolution) -> None:
    solution, loaded = made_solution(), load_run(run)
    assert isinstance(loaded, Run)
    assert loaded.config == solution.config
    assert np.array_equal(loaded.motion.parameters, STIFFNESS)
    for got, wanted in zip(loaded.motion.phases, solution.last_motion.phases, strict=True):
        assert (got.name, got.duration) == (wanted.name, wanted.duration)
        for name in FIELDS:
            assert np.array_equal(getattr(got, name), getattr(wanted, name)), name


def test_a_run_folder_holds_everything(run: Path) -> None:
    assert {path.name for path in run.iterdir()} == ENTRIES - {
        "NOT_CONVERGED.txt",
        "figures",
        "recordings",
    }
    assert (run / "log.txt").read_text(encoding="utf-8") == "line 1\nline 2\n"
    assert load_config(run / "config.resolved.yaml") == load_run(run).config
    assert read_trajectory(run / "forces.csv", missing=True).time.size > 90
    assert not left_over(run.parent)


def test_figures_are_written(tmp_path: Path, made_solution: MadeSolution) -> None:
    write_run(tmp_path / "run", made_solution())
    names = {path.name for path in (tmp_path / "run" / "figures").iterdir()}
    assert {"joint_angles.png", "joint_angles.svg", "orthosis_curves.png"} <= names
    expected = ENTRIES - {"NOT_CONVERGED.txt", "recordings"}
    assert {path.name for path in (tmp_path / "run").iterdir()} == expected


def test_metrics_are_strict_json_with_the_keys_that_scripts_rely_on(run: Path) -> None:
    def no_constants(name: str) -> None:
        pytest.fail(f"metrics.json holds {name}")

    text = (run / "metrics.json").read_text(encoding="utf-8")
    metrics = json.loads(text, parse_constant=no_constants)
    per_side = {
        f"{stem}_{side}"
        for side in SIDES
        for stem in (
            "step_length", "min_stance_knee_flexion", "dorsiflexion_stiffness",
            "plantarflexion_stiffness",
        )
    }  # fmt: skip
    assert metrics.keys() >= per_side | {
        "problem", "status", "cost", "cost_terms", "walking_speed", "stride_time", "distance",
        "phase_durations", "min_vertical_force", "largest_violation", "largest_violation_name",
        "reintegration_position_error", "reintegration_velocity_error", "second_engine_residual",
        "active_bounds", "intervals", "iterations", "seconds_build", "seconds_solve",
        "seconds_verify", "dynamics_backend", "kernels", "stages", "patient", "condition", "start",
        "smoke", "versions", "input_hashes", "bound_sources", "notes",
    }  # fmt: skip
    assert metrics["status"] == "converged"
    assert metrics["reintegration_position_error"] == 5e-4
    assert metrics["dorsiflexion_stiffness_left"] == STIFFNESS[1]
    assert metrics["active_bounds"][0] == "knee_l lower 0.264 in left_toe"
    assert metrics["active"][0] == {
        "name": "knee_l", "side": "lower", "value": 0.264, "places": ["left_toe"],
    }  # fmt: skip
    assert set(metrics["input_hashes"]) == {"config", "patient", "patient_kept"}


def test_numbers_that_json_does_not_know_become_null(
    tmp_path: Path, made_solution: MadeSolution
) -> None:
    violations = (Violation("everything", np.inf),)
    solution = made_solution(cost=np.nan, violations=violations, status="the iterates diverged")
    metrics = write_run(tmp_path / "run", solution)
    assert metrics["cost"] is None
    assert metrics["largest_violation"] is None


def test_the_config_of_a_run_is_valid_whatever_was_set(tmp_path: Path) -> None:
    config = load_config(
        "mapd-orthosis",
        changes=("bounds.joint_ranges={knee_r: [0.1, 1.6]}", "solver.tolerance=1e-7",
                 "solver.ipopt.mu_target=1e-9", "bounds.least_walking_speed=0.5"),
    )  # fmt: skip
    path = tmp_path / "config.yaml"
    path.write_text(config_text(config), encoding="utf-8")
    assert load_config(path) == config


def test_an_unconverged_run_is_sealed(tmp_path: Path, made_solution: MadeSolution) -> None:
    folder = tmp_path / "run"
    write_run(folder, made_solution(status="the iteration limit was reached"))
    seal = (folder / "NOT_CONVERGED.txt").read_text(encoding="utf-8")
    assert "did not converge: the iteration limit was reached" in seal
    assert "knee_r rate in right_toe" in seal
    with pytest.raises(NotConvergedError, match="the iteration limit was reached"):
        load_run(folder)
    assert load_run(folder, allow_unconverged=True).metrics["status"] != "converged"
    assert "a converged run" in refusal(
        lambda: warm_start_run(folder, load_config("mapd-orthosis"))
    )


def test_an_earlier_run_is_replaced_in_full(run: Path, made_solution: MadeSolution) -> None:
    write_run(run, made_solution(status="stopped by the user", cost=0.9))
    assert load_run(run, allow_unconverged=True).metrics["cost"] == 0.9
    write_run(run, made_solution())
    assert not (run / "NOT_CONVERGED.txt").exists()
    assert not left_over(run.parent)


def test_a_folder_of_other_files_is_never_replaced(
    run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, made_solution: MadeSolution
) -> None:
    (run / "thesis.txt").write_text("mine", encoding="utf-8")
    message = refusal(lambda: write_run(run, made_solution()))
    assert "holds thesis.txt" in message
    assert "choose another --out" in message
    assert (run / "thesis.txt").read_text(encoding="utf-8") == "mine"
    other = tmp_path / "other"
    other.mkdir()
    assert check_target(other) == other, "empty"
    (other / "log.txt").touch()
    assert "no run folder" in refusal(lambda: check_target(other)), "no metrics.json"
    (tmp_path / "file").touch()
    assert "is a file" in refusal(lambda: check_target(tmp_path / "file"))
    assert "is a file" in refusal(lambda: check_target(tmp_path / "file" / "run"))
    monkeypatch.chdir(tmp_path)
    assert "current folder" in refusal(lambda: check_target("."))
    assert "current folder" in refusal(lambda: check_target(".."))


@pytest.mark.parametrize(
    "error", [KeyboardInterrupt("Ctrl-C"), OSError(28, "No space left on device")]
)
def test_nothing_half_written_stays(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    made_solution: MadeSolution,
    error: BaseException,
) -> None:
    def fail(*_: Any) -> None:
        raise error

    folder = tmp_path / "runs" / "new"
    monkeypatch.setattr(run_folder, "_write_series", fail)
    with pytest.raises((KeyboardInterrupt, DataError), match=error.args[-1]):
        write_run(folder, made_solution())
    assert not list(tmp_path.iterdir())


def test_an_interrupted_exchange_keeps_the_earlier_run(
    run: Path, monkeypatch: pytest.MonkeyPatch, made_solution: MadeSolution
) -> None:
    rename = Path.rename

    def interrupted(self: Path, target: Path) -> Path:
        if self.name == "new":
            raise KeyboardInterrupt
        return rename(self, target)

    monkeypatch.setattr(run_folder, "swapped", lambda *_: False)  # as on disks that cannot
    monkeypatch.setattr(Path, "rename", interrupted)
    with pytest.raises(KeyboardInterrupt):
        write_run(run, made_solution(cost=0.9))
    assert load_run(run).metrics["cost"] == 0.4
    assert not left_over(run.parent)


def change(path: Path, old: str, new: str) -> None:
    """Replace text in a file."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new), encoding="utf-8")


def truncate(path: Path) -> None:
    """Keep the first half of a file."""
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])


@pytest.mark.parametrize(
    ("spoil", "message"),
    [
        (lambda run: truncate(run / "metrics.json"), "metrics.json, line .*: is not valid JSON"),
        (lambda run: (run / "metrics.json").write_text("[1]"), "holds no keys with values"),
        (lambda run: (run / "metrics.json").write_text('{"a": 1}'), "lacks the key run_format"),
        (lambda run: (run / "metrics.json").write_bytes(b"\xff\xfe"), "is not text in UTF-8"),
        (lambda run: (run / "metrics.json").unlink(), "metrics.json is missing"),
        (lambda run: truncate(run / "motion.npz"), "motion.npz: is damaged"),
        (lambda run: (run / "motion.npz").write_bytes(b""), "motion.npz: is damaged"),
        (lambda run: (run / "motion.npz").unlink(), "motion.npz: no such file"),
        (lambda run: np.savez(run / "motion.npz", a=np.ones(3)), "lacks 'phases'"),
        (lambda run: (run / "config.resolved.yaml").unlink(), "config.resolved.yaml is missing"),
        (
            lambda run: change(run / "metrics.json", '"run_format": 1', '"run_format": 0'),
            "has run_format 0; allowed: 1",
        ),
        (
            lambda run: change(
                run / "config.resolved.yaml", "problem: mapd-orthosis", "problem: mapd-barefoot"
            ),
            "config.resolved.yaml: does not belong to metrics.json",
        ),
    ],
)
def test_spoilt_runs_are_refused(run: Path, spoil: Callable[[Path], Any], message: str) -> None:
    spoil(run)
    with pytest.raises(DataError, match=message):
        load_run(run)


def test_what_is_no_run_is_refused(tmp_path: Path) -> None:
    assert "no such folder" in refusal(lambda: load_run(tmp_path / "nowhere"))
    assert "is no run folder" in refusal(lambda: load_run(tmp_path))


def test_the_motion_of_another_run_is_refused(
    run: Path, tmp_path: Path, made_solution: MadeSolution
) -> None:
    motion = made_solution().last_motion
    write_motion(run / "motion.npz", replace(motion, parameters=2.0 * motion.parameters))
    assert "motion.npz: does not belong to metrics.json" in refusal(lambda: load_run(run))


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        (
            "states",
            np.zeros((3, 20)),
            r"right_flat.states: has shape \(3, 20\); allowed: \(5, 20\)",
        ),
        ("states", np.full((5, 20), np.nan), "right_flat.states: holds values that are not finite"),
        ("mesh", np.array([0.0, 0.5, 0.4, 0.8, 1.0]), "does not increase from 0 to 1"),
        ("inner_states", np.zeros(3), "right_flat.inner_states: has shape"),
    ],
)
def test_spoilt_motions_are_refused(
    tmp_path: Path, made_solution: MadeSolution, name: str, value: np.ndarray, message: str
) -> None:
    first, *others = made_solution().last_motion.phases
    spoilt = replace(made_solution().last_motion, phases=(replace(first, **{name: value}), *others))
    write_motion(tmp_path / "motion.npz", spoilt)
    with pytest.raises(DataError, match=message):
        read_motion(tmp_path / "motion.npz")


def test_pickles_are_not_loaded(tmp_path: Path) -> None:
    np.savez(tmp_path / "motion.npz", phases=np.array([{}], dtype=object))
    assert "is damaged" in refusal(lambda: read_motion(tmp_path / "motion.npz"))


def test_a_run_of_another_condition_is_no_warm_start(run: Path) -> None:
    message = refusal(lambda: warm_start_run(run, load_config("mapd-barefoot")))
    assert "free parameters" in message
    assert "a run of the barefoot condition" in message
    assert warm_start_run(run, load_config("mapd-orthosis")).folder == run


def test_a_run_without_toes_is_no_warm_start_with_them(
    tmp_path: Path, made_solution: MadeSolution
) -> None:
    write_run(tmp_path / "run", made_solution("mapd-barefoot"))
    config = load_config("mapd-barefoot")
    toed = with_values(config, {"model.toes": True})
    message = refusal(lambda: warm_start_run(tmp_path / "run", toed))
    assert "is a run of feet without toes" in message
    assert warm_start_run(tmp_path / "run", config).config.model.toes is False


def test_a_barefoot_run_has_no_stiffness(tmp_path: Path, made_solution: MadeSolution) -> None:
    metrics = write_run(tmp_path / "run", made_solution("mapd-barefoot"))
    assert metrics["dorsiflexion_stiffness_left"] is None
    assert metrics["stiffness_ranges"] == {}
    assert load_run(tmp_path / "run").motion.parameters.size == 0
