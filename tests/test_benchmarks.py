"""The benchmark suite: it runs, its tables hold finite numbers, a failing part is only a row."""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from opensim_peer import with_opensim

BENCHMARKS = Path(__file__).parents[1] / "benchmarks"
IPOPT = """
Number of nonzeros in equality constraint Jacobian...:      300
Number of nonzeros in inequality constraint Jacobian.:       20
Number of nonzeros in Lagrangian Hessian.............:      100
Total number of variables............................:       50
Total number of equality constraints.................:       30
Total number of inequality constraints...............:        5

Number of Iterations....: 10

OverallAlgorithm....................:      9.500 (sys:      0.500 wall:     10.200)
 StdAugSystemSolverMultiSolve.......:      7.000 (sys:      0.000 wall:      7.000)
 LinearSystemSymbolicFactorization..:      1.000 (sys:      0.000 wall:      1.000)
 LinearSystemFactorization..........:      {factorisation} (sys:      0.000 wall:      4.000)
 LinearSystemBackSolve..............:      2.000 (sys:      0.000 wall:      2.000)
  LinearSystemStructureConverterInit:      0.000 (sys:      0.000 wall:      0.000)
Function Evaluations................:      0.900 (sys:      0.100 wall:      1.000)
"""


@pytest.fixture
def load(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Return a function that imports a module of the suite."""
    monkeypatch.syspath_prepend(str(BENCHMARKS))

    def module(name: str) -> ModuleType:
        return import_module(name)

    return module


def numbers(cells: Any) -> list[float]:
    """Return all numbers of a nested list."""
    if isinstance(cells, list):
        return [number for cell in cells for number in numbers(cell)]
    return [cells] if isinstance(cells, int | float) else []


def test_suite_writes_tables_of_finite_numbers(tmp_path: Path) -> None:
    files = [str(tmp_path / name) for name in ("all.json", "all.md")]
    words = ["--quick", "--only", "start", "build", "--json", files[0], "--markdown", files[1]]
    done = subprocess.run(
        [sys.executable, BENCHMARKS / "suite.py", *words], capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(Path(files[0]).read_text())
    assert list(found["sections"]) == ["start", "build"]
    for name, section in found["sections"].items():
        assert not section["failure"]
        for table in section["tables"]:
            assert table["rows"], name
            for row in table["rows"]:
                assert len(row) == len(table["columns"]), row
                assert numbers(row), row
                assert all(math.isfinite(k) and k >= 0 for k in numbers(row)), row
    text = Path(files[1]).read_text()
    assert "failed" not in text
    assert "| pathwalker --help | 0.3 |" in text
    assert "not measured" in text
    assert "Goals" in done.stdout


def test_iterations_are_measured_by_the_clock_of_ipopt(load: Any) -> None:
    result, cost = load("measure").fresh(
        "iterating:steps",
        problem="mapd-barefoot",
        intervals=16,
        variant="shipped",
        iterations=3,
        tracking=2,
        repetitions=1,
    )
    (part,) = result["parts"]
    assert part["iterations"] == 3
    assert part["unknowns"] > 1000
    pieces = [part[f"in_{name}"] for name in ("functions", "factorisation", "back_solves", "rest")]
    assert sum(pieces) == pytest.approx(part["whole"])
    assert all(math.isfinite(number) for number in part.values())
    assert all(call["seconds"] > 0 for call in result["functions"].values())
    assert cost.peak > 50


@pytest.mark.parametrize(("said", "expected"), [("3.500", 0.35), ("0.000", 0.4)])
def test_report_of_ipopt(load: Any, said: str, expected: float) -> None:
    # a linear solver that does not time its factorisation leaves it to what else took time
    statistics_of = load("parts.iterating").statistics_of
    found = statistics_of(IPOPT.format(factorisation=said))
    assert found["unknowns"] == 50
    assert found["analysis"] == pytest.approx(1.0)
    assert found["whole"] == pytest.approx(0.9)
    assert found["in_functions"] == pytest.approx(0.1)
    assert found["in_back_solves"] == pytest.approx(0.2)
    assert found["in_factorisation"] == pytest.approx(expected)
    assert found["in_rest"] == pytest.approx(0.6 - expected)


def test_report_without_times_is_refused(load: Any) -> None:
    statistics_of = load("parts.iterating").statistics_of
    with pytest.raises(ValueError, match="timing statistics lack"):
        statistics_of(IPOPT.partition("OverallAlgorithm")[0])


def test_failing_part_is_a_row_that_says_what_failed(load: Any) -> None:
    measure, report = load("measure"), load("report")
    table = report.Table("Some", ("what", "seconds", "peak"))
    words = [sys.executable, "-c", "raise SystemExit('no such thing')"]
    table.add(["first"], lambda: [measure.command(words).cost.cpu, 1.0])
    table.add(["second"], lambda: [measure.Sample((0.3, 0.1, 0.2)), None])
    assert table.padded() == [
        ["first", "failed: exit code 1: no such thing", ""],
        ["second", "0.2 (0.1-0.3)", "-"],
    ]


def test_command_that_takes_too_long_is_ended(load: Any) -> None:
    measure = load("measure")
    words = [sys.executable, "-c", "import time; time.sleep(60)"]
    with pytest.raises(measure.PartFailedError, match="given up after"):
        measure.command(words, time_limit=0.3)


def test_goals_say_what_is_met(load: Any) -> None:
    report, goals = load("report").Report, load("goals").goals_table
    found = {"a": report(reached={"warm": 0.4, "iteration": 0.06}, peaks={"x": 12.0, "y": 2e3})}
    rows = {row[0]: row[2:] for row in goals(found, 64, False).padded()}
    assert rows["one spring 5 % softer, warm, 64 intervals"] == ["0.4", "CPU s", "yes"]
    assert rows["one iteration on 64 intervals, the slower problem"] == ["0.06", "CPU s", "no"]
    assert rows["peak memory of any process (y)"] == ["2,000", "MB", "no"]
    assert rows["pathwalker --help"] == ["not measured", "CPU s", "-"]


@with_opensim
def test_a_peer_gets_our_step(load: Any, tmp_path: Path) -> None:
    """Moco reads the model, the start and the bounds, iterates, and is integrated anew."""
    load("peers").write_step(tmp_path, argparse.Namespace(intervals=3, iterations=1))
    words = [sys.executable, BENCHMARKS / "parts" / "moco.py", tmp_path]
    done = subprocess.run(words, capture_output=True, text=True, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "Total number of variables" in done.stdout
    found = json.loads((tmp_path / "result.json").read_text(encoding="utf-8"))
    assert (found["status"], found["iterations"]) == ("Maximum_Iterations_Exceeded", 1)
    assert all(math.isfinite(x) and x > 0 for x in found.values() if isinstance(x, float))
