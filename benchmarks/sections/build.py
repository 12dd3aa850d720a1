"""What happens before the first iteration, with and without kept derivatives."""

from __future__ import annotations

from context import Context
from measure import PartFailedError, fresh, sample_of
from report import Report

ABOUT = "Before the first iteration"
PROBLEMS = ("mapd-barefoot", "mapd-orthosis")


def run(context: Context) -> Report:
    """Measure the steps in fresh processes: with an empty cache, and with what that one left."""
    report = Report()
    for problem in PROBLEMS[:1] if context.quick else PROBLEMS:
        table = report.table(
            f"{ABOUT}: {problem}, {context.intervals} intervals",
            ("CPU seconds", "nothing cached", "cached"),
        )
        try:
            cold, cached = _measured(context, problem)
        except PartFailedError as failure:
            table.rows.append([f"failed: {failure}"])
            continue
        for step in cold[0]:
            table.rows.append([step, sample_of(cold, step), sample_of(cached, step)])
    return report


def _measured(
    context: Context, problem: str
) -> tuple[list[dict[str, float]], list[dict[str, float]]]:
    """Return the seconds of all steps, per repetition."""
    cold, cached = [], []
    for number in range(context.repetitions):
        context.tell(f"{problem}, {number + 1} of {context.repetitions}")
        cache = context.empty("cache")
        for rows in (cold, cached):
            seconds, cost = fresh(
                "building:steps", cache, problem=problem, intervals=context.intervals
            )
            rows.append(seconds | {"whole process": cost.cpu})
    return cold, cached
