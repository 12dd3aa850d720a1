"""What the neighbours of a solved problem cost."""

from __future__ import annotations

from typing import Any

from context import Context
from measure import Cost, PartFailedError, Sample, fresh
from report import Report

ABOUT = "Neighbours of a solved problem"
PROBLEM = "mapd-orthosis"
GOAL = "one spring 5 % softer, warm"


def run(context: Context) -> Report:
    """Solve neighbours of a run of `mapd-orthosis` in one process."""
    report = Report()
    table = report.table(
        f"{ABOUT}: {PROBLEM}, {context.intervals} intervals",
        ("what", "CPU seconds", "iterations"),
    )
    try:
        folder = context.run(PROBLEM, context.intervals)
        found: list[tuple[dict[str, Any], Cost]] = []
        for number in range(context.repetitions):
            context.tell(f"neighbours, {number + 1} of {context.repetitions}")
            found.append(fresh("neighbours:figures", context.cache, folder=str(folder)))
    except PartFailedError as failure:
        table.rows.append([f"failed: {failure}"])
        return report
    first = found[0][0]
    table.notes = (
        f"One process; {first['unknowns']:,} unknowns. Median of all repetitions and, where there "
        "are several, of all four springs.",
    )
    for what, done in first["done"].items():
        seconds = Sample.of(s for result, _ in found for s in result["done"][what]["seconds"])
        counts = ", ".join(f"{count}" for count in done["iterations"]) or None
        failed = sum(done["failed"])
        counts = f"{counts}; {failed} did not converge" if failed else counts
        table.rows.append([what, seconds, counts])
        if what == GOAL:
            report.reached["warm"] = seconds.median
    report.peaks["neighbours"] = max(cost.peak for _, cost in found)
    return report
