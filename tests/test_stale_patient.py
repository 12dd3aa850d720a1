"""What stands on a run takes the patient that the run keeps, whatever became of the patient's file.

The commands are those of the command line that take the folder of a run, and `batch`, whose file
names one: a command that is new and not tried here fails the first test.
"""

from __future__ import annotations

import re
import shutil
import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner
from matplotlib.figure import Figure

from conftest import made_result
from made_neighbours import MadeOptimum, MadeResolver, made_measures
from neighbours_stand_in import StandInOptimum, StandInResolver, stand_in_measures
from pathwalker_cli.animation import viewer
from pathwalker_cli.case import Case, load_case
from pathwalker_cli.cli import COMMANDS, cli
from pathwalker_cli.commands.complete import complete_runs
from pathwalker_cli.explore import session
from pathwalker_cli.explore.dials import dials_of
from pathwalker_cli.gait.neighbourhood import Derivative
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.nlp.ipopt import Multipliers, NlpResult, NlpSolver
from pathwalker_cli.nlp.program import Program
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import Stride, stride_of
from pathwalker_cli.stride.verify import reintegrate
from pathwalker_cli.studies import (
    landscape,
    learn,
    measures,
    neighbours,
    perturbation,
    sensitivity,
    tradeoff,
    uncertainty,
)
from pathwalker_cli.studies import run as study_run
from pathwalker_cli.studies.batch import worker
from pathwalker_cli.studies.learn import fit
from pathwalker_cli.verification import checks
from report_runs import write_made_run

PATIENT = "sreenivasa2017-patient"
CHANGED = "file is no longer that of the run"

BATCH = """
patients: [sreenivasa2017-patient]
problems: [mapd-orthosis]
warm_start: {mapd-orthosis: worn}
"""

WORDS: dict[str, tuple[str, ...]] = {
    "solve": ("mapd-orthosis", "mapd-orthosis", "--warm-start", "worn", "--out", "out"),
    "perturb": ("perturbation", "--run", "worn", "--out", "out"),
    "sensitivity": ("sensitivity", "--run", "worn", "--out", "out", "--set", "check=[]"),
    "uncertainty": ("uncertainty", "--run", "worn", "--out", "out", "--workers", "1",
                    "--set", "draws=4"),
    "landscape": ("landscape", "--run", "worn", "--out", "out",
                  "--set", "dorsiflexion.points=2", "--set", "plantarflexion.points=2"),
    "tradeoff": ("tradeoff", "--run", "worn", "--out", "out",
                 "--set", "walking_speed_weights=[0.0, 1.0]"),
    "learn": ("learn", "--run", "bare", "--out", "out", "--set", "steps=1", "--set", "set={}",
              "--set", "smoothing=[0.0]", "--set",
              "numbers={strengths.ankle_flexion.left: {prior: 6, factor: 2, range: [1, 60]}}"),
    "evaluate": ("worn", "bare", "-o", "out"),
    "export": ("worn", "-o", "out", "--opensim"),
    "verify": ("worn",),
    "rerun": ("worn", "--out", "out"),
    "compare": ("worn", "bare", "-o", "out"),
    "report": ("worn", "bare", "-o", "out.html"),
    "animate": ("worn", "bare", "-o", "out.html"),
    "view": ("worn", "--no-open"),
    "explore": ("worn", "-o", "out.html"),
    "batch": ("batch.yaml", "-o", "out"),
}  # fmt: skip
"""Arguments by command; `worn` and `bare` are the runs, `out` is what is written."""


def broken(file: Path) -> None:
    file.write_text("id: [", encoding="utf-8")


def heavier(file: Path) -> None:
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    file.write_text(yaml.safe_dump({**content, "body_mass": 60.0}), encoding="utf-8")


CHANGES: dict[str, Callable[[Path], None]] = {
    "changed": heavier, "removed": Path.unlink, "broken": broken,
}  # fmt: skip

_OPENED: list[str] = []


def _note(event: str, arguments: tuple[Any, ...]) -> None:
    if event == "open":
        _OPENED.append(str(arguments[0]))


sys.addaudithook(_note)


# Solves that end at once, with numbers that follow the patient


def kg(optimum: StandInOptimum | MadeOptimum) -> float:
    return optimum.case.patient.body_mass


