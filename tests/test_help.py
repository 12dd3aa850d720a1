"""Help, shell completion and JSON: what the command line offers besides its results."""

from __future__ import annotations

import json
import os
import shlex
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner, Result

from conftest import MadeSolution
from pathwalker_cli.checking.kinds import KINDS
from pathwalker_cli.cli import COMMANDS, GROUPS, cli
from pathwalker_cli.commands import complete
from pathwalker_cli.commands.complete import (
    complete_configs,
    complete_keys,
    complete_patients,
    complete_problems,
    complete_runs,
)
from pathwalker_cli.commands.examples import EXAMPLES
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.studies import base
from pathwalker_cli.studies import run as study_run
from pathwalker_cli.studies.batch import cases, study
from pathwalker_cli.studies.batch.ledger import Ended
from pathwalker_cli.studies.batch.study import report_content

JSON = ("solve", "perturb", "sensitivity", "uncertainty", "landscape", "tradeoff", "batch", "id",
        "doctor", "check", "evaluate")  # fmt: skip


def run(*words: object) -> Result:
    """Run the command line in this process."""
    return CliRunner().invoke(cli, [str(word) for word in words])


def command(name: str) -> click.Command:
    """Return a command."""
    found = cli.get_command(click.Context(cli), name)
    assert found is not None
    return found


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Help


def test_every_command_has_one_purpose() -> None:
    grouped = [name for names in GROUPS.values() for name in names]
    assert sorted(grouped) == sorted(COMMANDS)
    text = run("--help").output
    places = [text.index(f"\n{heading}:\n") for heading in GROUPS]
    assert places == sorted(places)
    assert text.endswith("Start with: pathwalker init my-child\n")


def test_every_command_has_examples() -> None:
    assert EXAMPLES.keys() == COMMANDS.keys()
    assert all(1 <= len(lines) <= 3 for lines in EXAMPLES.values())


@pytest.mark.parametrize(
    ("name", "line"), [(name, line) for name, lines in EXAMPLES.items() for line in lines]
)
def test_examples_are_real(name: str, line: str) -> None:
    assert len(line) <= 76
    words = shlex.split(line.partition(">")[0])
    assert words[:2] == ["pathwalker", name]
    made = command(name).make_context(name, words[2:], resilient_parsing=False)
    assert made.params
    assert f"\n    {line}\n" in run(name, "--help").output


@pytest.mark.parametrize("name", COMMANDS)
def test_help_fits_a_terminal(name: str) -> None:
    lines = CliRunner().invoke(cli, [name, "--help"], terminal_width=80).output.splitlines()
    assert [line for line in lines if len(line) > 80] == []


# Shell completion


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_a_script_for_each_shell(shell: str) -> None:
    result = run("completion", shell)
    assert result.exit_code == 0, result.output
    assert f"_PATHWALKER_COMPLETE={shell}_complete" in result.output
    assert "pathwalker" in result.output


def test_the_bash_script_is_bash() -> None:
    script = run("completion", "bash").output
    assert subprocess.run(["bash", "-n"], input=script, text=True, check=False).returncode == 0


def offered(completer: Callable[..., Any], begun: str, name: str = "") -> list[str]:
    """Return what is offered for a word that was begun."""
    context = click.Context(cli, info_name=name)
    return [item.value for item in completer(context, click.Argument(["x"]), begun)]


def test_problems_configs_and_patients_complete(here: Path) -> None:
    assert offered(complete_problems, "") == list(PROBLEMS)
    assert offered(complete_problems, "mapd-o") == ["mapd-orthosis"]
    (here / "mine.yaml").touch()
    (here / "mine.txt").touch()
    (here / "many").mkdir()
    (here / "many" / "one.yaml").touch()
    assert offered(complete_configs, "m") == [
        "many/", "mine.yaml", "mapd-barefoot", "mapd-healthy", "mapd-orthosis", "mapd-ws-orthosis",
        "markers",
    ]  # fmt: skip
    assert offered(complete_configs, "many/") == ["many/one.yaml"]
    assert offered(complete_configs, "nowhere/") == []
    assert offered(complete_patients, "sree") == [
        "sreenivasa2017-healthy",
        "sreenivasa2017-patient",
    ]


