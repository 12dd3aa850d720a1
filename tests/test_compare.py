"""The command `compare`: numbers, files, figures, differing configs, refusals."""

from __future__ import annotations

import csv
import json
import re
import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result

from conftest import MadeSolution
from pathwalker_cli.cli import cli
from pathwalker_cli.evaluation import figures
from pathwalker_cli.evaluation.curves import Trace, traces
from pathwalker_cli.evaluation.run import gaits_of_runs
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.patient import load_patient
from pathwalker_cli.report.compare import Compared, compare_runs, comparison_lines
from pathwalker_cli.results.metrics import RunMetrics
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.stride.measures import measure_of
from report_runs import write_made_run

CHILD = Path(__file__).parent / "data" / "child-10y" / "patient.yaml"
NAMES = ("joint_angles", "ground_forces", "joint_moments", "activations", "ankle_torque")


def compare(*words: object) -> Result:
    """Run the command."""
    return CliRunner().invoke(cli, ["compare", *map(str, words)])


def refusal(*words: object) -> str:
    """Return the one sentence with which the command refuses."""
    result = compare(*words)
    assert result.exit_code == 2, result.output
    assert result.output.count("\n") == 1
    return result.output


@pytest.fixture(scope="module")
def runs(made_solution: MadeSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of runs of two conditions, a half cycle and another patient."""
    folder = tmp_path_factory.mktemp("compare")
    for problem in ("mapd-barefoot", "mapd-orthosis", "mapd-healthy"):
        write_made_run(folder / problem, made_solution, problem)
    config = made_solution().config
    bounds = config.bounds.model_copy(update={"friction": 0.6})
    changes = {"patient": str(CHILD), "bounds": bounds}
    walker = build_walker(load_patient(CHILD), "orthosis")
    write_made_run(
        folder / "child", made_solution, "mapd-orthosis",
        config=config.model_copy(update=changes), walker=walker, cost=0.5,
    )  # fmt: skip
    return folder


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures out, which take most of the time."""
    monkeypatch.setattr(figures, "save_overlays", lambda *_: ())


def test_differences_are_to_the_first_run(runs: Path) -> None:
    folders = [runs / name for name in ("mapd-barefoot", "mapd-orthosis", "child")]
    found = compare_runs(folders)
    metrics = [json.loads((folder / "metrics.json").read_text()) for folder in folders]
    rows = {row.measure.key: row for row in found.rows}
    cost = rows["cost"]
    assert cost.values == (0.4, 0.4, 0.5)
    assert cost.differences[1:] == pytest.approx((0.0, 0.1))
    assert cost.shares[2] == pytest.approx(0.25)
    for key in ("walking_speed", "step_length_left", "positive_orthosis_work"):
        assert rows[key].values == tuple(m[key] for m in metrics)
    stiffness = rows["dorsiflexion_stiffness_right"]
    assert stiffness.values == (None, 50.0, 50.0)
    assert stiffness.differences == (None, None, None)


def test_a_share_is_one_of_the_size_of_the_first_value(runs: Path) -> None:
    measure = compare_runs([runs / "mapd-barefoot", runs / "child"]).rows[0].measure
    assert Compared(measure, (-2.0, -3.0)).shares == (0.0, -0.5)
    assert Compared(measure, (0.0, 1.0)).shares == (None, None)
    assert Compared(measure, (None, 1.0)).shares == (None, None)


def test_two_runs_fit_into_80_columns(runs: Path) -> None:
    result = compare(runs / "mapd-barefoot", runs / "mapd-orthosis")
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert max(map(len, lines)) <= 80
    assert lines[0] == "mapd-orthosis compared with mapd-barefoot"
    assert " problem: mapd-barefoot (mapd-barefoot), mapd-orthosis (mapd-orthosis)" in lines
    assert "note: different conditions: barefoot (mapd-barefoot), orthosis" in result.output
    speed = next(line for line in lines if line.startswith(" walking speed"))
    assert speed.split()[-1] == "m/s"
    assert speed.split()[-3:-1] == ["+0.000", "+0.0"]


def test_more_runs_follow_one_another(runs: Path) -> None:
    result = compare(runs / "mapd-barefoot", runs / "mapd-healthy", runs / "child")
    assert result.exit_code == 0, result.output
    assert max(map(len, result.output.splitlines())) <= 80
    assert "mapd-healthy compared with mapd-barefoot" in result.output
    assert "child compared with mapd-barefoot" in result.output
    assert "bounds.friction: 0.8 (mapd-barefoot), 0.8 (mapd-healthy), 0.6" in result.output
    assert "note: different patients" in result.output


def test_the_same_config_is_told(made_solution: MadeSolution, runs: Path, tmp_path: Path) -> None:
    twin = write_made_run(tmp_path / "twin", made_solution, "mapd-orthosis")
    result = compare(runs / "mapd-orthosis", twin)
    assert "The configs are the same." in result.output
    assert "note:" not in result.output


def test_files_and_figures(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = compare(runs / "mapd-barefoot", runs / "child", "-o", out)
    assert result.exit_code == 0, result.output
    made = {str(path.relative_to(out)) for path in out.rglob("*.*")}
    wanted = {f"figures/{name}.{kind}" for name in NAMES for kind in ("png", "svg")}
    assert made == wanted | {"compare.csv", "compare.json"}
    for name in NAMES:
        text = (out / "figures" / f"{name}.svg").read_text()
        ET.fromstring(text)
        assert "mapd-barefoot</text>" in text, "runs are named"
    with (out / "compare.csv").open() as file:
        rows = {row["metric"]: row for row in csv.DictReader(file)}
    assert float(rows["cost"]["child - mapd-barefoot"]) == pytest.approx(0.1)
    assert float(rows["cost"]["child - mapd-barefoot [%]"]) == pytest.approx(25.0)
    assert rows["dorsiflexion_stiffness_left"]["mapd-barefoot"] == ""


def test_goals_are_compared(runs: Path) -> None:
    found = compare_runs([runs / "mapd-barefoot", runs / "child"])
    rows = {row.measure.key: row for row in found.rows}
    told = [
        json.loads((runs / name / "metrics.json").read_text())["goals"]
        for name in ("mapd-barefoot", "child")
    ]
    assert rows["goals.crouch"].values == tuple(goals["crouch"] for goals in told)
    output = compare(runs / "mapd-barefoot", runs / "child").output
    assert re.search(r"^ crouch +[0-9.]+ .* rad\^2$", output, re.MULTILINE)


@pytest.mark.parametrize(
    ("changes", "alone"),
    [
        ({"goals": {"crouch": 0.5}}, {"cost"}),
        ({"walking_speed_weight": 1.0}, {"cost"}),
        ({"activation_power": 3}, {"cost", "effort_per_distance"}),
    ],
)
def test_what_means_something_else_has_no_difference(
    made_solution: MadeSolution, runs: Path, tmp_path: Path, changes: dict[str, Any],
    alone: set[str],
) -> None:  # fmt: skip
    config = made_solution().config
    cost = config.cost.model_copy(update=changes)
    other = write_made_run(
        tmp_path / "other", made_solution, "mapd-orthosis",
        config=config.model_copy(update={"cost": cost}), cost=0.5,
    )  # fmt: skip
    found = compare_runs([runs / "mapd-orthosis", other])
    silent = {
        row.measure.key
        for row in found.rows
        if None not in row.values and row.differences[1] is None
    }
    assert silent == alone
    assert "costs of different weights or goals cannot be compared" in found.notes
    line = next(
        line for line in "\n".join(comparison_lines(found)).split("\n") if line[:5] == " cost"
    )
    assert line.split() == ["cost", "0.400", "0.500", "-", "-"]


def test_fits_and_predictions_have_other_costs(
    made_solution: MadeSolution, runs: Path, tmp_path: Path
) -> None:
    fit = write_made_run(tmp_path / "fit", made_solution, "ls-barefoot")
    (cost,) = (
        r for r in compare_runs([runs / "mapd-barefoot", fit]).rows if r.measure.key == "cost"
    )
    assert cost.differences[1] is None


def test_words_for_people(made_solution: MadeSolution, runs: Path, tmp_path: Path) -> None:
    config = made_solution().config.model_copy(update={"verdict": False})
    other = write_made_run(tmp_path / "other", made_solution, "mapd-orthosis", config=config)
    output = compare(runs / "mapd-orthosis", other).output
    assert " verdict: yes (mapd-orthosis), no (other)" in output
    assert "-0.0 " not in output
    measure = measure_of("step_length_left")
    assert measure.text(-1e-9, sign=True) == "+0.000"
    assert measure.text(-0.001) == "-0.001"


@pytest.mark.usefixtures("no_figures")
def test_json_prints_what_it_writes(runs: Path, tmp_path: Path) -> None:
    result = compare(runs / "mapd-barefoot", runs / "child", "--json", "-o", tmp_path / "out")
    assert result.stdout == (tmp_path / "out" / "compare.json").read_text()
    content = json.loads(result.stdout)
    assert content["base"] == "mapd-barefoot"
    assert content["metrics"]["cost"]["differences"]["child"] == pytest.approx(0.1)
    assert content["config"]["bounds.friction"] == {"mapd-barefoot": "0.8", "child": "0.6"}


def test_bad_input_gets_one_sentence(
    runs: Path, made_solution: MadeSolution, tmp_path: Path
) -> None:
    run = runs / "mapd-barefoot"
    assert "allowed: two runs or more" in refusal(run)
    assert "is named twice" in refusal(run, f"{run}/.")
    assert "no such folder" in refusal(run, "nowhere")
    bad = made_solution(status="maximum number of iterations")
    folder = write_made_run(tmp_path / "bad", lambda *_, **__: bad, "mapd-orthosis")
    assert "did not converge" in refusal(run, folder)
    (tmp_path / "file").write_text("")
    assert "is a file" in refusal(run, runs / "child", "-o", tmp_path / "file")


def test_twenty_runs_look_different_and_one_alone_looks_like_its_sides(runs: Path) -> None:
    ((_, gait),) = gaits_of_runs([runs / "mapd-barefoot"])
    shown = traces([gait] * 20, [str(i) for i in range(20)])
    assert len({str(trace.look("right")) for trace in shown}) == 20
    assert all(trace.look("right") == trace.look("left") for trace in shown)
    alone = Trace(gait, gait.problem)
    assert alone.look("right") != alone.look("left")
    assert alone.look("right")["linestyle"] != alone.look("left")["linestyle"]


def test_labels_are_never_formulas_nor_hidden(runs: Path) -> None:
    ((_, gait),) = gaits_of_runs([runs / "mapd-barefoot"])
    labels = [trace.label for trace in traces([gait] * 3, ["$a$", "_b", "c\n\x00"])]
    assert labels == [r"\$a\$", " _b", "c??"]


@pytest.mark.parametrize(
    "bound",
    [
        ActiveBound("knee_l", "lower", 0.264, ("left_toe", "left_flat")),
        ActiveBound("hip_extension_l excitation above 0", "upper", -1e-09, ()),
        ActiveBound("dorsiflexion_stiffness_left", "upper", 92.0, ()),
    ],
    ids=str,
)
def test_an_active_bound_comes_back_from_its_text(bound: ActiveBound) -> None:
    assert ActiveBound.parsed(str(bound)) == bound
    assert ActiveBound.parsed("knee") is None


def test_active_bounds_of_older_runs_are_read_from_their_text(runs: Path) -> None:
    run = load_run(runs / "mapd-orthosis")
    older = RunMetrics.model_validate({k: v for k, v in run.metrics.items() if k != "active"})
    assert older.active is None
    assert older.bounds == run.result.bounds
    assert run.result.bounds[0] == ActiveBound("knee_l", "lower", 0.264, ("left_toe",))
