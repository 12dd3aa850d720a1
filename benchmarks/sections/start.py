"""How long the program takes to say something."""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial

from context import Context
from measure import Finished, Sample, command, pathwalker
from report import Cell, Report

ABOUT = "Start of the program"
IMPORT = "import pathwalker_cli.gait.solve"


def run(context: Context) -> Report:
    """Measure the first answers of the program."""
    report = Report()
    table = report.table(
        ABOUT,
        ("command", "CPU seconds", "wall seconds", "peak [MB]"),
        "Files were in the memory of the machine: a first call that is not counted saw to that. "
        "Peaks are not below what the suite itself holds, about 20 MB.",
    )
    calls = {
        "pathwalker --help": lambda: pathwalker("--help"),
        "pathwalker --version": lambda: pathwalker("--version"),
        "pathwalker solve --help": lambda: pathwalker("solve", "--help"),
        f'python -c "{IMPORT}"': lambda: command([sys.executable, "-c", IMPORT]),
    }
    for name, call in calls.items():
        context.tell(name)
        table.add([name], partial(_cells, context, report, name, call))
    return report


def _cells(context: Context, report: Report, name: str, call: Callable[[], Finished]) -> list[Cell]:
    """Call it and return the cells of its row."""
    call()
    costs = [call().cost for _ in range(context.repetitions)]
    cpu = Sample.of(cost.cpu for cost in costs)
    report.reached[name] = cpu.median
    return [cpu, Sample.of(cost.wall for cost in costs), max(cost.peak for cost in costs)]
