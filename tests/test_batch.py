"""Studies of many cases: expansion, refusals, table, restart, and workers that die."""

from __future__ import annotations

import csv
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from rich.console import Console

from conftest import MadeSolution
from fake_work import die, fake_work
from helpers import GUARD
from pathwalker_cli.case import Case, load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.commands.progress import BatchProgress
from pathwalker_cli.config import load_config
from pathwalker_cli.errors import ConfigError, DataError, NotConvergedError
from pathwalker_cli.io import processes
from pathwalker_cli.io.lock import locked
from pathwalker_cli.io.yaml_file import read_mapping
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.studies.batch import ledger, worker
from pathwalker_cli.studies.batch.cases import BatchCase, load_cases
from pathwalker_cli.studies.batch.ledger import CaseTable, unit_of
from pathwalker_cli.studies.batch.schema import case_name, short_keys, slug
from pathwalker_cli.studies.batch.study import Watch, report_text, run_batch
from pathwalker_cli.studies.batch.worker import LOST, LocalPool, Task, Work, failure, solve_case
from pathwalker_cli.studies.batch.worker import Result as Ending

PATIENT = "sreenivasa2017-patient"
HEALTHY = "sreenivasa2017-healthy"
MINIMAL = {"patients": [PATIENT], "problems": ["mapd-barefoot"]}


def study_file(folder: Path, **keys: Any) -> Path:
    """Write a study of the shipped patient, barefoot, with these keys."""
    path = folder / "study.yaml"
    path.write_text(yaml.safe_dump({**MINIMAL, **keys}, sort_keys=False), encoding="utf-8")
    return path


def child(path: Path, name: str, **changes: Any) -> Path:
    """Write a patient like the shipped one under another id."""
    source = load_patient(PATIENT).source
    assert source is not None
    content = {**read_mapping(source)[0], "id": name, **changes}
    path.parent.mkdir(exist_ok=True)
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def names(path: Path, *changes: str) -> list[str]:
    """Return the names of all cases of a study."""
    return [case.name for case in load_cases(path, changes).cases]


def run(*words: object) -> Result:
    """Run the command line in this process."""
    return CliRunner().invoke(cli, ["batch", *(str(word) for word in words)])


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Expansion


def test_the_shipped_study_is_patients_by_problems_by_grid() -> None:
    batch = load_cases("cohort")
    assert batch.name == "cohort"
    assert [case.name for case in batch.cases] == [
        f"{PATIENT}--mapd-barefoot--strengths_0.8",
        f"{PATIENT}--mapd-barefoot--strengths_1",
        f"{PATIENT}--mapd-orthosis--strengths_0.8",
        f"{PATIENT}--mapd-orthosis--strengths_1",
    ]
    weak = batch.cases[0].study.patient.max_isometric_torque
    assert weak == pytest.approx(0.8 * np.array(load_patient(PATIENT).max_isometric_torque))


def test_grid_times_named_cases_in_order(here: Path) -> None:
    path = study_file(
        here,
        set={"mesh": {"refinements": 0}, "bounds.friction": 0.7},
        grid={"cost.rate_weight": [0.1, 0.2], "bounds.joint_ranges.hip_r": [[-1.0, 0.5]]},
        cases=[{"name": "plain"}, {"name": "rough", "set": {"bounds.friction": 0.9}}],
    )
    cases = load_cases(path).cases
    stem = f"{PATIENT}--mapd-barefoot--rate_weight"
    assert [case.name for case in cases] == [
        f"{stem}_0.1--hip_r_-1_0.5--plain",
        f"{stem}_0.1--hip_r_-1_0.5--rough",
        f"{stem}_0.2--hip_r_-1_0.5--plain",
        f"{stem}_0.2--hip_r_-1_0.5--rough",
    ]
    assert [case.study.config.bounds.friction for case in cases] == [0.7, 0.9, 0.7, 0.9]
    assert {case.study.config.mesh.refinements for case in cases} == {0}
    degrees = {case.study.config.mesh.degree for case in cases}
    assert degrees == {3}, "a block leaves the rest as it is"
    assert cases[0].study.config.bounds.joint_ranges["hip_r"] == (-1.0, 0.5)