def test_runs_complete_to_their_folder(here: Path) -> None:
    (here / "runs" / "barefoot").mkdir(parents=True)
    (here / "runs" / "barefoot" / "metrics.json").touch()
    (here / "runs" / "other" / "figures").mkdir(parents=True)
    (here / "runs" / "study" / "base").mkdir(parents=True)
    (here / "runs" / "study" / "base" / "metrics.json").touch()
    (here / "docs").mkdir()
    assert offered(complete_runs, "") == ["runs/"]
    assert offered(complete_runs, "runs/") == ["runs/barefoot", "runs/study/"]
    assert offered(complete_runs, "runs/study/") == ["runs/study/base"]


def test_a_report_is_offered_all_that_it_takes(here: Path) -> None:
    for folder, mark in (("walk", "metrics.json"), ("torques", "stances.csv"), ("notes", "a.txt")):
        (here / "runs" / folder).mkdir(parents=True)
        (here / "runs" / folder / mark).touch()
    assert offered(complete_runs, "runs/", "report") == ["runs/torques", "runs/walk"]
    assert offered(complete_runs, "runs/", "compare") == ["runs/walk"]


def test_a_deep_or_wide_folder_is_not_searched_to_its_end(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    deep = here / "runs" / "a" / "b" / "c" / "d"
    deep.mkdir(parents=True)
    (deep / "metrics.json").touch()
    assert offered(complete_runs, "") == []
    assert offered(complete_runs, "runs/") == ["runs/a/"]
    monkeypatch.setattr(complete, "_MOST_FOLDERS", 1)
    assert offered(complete_runs, "") == ["runs/"], "who does not know lets go on"


def test_keys_of_predictions_complete() -> None:
    every = offered(complete_keys, "", "solve")
    assert {"problem", "starts", "mesh.degree", "bounds.least_walking_speed"} <= set(every)
    assert "mesh" not in every
    assert offered(complete_keys, "bounds.fr", "solve") == ["bounds.friction"]
    assert offered(complete_keys, "bounds.fr", "check") == ["bounds.friction"]
    assert offered(complete_keys, "bounds.friction=", "solve") == []


@pytest.mark.parametrize("name", COMMANDS)
def test_keys_of_every_command_with_overrides_complete(name: str) -> None:
    option = next((p for p in command(name).params if "--set" in p.opts), None)
    if option is None:
        return
    offers = option.shell_complete(click.Context(cli, info_name=name), "")
    model = KINDS[complete._SHIPPED.get(name, "prediction")].model
    keys = {field.alias or key for key, field in model.model_fields.items()}
    assert {item.value.partition(".")[0] for item in offers} == keys


def test_completing_keys_imports_no_heavy_library() -> None:
    ask = "; ".join(
        f"complete_keys(Context(Command('{name}'), info_name='{name}'), None, '')"
        for name in ("solve", "id", "landscape", "batch")
    )
    code = (
        "import sys; from click import Command, Context; "
        f"from pathwalker_cli.commands.complete import complete_keys; {ask}; "
        "print([m for m in ('casadi', 'pinocchio', 'scipy', 'matplotlib') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "[]\n"


def test_the_shell_gets_what_it_asks_for(tmp_path: Path) -> None:
    """A whole process, as the shell starts it."""
    asked = {"_PATHWALKER_COMPLETE": "bash_complete", "COMP_CWORD": "2"}
    environment = {**os.environ, **asked, "COMP_WORDS": "pathwalker solve mapd-b"}
    words = [sys.executable, "-c", "from pathwalker_cli.cli import main; main()"]
    done = subprocess.run(
        words, cwd=tmp_path, env=environment, capture_output=True, text=True, check=True
    )
    assert done.stdout == "plain,mapd-barefoot\n"


# JSON


@pytest.mark.parametrize("name", JSON)
def test_commands_with_results_speak_json(name: str) -> None:
    options = [word for p in command(name).params for word in p.opts]
    assert "--json" in options


class _Solver:
    """Ends as it is told to."""

    end: GaitSolution

    def __init__(self, config: Any, observer: Any) -> None:
        self.observer = observer

    def solve(self, warm_start: Any = None) -> GaitSolution:
        self.observer("first mesh", ProgressReport(0, 1.0, 1.0, 1.0))
        return self.end


@pytest.fixture
def solve(
    monkeypatch: pytest.MonkeyPatch, here: Path, made_solution: MadeSolution
) -> Callable[..., Result]:
    """Return a function that runs `solve --json` with a made end."""
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    monkeypatch.setattr(study_run, "GaitSolver", _Solver)
    monkeypatch.setattr(study_run, "verdict_of", lambda solution: None)

    def solve(*words: str, **changes: Any) -> Result:
        monkeypatch.setattr(_Solver, "end", made_solution(**changes), raising=False)
        return run("solve", "mapd-orthosis", "mapd-orthosis", "--json", *words)

    return solve


def test_a_solve_prints_one_document(solve: Callable[..., Result], here: Path) -> None:
    result = solve("--out", "mine")
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    assert (content["folder"], content["status"], content["converged"]) == (
        "mine", "converged", True,
    )  # fmt: skip
    assert content["metrics"] == json.loads((here / "mine" / "metrics.json").read_text("utf-8"))


def test_a_solve_begins_with_what_is_worn(solve: Callable[..., Result]) -> None:
    lines = solve("--out", "mine").stderr.splitlines()
    assert lines[0].startswith("orthosis: right and left: ")
    assert "neutral angle" in lines[0]
    assert lines[1].startswith("stops: right: ")
    assert "neutral angle" not in solve("--out", "mine", "--quiet").stderr


def test_a_solve_that_failed_prints_one_document_too(solve: Callable[..., Result]) -> None:
    result = solve(status="too many iterations")
    assert result.exit_code == 1
    content = json.loads(result.stdout)
    assert (content["status"], content["converged"]) == ("too many iterations", False)
    assert result.stderr.splitlines()[-1].startswith("Error: mapd-orthosis did not converge")


def test_bad_input_leaves_stdout_empty(solve: Callable[..., Result]) -> None:
    result = solve("--set", "mesh.degree=two")
    assert (result.exit_code, result.stdout) == (2, "")
    assert result.stderr.startswith("Error: ")


def test_a_study_whose_base_fails_says_so(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: Any) -> None:
        raise NotConvergedError("mapd-orthosis, on which the study stands, did not converge")

    monkeypatch.setattr(base, "base_run", fail)
    for name in ("sensitivity", "landscape", "tradeoff"):
        result = run(name, name, "--json")
        assert result.exit_code == 1
        content = json.loads(result.stdout)
        assert content["converged"] is False
        assert "on which the study stands" in content["message"]
        assert "on which the study stands" in result.stderr


def test_inverse_dynamics_prints_one_document(here: Path) -> None:
    result = run("id", "inverse-dynamics", "--json", "--set", "trials=['3053179']")
    assert result.exit_code == 0, result.output
    content = json.loads(result.stdout)
    assert [trial["trial"] for trial in content["trials"]] == ["3053179"]
    assert content["strengths"]["hip_extension_r"]["patient_file"] == pytest.approx(18.63684)
    assert content["updated"] is None


def test_a_batch_as_plain_values(tmp_path: Path) -> None:
    first, second, *_ = cases.load_cases("cohort").cases
    ended = (
        Ended(first, "converged", {"cost": 1.5}, 2.0),
        Ended(second, "failed: time", None, 1.0),
    )
    content = report_content(study.Report(tmp_path, ended))
    assert content["failed"] == 1
    assert [case["cost"] for case in content["cases"]] == [1.5, None]
    assert content["cases"][0]["folder"] == str(tmp_path / "cases" / first.name)
