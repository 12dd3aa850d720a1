"""The command `reproduce`: every number of the article has its row, and nothing is done twice."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cache
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from helpers import stylised_series
from pathwalker_cli.case import Case
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.evaluation.paper import NUMBERS, PaperNumber
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.reproduce import pipeline
from pathwalker_cli.reproduce.comparison import Ours, Row
from pathwalker_cli.reproduce.figures import save_paper_figures
from pathwalker_cli.reproduce.pipeline import ORDER, SEVERAL, planned_studies
from pathwalker_cli.reproduce.results import Results, evaluated, inverse_config, inverse_result
from pathwalker_cli.reproduce.words import deviation, label, ours_text, printed, subject
from pathwalker_cli.studies import run as study_run

MadeSolution = Callable[..., GaitSolution]

OPTIMUM = LocalOptimum(0, "synthetic", "converged", 0.4, 0.6, (), 42, 1.5)


class Solver:
    """Stands in for the solver: ends every solve with the stylised gait and counts the solves."""

    def __init__(self, made: MadeSolution) -> None:
        self.made = made
        self.solved: list[str] = []
        self.failing: set[str] = set()

    def __call__(self, case: Case, *_: object) -> GaitSolution:
        """Return the end of a solve."""
        study = case.config
        self.solved.append(study.problem)
        walker = build_walker(case.patient, study.condition)
        optima = (OPTIMUM, replace(OPTIMUM, start=1, cost=0.5)) if study.starts > 1 else ()
        return self.made(
            "mapd-orthosis" if study.condition == "orthosis" else "mapd-barefoot",
            case=case,
            walker=walker,
            last_motion=stylised_series(study.condition).motion,
            bounds=gait_bounds(walker, study.bounds),
            status="too many iterations" if study.problem in self.failing else "converged",
            optima=optima,
        )


RECORDINGS = cache(pipeline.recordings)


@contextmanager
def _without_solves(made: MadeSolution) -> Iterator[Solver]:
    """Let a stand-in solve; leave out figures and read recordings once, which take the time."""
    stand_in = Solver(made)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(study_run, "_solve", stand_in)
        patch.setattr(study_run, "verdict_of", lambda solution: None)
        patch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
        patch.setattr(pipeline, "recordings", RECORDINGS)
        patch.setattr(pipeline, "save_paper_figures", lambda *_: (("figure-1.png", "Figure 1"),))
        yield stand_in


@pytest.fixture(scope="module")
def written(made_solution: MadeSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a quick call that went well."""
    folder = tmp_path_factory.mktemp("written") / "out"
    with _without_solves(made_solution) as solver:
        result = reproduce("--quick", "--out", folder)
    assert result.exit_code == 0, result.output
    assert solver.solved == list(ORDER)
    return folder


@pytest.fixture
def solver(made_solution: MadeSolution) -> Iterator[Solver]:
    """Yield the stand-in solver."""
    with _without_solves(made_solution) as stand_in:
        yield stand_in


def reproduce(*words: object) -> Result:
    """Run the command."""
    return CliRunner().invoke(cli, ["reproduce", *map(str, words)])


@pytest.fixture
def done(written: Path, tmp_path: Path) -> Path:
    """Return a copy of the folder of a quick call, which may be changed."""
    return Path(shutil.copytree(written, tmp_path / "out"))


def test_quick_means_coarse_meshes_and_single_starts() -> None:
    quick, full = (
        {name: case.config for name, case in planned_studies(8, few).items()}
        for few in (True, False)
    )
    assert tuple(quick) == tuple(full) == ORDER
    assert all(study.smoke and study.starts == 1 for study in quick.values())
    assert all(study.mesh.refinements == 0 for study in quick.values())
    for problem, study in full.items():
        assert study.starts == (8 if problem in SEVERAL else 1)
        assert study.model_copy(update={"starts": 1}) == load_config(problem)


