"""The trade-off: chain, dominance, refined meshes, files, figure, words, refusals, restart."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from made_neighbours import LIMIT, Fails, MadeResolver, made_measures, made_run, speed
from pathwalker_cli.case import load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.studies import base, neighbours
from pathwalker_cli.studies import tradeoff as module
from pathwalker_cli.studies.base import Work, load_study
from pathwalker_cli.studies.tradeoff import STUDY, TradeoffStudy, chain, tradeoff_of
from pathwalker_cli.studies.tradeoff.figures import labels, tradeoff_figure
from pathwalker_cli.studies.tradeoff.result import (
    FrontPoint,
    Tradeoff,
    front_of,
    judged,
    tradeoff_lines,
)

pytestmark = pytest.mark.usefixtures("sketched")

FOUR = ("walking_speed_weights=[0, 0.5, 1, 2]",)
ROUGH = (5e-3, 5e-2)
"""Re-integration errors that the mesh tolerances of the config refuse."""

Make = Callable[..., tuple[Tradeoff, MadeResolver]]


def point(name: str, speed: float, effort: float, **changes: Any) -> FrontPoint:
    """Return a point of a front."""
    numbers = {"walking_speed": speed, "effort_per_distance": effort}
    made = FrontPoint(float(name[1:]), "converged", "base", None, numbers, (1e-4, 1e-3), 107,
                      0.2, 1, 12)  # fmt: skip
    return replace(made, **changes)


@pytest.fixture
def made(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Make:
    """Return a function that computes a trade-off without a solve."""
    monkeypatch.setattr(module, "measures", made_measures)

    def make(
        changes: tuple[str, ...] = FOUR, fails: Fails | None = None, errors: Any = (5e-4, 5e-3)
    ) -> tuple[Tradeoff, MadeResolver]:
        resolver = MadeResolver(load_case("mapd-orthosis"), errors=errors)
        resolver.fails = fails or resolver.fails
        monkeypatch.setattr(neighbours, "resolver_of", lambda run: resolver)
        study = load_study("tradeoff", TradeoffStudy, changes)
        run = made_run(tmp_path)
        return tradeoff_of(study, run, Work(tmp_path)), resolver

    return make


@pytest.fixture
def refined(monkeypatch: pytest.MonkeyPatch) -> dict[Path, dict[str, Any]]:
    """Let solves on finer meshes end at once; return what they left behind, by folder."""
    runs: dict[Path, dict[str, Any]] = {}
    status = {2.0: "the mesh does not reach the accuracy asked for"}

    class Solver:
        def __init__(self, case: Any, log: Any) -> None:
            self.case = case

        def solve(self, motion: Any) -> Any:
            return self.case

    def write(folder: Path, case: Any, lines: Any) -> None:
        config = case.config
        weight = config.cost.walking_speed_weight
        numbers = {"cost": 0.3, "effort_per_distance": 0.2 + weight, "walking_speed": speed(config)}
        runs[folder] = {
            **numbers, "status": status.get(weight, "converged"), "intervals": 140,
            "reintegration_position_error": 3e-4, "reintegration_velocity_error": 4e-3,
            "seconds_solve": 9.0, **dict.fromkeys(STIFFNESSES, 50.0),
        }  # fmt: skip

    monkeypatch.setattr(module, "GaitSolver", Solver)
    monkeypatch.setattr(module, "write_run", write)
    monkeypatch.setattr(module, "done_run", lambda folder, case: runs.get(folder))
    monkeypatch.setattr(
        module, "load_run",
        lambda folder, allow_unconverged: SimpleNamespace(metrics=runs[folder]),
    )  # fmt: skip
    return runs


# Config


def test_the_shipped_config_holds_the_defaults() -> None:
    assert load_study("tradeoff", TradeoffStudy) == TradeoffStudy(base="mapd-orthosis")
    assert len(TradeoffStudy(base="").walking_speed_weights) >= 8


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("walking_speed_weights=[1, 0.5]", "does not rise"),
        ("walking_speed_weights=[1]", "2"),
        ("walking_speed_weights=[-1, 0]", "0"),
        ("weights=[0, 1]", "weights"),
    ],
)
def test_bad_studies_are_refused(change: str, words: str) -> None:
    with pytest.raises(ConfigError, match=re.escape(words)):
        load_study("tradeoff", TradeoffStudy, (change,))


# Chain and dominance


def test_the_base_stands_in_the_chain_by_its_weight() -> None:
    graph = chain((0.0, 1.0, 3.0), 2.0)
    assert graph.edges == (("w0", "w1"), ("w1", "base"), ("base", "w3"))
    assert graph.outwards == ("base", "w1", "w3", "w0")
    assert chain((2.0, 3.0), 2.0).edges == (("base", "w2"), ("w2", "w3"))


def test_a_point_is_dominated_by_one_that_is_no_slower_and_no_more_costly(made: Make) -> None:
    points = judged((
        point("w0", 0.6, 0.25),
        point("w1", 0.8, 0.40),
        point("w2", 0.7, 0.45),  # slower and more costly than w1
        point("w3", 0.6, 0.25 + 1e-6),  # the same as w0
        point("w4", 0.9, 0.60),
    ))  # fmt: skip
    tradeoff = replace(made()[0], points=points, front=front_of(points))
    assert [p.walking_speed_weight for p in points if p.dominated] == [2.0]
    assert [p.walking_speed_weight for p in tradeoff.front_points] == [0.0, 3.0, 1.0, 4.0]


def test_points_in_one_place_share_a_label() -> None:
    points = (point("w0", 0.6, 0.25), point("w0.5", 0.6, 0.25), point("w1", 0.8, 0.4))
    assert [text for _, text in labels(points)] == ["0 to 0.5", "1"]


# The study without a solve


def test_the_front_rises(made: Make) -> None:
    tradeoff, _ = made()
    np.testing.assert_allclose([p.speed for p in tradeoff.points], [0.636, 0.636, 0.736, 0.936])
    assert [p.mesh for p in tradeoff.points] == ["base"] * 4
    assert not any(p.dominated for p in tradeoff.points)
    assert tradeoff.recorded_walking_speed is not None
    assert tradeoff.seconds_refined == 0.0


def test_weights_that_fail_stay_in_the_table(made: Make, tmp_path: Path) -> None:
    tradeoff, _ = made(fails=lambda config: config.cost.walking_speed_weight > 1.0)
    assert [p.solved for p in tradeoff.points] == [True, True, True, False]
    assert "no solve converged" in "\n".join(tradeoff_lines(tradeoff))
    (tmp_path / "out").mkdir()
    STUDY.write(tradeoff, tmp_path / "out")
    with (tmp_path / "out" / "tradeoff.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["converged"] * 3 + ["no solve converged"]
    assert rows[3]["walking_speed [m/s]"] == ""


def test_points_too_rough_are_solved_on_finer_meshes(
    made: Make, refined: dict[Path, dict[str, Any]], tmp_path: Path
) -> None:
    tradeoff, _ = made(errors=ROUGH)
    assert refined.keys() == {tmp_path / "runs" / f"w{w:g}" for w in (0, 0.5, 1, 2)}
    assert [p.mesh for p in tradeoff.points] == ["refined"] * 3 + ["inaccurate"]
    assert [p.intervals for p in tradeoff.points[:3]] == [140] * 3
    assert tradeoff.points[2].effort == 1.2
    assert tradeoff.points[3].errors == ROUGH, "a finer mesh that fails changes no number"
    assert tradeoff.seconds_refined == 36.0
    text = "\n".join(tradeoff_lines(tradeoff))
    assert "finer mesh, 140 intervals" in text
    assert "exceeded at weight 2" in text
    assert "on a finer mesh: the mesh does not reach" in text
    entries = [text.get_text() for text in tradeoff_figure(tradeoff).legends[0].get_texts()]
    assert "mesh too coarse" in entries


def test_without_refinement_rough_points_are_flagged(made: Make) -> None:
    tradeoff, _ = made((*FOUR, "refine=false"), errors=ROUGH)
    assert [p.mesh for p in tradeoff.points] == ["inaccurate"] * 4


def test_a_second_call_solves_nothing(made: Make) -> None:
    first, resolver = made()
    assert len(resolver.solved) == first.solves
    second, resolver = made()
    assert resolver.solved == []
    assert second.points == first.points


def test_a_failed_solve_is_not_tried_again(made: Make) -> None:
    def never(config: Any) -> bool:
        return config.cost.walking_speed_weight > 0.0

    first, _ = made(fails=never)
    assert first.failed_solves > 0
    second, resolver = made(fails=never)
    assert resolver.solved == []
    assert {LIMIT} >= {p.status for p in second.points if not p.solved and p.status == LIMIT}


def test_a_fit_has_no_trade_off() -> None:
    with pytest.raises(ConfigError, match="follows a recording"):
        STUDY.require(load_case("ls-barefoot").config, "base")


# Files, figure, command


@pytest.mark.drawn
def test_files_and_figure(made: Make, tmp_path: Path) -> None:
    tradeoff, _ = made()
    (tmp_path / "out").mkdir()
    STUDY.write(tradeoff, tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} <= STUDY.files
    for extension in ("png", "svg"):
        assert (tmp_path / "out" / "figures" / f"tradeoff.{extension}").stat().st_size > 10_000
    figure = tradeoff_figure(tradeoff)
    assert [axes.get_title() for axes in figure.axes] == [
        "What speed costs", "Springs along the front",
    ]  # fmt: skip
    lines = figure.axes[1].lines
    assert len({(line.get_linestyle(), line.get_marker()) for line in lines}) == 4


def test_barefoot_shows_no_springs(made: Make) -> None:
    tradeoff = replace(made()[0], condition="barefoot")
    assert len(tradeoff_figure(tradeoff).axes) == 1
    assert "K_D" not in "\n".join(tradeoff_lines(tradeoff))


def run(*words: object) -> Any:
    return CliRunner().invoke(cli, ["tradeoff", *map(str, words)])


def test_the_command_writes_everything(
    made: Make, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made()
    monkeypatch.setattr(base, "base_run", lambda *_: made_run(tmp_path))
    words = ("tradeoff", "--out", tmp_path / "out", "--set", *FOUR)
    done = run(*words)
    assert done.exit_code == 0, done.output
    assert "effort" in done.stdout
    assert "w1.from.w0.5-0" in done.stderr
    assert {path.name for path in (tmp_path / "out").iterdir()} == STUDY.files - {"runs"}
    again = run(*words, "--quiet")
    assert (again.exit_code, again.output) == (0, "")


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--set", "refine=perhaps"], "refine"),
        (["--run", "nowhere"], "no such folder"),
        (["--set", "set={cost.speed: 1}"], "speed"),
    ],
)
def test_refusals(tmp_path: Path, words: list[str], sentence: str) -> None:
    done = run("tradeoff", "--out", tmp_path / "out", *words)
    assert done.exit_code == 2
    assert sentence in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1
