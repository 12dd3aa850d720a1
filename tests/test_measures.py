"""A new measure is one entry of the registry: then it stands everywhere."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any, Final, cast

import generate_run_folder
import numpy as np
import pytest
from click.testing import CliRunner

from conftest import MadeSolution
from helpers import stylised_series
from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import GRAVITY
from pathwalker_cli.evaluation import figures
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.report.gait_page import gait_section
from pathwalker_cli.report.runs import read_runs
from pathwalker_cli.results.text import summary, summary_rows
from pathwalker_cli.stride import measures as registry
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import REGISTRY, TABLES, expanded, measures_in, metrics_of
from pathwalker_cli.stride.stride import NotKnownError, stride_of
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.ledger import CaseTable
from pathwalker_cli.studies.landscape import text as landscape
from pathwalker_cli.studies.measures import all_measures, measures
from pathwalker_cli.studies.sensitivity.result import (
    Sensitivities,
    Sensitivity,
    sensitivity_lines,
)
from pathwalker_cli.studies.tradeoff import result as tradeoff
from pathwalker_cli.studies.uncertainty.text import uncertainty_lines
from report_runs import write_made_run
from test_report import made_landscape, made_tradeoff, made_uncertainty

KEY: Final = "froude_number"
MEANING: Final = "speed squared over gravity times leg length"


@pytest.fixture
def _froude(monkeypatch: pytest.MonkeyPatch) -> None:
    """Add one entry, leave figures out."""
    froude = Measure(
        KEY, "Froude number", "1", MEANING,
        lambda s: s.walking_speed**2 / (GRAVITY * s.walker.leg_length), part="recording",
    )  # fmt: skip
    monkeypatch.setattr(registry, "REGISTRY", (*REGISTRY, froude))
    for name in ("save_evaluation_figures", "save_overlays"):
        monkeypatch.setattr(figures, name, lambda *_: ())


@pytest.fixture
def runs(_froude: None, made_solution: MadeSolution, tmp_path: Path) -> list[Path]:
    """Return a barefoot run and one with orthoses."""
    names = ("mapd-barefoot", "mapd-orthosis")
    return [write_made_run(tmp_path / name, made_solution, name) for name in names]


def metrics_in(run: Path) -> dict[str, Any]:
    return json.loads((run / "metrics.json").read_text(encoding="utf-8"))


def test_a_new_measure_stands_in_every_table_of_runs(runs: list[Path], tmp_path: Path) -> None:
    values = [metrics_in(run)[KEY] for run in runs]
    walker = stylised_series("barefoot").walker
    assert values[0] == pytest.approx(0.6**2 / (GRAVITY * walker.leg_length))
    assert f"Froude number                 {values[0]:.3f}" in summary(
        summary_rows(metrics_in(runs[0]), "x")
    )
    found = CliRunner().invoke(cli, ["evaluate", *map(str, runs), "-o", str(tmp_path / "out")])
    assert "Froude number" in found.output
    evaluation = json.loads((tmp_path / "out" / "evaluation.json").read_text())
    (row,) = (run["quantities"][KEY] for run in evaluation["runs"][:1])
    assert row["value"] == values[0]
    assert row["recorded"]["count"] > 5, "recordings tell it too"
    assert KEY in evaluation["changes"]
    found = CliRunner().invoke(cli, ["compare", *map(str, runs), "--json"])
    assert [*json.loads(found.stdout)["metrics"][KEY]["values"].values()] == values
    section = gait_section(read_runs(runs))
    assert "Froude number" in [row.cells[0] for row in section.tables[0].rows]
    case = cast(
        BatchCase, SimpleNamespace(name="c", patient="p", problem="m", values={}, variant="")
    )
    table = CaseTable([case])
    cells = table.row(case, "converged", metrics_in(runs[0]))
    assert dict(zip(table.header, cells, strict=True))[KEY] == f"{values[0]:.9g}"


def test_a_new_measure_stands_in_every_study(runs: list[Path], tmp_path: Path) -> None:
    optimum = cast(Optimum, SimpleNamespace(series=stylised_series("orthosis"), cost=0.4))
    numbers, metrics = measures(optimum), metrics_in(runs[1])
    assert all_measures(optimum)[KEY] == numbers[KEY] == metrics[KEY]
    for name in ("landscape", "tradeoff"):
        (tmp_path / name).mkdir()
    landscape.write_tables(made_landscape(metrics, numbers), tmp_path / "landscape")
    tradeoff.write_tables(made_tradeoff(metrics, numbers), tmp_path / "tradeoff")
    for name in ("landscape", "tradeoff"):
        with (tmp_path / name / f"{name}.csv").open(encoding="utf-8") as file:
            assert f"{KEY} [1]" in next(csv.reader(file))
    assert "Froude number" in "\n".join(uncertainty_lines(made_uncertainty(metrics, numbers)))
    row = Sensitivity("body_mass", 33.0, numbers, dict.fromkeys(numbers, 0.5))
    found = Sensitivities("mapd-orthosis", "p", 1e-9, numbers, (row,), (), 0, 0, 1.0)
    assert "Froude number" in next(line for i, line in enumerate(sensitivity_lines(found)) if i)


@pytest.mark.usefixtures("_froude")
def test_a_new_measure_stands_in_the_reference() -> None:
    assert f"| `{KEY}` | {MEANING} |" in generate_run_folder.page()


def test_keys_differ_and_tables_name_measures_that_exist() -> None:
    keys = [measure.key for measure in REGISTRY]
    assert len(set(keys)) == len(keys)
    for names in ([(m.label, m.unit) for m in REGISTRY], [(m.section, m.row) for m in REGISTRY]):
        assert len(set(names)) == len(names), "one name, one definition"
    assert {key for names in TABLES.values() for name in names for key in expanded(name)} <= {*keys}
    for table in TABLES:
        assert len({measure.key for measure in measures_in(table)}) == len(measures_in(table))


def test_what_a_stride_does_not_know_is_none() -> None:
    whole = stride_of(stylised_series("barefoot"))
    assert metrics_of(whole)["dorsiflexion_stiffness_right"] is None

    def unknown(_: object) -> float:
        raise NotKnownError("wind")

    assert Measure("wind", "wind", "N", "", unknown).of(whole) is None
    assert Measure("wind", "wind", "N", "", lambda _: np.nan).of(whole) is None