def test_every_number_of_the_article_has_its_row(done: Path) -> None:
    page = (done / "results.md").read_text(encoding="utf-8")
    lines = page.splitlines()
    for number in NUMBERS:
        if number.place == "table 5":
            continue
        begin = f"| {subject(number)}: {label(number)}"
        assert any(line.startswith(begin) and f"| {printed(number)} |" in line for line in lines), (
            number
        )
    for number in NUMBERS:
        assert number.text in page
    assert "not a medical device" in page
    assert re.search(r"Made on \d{4}-\d\d-\d\d, .* with pathwalker \d", page)
    assert "A quick check" in page
    assert "not computed: the published method needs the article's C3D files" in page
    assert "not computed: the perturbation analysis" in page
    assert "nan" not in page.lower().replace("sreenivasa", "")


def test_tables_have_equal_columns(done: Path) -> None:
    before = 0
    for line in (done / "results.md").read_text(encoding="utf-8").splitlines():
        bars = line.count("|") if line.startswith("|") else 0
        assert not (bars and before) or bars == before, line
        before = bars


def test_what_is_done_is_not_done_again(done: Path, solver: Solver) -> None:
    result = reproduce("--quick", "-o", done)
    assert result.exit_code == 0, result.output
    assert solver.solved == []
    assert result.output.count("was there") == len(ORDER) + 1
    assert result.output.splitlines()[-1] == f"Written to {done / 'results.md'}"
    assert "| this call | kept |" in (done / "results.md").read_text(encoding="utf-8")


def test_other_settings_are_solved_anew(done: Path, solver: Solver) -> None:
    result = reproduce("--out", done, "--starts", 2)
    assert result.exit_code == 0, result.output
    assert solver.solved == list(ORDER)
    page = (done / "results.md").read_text(encoding="utf-8")
    assert "A quick check" not in page
    assert "mapd-orthosis, 2 starts:" in page
    assert "+25.0 %" in page


@pytest.mark.parametrize("damage", ["truncated", "motion", "config"])
def test_a_damaged_or_other_run_is_solved_again(done: Path, solver: Solver, damage: str) -> None:
    run = done / "runs" / "mapd-orthosis"
    if damage == "truncated":
        (run / "metrics.json").write_text('{"run_format": 1, ', encoding="utf-8")
    elif damage == "motion":
        (run / "motion.npz").unlink()
    else:
        config = run / "config.resolved.yaml"
        text = config.read_text(encoding="utf-8")
        config.write_text(text.replace("friction: 0.8", "friction: 0.7"), encoding="utf-8")
    result = reproduce("--quick", "--out", done)
    assert result.exit_code == 0, result.output
    assert solver.solved == ["mapd-orthosis"]


