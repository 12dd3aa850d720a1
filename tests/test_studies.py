"""All studies alike: what one cannot take is refused before a solve; a new one is one entry."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

import speeds_study
from made_neighbours import MadeResolver, made_measures, made_run
from pathwalker_cli.case import load_case
from pathwalker_cli.checking.studies import check_study
from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.resolve import Resolver
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.studies import neighbours
from pathwalker_cli.studies.base import Plan, Work
from pathwalker_cli.studies.landscape import LandscapeStudy, varied_springs
from pathwalker_cli.studies.perturbation import PerturbationStudy, moved_numbers
from pathwalker_cli.studies.registry import STUDIES

BAREFOOT = ("base=mapd-barefoot",)
FIT = ("base=ls-barefoot",)
SHOOTING = ("set={transcription: multiple-shooting}",)
HALF = ("set={half_cycle: true}",)
TIED = "orthosis.stiffness_guess.dorsiflexion"
"""Address of both K_D as one number."""
SPRINGS = ", ".join(f"{name}: [40, 40]" for name in STIFFNESSES)
PRESCRIBED = f"set={{bounds.stiffness: {{{SPRINGS}}}}}"


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Count what is solved; nothing is."""
    counted: list[str] = []

    def count(self: Any, *_: Any, **__: Any) -> None:
        counted.append(type(self).__name__)
        raise AssertionError("something is solved")

    monkeypatch.setattr(GaitSolver, "solve", count)
    monkeypatch.setattr(Resolver, "resolve", count)
    monkeypatch.setattr(Resolver, "optimum", property(count))
    return counted


def free(*addresses: str) -> str:
    """Return the override with which a base frees numbers."""
    return f"set={{free: {{{', '.join(f'{a}: [5, 92]' for a in addresses)}}}}}"


@pytest.mark.parametrize(
    ("command", "changes", "words"),
    [
        *((name, BAREFOOT, "is walked barefoot and has no springs")
          for name in ("perturb", "uncertainty", "landscape")),
        *((name, FIT, "is walked barefoot and has no springs")
          for name in ("perturb", "uncertainty", "landscape")),
        ("tradeoff", FIT, "is ls-barefoot, which follows a recording"),
        *((name, SHOOTING, "is solved by multiple-shooting, but neighbours are solved by")
          for name in STUDIES),
        *((name, HALF, "is solved as half a cycle, in which the numbers of one side")
          for name in ("perturb", "uncertainty", "landscape")),
        ("sensitivity", ("base=mapd-healthy", "check=[]"),
         "half_cycle: asks for half a cycle, but strengths"),
        ("sensitivity", ("places=[body_weight]",), "body_weight"),
        ("sensitivity", ("check=[body]",), "check: names body"),
        ("perturb", (PRESCRIBED,), "springs: there is nothing to move"),
        ("perturb", (free(TIED), "springs=[dorsiflexion_stiffness_left]"),
         "dorsiflexion_stiffness_left is no number of the problem; allowed: plantarflexion_"),
        ("perturb", ("springs=[K_D]",), "springs[0]: K_D is no number of the problem"),
        ("landscape", (PRESCRIBED,), "dorsiflexion: runs from 40 to 40 N m/rad"),
        ("landscape", (free(TIED), "side=right"),
         "side: is right, but the problem chooses one dorsiflexion"),
        ("uncertainty", ("quantities={orthosis.neutral_angle: {absolute: 0.5}}",), "is refused"),
    ],
)  # fmt: skip
def test_what_a_study_cannot_take_is_refused_before_anything_is_solved(
    command: str, changes: tuple[str, ...], words: str, tmp_path: Path, solves: list[str]
) -> None:
    options = [part for change in changes for part in ("--set", change)]
    out = tmp_path / "out"
    result = CliRunner().invoke(cli, [command, STUDIES[command].name, "--out", str(out), *options])
    assert result.exit_code == 2, result.output
    assert words in result.output
    assert len(result.output.splitlines()) == 1
    assert solves == []
    assert not out.exists()
    with pytest.raises(Exception, match=r".") as refused:
        check_study(command, STUDIES[command].name, changes)
    assert words.partition(": ")[2] in str(refused.value), "`check` says the same"


