"""The landscape: grid, region, files, figure, words, refusals, restart, and one real solve."""

from __future__ import annotations

import csv
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from made_neighbours import LIMIT, Fails, MadeResolver, made_measures, made_run
from pathwalker_cli.case import load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.errors import ConfigError, NotConvergedError
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.studies import base, neighbours
from pathwalker_cli.studies import landscape as module
from pathwalker_cli.studies.base import Work, load_study
from pathwalker_cli.studies.landscape import (
    STUDY,
    Axis,
    LandscapeStudy,
    axis_values,
    grid,
    landscape_of,
    varied_springs,
    with_springs,
)
from pathwalker_cli.studies.landscape.figures import landscape_figure
from pathwalker_cli.studies.landscape.result import Landscape, region_of
from pathwalker_cli.studies.landscape.text import landscape_lines, write_tables

pytestmark = pytest.mark.usefixtures("sketched")

COARSE = ("side=right", "dorsiflexion=[5, 13.2, 34.8, 92]", "plantarflexion=[5, 20, 80]")

Make = Callable[..., tuple[Landscape, MadeResolver]]


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Return a function that computes a landscape without a solve."""
    monkeypatch.setattr(module, "measures", made_measures)

    def make(
        changes: tuple[str, ...] = COARSE,
        fails: Fails | None = None,
        leaps: bool = False,
        errors: tuple[float, float] = (5e-4, 5e-3),
    ) -> tuple[Landscape, MadeResolver]:
        resolver = MadeResolver(load_case("mapd-orthosis"), leaps=leaps, errors=errors)
        resolver.fails = fails or resolver.fails
        monkeypatch.setattr(neighbours, "resolver_of", lambda run: resolver)
        study = load_study("landscape", LandscapeStudy, changes)
        found = landscape_of(study, made_run(tmp_path), Work(tmp_path))
        return found, resolver

    return make


# Config


def test_the_shipped_config_holds_the_defaults() -> None:
    assert load_study("landscape", LandscapeStudy) == LandscapeStudy(base="mapd-orthosis")


def test_axes() -> None:
    low, high = 5.0, 92.0
    found = axis_values(Axis(points=3), (low, high), "dorsiflexion")
    np.testing.assert_allclose(found, [low, np.sqrt(low * high), high])
    linear = Axis.model_validate({"from": 10.0, "to": 30.0, "points": 3, "spacing": "linear"})
    np.testing.assert_allclose(axis_values(linear, (low, high), ""), [10.0, 20.0, 30.0])
    given = Axis.model_validate([7, 9, 40])
    np.testing.assert_allclose(axis_values(given, (low, high), ""), [7.0, 9.0, 40.0])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("dorsiflexion=[40, 20]", "does not rise"),
        ("dorsiflexion=[40]", "has one value"),
        ("dorsiflexion={from: 80, to: 20}", "does not rise"),
        ("dorsiflexion={values: [20, 40], from: 5}", "has values and ends"),
        ("dorsiflexion={points: 1}", "2"),
        ("tolerance=5", "is it in percent?"),
        ("side=middle", "right"),
        ("stiffness=3", "stiffness"),
    ],
)
def test_bad_studies_are_refused(change: str, words: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(words)):
        load_study("landscape", LandscapeStudy, (change,))


def test_an_end_beyond_the_range_of_the_base_is_refused() -> None:
    axis = Axis.model_validate({"from": 95.0})
    with pytest.raises(ConfigError, match="dorsiflexion: runs from 95 to 92"):
        axis_values(axis, (5.0, 92.0), "dorsiflexion")


# Grid and region


def test_the_grid_joins_the_optimum_to_the_corners_of_its_cell() -> None:
    k = np.array([10.0, 20.0, 40.0])
    graph = grid(k, k, (30.0, 15.0))
    assert graph.neighbours["optimum"] == ("d2-p1", "d2-p2", "d3-p1", "d3-p2")
    assert graph.neighbours["d2-p2"] == ("optimum", "d1-p2", "d2-p1", "d2-p3", "d3-p2")
    assert len(graph.outwards) == 10
    outside = grid(k, k, (92.0, 5.0))
    assert outside.neighbours["optimum"] == ("d3-p1",)


def test_springs_that_exist_stand_on_the_axes() -> None:
    found = axis_values(Axis(points=4), (5.0, 92.0), "dorsiflexion", (40.1, 91.7, 200.0))
    assert found == pytest.approx([5.0, 13.2, 40.1, 91.7], abs=0.01)
    assert LandscapeStudy(base="").side == "both", "a pair of orthoses is fitted on two legs"


@pytest.mark.parametrize("side", ["right", "left", "both"])
def test_springs_of_a_side_are_prescribed_and_others_stay(side: str) -> None:
    base = load_case("mapd-orthosis")
    sides = LandscapeStudy(base="", side=side).sides
    springs = varied_springs(LandscapeStudy(base="", side=side), base.walker().unknowns)
    given = with_springs(base, springs, (40.0, 10.0)).config.bounds.stiffness
    assert given == {
        f"{kind}_stiffness_{s}": (k, k)
        for kind, k in (("dorsiflexion", 40.0), ("plantarflexion", 10.0)) for s in sides
    }  # fmt: skip


def test_the_region_is_linear_between_points() -> None:
    k_d, k_p = np.array([10.0, 20.0, 30.0]), np.array([5.0, 15.0])
    increase = np.array([[0.30, 0.40], [0.10, 0.20], [0.00, 0.02]])
    region = region_of(k_d, k_p, increase, 0.05)
    assert region is not None
    np.testing.assert_allclose(region.k_d, [25.0, 30.0])
    np.testing.assert_allclose(region.k_p, [5.0, 15.0])
    assert (region.points, region.share) == (2, 2 / 6)
    assert region.ends == ("K_D upper", "K_P lower", "K_P upper")


def test_points_without_a_solution_are_no_part_of_the_region() -> None:
    increase = np.array([[np.nan, 0.2], [0.0, np.nan]])
    region = region_of(np.array([1.0, 2.0]), np.array([1.0, 2.0]), increase, 0.05)
    assert region is not None
    assert (region.points, region.share, region.k_d) == (1, 0.5, (2.0, 2.0))
    assert region_of(np.array([1.0, 2.0]), np.array([1.0, 2.0]), increase + 1.0, 0.05) is None


# The study without a solve


def test_cost_rises_away_from_the_optimum(made: Make) -> None:
    landscape, _ = made()
    assert landscape.bests.keys() == {(i, j) for i in range(4) for j in range(3)}
    assert landscape.best.name == "optimum"
    increase = landscape.increase
    assert (increase > 0.0).all()
    assert (np.diff(increase, axis=0) < 0.0).all(), "stiffer against dorsiflexion is better here"
    assert landscape.released is None
    assert landscape.failed == ()
    assert landscape.checks.keys() == {"optimum", "d1-p1", "d1-p3", "d4-p1", "d4-p3"}


def test_a_better_optimum_found_on_the_way_is_said_and_freed(made: Make) -> None:
    landscape, _ = made(leaps=True)
    assert landscape.better_than_start > 0.01
    assert landscape.released is not None
    assert landscape.released.cost < landscape.optimum.cost
    assert len(landscape.branched) == 12, "the other basin reaches every point"
    text = "\n".join(landscape_lines(landscape))
    assert "the landscape holds a local optimum that is 2.0 % better" in text
    assert "freed from the best" in text


def test_points_that_fail_stay_blank(made: Make) -> None:
    def soft(config: Any) -> bool:
        return config.bounds.stiffness.get("dorsiflexion_stiffness_right", (92.0,))[0] < 6.0

    landscape, _ = made(fails=soft)
    assert [point.name for point in landscape.failed] == ["d1-p1", "d1-p2", "d1-p3"]
    assert np.isnan(landscape.increase[0]).all()
    assert {point.status for point in landscape.failed} == {LIMIT}
    assert landscape.failed_solves > 3, "halfway points were tried"
    landscape_figure(landscape)


def test_tied_sides_have_no_optimum_to_compare_with(made: Make) -> None:
    landscape, resolver = made((*COARSE, "side=both"))
    springs = resolver.solved[-1].config.bounds.stiffness
    assert springs["dorsiflexion_stiffness_right"] == springs["dorsiflexion_stiffness_left"]
    text = "\n".join(landscape_lines(landscape))
    assert "both sides" in text
    assert "not tied" in text
    labels = [text.get_text() for text in landscape_figure(landscape).axes[0].texts]
    assert labels == ["right", "left"], "the article has one point per side"


def test_a_second_call_solves_nothing(made: Make) -> None:
    first, resolver = made(leaps=True)
    assert len(resolver.solved) == first.solves + 1, "the freed one counts apart"
    second, resolver = made(leaps=True)
    assert resolver.solved == []
    assert second.points == first.points


def test_a_stopped_study_goes_on(made: Make) -> None:
    calls = iter(range(7))

    def stops(config: Any) -> bool:
        if next(calls, None) is None:
            raise NotConvergedError("stopped by the user")
        return False

    with pytest.raises(NotConvergedError):
        made(fails=stops)
    landscape, resolver = made()
    assert len(resolver.solved) == landscape.solves - 7


def test_tied_springs_need_a_solution_to_begin_with(made: Make) -> None:
    with pytest.raises(NotConvergedError, match="tied to equal values"):
        made((*COARSE, "side=both"), fails=lambda config: True)


def test_barefoot_has_no_landscape() -> None:
    with pytest.raises(ConfigError, match="springs"):
        STUDY.require(load_case("mapd-barefoot").config, "base")


# Files, figure, words


@pytest.mark.drawn
def test_files(made: Make, tmp_path: Path) -> None:
    landscape, _ = made(leaps=True)
    STUDY.write(landscape, made_folder(tmp_path / "out"))
    assert {path.name for path in (tmp_path / "out").iterdir()} <= STUDY.files
    with (tmp_path / "out" / "landscape.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == len(landscape.points)
    best = [row for row in rows if row["branch"] == "1" and row["point"] != "optimum"]
    found = np.array([float(row["cost_increase [1]"]) for row in best]).reshape(4, 3)
    np.testing.assert_allclose(found, landscape.increase, rtol=1e-8)
    assert "walking_speed [m/s]" in rows[0]
    summary = json.loads((tmp_path / "out" / "landscape.json").read_text(encoding="utf-8"))
    assert summary["region"]["points"] == landscape.region.points  # type: ignore[union-attr]
    assert summary["grid_points"] == 12
    for extension in ("png", "svg"):
        assert (tmp_path / "out" / "figures" / f"landscape.{extension}").stat().st_size > 10_000


def test_what_cannot_be_integrated_is_null_in_the_summary(made: Make, tmp_path: Path) -> None:
    write_tables(made(errors=(5e-4, np.inf))[0], tmp_path)
    checks = json.loads((tmp_path / "landscape.json").read_text(encoding="utf-8"))["reintegration"]
    assert {(check["position"], check["velocity"]) for check in checks.values()} == {(5e-4, None)}


def test_the_figure_marks_what_is_there(made: Make) -> None:
    landscape, _ = made(leaps=True)

    def entries(shown: Landscape) -> list[str]:
        box = landscape_figure(shown).axes[4].get_legend()
        return [text.get_text().replace("\n", " ") for text in box.get_texts()]

    assert entries(landscape) == [
        "at most 5 % above the least", "least cost found", "identified in the article", "solved",
        "several local optima, best shown",
    ]  # fmt: skip
    assert "identified in the article" not in entries(replace(landscape, patient="someone else"))


def test_a_mesh_too_coarse_is_said(made: Make) -> None:
    assert made()[0].rough == ()
    landscape, _ = made(errors=(5e-4, 0.2))
    assert landscape.rough == tuple(landscape.checks)
    text = "\n".join(landscape_lines(landscape))
    assert "too coarse at 91.9, 6; 5, 5; 5, 80; 92, 5; 92, 80: 0.001 rad or m" in text


def test_words(made: Make) -> None:
    text = "\n".join(landscape_lines(made()[0]))
    assert "that region, not a point, is the recommendation" in text
    assert "N m/deg" in text
    assert "it reaches the end of the range at K_D upper" in text
    assert "12: 0 without a solution, 0 with several local optima" in text
    assert "the last found nothing new" in text


# The command


def made_folder(folder: Path) -> Path:
    folder.mkdir()
    return folder


def run(*words: object) -> Any:
    return CliRunner().invoke(cli, ["landscape", *map(str, words)])


def test_the_command_writes_everything(
    made: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made()
    monkeypatch.setattr(base, "base_run", lambda *_: made_run(tmp_path))
    words = [word for change in COARSE for word in ("--set", change)]
    done = run("landscape", "--out", tmp_path / "out", *words)
    assert done.exit_code == 0, done.output
    assert "best springs found" in done.stdout
    assert "d4-p1.from.optimum-0" in done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == STUDY.files
    again = run("landscape", "--out", tmp_path / "out", *words, "--quiet")
    assert (again.exit_code, again.output) == (0, "")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--set", "side=up"], "side"),
        (["--run", "nowhere"], "no such folder"),
        (["--run", "nowhere", "--set", "set={starts: 2}"], "leave one of the two out"),
        (["--set", "base=mapd-nothing"], "mapd-nothing"),
    ],
)
def test_refusals(tmp_path: Path, words: list[str], sentence: str) -> None:
    done = run("landscape", "--out", tmp_path / "out", *words)
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_a_foreign_folder_is_refused(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine", encoding="utf-8")
    done = run("landscape", "--out", tmp_path)
    assert done.exit_code == 2
    assert "notes.txt" in done.stderr


@pytest.mark.slow
def test_a_real_landscape(tmp_path: Path) -> None:
    case = load_case("mapd-orthosis", changes=("mesh.intervals=24", "mesh.refinements=0"))
    write_run(tmp_path / "run", GaitSolver(case).solve())
    words = ("--set", "dorsiflexion.points=3", "--set", "plantarflexion.points=3")
    done = run("landscape", "--run", tmp_path / "run", "--out", tmp_path / "out", *words)
    assert done.exit_code == 0, done.output
    summary = json.loads((tmp_path / "out" / "landscape.json").read_text(encoding="utf-8"))
    assert summary["failed_points"] == []
    assert summary["grid_points"] == 9
    costs = (summary[name]["measures"]["cost"] for name in ("best", "start"))
    assert next(costs) <= next(costs) * (1.0 + 1e-6), "to the tolerance of the solves"
    soft = [row for row in csv.DictReader((tmp_path / "out" / "landscape.csv").open())
            if row["point"] == "d1-p3"]  # fmt: skip
    assert float(soft[0]["cost_increase [1]"]) > 0.05, "soft against dorsiflexion costs effort"
