"""Every shipped problem from its synthetic start, from the shell."""

from __future__ import annotations

from functools import partial

from context import Context, metrics_of
from measure import Cost, Sample
from report import Cell, Report

ABOUT = "Shipped problems from their starts"
PROBLEMS = ("mapd-barefoot", "mapd-healthy", "mapd-orthosis", "mapd-ws-orthosis", "ls-barefoot")
TOYS = ("mapd-barefoot", "mapd-orthosis")
COLUMNS = (
    "problem", "status", "iterations by stage", "nothing cached", "cached", "build, solve, verify",
    "cost", "largest violation", "re-integration error", "intervals", "peak [MB]",
)  # fmt: skip


def run(context: Context) -> Report:
    """Solve the problems on a mesh that is not refined, and as shipped."""
    report = Report()
    notes = (
        "CPU seconds from the shell, figures and all; build, solve, verify: wall seconds of these "
        "parts, cached. Verdict on the springs off. Error: [rad, m] and [rad/s, m/s], between "
        "neighbouring nodes.",
    )
    fixed = f"{context.intervals} intervals, not refined"
    table = report.table(f"{ABOUT}: {fixed}", COLUMNS, *notes)
    for problem in TOYS if context.quick else PROBLEMS:
        table.add([problem], partial(_cells, context, report, problem, context.intervals))
    if not context.quick:
        table = report.table(f"{ABOUT}: as shipped, refined to tolerance", COLUMNS, *notes)
        for problem in PROBLEMS:
            table.add([problem], partial(_cells, context, report, problem, None))
    return report


def _cells(context: Context, report: Report, problem: str, intervals: int | None) -> list[Cell]:
    """Solve one problem, with an empty cache and with what that left, and return its row."""
    mesh = "as shipped" if intervals is None else f"{intervals} intervals"
    cold: list[Cost] = []
    cached: list[Cost] = []
    for number in range(context.repetitions):
        context.tell(f"{problem}, {mesh}, {number + 1} of {context.repetitions}")
        cache = context.empty("cache")
        for costs in (cold, cached):
            finished, run = context.solve(problem, intervals, cache)
            costs.append(finished.cost)
    seconds = [Sample.of(cost.cpu for cost in costs) for costs in (cold, cached)]
    for name, sample in zip(("cold", "cached"), seconds, strict=True):
        report.reached[f"{problem}, {intervals or 'shipped'}, {name}"] = sample.median
    peak = max(cost.peak for cost in (*cold, *cached))
    report.peaks[f"solve {problem}, {mesh}"] = peak
    found = metrics_of(run)
    errors = [found[f"reintegration_{name}_error"] for name in ("position", "velocity")]
    return [
        found["status"],
        " + ".join(f"{stage['iterations']}" for stage in found["stages"]),
        *seconds,
        ", ".join(f"{found[f'seconds_{part}']:.1f}" for part in ("build", "solve", "verify")),
        f"{found['cost']:.6g}",
        f"{found['largest_violation']:.1e}",
        ", ".join("-" if error is None else f"{error:.1e}" for error in errors),
        found["intervals"],
        peak,
    ]
