"""The command `evaluate`: tables, files, figures and refusals."""

from __future__ import annotations

import csv
import json
import shutil
import xml.etree.ElementTree as ET
from collections.abc import Callable
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from pathwalker_cli.cli import cli
from pathwalker_cli.evaluation import figures
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import write_run

MadeSolution = Callable[..., GaitSolution]
CHILD = Path(__file__).parent / "data" / "child-10y" / "patient.yaml"
NAMES = ("joint_angles", "ground_forces", "ankle_torque")


def evaluate(*words: object) -> Result:
    """Run the command."""
    return CliRunner().invoke(cli, ["evaluate", *map(str, words)])


def refusal(*words: object) -> str:
    """Return the one sentence with which the command refuses."""
    result = evaluate(*words)
    assert result.exit_code == 2, result.output
    assert result.output.count("\n") == 1
    assert "Traceback" not in result.output
    return result.output


@pytest.fixture
def runs(made_runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> dict[str, Path]:
    """Return the folders of both runs by problem, copies that may be changed; work beside them."""
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    monkeypatch.chdir(tmp_path)
    shutil.copytree(made_runs, tmp_path / "made")
    return {folder.name: folder for folder in (tmp_path / "made").iterdir()}


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the figures out, which take most of the time."""
    monkeypatch.setattr(figures, "save_evaluation_figures", lambda *_: ())


def test_one_run_gives_table_files_and_figures(runs: dict[str, Path], tmp_path: Path) -> None:
    result = evaluate(runs["mapd-orthosis"], "-o", "out")
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    assert max(map(len, lines)) <= 80
    assert any("walking speed" in line and "0.62  m/s" in line for line in lines)
    assert any("mean [min, max]" in line for line in lines)
    assert "From barefoot" not in result.output
    assert "% of the largest recorded peak" in result.output.replace("\n      ", " ")
    made = {str(p.relative_to(tmp_path / "out")) for p in (tmp_path / "out").rglob("*.*")}
    wanted = {f"figures/{name}.{kind}" for name in NAMES for kind in ("png", "svg")}
    assert made == wanted | {"evaluation.json", "evaluation.csv"}
    for name in NAMES:
        assert (tmp_path / "out" / "figures" / f"{name}.png").read_bytes()[:4] == b"\x89PNG"
        ET.parse(tmp_path / "out" / "figures" / f"{name}.svg")


@pytest.mark.usefixtures("no_figures")
def test_two_runs_give_the_change(runs: dict[str, Path], tmp_path: Path) -> None:
    result = evaluate(runs["mapd-orthosis"], runs["mapd-barefoot"])
    assert result.exit_code == 0, result.output
    assert max(map(len, result.output.splitlines())) <= 80
    assert "From barefoot to orthosis" in result.output
    out = tmp_path / "runs" / "evaluation-mapd-orthosis-mapd-barefoot"
    content = json.loads((out / "evaluation.json").read_text())
    assert [run["condition"] for run in content["runs"]] == ["orthosis", "barefoot"]
    assert [run["one_trial"] for run in content["runs"]] == ["3053141", "3053171"]
    knee = content["changes"]["min_stance_knee_flexion_right"]
    assert knee["change"] == knee["orthosis"] - knee["barefoot"]
    assert knee["paper"]["printed"] == "-9.26"
    assert content["changes"]["walking_speed"]["paper"]["printed"] == "rises"
    speed = content["runs"][0]["quantities"]["walking_speed"]
    assert speed["unit"] == "m/s"
    assert speed["recorded"]["min"] < speed["recorded"]["mean"] < speed["recorded"]["max"]
    assert speed["paper"]["value"] == 0.62
    with (out / "evaluation.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {row["run"] for row in rows} == {"mapd-orthosis", "mapd-barefoot"}
    assert len(rows) == sum(len(run["quantities"]) for run in content["runs"])
    first = rows[0]
    assert (first["quantity"], first["paper"]) == ("walking_speed", "0.62")
    assert float(first["value"]) == pytest.approx(speed["value"])


@pytest.mark.usefixtures("no_figures")
def test_json_prints_what_it_writes(runs: dict[str, Path], tmp_path: Path) -> None:
    result = evaluate(runs["mapd-barefoot"], "--json", "-o", "out", "--trial", "3053177")
    assert result.exit_code == 0, result.output
    assert result.stdout == (tmp_path / "out" / "evaluation.json").read_text()
    assert json.loads(result.stdout)["runs"][0]["one_trial"] == "3053177"


@pytest.mark.usefixtures("no_figures")
def test_runs_of_the_same_name_are_told_apart(runs: dict[str, Path], tmp_path: Path) -> None:
    twin = tmp_path / "twin" / "mapd-orthosis"
    twin.parent.mkdir()
    runs["mapd-orthosis"].rename(twin)
    (tmp_path / "other").mkdir()
    again = tmp_path / "other" / "mapd-orthosis"
    runs["mapd-barefoot"].rename(again)
    result = evaluate(twin, again, "--json", "-o", "out")
    names = [run["name"] for run in json.loads(result.stdout)["runs"]]
    assert names == ["mapd-orthosis", "mapd-orthosis-2"]


def test_a_patient_without_recordings_gets_the_rest(
    runs: dict[str, Path], made_solution: MadeSolution, tmp_path: Path
) -> None:
    config = made_solution().config.model_copy(update={"patient": str(CHILD)})
    walker = build_walker(load_patient(CHILD), "orthosis")
    write_run(tmp_path / "child", made_solution(config=config, walker=walker))
    result = evaluate(tmp_path / "child", runs["mapd-barefoot"], "-o", "out")
    assert result.exit_code == 0, result.output
    text = " ".join(result.output.split())
    assert "patient child-10y has no orthosis recordings beside its file" in text
    assert "a change is shown from one barefoot run" in text
    assert "From barefoot to orthosis" not in text
    assert (tmp_path / "out" / "figures" / "child" / "joint_angles.png").is_file()


def test_a_run_that_did_not_converge_is_refused(
    runs: dict[str, Path], made_solution: MadeSolution, tmp_path: Path
) -> None:
    write_run(tmp_path / "bad", made_solution(status="maximum number of iterations"))
    assert "did not converge" in refusal(tmp_path / "bad")
    assert "did not converge" in refusal(runs["mapd-barefoot"], tmp_path / "bad")
    assert not (tmp_path / "runs").exists()


@pytest.mark.usefixtures("no_figures")
def test_bad_input_gets_one_sentence(runs: dict[str, Path], tmp_path: Path) -> None:
    run = runs["mapd-orthosis"]
    assert "no such folder" in refusal("nowhere")
    assert "is no run folder" in refusal(tmp_path)
    assert "is named twice" in refusal(run, f"{run}/.")
    assert "--trial: there is no recording 'walk'; allowed: 3053138" in refusal(
        run, "--trial", "walk"
    )
    assert "shows no stride" in refusal(runs["mapd-barefoot"], "--trial", "3053175")
    (tmp_path / "file").write_text("")
    assert "is a file" in refusal(run, "-o", "file")
    (run / "motion.npz").write_bytes(b"")
    assert "motion.npz" in refusal(run)


@pytest.mark.usefixtures("no_figures", "runs")
def test_a_smoke_run_says_so(made_solution: MadeSolution, tmp_path: Path) -> None:
    config = made_solution().config.model_copy(update={"smoke": True})
    write_run(tmp_path / "smoke", made_solution(config=config))
    assert "a quick check on a coarse mesh" in evaluate(tmp_path / "smoke").output