class Around:
    """Stands in for what surrounds an optimum."""

    kkt = SimpleNamespace(active=7, doubtful=0)
    free = ()

    def __init__(self, resolver: StandInResolver) -> None:
        case = resolver.case
        solver = StandInOptimum(case, made_result()).solver
        solver.free, solver.case, solver.config = (), case, case.config
        self.optimum: Any = SimpleNamespace(case=case, free=(), solver=solver)

    def by_factor(self, place: str) -> Derivative:
        return Derivative(1e-3 * kg(self.optimum), self.optimum, self.optimum, 1e-4)


def ended(
    solver: object, program: Program, start: np.ndarray, multipliers: Multipliers | None = None
) -> NlpResult:
    """End a nonlinear program where it begins, every unknown pressed on a little."""
    objective, rows = program.functions["nlp"](start, program.parameters)
    pressed = Multipliers(np.full(program.size, -1.0), np.zeros(program.rows))
    known = start, np.asarray(rows).ravel(), float(objective)
    return NlpResult("converged", *known, multipliers or pressed, 0, 0.0, 0.0)


def made_stride(made_solution: Callable[..., GaitSolution], case: Case) -> Stride:
    solution = made_solution(case.config.problem, case=case, walker=case.walker())
    return stride_of(gait_series(solution.walker, solution.last_motion))


def no_slopes(learner: Any, deviations: np.ndarray) -> np.ndarray:
    size = learner.misfit(deviations).size - deviations.size
    return np.vstack([np.zeros((size, deviations.size)), np.eye(deviations.size)])


class HereAndNow:
    """A pool of this very process."""

    workers = 1

    def __init__(self, *_: object) -> None:
        pass

    def run(self, tasks: Sequence[Any], work: Any) -> Iterator[tuple[str, Any]]:
        yield from ((task.name, work(task.case, task.folder, task.warm_start)) for task in tasks)


def shown(figure: Figure, file: Any, **_: Any) -> None:
    """Save the numbers that a figure shows instead of drawing it."""
    lines = [line for axes in figure.axes for line in axes.lines]
    text = repr([line.get_xydata().round(12).tolist() for line in lines])
    if hasattr(file, "write"):
        file.write(f"<svg>{text}</svg>")
    else:
        Path(file).write_text(text, encoding="utf-8")


@pytest.fixture
def quick(monkeypatch: pytest.MonkeyPatch, made_solution: Callable[..., GaitSolution]) -> None:
    """Let every solve end at once."""

    def solved(case: Case, earlier: Run | None, log: object) -> GaitSolution:
        made = made_solution(case.config.problem, case=case, walker=case.walker())
        return made if earlier is None else replace(made, cost=float(earlier.motion.duration))

    def near(run: Run, tolerance: float | None = None) -> StandInResolver | MadeResolver:
        return MadeResolver(run.case) if tolerance is None else StandInResolver(run.case)

    def numbers(optimum: StandInOptimum) -> dict[str, float]:
        return {**stand_in_measures(optimum), "stride_time": 0.03 * kg(optimum)}

    monkeypatch.setattr(NlpSolver, "solve", ended)
    monkeypatch.setattr(session, "dials_of", lambda optimum: dials_of(optimum)[::8])
    monkeypatch.setattr(study_run, "_solve", solved)
    monkeypatch.setattr(study_run, "verdict_of", lambda _: None)
    monkeypatch.setattr(worker, "LocalPool", HereAndNow)
    monkeypatch.setattr(Figure, "savefig", shown)
    for place in (perturbation, uncertainty, neighbours, sensitivity):
        monkeypatch.setattr(place, "resolver_of", near)
        monkeypatch.setattr(place, "measures", numbers)
    monkeypatch.setattr(sensitivity, "Neighbourhood", Around)
    for place in (sensitivity, measures):
        monkeypatch.setattr(place, "all_measures", lambda o: {"cost": 0.01 * kg(o)})
    monkeypatch.setattr(learn, "resolver_of", lambda run: MadeResolver(run.case))
    for place in (learn, fit):
        monkeypatch.setattr(place, "stride_at", lambda o: made_stride(made_solution, o.case))
    monkeypatch.setattr(learn, "ranges_that_act", lambda *_: ())
    monkeypatch.setattr(fit.Learner, "slopes", no_slopes)
    for place in (landscape, tradeoff):
        monkeypatch.setattr(
            place, "measures", lambda o: {**made_measures(o), "stride_time": 0.03 * kg(o)}
        )
    monkeypatch.setattr(
        viewer, "open_viewer",
        lambda walker: SimpleNamespace(viewer=SimpleNamespace(url=lambda: f"{walker.weight} N")),
    )  # fmt: skip
    monkeypatch.setattr(checks, "reintegrate", partial(reintegrate, tolerance=0.1))
    monkeypatch.setattr(viewer, "show", lambda shown, series, strides: None)


