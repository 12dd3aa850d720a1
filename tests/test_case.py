"""A case: patient and config are read once, travel, and come back from a run."""

from __future__ import annotations

import pickle
import shutil
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner

from pathwalker_cli.case import Case, load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.errors import ConfigError, DataError, PatientError
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.studies import run as study_run
from report_runs import write_made_run

MadeSolution = Callable[..., GaitSolution]

_OPENED: list[str] = []


def _note(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        _OPENED.append(str(arguments[0]))


sys.addaudithook(_note)


@pytest.fixture
def child(tmp_path: Path) -> Path:
    """Return a folder with a patient, the orthosis apart, two recordings, and a config."""
    source = load_patient("sreenivasa2017-patient").source
    assert source is not None
    content = yaml.safe_load(source.read_text(encoding="utf-8"))
    if isinstance(content["orthosis"], str):
        worn = (source.parent / content["orthosis"]).read_text(encoding="utf-8")
    else:
        worn = yaml.safe_dump(content["orthosis"])
    (tmp_path / "hinge.yaml").write_text(worn, encoding="utf-8")
    content["orthosis"] = "hinge.yaml"
    (tmp_path / "patient.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    for name in ("mapd-orthosis", "ls-barefoot"):
        text = f"problem: {name}\npatient: ./patient.yaml\nsolver: {{max_iterations: 1}}\n"
        (tmp_path / f"{name}.yaml").write_text(text, encoding="utf-8")
    recordings = tmp_path / "recordings" / "barefoot"
    recordings.mkdir(parents=True)
    for path in (source.parent / "recordings" / "barefoot").glob("305317[13]_*.csv"):
        shutil.copy(path, recordings)
    return tmp_path


def opened(child: Path, *words: str) -> dict[str, int]:
    """Return how often a command opens each file of the patient and the configs."""
    _OPENED.clear()
    result = CliRunner().invoke(cli, [*words, "--quiet"])
    assert result.exit_code in (0, 1), result.output
    names = {path.name: str(path) for path in child.glob("*.yaml")}
    return {name: count for name, path in names.items() if (count := _OPENED.count(path))}


@pytest.mark.parametrize("problem", ["mapd-orthosis", "ls-barefoot"])
def test_a_solve_opens_every_file_once(child: Path, problem: str) -> None:
    config, out = child / f"{problem}.yaml", child / "run"
    found = opened(child, "solve", problem, str(config), "--smoke", "--out", str(out))
    assert found == {"patient.yaml": 1, "hinge.yaml": 1, config.name: 1}
    assert (out / "patient.yaml").is_file()


@pytest.mark.parametrize(
    "study", ["perturbation", "sensitivity", "uncertainty", "landscape", "tradeoff"]
)
def test_the_base_of_a_study_is_read_once_too(
    child: Path, study: str, made_solution: MadeSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    def solved(case: Case, *_: object) -> GaitSolution:
        return made_solution(case.config.problem, case=case, status="the iterates diverged")

    monkeypatch.setattr(study_run, "_solve", solved)
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    command = "perturb" if study == "perturbation" else study
    base = ("--set", f"base={child / 'mapd-orthosis.yaml'}", "--out", str(child / "out"))
    found = opened(child, command, study, *base)
    assert found == {"patient.yaml": 1, "hinge.yaml": 1, "mapd-orthosis.yaml": 1}
    assert (child / "out" / "base" / "NOT_CONVERGED.txt").is_file()


def test_other_values_read_no_file(child: Path) -> None:
    case = load_case(child / "mapd-orthosis.yaml")
    shutil.rmtree(child)
    heavy = case.with_values({"variation.scale": {"body_mass": 1.2}})
    assert heavy.patient.body_mass == pytest.approx(1.2 * case.patient.body_mass)
    assert heavy.unvaried is case.unvaried
    again = heavy.with_values({"variation.scale": {"body_mass": 0.5}})
    assert again.patient.body_mass == pytest.approx(0.5 * case.patient.body_mass)
    assert again.content_hash == case.content_hash


def test_another_patient_is_read() -> None:
    case = load_case("mapd-barefoot").with_values({"patient": "sreenivasa2017-healthy"})
    assert case.patient.id == "sreenivasa2017-healthy"


def test_a_case_travels_whole(child: Path) -> None:
    case = load_case(child / "mapd-orthosis.yaml", changes=("variation.scale={strengths: 0.9}",))
    there = pickle.loads(pickle.dumps(case))  # noqa: S301 - our own
    assert there == case
    assert there.patient == case.patient
    assert there.patient.notes == case.patient.notes
    assert there.content_hash == case.content_hash
    assert there.patient.recordings == case.patient.recordings


def test_what_does_not_fit_is_refused_where_it_is_read(child: Path) -> None:
    config = child / "mapd-orthosis.yaml"
    with pytest.raises(PatientError, match=r"orthosis.yaml, patient: no patient 'nobody'"):
        load_case(config, changes=("patient=nobody",))
    with pytest.raises(ConfigError, match="the patient's file has no 'weight'"):
        load_case(config, changes=("variation.scale={weight: 1.1}",))


def test_a_run_gives_its_case_back(child: Path, made_solution: MadeSolution) -> None:
    changes = ("variation.scale={body_mass: 1.1}",)
    case = load_case(child / "mapd-orthosis.yaml", changes=changes)
    run = write_made_run(child / "run", made_solution, "mapd-orthosis", case=case)
    (child / "patient.yaml").unlink()
    found = load_run(run).case
    assert found.config == case.config
    assert found.unvaried.model_dump() == case.unvaried.model_dump()
    assert found.patient.model_dump() == case.patient.model_dump()
    assert recording_names(found.patient, "barefoot") == ("3053171", "3053173")


def test_recordings_that_a_run_keeps_count_before_others(
    child: Path, made_solution: MadeSolution
) -> None:
    changes = ("start.gait=recorded", "start.trial=3053173")
    case = load_case(child / "mapd-orthosis.yaml", changes=changes)
    run = write_made_run(child / "run", made_solution, "mapd-orthosis", case=case,
                         walker=case.walker())  # fmt: skip
    for file in (child / "recordings" / "barefoot").glob("3053173*"):
        file.write_text("broken", encoding="utf-8")
    patient = load_run(run).case.patient
    assert recording_names(patient, "barefoot") == ("3053171", "3053173")
    assert read_recording(patient, "barefoot", "3053173").name == "3053173"
    shutil.rmtree(child / "recordings")
    assert recording_names(patient, "barefoot") == ("3053173",)
    with pytest.raises(DataError, match="has no barefoot recording '3053171'; allowed: 3053173"):
        read_recording(patient, "barefoot", "3053171")


def test_a_run_without_a_patient_is_refused(child: Path, made_solution: MadeSolution) -> None:
    case = load_case(child / "mapd-orthosis.yaml")
    run = write_made_run(child / "run", made_solution, "mapd-orthosis", case=case)
    (run / "patient.yaml").unlink()
    result = CliRunner().invoke(cli, ["evaluate", str(run)])
    assert result.exit_code == 2
    (line,) = result.output.splitlines()
    assert "keeps no patient.yaml" in line
    assert line.endswith("solve again")


def test_a_config_is_a_case_once_its_patient_is_read() -> None:
    case = Case.of(load_config("mapd-orthosis"))
    assert Case.of(case) is case
    assert case.patient == load_patient("sreenivasa2017-patient")
