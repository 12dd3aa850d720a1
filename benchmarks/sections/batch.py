"""How many cases of a batch a minute takes, on one process and on two."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from functools import partial

from context import Context, fixed_mesh
from measure import Cost, Sample, pathwalker
from report import Cell, Report

ABOUT = "Cases of a batch"
INTERVALS = 16
PROBLEMS = ("mapd-barefoot", "mapd-orthosis")
STRENGTHS = (1.0, 0.8, 0.9, 1.1)


def run(context: Context) -> Report:
    """Solve a small cohort on a coarse mesh."""
    report = Report()
    table = report.table(
        f"{ABOUT} on {INTERVALS} intervals",
        ("processes", "cases", "converged", "cases per minute", "wall seconds", "CPU seconds"),
        f"{' and '.join(_problems(context))} from the synthetic start, verdict off; "
        "every case leaves a whole run folder.",
    )
    for workers in (1, 2):
        table.add([workers], partial(_cells, context, report, workers))
    return report


def _problems(context: Context) -> Sequence[str]:
    return PROBLEMS[:1] if context.quick else PROBLEMS


def _cells(context: Context, report: Report, workers: int) -> list[Cell]:
    """Solve the cases on so many processes and return their row."""
    problems = _problems(context)
    strengths = STRENGTHS[:workers] if context.quick else STRENGTHS
    cases = len(problems) * len(strengths)
    costs: list[Cost] = []
    converged = 0
    for number in range(context.repetitions):
        context.tell(f"{cases} cases on {workers}, {number + 1} of {context.repetitions}")
        cost, rows = _batch(context, workers, problems, strengths)
        costs.append(cost)
        converged = sum(row["status"] == "converged" for row in rows)
    report.peaks[f"batch, {workers} at a time"] = max(cost.peak for cost in costs)
    return [
        cases,
        converged,
        Sample.of(60 * cases / cost.wall for cost in costs),
        Sample.of(cost.wall for cost in costs),
        Sample.of(cost.cpu for cost in costs),
    ]


def _batch(
    context: Context, workers: int, problems: Sequence[str], strengths: Sequence[float]
) -> tuple[Cost, list[dict[str, str]]]:
    """Run the command; return what it took and the rows of its cases."""
    out = context.empty("batch") / "study"
    mesh = ", ".join(change.replace("=", ": ") for change in fixed_mesh(INTERVALS))
    changes = [
        f"problems=[{', '.join(problems)}]",
        f"set={{{mesh}, verdict: false}}",
        f"grid={{variation.scale.strengths: {list(strengths)}}}",
    ]
    words = [word for change in changes for word in ("--set", change)]
    study = ("batch", "cohort", "--quiet", "--workers", f"{workers}", "--out", out)
    finished = pathwalker(*study, *words, cache=context.cache, allowed=(0, 1))
    with (out / "cases.csv").open(encoding="utf-8", newline="") as file:
        return finished.cost, list(csv.DictReader(file))