@pytest.mark.parametrize("command", ["perturb", "uncertainty", "landscape"])
def test_a_barefoot_run_is_refused_before_anything_is_solved(
    command: str, made_runs: Path, tmp_path: Path, solves: list[str]
) -> None:
    options = ["--run", str(made_runs / "mapd-barefoot"), "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(cli, [command, STUDIES[command].name, *options])
    assert result.exit_code == 2
    assert "is walked barefoot and has no springs" in result.output
    assert solves == []


def test_numbers_that_the_base_frees_are_moved_by_name() -> None:
    values = {
        "free": {"orthosis.neutral_angle": (-0.1, 0.05), "strengths.knee_flexion": (5.0, 90.0)}
    }
    solver = GaitSolver(load_case("mapd-orthosis").with_values(values))
    moved = moved_numbers(PerturbationStudy(base=""), solver)
    assert [u.name for u in moved][-2:] == ["neutral_angle", "knee_flexion_strength"]
    one = PerturbationStudy(base="", springs=("neutral_angle",))
    assert [u.name for u in moved_numbers(one, solver)] == ["neutral_angle"]
    with pytest.raises(ConfigError, match="neutral_angle, knee_flexion_strength"):
        moved_numbers(PerturbationStudy(base="", springs=("free_play",)), solver)


def test_a_barefoot_base_with_a_free_number_is_moved_too() -> None:
    case = load_case("mapd-barefoot").with_values({"free": {"strengths.knee_flexion": (5.0, 90.0)}})
    kind = STUDIES["perturb"].load()
    kind.require(case.config, "base")
    assert kind.plan(PerturbationStudy(base=""), GaitSolver(case)) == Plan(
        "moves knee_flexion_strength, each to 0.95 times its optimum", 1
    )


def test_tied_springs_have_a_landscape_of_both_sides() -> None:
    case = load_case("mapd-orthosis").with_values({"free": {TIED: (5.0, 92.0)}})
    both = varied_springs(LandscapeStudy(base="", side="both"), case.walker().unknowns)
    assert [[u.name for u in each] for each in both] == [
        ["dorsiflexion_stiffness"],
        ["plantarflexion_stiffness_right", "plantarflexion_stiffness_left"],
    ]


# A new study

REGISTERED = """
import sys
from pathwalker_cli.studies.registry import STUDIES, StudyEntry
STUDIES["speeds"] = StudyEntry(
    "speeds", "Tell what speed costs.", "Tell what speeds cost, as CONFIG says.", "Speeds",
    "speeds_study",
)
from pathwalker_cli.cli import main
main()
"""


def registered(*words: object, here: Path) -> subprocess.CompletedProcess[str]:
    """Run a command in a process that has registered the new study."""
    paths = f"import sys; sys.path.insert(0, {str(Path(__file__).parent)!r})\n"
    return subprocess.run(
        [sys.executable, "-c", paths + REGISTERED, *map(str, words)],
        cwd=here, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_a_new_study_is_a_module_and_an_entry(made_runs: Path, tmp_path: Path) -> None:
    (tmp_path / "mine.yaml").write_text(
        "base: mapd-barefoot\nleast_speeds: [0.7, 0.8]\n", encoding="utf-8"
    )
    checked = registered("check", "mine.yaml", here=tmp_path)
    assert checked.returncode == 0, checked.stderr
    assert "mine.yaml: speeds, in order" in checked.stdout
    assert "2 neighbours of the base" in checked.stdout
    shown = registered("speeds", "--help", here=tmp_path)
    assert "Tell what speeds cost" in shown.stdout
    assert "runs/speeds" in shown.stdout
    assert "Tell what speed costs." in registered("--help", here=tmp_path).stdout
    refused = registered("speeds", "mine.yaml", "--set", "base=ls-barefoot", here=tmp_path)
    assert refused.returncode == 2
    assert "follows a recording" in refused.stderr
    unknown = registered("report", tmp_path, "-o", "page.html", here=tmp_path)
    assert "learn or speeds of pathwalker wrote" in unknown.stderr


def test_a_new_study_stands_on_a_page(made_runs: Path, tmp_path: Path) -> None:
    run = Path(shutil.copytree(made_runs / "mapd-barefoot", tmp_path / "run"))
    metrics = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    content = {key: metrics[key] for key in ("problem", "patient")}
    content["optimum"] = {key: metrics[key] for key in ("cost", "walking_speed")}
    (tmp_path / "speeds").mkdir()
    (tmp_path / "speeds" / "speeds.json").write_text(json.dumps(content), encoding="utf-8")
    done = registered("report", run, tmp_path / "speeds", "-o", "page.html", here=tmp_path)
    assert done.returncode == 0, done.stderr
    page = (tmp_path / "page.html").read_text(encoding="utf-8")
    assert "Tell what speed costs. Its numbers: " in page


def test_a_new_study_solves_neighbours_as_all_do(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    resolver = MadeResolver(load_case("mapd-orthosis"))
    monkeypatch.setattr(neighbours, "resolver_of", lambda run: resolver)
    monkeypatch.setattr(speeds_study, "measures", made_measures)
    lines: list[str] = []
    study = speeds_study.SpeedStudy(base="mapd-orthosis")
    result = speeds_study.costs(study, made_run(tmp_path), Work(tmp_path, lines.append))
    assert len(resolver.solved) == len(lines) == 3
    speeds_study.STUDY.write(result, tmp_path)
    assert json.loads((tmp_path / "speeds.json").read_text(encoding="utf-8"))["costs"].keys() == {
        "0.7", "0.8", "0.9",
    }  # fmt: skip
    assert speeds_study.STUDY.failed(result, tmp_path) == ""