def test_places_in_the_patients_file_keep_their_dots(here: Path) -> None:
    path = study_file(
        here,
        set={"variation": {"scale": {"strengths": 0.5}}, "variation.shift.body_mass": 1.0},
        grid={"variation.scale.strengths.knee_extension.right": [0.5]},
    )
    (case,) = load_cases(path).cases
    scale = {"strengths": 0.5, "strengths.knee_extension.right": 0.5}
    assert case.study.config.variation.scale == scale
    assert case.study.config.variation.shift == {"body_mass": 1.0}


def test_patients_come_by_id_file_folder_and_pattern(here: Path) -> None:
    for name in ("berta", "anna"):
        child(here / "clinic" / f"{name}.yaml", name)
    child(here / "carla" / "patient.yaml", "carla")
    child(here / "others" / "dora.yaml", "dora")
    listed = [PATIENT, "clinic/*.yaml", "carla", "others"]
    cases = load_cases(study_file(here, patients=listed)).cases
    assert [case.patient for case in cases] == [PATIENT, "anna", "berta", "carla", "dora"]
    assert cases[1].study.config.patient == str(here / "clinic" / "anna.yaml")
    assert cases[4].patient == "dora"


def test_names_stay_when_patients_are_added_and_paths_do_not_depend_on_where_one_is(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    child(here / "clinic" / "berta.yaml", "berta")
    path = study_file(here, patients=["clinic/*.yaml"], grid={"cost.rate_weight": [0.1]})
    before = load_cases(path).cases
    child(here / "clinic" / "anna.yaml", "anna")
    monkeypatch.chdir("/")
    after = load_cases(path).cases
    assert [case.name for case in after[1:]] == [case.name for case in before]
    assert after[1].study.config == before[0].study.config


def test_problems_come_by_name_and_by_file(here: Path) -> None:
    content = {"problem": "mapd-orthosis", "patient": "nobody", "cost": {"rate_weight": 0.5}}
    (here / "calm.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    cases = load_cases(study_file(here, problems=["calm.yaml", "mapd-orthosis"])).cases
    assert [case.problem for case in cases] == ["calm", "mapd-orthosis"]
    assert cases[0].study.config.cost.rate_weight == 0.5
    assert cases[0].study.config.patient == PATIENT


def test_keys_of_the_study_are_overridden_by_dotted_keys(here: Path) -> None:
    path = study_file(here, grid={"cost.rate_weight": [0.1]})
    (case,) = load_cases(path, ("set.bounds.friction=0.5", "grid.cost.rate_weight=[0.3]")).cases
    assert case.name == f"{PATIENT}--mapd-barefoot--rate_weight_0.3"
    assert case.study.config.bounds.friction == 0.5
    assert [case.patient for case in load_cases(path, (f"patients=[{HEALTHY}]",)).cases] == [
        HEALTHY
    ]


# Names


def test_short_keys_tell_keys_apart() -> None:
    assert short_keys(["variation.scale.strengths", "cost.rate_weight"]) == {
        "variation.scale.strengths": "strengths",
        "cost.rate_weight": "rate_weight",
    }
    assert list(short_keys(["variation.scale.a", "variation.shift.a"]).values()) == [
        "scale.a", "shift.a",
    ]  # fmt: skip
    assert list(short_keys(["mesh", "variation.scale.mesh"]).values()) == ["mesh", "scale.mesh"]


@pytest.mark.parametrize("value", [1.0, -0.13, 1e-9, True, None, [92, 92.5], "a/b", {"a": [1]}, ""])
def test_every_value_becomes_a_name(value: Any) -> None:
    name = case_name("anna", "walk", {"key": value}, "")
    assert slug(name) == name
    assert name.startswith("anna--walk--key_")


def test_long_and_unsafe_texts_stay_different() -> None:
    assert slug("a/b") != slug("a:b") != slug("a_b")
    texts = ["x" * 300 + end for end in "ab"]
    assert slug(texts[0]) != slug(texts[1])
    long = [case_name("p" * 64, "q" * 40, {"k" * 30: t, "l" * 30: t}, "v") for t in texts]
    assert long[0] != long[1]
    assert max(map(len, long)) <= 160


# Refusals


def bad_patient(folder: Path) -> Path:
    """Write a study of two children, one of them without mass."""
    child(folder / "clinic" / "anna.yaml", "anna")
    child(folder / "clinic" / "berta.yaml", "berta", body_mass=-3.0)
    return study_file(folder, patients=["clinic/*.yaml"])


def twins(folder: Path) -> Path:
    """Write a study of two patients of one id."""
    child(folder / "clinic" / "anna.yaml", "anna")
    child(folder / "clinic" / "berta.yaml", "anna")
    return study_file(folder, patients=["clinic"])


def weak_file(folder: Path) -> Path:
    """Write a study of a patient without strengths."""
    child(folder / "clinic" / "anna.yaml", "anna", strengths=None)
    return study_file(folder, patients=["clinic"])


def text(folder: Path, content: str) -> Path:
    """Write a study as it stands."""
    path = folder / "study.yaml"
    path.write_text(content, encoding="utf-8")
    return path


FAULTS: dict[str, tuple[Callable[[Path], Path], tuple[str, ...]]] = {
    "missing file": (lambda f: f / "study.yaml", ("study.yaml: no such file",)),
    "not YAML": (lambda f: text(f, "patients: [1"), ("study.yaml, line", "not valid YAML")),
    "unknown key": (
        lambda f: study_file(f, grids={}),
        ("study.yaml, line 5: grids: unknown key", "did you mean 'grid'?"),
    ),
    "nobody": (lambda f: study_file(f, patients=[]), ("patients: has 0 entries",)),
    "unknown patient": (
        lambda f: study_file(f, patients=["nobody"]),
        ("study.yaml: patients: 'nobody' leads to no patient", PATIENT),
    ),
    "empty pattern": (
        lambda f: study_file(f, patients=["clinic/*.yaml"]),
        ("'clinic/*.yaml' leads to no patient",),
    ),
    "bad patient": (bad_patient, ("clinic/berta.yaml", "body_mass", "5 to 150 kg")),
    "same id": (twins, ("anna.yaml", "berta.yaml", "have the same id, anna")),
    "listed twice": (
        lambda f: study_file(f, patients=[PATIENT, PATIENT]),
        ("is listed already", "list it once"),
    ),
    "no strengths": (
        weak_file,
        ("case anna--mapd-barefoot", "anna.yaml", "strengths is not given"),
    ),
    "no orthosis": (
        lambda f: study_file(f, patients=[HEALTHY], problems=["mapd-healthy", "mapd-orthosis"]),
        (f"patient {HEALTHY} has no orthosis, which problem mapd-orthosis needs", "add the"),
    ),
    "unknown problem": (
        lambda f: study_file(f, problems=["mapd-shoes"]),
        ("problems: 'mapd-shoes' is no config of a problem", "mapd-ws-orthosis"),
    ),
    "problem twice": (
        lambda f: study_file(f, problems=["mapd-barefoot", "mapd-barefoot"]),
        ("two problems are named mapd-barefoot",),
    ),
    "unknown config key": (
        lambda f: study_file(f, set={"mesh.degre": 3}),
        ("study.yaml, set, problem mapd-barefoot: mesh.degre", "did you mean 'degree'?"),
    ),
    "value out of range": (
        lambda f: study_file(f, grid={"bounds.friction": [0.8, -1]}),
        (f"case {PATIENT}--mapd-barefoot--friction_-1: bounds.friction", "0.05 to 2"),
    ),
    "unknown place": (
        lambda f: study_file(f, grid={"variation.scale.strenghts": [0.8]}),
        ("variation.scale.strenghts", "did you mean 'strengths'?"),
    ),
    "value twice": (
        lambda f: study_file(f, grid={"bounds.friction": [0.7, 0.7]}),
        ("friction_0.7 are the same", "look for what stands twice"),
    ),
    "key twice": (
        lambda f: study_file(f, set={"mesh": {"degree": 3}}, grid={"mesh.degree": [3, 4]}),
        ("varies mesh.degree in grid and sets it in set",),
    ),
    "problem as a key": (
        lambda f: study_file(f, set={"problem": "mapd-healthy"}),
        ("overrides problem", "list it under problems"),
    ),
    "unsafe name": (
        lambda f: study_file(f, cases=[{"name": "../x"}]),
        ("cases[0].name", "not safe in the name of a folder"),
    ),
    "name twice": (
        lambda f: study_file(f, cases=[{"name": "a"}, {"name": "a"}]),
        ("has two cases named a",),
    ),
    "half a cycle": (
        lambda f: study_file(f, set={"half_cycle": True}),
        ("half_cycle: asks for half a cycle", "set half_cycle to false"),
    ),
    "several starts": (
        lambda f: study_file(f, set={"starts": 8}),
        ("starts: is 8", "start.knee_flexion"),
    ),
    "nothing recorded": (
        lambda f: study_file(f, patients=[HEALTHY], set={"start.gait": "recorded"}),
        (HEALTHY, "recording"),
    ),
    "warm start of nothing": (
        lambda f: study_file(f, warm_start={"mapd-orthosis": "runs"}),
        ("warm_start.mapd-orthosis: is no problem of this study; allowed: mapd-barefoot",),
    ),
    "no warm start": (
        lambda f: study_file(f, warm_start={"mapd-barefoot": "runs/old"}),
        ("warm_start.mapd-barefoot: ", "runs/old: no such folder"),
    ),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_bad_studies_get_one_sentence_and_leave_nothing(here: Path, fault: str) -> None:
    make, parts = FAULTS[fault]
    refused(here, run(make(here).name), *parts)


def refused(folder: Path, result: Result, *parts: str) -> None:
    """Check exit code and message, and that nothing was written."""
    assert isinstance(result.exception, SystemExit), repr(result.exception)
    assert result.exit_code == 2, result.output
    (line,) = result.output.splitlines()
    assert line.startswith("Error: ")
    for part in parts:
        assert part in line
    assert {path.name for path in folder.iterdir()} <= {"study.yaml", "clinic", "mine.txt", "mine"}


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--set", "mesh.degree=4"], ("no key of a study of many", "--set set.mesh.degree=4")),
        (["--set", "nonsense"], ("dotted.key=value",)),
        (["--set", "grid.mesh.degree=4"], ("mesh.degree", "a list")),
        (["--out", "mine.txt"], ("mine.txt: is a file",)),
        (["--out", "mine"], ("mine: is not empty and holds thesis.txt", "pathwalker batch")),
        (["--scheduler", "slurm"], ("--workers", "add --workers N")),
        (["--scheduler", "tcp://127.0.0.1:1", "--workers", "2"], ("--workers", "leave it out")),
        (["--scheduler", "slurm", "--time-limit", "9"], ("--time-limit", "max_wall_time")),
    ],
)
def test_bad_words_get_one_sentence(here: Path, words: list[str], parts: tuple[str, ...]) -> None:
    (here / "mine.txt").touch()
    (here / "mine").mkdir()
    (here / "mine" / "thesis.txt").touch()
    refused(here, run(study_file(here).name, *words), *parts)


def test_the_real_process_shows_no_traceback(tmp_path: Path) -> None:
    command = [sys.executable, "-c", "from pathwalker_cli.cli import main; main()", "batch"]
    path = bad_patient(tmp_path)
    done = subprocess.run([*command, path], cwd=tmp_path, capture_output=True, text=True,
                          check=False)  # fmt: skip
    assert done.returncode == 2
    assert done.stdout == ""
    assert done.stderr.startswith("Error: ")
    assert "berta.yaml" in done.stderr
    assert done.stderr.count("\n") == 1


# Table


@pytest.mark.parametrize(
    ("key", "unit"),
    [
        ("bounds.least_walking_speed", "m/s"),
        ("bounds.dorsiflexion_stiffness", "N m/rad"),
        ("bounds.joint_ranges.hip_r", "rad"),
        ("bounds.friction", "1"),
        ("mesh.intervals", ""),
        ("transcription", ""),
        ("variation.scale.strengths", "1"),
        ("variation.shift.body_mass", "kg"),
        ("variation.shift.strengths.knee_extension.right", "N m"),
        ("variation.shift.strengths.knee_extension", "N m"),
        ("variation.shift.orthosis.neutral_angle", "rad"),
        ("nonsense.at.all", ""),
    ],
)
def test_headers_have_the_units_of_what_is_varied(key: str, unit: str) -> None:
    assert unit_of(key) == unit


def test_a_row_leaves_out_the_gait_of_a_last_iterate() -> None:
    anna = load_patient(PATIENT).model_copy(update={"id": "anna"})
    study = Case(load_config("mapd-barefoot"), anna)
    case = BatchCase("a", "walk", study, {"bounds.friction": 0.7, "x": [1, 2]}, "calm")
    table = CaseTable([case])
    assert ",".join(table.header) == (
        "case,patient,problem,bounds.friction [1],x,variant,status,cost,walking_speed [m/s],"
        "step_length_right [m],step_length_left [m],"
        "min_stance_knee_flexion_right [rad],min_stance_knee_flexion_left [rad],"
        "dorsiflexion_stiffness_right [N m/rad],dorsiflexion_stiffness_left [N m/rad],"
        "plantarflexion_stiffness_right [N m/rad],plantarflexion_stiffness_left [N m/rad],"
        "effort_per_distance [s/m],largest_violation,reintegration_position_error [rad or m],"
        "reintegration_velocity_error [rad/s or m/s],intervals,iterations"
    )
    metrics = {"walking_speed": 2 / 3, "iterations": 12, "step_length_left": None}
    row = dict(zip(table.header, table.row(case, "converged", metrics), strict=True))
    assert row["walking_speed [m/s]"] == "0.666666667"
    assert (row["x"], row["step_length_left [m]"], row["iterations"]) == ("[1, 2]", "", "12")
    failed = dict(zip(table.header, table.row(case, "no way", metrics), strict=True))
    assert failed["walking_speed [m/s]"] == ""
    assert failed["iterations"] == "12"


# Runs without a solve


class Serial:
    """A pool of this very process; keeps the names of what it was given."""

    workers: int | None = 1

    def __init__(self, work: Work, stop_after: int | None = None) -> None:
        self.work, self.stop_after = work, stop_after
        self.given: list[str] = []

    def run(self, tasks: Sequence[Task], work: Work) -> Iterator[tuple[str, Ending]]:
        """Do the work that the test wants, not the one of the study."""
        for i, task in enumerate(tasks):
            if i == self.stop_after:
                raise KeyboardInterrupt
            self.given.append(task.name)
            yield task.name, self.work(task.case, task.folder, task.warm_start)


def kinds(folder: Path, *wanted: str) -> tuple[BatchCase, ...]:
    """Return cases that go as their names say."""
    cases = [
        {"name": kind, "set": {"bounds.friction": round(0.5 + 0.01 * i, 2)}}
        for i, kind in enumerate(wanted)
    ]
    return load_cases(study_file(folder, cases=cases)).cases


def table_of(folder: Path) -> dict[str, dict[str, str]]:
    """Return the table of a study by the last word of the case's name."""
    with (folder / "cases.csv").open(encoding="utf-8", newline="") as file:
        return {row["case"].rpartition("--")[2]: row for row in csv.DictReader(file)}


def test_a_worker_that_dies_loses_only_its_own_case(tmp_path: Path) -> None:
    cases = kinds(tmp_path, "is_fine", "dies_once", "dies", "fails", "is_hard", "hangs", "is_good")
    folder = tmp_path / "out"
    report = run_batch(cases, folder, LocalPool(2, time_limit=8.0), Watch(), fake_work)
    rows = table_of(folder)
    assert {name: row["status"] for name, row in rows.items()} == {
        "is_fine": "converged",
        "dies_once": "converged",
        "dies": "failed: its worker died every time it was tried",
        "fails": "failed: ZeroDivisionError: a bug",
        "is_hard": "the iteration limit was reached",
        "hangs": "failed: took longer than the time limit of 8 s",
        "is_good": "converged",
    }
    assert rows["dies_once"]["cost"] == "0.17"
    assert rows["is_hard"]["cost"] == ""
    assert len(report.failed) == 4
    assert "SIGKILL" in (folder / "failures" / f"{cases[2].name}.txt").read_text()
    lines = report_text(report).splitlines()
    assert lines[0].split()[:2] == ["case", "cost"]
    assert "failed: 4 of 7" in lines
    assert lines[-1] == f"Written to {folder}"


def test_workers_that_cannot_begin_fail_every_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(processes, "prepare_worker", die)
    case = load_case("mapd-barefoot")
    tasks = [Task(str(i), case, str(tmp_path)) for i in range(9)]
    results = dict(LocalPool(4).run(tasks, fake_work))
    assert {result["reason"] for result in results.values()} == {LOST}
    assert {result["detail"] for result in results.values()} == {worker.NO_WORKERS}
    assert len(results) == 9


def made(made_solution: MadeSolution) -> Work:
    """Return work that writes a run which is not the fruit of a solve."""

    def work(case: Case, folder: str, warm_start: str) -> Ending:
        bad = "fails" in folder and not Path(folder).exists()
        status = "the iterates diverged" if bad else "converged"
        solution = made_solution(case.config.problem, case=case, status=status)
        write_run(folder, solution)
        return Ending(wrote=True, reason="", detail="", seconds=1.0, worker="me")

    return work


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave figures out of run folders."""
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())


@pytest.mark.usefixtures("no_figures")
def test_a_restart_does_only_what_is_not_done(tmp_path: Path, made_solution: MadeSolution) -> None:
    cases, folder = kinds(tmp_path, "first", "fails", "last"), tmp_path / "out"
    with pytest.raises(NotConvergedError, match="with 1 of 3 cases done; the same command"):
        run_batch(cases, folder, Serial(made(made_solution), stop_after=2), Watch())
    status = {name: row["status"] for name, row in table_of(folder).items()}
    assert status == {
        "first": "converged", "fails": "the iterates diverged", "last": "not yet run",
    }  # fmt: skip
    last = cases[-1].name
    left = folder / "cases" / f".{last}.0123abcd.tmp"
    left.mkdir()
    left.with_name(f".{last}.lock").touch()  # of a worker that was killed
    first = folder / "cases" / cases[0].name / "metrics.json"
    before = first.stat()
    pool = Serial(made(made_solution))
    report = run_batch(cases, folder, pool, Watch())
    assert pool.given == [cases[1].name, cases[2].name]
    assert not report.failed
    assert (first.stat().st_mtime_ns, first.stat().st_ino) == (before.st_mtime_ns, before.st_ino)
    assert not list(folder.rglob(".*"))
    with (folder / "times.csv").open(encoding="utf-8", newline="") as file:
        times = {row["case"]: row for row in csv.DictReader(file)}
    assert list(times) == [case.name for case in cases]
    assert times[cases[0].name]["worker"] == "me"
    first.write_text("{", encoding="utf-8")
    (folder / "cases" / cases[2].name / "config.resolved.yaml").write_text("{", encoding="utf-8")
    again = Serial(made(made_solution))
    assert not run_batch(cases, folder, again, Watch()).failed
    assert again.given == [cases[0].name, cases[2].name], "a damaged run is done again"


@pytest.mark.usefixtures("no_figures")
def test_a_case_that_is_solved_already_is_not_solved_again_by_a_worker(
    tmp_path: Path, made_solution: MadeSolution, monkeypatch: pytest.MonkeyPatch
) -> None:
    (case,) = kinds(tmp_path, "done")
    words = (case.study, str(tmp_path / "run"), "")
    made(made_solution)(*words)
    monkeypatch.setattr("pathwalker_cli.studies.run.run_study", lambda *_: 1 / 0)
    assert solve_case(*words)["wrote"]


@pytest.mark.usefixtures("no_figures")
def test_the_table_does_not_tell_who_did_what_when(
    tmp_path: Path, made_solution: MadeSolution
) -> None:
    cases = kinds(tmp_path, "first", "second")
    run_batch(cases, tmp_path / "whole", Serial(made(made_solution)), Watch())
    with pytest.raises(NotConvergedError):
        run_batch(cases, tmp_path / "parts", Serial(made(made_solution), 1), Watch())
    run_batch(cases, tmp_path / "parts", Serial(made(made_solution)), Watch())
    whole, parts = ((tmp_path / name / "cases.csv").read_bytes() for name in ("whole", "parts"))
    assert whole == parts


@pytest.mark.usefixtures("no_figures")
def test_warm_starts_reach_the_worker_and_must_fit(here: Path, made_solution: MadeSolution) -> None:
    write_run(here / "clinic" / "old", made_solution("mapd-barefoot"))
    (case,) = load_cases(study_file(here, warm_start={"mapd-barefoot": "clinic/old"})).cases
    assert case.warm_start == here / "clinic" / "old"
    path = study_file(here, problems=["mapd-orthosis"], warm_start={"mapd-orthosis": "clinic/old"})
    refused(here, run(path.name), "warm_start.mapd-orthosis: ", "(barefoot)", "clinic/old")


@pytest.mark.usefixtures("no_figures")
def test_the_example_of_the_documentation_is_accepted(
    here: Path, made_solution: MadeSolution
) -> None:
    page = (Path(__file__).parent.parent / "docs" / "cohorts.md").read_text(encoding="utf-8")
    (here / "studies").mkdir()
    child(here / "studies" / "children" / "anna.yaml", "anna")
    write_run(here / "runs" / "mapd-orthosis", made_solution())
    path = text(here / "studies", page.split("```yaml\n")[1].split("```")[0])
    found = names(path)
    assert len(found) == 2 * 2 * 4 * 2
    named = re.search(r"named after what it\s+is, e.g. `([^`]+)`", page)
    assert named is not None
    assert named[1] in found


def test_a_worker_says_why_there_is_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "thesis.txt").touch()
    result = solve_case(load_case("mapd-barefoot"), str(tmp_path / "taken"), "")
    assert not result["wrote"]
    assert "thesis.txt" in result["reason"]
    monkeypatch.setattr("pathwalker_cli.studies.run.check_target", lambda _: 1 / 0)
    result = solve_case(load_case("mapd-barefoot"), str(tmp_path / "new"), "")
    assert result["reason"] == "ZeroDivisionError: division by zero"
    assert "Traceback" in result["detail"]


def test_a_run_that_cannot_be_seen_is_a_failed_case(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ledger, "SIGHT", 0.1)
    elsewhere = Serial(lambda *_: Ending(wrote=True, reason="", detail="", seconds=1.0, worker=""))
    report = run_batch(kinds(tmp_path, "lost"), tmp_path / "out", elsewhere, Watch())
    assert "do all workers share this disk?" in report.failed[0].status


# One process at a time


def test_two_processes_in_one_folder_are_refused(tmp_path: Path) -> None:
    script = (
        "import sys, time\nfrom pathlib import Path\n"
        "from pathwalker_cli.io.lock import locked\n"
        "with locked(Path(sys.argv[1]) / '.lock', Path()):\n"
        f"    print('held', flush=True)\n    time.sleep({2 * GUARD})\n"
    )
    command = [sys.executable, "-c", script, str(tmp_path / "out")]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == "held\n"
        with pytest.raises(DataError, match="another `pathwalker` is at work there"):
            run_batch(kinds(tmp_path, "a"), tmp_path / "out", Serial(fake_work), Watch())
        other.kill()
    with locked(tmp_path / "out" / ".lock", tmp_path):
        pass


HANGING = """
import signal
import sys
from pathlib import Path
from fake_work import die, fake_work
from pathwalker_cli.case import load_case
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.studies.batch.worker import LocalPool
from pathwalker_cli.studies.batch.worker import Task

def work():
    case = load_case("mapd-barefoot")
    tasks = [Task(n, case, sys.argv[1] + "/cases/" + n) for n in ("a--hangs", "b--hangs")]
    for _ in LocalPool(2).run(tasks, fake_work): pass

if __name__ == "__main__":
    # shells start background jobs deaf to Ctrl-C
    signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        work()
    except KeyboardInterrupt:
        print("stopped", flush=True)
"""


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGKILL])
def test_workers_end_with_their_parent(tmp_path: Path, number: signal.Signals) -> None:
    script = tmp_path / "hanging.py"
    script.write_text(HANGING, encoding="utf-8")
    places = [str(Path(__file__).parent), *filter(None, [os.environ.get("PYTHONPATH")])]
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(places)}
    command = [sys.executable, script, tmp_path]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True, env=environment,
                          start_new_session=True) as parent:  # fmt: skip
        try:
            workers = awaited(lambda: busy(parent.pid))
            if number == signal.SIGINT:
                os.killpg(parent.pid, number)
            else:
                parent.send_signal(number)
            output, _ = parent.communicate(timeout=GUARD)
        except BaseException:
            os.killpg(parent.pid, signal.SIGKILL)
            raise
    assert output == ("stopped\n" if number == signal.SIGINT else "")
    awaited(lambda: not any(Path(f"/proc/{pid}").exists() for pid in workers))


def busy(parent: int) -> list[int]:
    """Return the worker processes of a parent once both sleep in their work."""
    children = Path(f"/proc/{parent}/task").glob("*/children")
    pids = [int(pid) for path in children for pid in path.read_text().split()]
    workers = [pid for pid in pids if "spawn_main" in Path(f"/proc/{pid}/cmdline").read_text()]
    ready = [pid for pid in workers if len(list(Path(f"/proc/{pid}/task").iterdir())) > 1]
    return ready if len(ready) == 2 else []


def awaited(condition: Callable[[], Any], seconds: float = GUARD) -> Any:
    """Return what a condition gives as soon as it is true."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        found = condition()
        if found:
            return found
        time.sleep(0.1)
    raise AssertionError("waited in vain")


# The command


@pytest.fixture
def fakes(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the command work without solves."""
    monkeypatch.setattr(worker, "LocalPool", lambda *_: Serial(fake_work))


@pytest.mark.usefixtures("fakes")
def test_the_command_reports_and_exits_with_0_or_1(here: Path) -> None:
    kinds(here, "is_fine", "is_good")
    result = run("study.yaml", "--workers", 2)
    assert result.exit_code == 0, result.output
    assert "[1/2] " in result.stderr
    assert "--is_fine: converged, 0.2 s" in result.stderr
    assert result.stdout.endswith("\nWritten to runs/study\n")
    assert (here / "runs" / "study" / "cases.csv").exists()
    kinds(here, "is_fine", *(f"hard{i}--is_hard" for i in range(5)))
    result = run("study.yaml", "--out", "other", "--quiet")
    assert result.exit_code == 1
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    assert line.startswith("Error: 5 of 6 cases did not converge: ")
    assert "and 2 more; other/cases.csv says why" in line


def test_a_terminal_gets_a_bar() -> None:
    screen = StringIO()
    console = Console(file=screen, force_terminal=True, width=100)
    study = load_case("mapd-barefoot")
    with BatchProgress(console=console) as progress:
        progress.begin(4, 1, 2)
        for name, status in (("a", "converged"), ("b", "failed: a bug")):
            progress.ended(ledger.Ended(BatchCase(name, "q", study), status, None, 3.0))
    shown = screen.getvalue()
    assert "1 of 4" in shown
    assert "b: failed: a bug, 3.0 s" in shown
    assert "1 failed, 1 running" in shown
    assert "a: converged" not in shown


def test_failures_are_one_line() -> None:
    assert failure("a\n  b")["reason"] == "a b"
    with pytest.raises(ConfigError):
        load_cases("nowhere.yaml")


@pytest.mark.slow
def test_real_cases_end_in_the_same_table_however_they_are_spread(tmp_path: Path) -> None:
    quick = {
        "mesh.intervals": [2] * 8, "mesh.refinements": 0, "solver.tolerance": 1e-3, "smoke": True,
    }  # fmt: skip
    path = study_file(tmp_path, set=quick, grid={"variation.scale.strengths": [1.0, 1.1]})
    cases = load_cases(path).cases
    tables = []
    for workers in (1, 2):
        folder = tmp_path / str(workers)
        run_batch(cases, folder, LocalPool(workers), Watch())
        tables.append((folder / "cases.csv").read_bytes())
    assert tables[0] == tables[1]
    assert b"converged" in tables[0]
