"""Uncertainty: springs identified anew for many drawn patients, on two processes."""

from __future__ import annotations

import csv
from functools import partial
from pathlib import Path

from context import Context
from measure import Cost, Sample, pathwalker
from report import Cell, Report

ABOUT = "Draws of an uncertain patient"
PROBLEM = "mapd-orthosis"
STRENGTHS = "quantities={strengths: {kind: normal, relative: 0.10, each: true}}"
WORKERS = 2


def run(context: Context) -> Report:
    """Solve draws from runs on several meshes."""
    report = Report()
    count = 4 if context.quick else 100
    table = report.table(
        f"{ABOUT}: {count} draws, {WORKERS} processes",
        ("what is drawn", "mesh", "wall seconds", "CPU seconds", "iterations, median",
         "seconds per draw, median", "converged [%]", "peak of a process [MB]"),
        "The run that they start from is there already.",
    )  # fmt: skip
    fixed = f"{context.intervals} intervals"
    cases: list[tuple[str, str, int | None, list[str]]] = [
        ("strengths", fixed, context.intervals, [STRENGTHS])
    ]
    if not context.quick:
        cases.append(("all 28 numbers of the shipped study", fixed, context.intervals, []))
        cases.append(("strengths", "as shipped", None, [STRENGTHS]))
    for what, mesh, intervals, changes in cases:
        words = [f"draws={count}", *changes]
        table.add([what, mesh], partial(_cells, context, report, what, intervals, words))
    return report


def _cells(
    context: Context, report: Report, what: str, intervals: int | None, changes: list[str]
) -> list[Cell]:
    """Solve the draws and return their row."""
    run = context.run(PROBLEM, intervals)
    costs: list[Cost] = []
    rows: list[dict[str, str]] = []
    for number in range(context.repetitions):
        context.tell(f"draws of {what}, {number + 1} of {context.repetitions}")
        cost, rows = _draws(context, run, changes)
        costs.append(cost)
    wall, peak = Sample.of(cost.wall for cost in costs), max(cost.peak for cost in costs)
    if what == "strengths":
        report.reached[f"draws, {intervals or 'shipped'}"] = wall.median
    report.peaks[f"draws of {what}, {intervals or 'shipped'}"] = peak
    return [
        wall,
        Sample.of(cost.cpu for cost in costs),
        Sample.of(float(row["iterations"]) for row in rows).median,
        Sample.of(float(row["seconds [s]"]) for row in rows).median,
        100 * sum(row["status"] == "converged" for row in rows) / len(rows),
        peak,
    ]


def _draws(context: Context, run: Path, changes: list[str]) -> tuple[Cost, list[dict[str, str]]]:
    """Run the study; return what it took and the rows of its draws."""
    out = context.empty("uncertainty") / "study"
    words = [word for change in changes for word in ("--set", change)]
    study = ("uncertainty", "uncertainty", "--quiet", "--workers", f"{WORKERS}")
    finished = pathwalker(
        *study, "--run", run, "--out", out, *words, cache=context.cache, allowed=(0, 1)
    )
    with (out / "draws.csv").open(encoding="utf-8", newline="") as file:
        return finished.cost, list(csv.DictReader(file))