@pytest.fixture(scope="module")
def kept(
    made_solution: Callable[..., GaitSolution], tmp_path_factory: pytest.TempPathFactory
) -> Path:
    """Return a folder with a patient, two runs of this patient, and a study of many cases."""
    folder = tmp_path_factory.mktemp("stale")
    source = load_patient(PATIENT).source
    assert source is not None
    few = shutil.ignore_patterns("30531[4-6]*", "305317[4-9]*", "305318*")
    shutil.copytree(source.parent, folder / "child", ignore=few)
    for name, problem in (("worn", "mapd-orthosis"), ("bare", "mapd-barefoot")):
        case = load_case(problem, changes=(f"patient={folder / 'child' / 'patient.yaml'}",))
        write_made_run(folder / name, made_solution, problem, case=case)
    (folder / "batch.yaml").write_text(BATCH, encoding="utf-8")
    return folder


@pytest.fixture
def here(kept: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """Return that folder, the patient's file in it as it was."""
    file = kept / "child" / "patient.yaml"
    content = file.read_bytes()
    monkeypatch.chdir(kept)
    yield kept
    file.write_bytes(content)


def outcome(command: str) -> dict[str, Any]:
    """Return all that a command says and writes, without what takes time."""
    for old in (Path("out"), Path("out.html")):
        shutil.rmtree(old, ignore_errors=True)
        old.unlink(missing_ok=True)
    result = CliRunner().invoke(cli, [command, *WORDS[command]])
    assert not isinstance(result.exception, AssertionError | TypeError), result.exc_info
    files = [path for path in sorted(Path().glob("out*/**/*")) if path.is_file()]
    files += [path for path in [Path("out.html")] if path.is_file()]
    written = {str(path): timeless(path) for path in files if path.name != "times.csv"}
    return {"code": result.exit_code, "says": timeless_text(result.output), **written}


def timeless(path: Path) -> Any:
    content = path.read_bytes()
    return content if path.suffix == ".npz" else timeless_text(content.decode("utf-8"))


def timeless_text(text: str) -> str:
    """Return a text without seconds, and without hashes of them."""
    text = re.sub(r'("(?:seconds|metrics_hash)\w*"): [^,\n]+', r"\1", text)
    text = re.sub(r"\b(build|solve|verify) [\d.]+", r"\1", text)
    return re.sub(r"\b[\d.]+ s\b", "s", text)


# Tests


def test_every_command_that_takes_a_run_is_tried() -> None:
    taken = {
        name
        for name in COMMANDS
        for parameter in cli.get_command(None, name).params  # type: ignore[arg-type, union-attr]
        if parameter._custom_shell_complete is complete_runs
    }
    assert WORDS.keys() == taken | {"batch"}


@pytest.mark.usefixtures("quick")
@pytest.mark.parametrize("command", WORDS)
def test_the_run_is_what_counts_whatever_became_of_the_file(command: str, here: Path) -> None:
    file = here / "child" / "patient.yaml"
    content = file.read_bytes()
    before = outcome(command)
    assert before["code"] == (1 if command == "verify" else 0), before["says"]
    for change in CHANGES.values():
        file.write_bytes(content)
        change(file)
        _OPENED.clear()
        now = outcome(command)
        assert _OPENED.count(str(file)) <= (2 if command == "report" else 0)
        if command == "report" and change is heavier:
            assert now["out.html"].count(CHANGED) == 2
            now["out.html"] = re.sub(
                rf'<p class="warning">[^<]*{CHANGED}[^<]*</p>\n', "", now["out.html"]
            )
        assert now == before
    if command not in ("solve", "batch"):  # they take the motion alone
        taken = here / ("bare" if command == "learn" else "worn") / "patient.yaml"
        kept = taken.read_bytes()
        heavier(taken)
        assert outcome(command) != before, "or this test shows nothing"
        taken.write_bytes(kept)