def test_a_problem_that_does_not_converge_is_named(solver: Solver, tmp_path: Path) -> None:
    solver.failing = {"mapd-orthosis"}
    result = reproduce("--quick", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "Error: mapd-orthosis did not converge" in result.output
    page = (tmp_path / "out" / "results.md").read_text(encoding="utf-8")
    assert "**Did not converge:** mapd-orthosis" in page
    assert "not computed: mapd-orthosis did not converge" in page
    assert "not computed: mapd-barefoot and mapd-orthosis did not both converge" in page
    solver.solved.clear()
    solver.failing = set()
    assert reproduce("--quick", "--out", tmp_path / "out").exit_code == 0
    assert solver.solved == ["mapd-orthosis"]


def test_a_stopped_call_goes_on(
    solver: Solver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopping(case: Case, *rest: object) -> GaitSolution:
        if case.config.problem == "mapd-barefoot":
            raise KeyboardInterrupt
        return solver(case, *rest)

    with monkeypatch.context() as patch:
        patch.setattr(study_run, "_solve", stopping)
        result = reproduce("--quick", "--out", tmp_path / "out")
    assert result.exit_code == 1
    assert "stopped by the user in mapd-barefoot" in result.output
    assert reproduce("--quick", "--out", tmp_path / "out").exit_code == 0
    assert solver.solved == list(ORDER)


@pytest.mark.parametrize("wrong", ["file", "foreign", "foreign run"])
def test_other_folders_are_refused_before_anything_is_solved(
    solver: Solver, tmp_path: Path, wrong: str
) -> None:
    folder = tmp_path / "out"
    if wrong == "file":
        folder.write_text("mine", encoding="utf-8")
    elif wrong == "foreign":
        folder.mkdir()
        (folder / "thesis.tex").write_text("mine", encoding="utf-8")
    else:
        (folder / "runs" / "mapd-healthy").mkdir(parents=True)
        (folder / "runs" / "mapd-healthy" / "thesis.tex").write_text("mine", encoding="utf-8")
    result = reproduce("--quick", "--out", folder)
    assert result.exit_code == 2
    assert result.output.count("\n") == 1
    assert "Traceback" not in result.output
    assert solver.solved == []


def test_a_missing_folder_of_c3d_files_is_refused(solver: Solver, tmp_path: Path) -> None:
    result = reproduce("--quick", "--out", tmp_path / "out", "--c3d", tmp_path / "nowhere")
    assert result.exit_code == 2
    assert result.output.count("Error: ") == 1
    assert solver.solved == []


def test_inverse_dynamics_is_kept_until_something_changes(tmp_path: Path) -> None:
    config = inverse_config("default", None)
    assert config is not None
    file = tmp_path / "default.json"
    first, kept = inverse_result(config, file)
    assert not kept
    assert inverse_result(config, file) == (first, True)
    file.write_text(file.read_text(encoding="utf-8")[:-20], encoding="utf-8")
    assert inverse_result(config, file) == (first, False)
    other = config.model_copy(update={"motion_cutoff": 8.0})
    assert not inverse_result(other, file)[1]


@pytest.mark.parametrize(
    ("number", "ours", "shown", "off"),
    [
        (("0.60", "m/s", ""), Ours(0.636), "0.636", "+0.036 (+6 %)"),
        (("0.60", "m/s", ""), Ours(0.6098), "0.610", "as printed"),
        (("12.95", "deg", ""), Ours(0.1745329), "10.00", "-2.95 (-23 %)"),
        (("4", "h", ""), Ours(144.0), "144 s", "1/100 of it"),
        (("0.30", "m", "0.43"), Ours(0.35, 0.31, 0.42), "0.310 to 0.420",
         "ends +0.010 and -0.010"),
        (("95.7", "N m/rad", "135.5"), Ours(92.0), "92.0", "3.7 below"),
        (("95.7", "N m/rad", "135.5"), Ours(100.0), "100.0", "inside"),
        (("95.7", "N m/rad", "135.5"), Ours(140.0), "140.0", "4.5 above"),
        (("2.2", "s/m", ""), "not computed: why", "not computed: why", "-"),
    ],
)  # fmt: skip
def test_numbers_stand_in_the_unit_of_the_article(
    number: tuple[str, str, str], ours: Ours | str, shown: str, off: str
) -> None:
    text, unit, upper = number
    row = Row(PaperNumber("mapd-barefoot", "walking_speed", text, unit, "table 4", upper), ours)
    assert (ours_text(row), deviation(row)) == (shown, off)


def test_figures_of_the_article_are_drawn(done: Path, tmp_path: Path) -> None:
    runs = {name: evaluated(done / "runs" / name, True, {}) for name in SEVERAL}
    results = Results(runs, {}, {}, True)
    saved = save_paper_figures(results, tmp_path / "figures")
    assert {name.split(".")[0][:8] for name, _ in saved} == {f"figure-{n}" for n in range(1, 8)}
    for name, caption in saved:
        assert (tmp_path / "figures" / name).read_bytes()[:4] == b"\x89PNG"
        assert (tmp_path / "figures" / name.replace(".png", ".svg")).is_file()
        assert caption.startswith(f"Figure {name[7]}")


@pytest.mark.slow
def test_the_whole_quick_check(tmp_path: Path) -> None:
    result = reproduce("--quick", "--out", tmp_path / "out", "--quiet")
    failed = "did not converge" in result.output
    assert result.exit_code == int(failed), result.output
    page = (tmp_path / "out" / "results.md").read_text(encoding="utf-8")
    files = re.findall(r"\]\((figures/[^)]+)\)", page)
    assert files
    assert all((tmp_path / "out" / file).is_file() for file in files)
    for problem in ORDER:
        metrics = json.loads((tmp_path / "out" / "runs" / problem / "metrics.json").read_text())
        assert metrics["smoke"]
    shutil.rmtree(tmp_path / "out" / "figures")
    assert reproduce("--quick", "--out", tmp_path / "out", "--quiet").exit_code == int(failed)
