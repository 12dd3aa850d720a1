"""The command `perturb`: every spring moved, changes beside the article, and reasons."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from conftest import made_result
from made_neighbours import made_run
from neighbours_stand_in import BEST, StandInOptimum, StandInResolver, stand_in_measures
from pathwalker_cli.case import load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.evaluation.paper import PATIENT, paper_number
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.results import run_folder
from pathwalker_cli.studies import perturbation as module
from pathwalker_cli.studies.base import Work, base_run, load_study, require_optimum
from pathwalker_cli.studies.measures import COMPARED
from pathwalker_cli.studies.neighbours import Journal
from pathwalker_cli.studies.perturbation import PerturbationStudy, perturb
from pathwalker_cli.studies.perturbation.result import perturbation_lines, remark

pytestmark = pytest.mark.usefixtures("sketched")

MadeSolution = Callable[..., GaitSolution]


@pytest.fixture
def resolver(monkeypatch: pytest.MonkeyPatch) -> StandInResolver:
    """Let a stand-in solve all neighbours."""
    stand_in = StandInResolver(load_case("mapd-orthosis"))
    monkeypatch.setattr(module, "resolver_of", lambda run, tolerance: stand_in)
    monkeypatch.setattr(module, "measures", stand_in_measures)
    return stand_in


@pytest.fixture
def call(made_runs: Path, resolver: StandInResolver, tmp_path: Path) -> Callable[..., Result]:
    """Return a function that runs the command on the run with orthoses."""

    def run(*words: object, problem: str = "mapd-orthosis", config: str = "perturbation") -> Result:
        options = ["--run", made_runs / problem, "--out", tmp_path / "out", *words]
        return CliRunner().invoke(cli, ["perturb", config, *map(str, options)])

    return run


def table(folder: Path) -> list[dict[str, str]]:
    with (folder / "perturbation.csv").open(encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_shipped_config_holds_the_defaults() -> None:
    study = load_study("perturbation", PerturbationStudy)
    assert study == PerturbationStudy(base="mapd-orthosis")


@pytest.mark.drawn
def test_every_free_spring_is_moved_and_stands_beside_the_article(
    call: Callable[..., Result], resolver: StandInResolver, tmp_path: Path
) -> None:
    result = call()
    assert result.exit_code == 0, result.output
    rows = table(tmp_path / "out")
    assert [row["spring"] for row in rows] == ["", *STIFFNESSES]
    for row, name in zip(rows[1:], STIFFNESSES, strict=True):
        assert float(row["stiffness [N m/rad]"]) == pytest.approx(0.95 * BEST[name])
        assert float(row[f"{name} [N m/rad]"]) == pytest.approx(0.95 * BEST[name])
        for key in COMPARED:
            number = paper_number("mapd-orthosis", f"{key}_after_-5%_{name}")
            assert number is not None
            printed = float(row[f"change of {key} in the article [%]"])
            assert printed == pytest.approx(float(number.text))
    inside = rows[1 + STIFFNESSES.index("dorsiflexion_stiffness_left")]
    cost = float(inside["cost [1]"]) / float(rows[0]["cost [1]"]) - 1.0
    assert float(inside["change of cost [%]"]) == pytest.approx(100.0 * cost, rel=1e-5)
    assert len(resolver.solved) == 4
    assert all(case.config.solver.tolerance == 1e-8 for case in resolver.solved)
    for extension in ("png", "svg"):
        assert (tmp_path / "out" / "figures" / f"perturbation.{extension}").stat().st_size > 1000


def test_the_table_tells_why_the_cost_falls(call: Callable[..., Result], tmp_path: Path) -> None:
    output = call().output
    assert "K_P left: 5 -> 4.75 N m/rad; the optimum sits at its lower limit of 5" in output
    assert "softer than any in [5, 92]: the cost falls" in output
    assert "K_D right: 92 -> 87.4 N m/rad; the optimum sits at its upper limit" in output
    assert "falls only outside the range of real springs (K_P left x 0.95)" in output
    assert "NO TRUE OPTIMUM" not in output
    content = json.loads((tmp_path / "out" / "perturbation.json").read_text(encoding="utf-8"))
    assert content["patient"] == PATIENT
    assert content["at_limit"] == {
        "dorsiflexion_stiffness_right": "upper",
        "plantarflexion_stiffness_left": "lower",
    }
    falling = [row["spring"] for row in content["rows"] if row["cost_falls"]]
    assert falling == ["plantarflexion_stiffness_left"]
    assert not any(row["no_true_optimum"] for row in content["rows"])


def test_a_cheaper_spring_that_was_allowed_is_no_optimum(
    call: Callable[..., Result], monkeypatch: pytest.MonkeyPatch
) -> None:
    def better(optimum: Any) -> dict[str, float]:
        numbers = stand_in_measures(optimum)
        prescribed = "dorsiflexion_stiffness_left" in optimum.config.bounds.stiffness
        return {**numbers, "cost": numbers["cost"] * (0.98 if prescribed else 1.0)}

    monkeypatch.setattr(module, "measures", better)
    output = call().output
    assert "no true optimum: better by 1.9 %" in output
    assert "NO TRUE OPTIMUM: the cost falls for K_D left x 0.95, by 1.9 % at best" in output


@pytest.mark.parametrize(
    ("end", "stiffness", "fall", "words", "explained"),
    [
        ("", 20.0, 0.0, "", False),
        ("", 20.0, -0.02, "no true optimum: better by 2 %", False),
        ("lower", 4.0, -0.02, "softer than any in [5, 92]: the cost falls", True),
        ("lower", 4.0, 0.0, "softer than any in [5, 92]: the cost may fall", True),
        ("upper", 99.0, -0.02, "stiffer than any in [5, 92]: the cost falls", True),
        ("upper", 80.0, 0.0, "upper limit of 92 N m/rad; moving into the range raises", False),
        ("lower", 6.0, 0.0, "lower limit of 5 N m/rad; moving into the range raises", False),
        ("upper", 80.0, -0.02, "no true optimum", False),
        ("", 4.9, -0.02, "4.9 N m/rad is softer", True),
    ],
)
def test_remarks_follow_from_limits_and_cost(
    end: str, stiffness: float, fall: float, words: str, explained: bool
) -> None:
    note, reason = remark(end, stiffness, (5.0, 92.0), fall)
    assert words in note
    assert bool(note) == bool(words)
    assert reason is explained


def test_numbers_beside_the_article_only_for_its_factor(call: Callable[..., Result]) -> None:
    output = call("--set", "factors=[0.9, 1.1]").output
    assert "article" not in output
    assert "K_D left x 0.9 " in output
    assert "K_D left x 1.1 " in output


def test_further_factors_start_from_nearer_ones(
    made_runs: Path, resolver: StandInResolver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    starts = []
    solve = resolver.resolve
    monkeypatch.setattr(
        resolver,
        "resolve",
        lambda case, start, insist: (starts.append(start.config), solve(case, start, insist))[1],
    )
    study = PerturbationStudy(
        base="x", factors=(0.8, 1.2, 0.9), springs=("dorsiflexion_stiffness_left",)
    )
    run = run_folder.load_run(made_runs / "mapd-orthosis")
    result = perturb(study, run, Work(tmp_path))
    held = [c.bounds.stiffness.get("dorsiflexion_stiffness_left") for c in starts]
    assert held == [None, None, (36.0, 36.0)]
    assert [row.factor for row in result.rows] == [0.8, 1.2, 0.9]


def test_a_second_call_solves_nothing(
    call: Callable[..., Result], resolver: StandInResolver
) -> None:
    first = call().output
    resolver.solved.clear()
    again = call()
    assert again.exit_code == 0
    assert resolver.solved == []
    without_time = [line for line in again.output.splitlines() if " in all" not in line]
    assert without_time == [line for line in first.splitlines() if " in all" not in line]
    assert call("--set", "tolerance=1e-7").exit_code == 0
    assert len(resolver.solved) == 4, "another tolerance is another answer"


def test_what_does_not_converge_is_told_and_leads_to_exit_code_1(
    call: Callable[..., Result], resolver: StandInResolver, tmp_path: Path
) -> None:
    resolver.fails = lambda config: "plantarflexion_stiffness_left" in config.bounds.stiffness
    result = call()
    assert result.exit_code == 1
    assert "no solution was found for K_P left x 0.95" in result.output
    row = table(tmp_path / "out")[-1]
    assert row["status"] == "the iteration limit was reached"
    assert row["cost [1]"] == row["change of cost [%]"] == ""
    assert row["note"].startswith("not converged")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--set", "springs=[K_D]"), "springs[0]"),
        (("--set", "factors=[1.0]"), "names a factor twice, or 1"),
        (("--set", "factors=[50]"), "is it in percent?"),
        (("--set", "factors=[0.15]"), "is 0.9 N m/rad"),
        (("--set", "tolerance=0.1"), "1e-10 to 0.0001"),
        (("--set", "set={bounds.least_walking_speed: 0.7}"), "--run"),
        (("--run", "nowhere"), "no such folder"),
    ],
)
def test_refusals(call: Callable[..., Result], words: tuple[str, ...], message: str) -> None:
    result = call(*words)
    assert result.exit_code == 2, result.output
    assert message in result.output
    assert len(result.output.splitlines()) == 1


def test_a_barefoot_run_has_no_springs(call: Callable[..., Result]) -> None:
    result = call(problem="mapd-barefoot")
    assert result.exit_code == 2
    assert "mapd-barefoot is walked barefoot and has no springs" in result.output
    assert len(result.output.splitlines()) == 1


def test_a_barefoot_base_is_refused_before_it_is_solved(tmp_path: Path) -> None:
    options = ["--set", "base=mapd-barefoot", "--out", str(tmp_path / "out")]
    result = CliRunner().invoke(cli, ["perturb", "perturbation", *options])
    assert result.exit_code == 2
    assert "has no springs" in result.output
    assert not (tmp_path / "out").exists()


def test_a_prescribed_spring_has_no_optimum(
    call: Callable[..., Result], resolver: StandInResolver
) -> None:
    held = {"dorsiflexion_stiffness_left": (40.0, 40.0)}
    resolver.case = resolver.case.with_values({"bounds.stiffness": held})
    output = call().output
    assert "K_D left" not in output
    result = call("--set", "springs=[dorsiflexion_stiffness_left]")
    assert result.exit_code == 2
    assert "is prescribed by the problem and has no optimum" in result.output


def test_a_folder_with_something_else_is_refused(
    call: Callable[..., Result], tmp_path: Path
) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "thesis.txt").touch()
    result = call()
    assert result.exit_code == 2
    assert "thesis.txt" in result.output


def test_an_optimum_that_cannot_be_solved_again_is_refused(tmp_path: Path) -> None:
    run = made_run(tmp_path)
    failed = replace(made_result(), status="the iteration limit was reached")
    resolver: Any = SimpleNamespace(optimum=StandInOptimum(run.case, failed))
    with pytest.raises(NotConvergedError, match="a tolerance of 1e-08: the iteration limit"):
        require_optimum(resolver, run, 1e-8)


def test_what_was_solved_before_needs_no_optimum(tmp_path: Path) -> None:
    run = made_run(tmp_path)

    class Unasked(StandInResolver):
        @property
        def optimum(self) -> StandInOptimum:
            raise AssertionError("the optimum is solved")

    for solved in (1, 0):
        resolver: Any = Unasked(run.case)
        journal = Journal(tmp_path / "points", run, resolver)
        assert journal.resolve("softer", run.case).converged
        assert (journal.solved, len(resolver.solved)) == (solved, solved)


@pytest.mark.slow
def test_real_neighbours_of_a_coarse_optimum(tmp_path: Path) -> None:
    coarse = {"mesh.intervals": 16, "mesh.refinements": 0, "solver.first_tolerance": 1e-6}
    run = base_run(load_case("mapd-orthosis").with_values(coarse), tmp_path / "base")
    result = perturb(PerturbationStudy(base="x"), run, Work(tmp_path))
    assert all(row.values for row in result.rows)
    assert "\n".join(perturbation_lines(result))
    for row in result.rows:
        assert row.values[row.name] == pytest.approx(0.95 * result.optimum[row.name], rel=1e-4)
        assert row.iterations < 80
        assert abs(row.changes["cost"]) < 0.05
        moved = [abs(row.changes[key]) for key in COMPARED]
        assert np.isfinite(moved).all()
        if row.value > result.ranges[row.name][0]:
            assert not row.cost_falls, "an optimum within the range"
