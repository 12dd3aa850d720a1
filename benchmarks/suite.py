"""What the program costs: `python benchmarks/suite.py [--quick] [--only SECTION ...]`.

Run on a quiet machine.  Everything is measured in fresh processes on one thread; figures are
medians, with the range of all repetitions in brackets.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
import traceback
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from context import Context
from goals import goals_table
from measure import PartFailedError, fresh
from report import Report, Table
from rich.console import Console
from sections import batch, build, draws, iteration, solves, start, warm

SECTIONS: Final = {
    "start": start,
    "build": build,
    "iteration": iteration,
    "solves": solves,
    "warm": warm,
    "draws": draws,
    "batch": batch,
}


def main() -> None:
    """Measure, print, and write the files that are asked for."""
    options = _options()
    console = Console(width=None if sys.stdout.isatty() else 190)
    machine = _machine()
    machine.print(console)
    reports: dict[str, Report] = {}
    with tempfile.TemporaryDirectory(prefix="pathwalker-benchmarks-") as folder:
        repetitions = options.repetitions or (1 if options.quick else 3)
        context = Context(Path(folder), options.quick, repetitions, _tell)
        for name in options.only or SECTIONS:
            began = time.perf_counter()
            reports[name] = _measured(name, context)
            for table in reports[name].tables:
                table.print(console)
            _tell(f"section {name} took {time.perf_counter() - began:.0f} s")
            # written after every section: an interrupted call leaves what it has
            goals = goals_table(reports, context.intervals, context.quick)
            _write(options, machine, reports, goals)
    goals.print(console)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="toy sizes: does the suite run?")
    parser.add_argument(
        "--only", nargs="+", choices=list(SECTIONS), metavar="SECTION", help=", ".join(SECTIONS)
    )
    parser.add_argument("--repetitions", type=int, metavar="N", help="3; 1 with --quick")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write all repetitions")
    parser.add_argument("--markdown", type=Path, metavar="FILE", help="write tables")
    return parser.parse_args()


def _tell(text: str) -> None:
    """Tell on standard error what goes on."""
    print(f"{time.strftime('%H:%M:%S')} {text}", file=sys.stderr, flush=True)


def _measured(name: str, context: Context) -> Report:
    """Return the report of a section; if it fails as a whole, one that says so."""
    try:
        report: Report = SECTIONS[name].run(context)
        return report
    except Exception as failure:  # whatever it is: other sections shall still be measured
        traceback.print_exc()
        report = Report(failure=f"{type(failure).__name__}: {failure}")
        report.table(SECTIONS[name].ABOUT, ("failed",)).rows.append([report.failure])
        return report


def _machine() -> Table:
    """Return what was measured on which machine."""
    table = Table("Machine", ("what", "which"))
    try:
        described, _ = fresh("machine:description")
    except PartFailedError as failure:
        described = {"failed": str(failure)}
    table.rows = [[key, str(value)] for key, value in described.items()]
    return table


def _write(
    options: argparse.Namespace, machine: Table, reports: Mapping[str, Report], goals: Table
) -> None:
    """Write the files that were asked for."""
    if options.markdown is not None:
        parts = [machine.markdown()]
        for name, report in reports.items():
            parts += [f"## {name}", *(table.markdown() for table in report.tables)]
        text = "\n\n".join(["# Benchmarks", *parts, "## goals", goals.markdown()])
        options.markdown.write_text(text.rstrip() + "\n", encoding="utf-8")
    if options.json is not None:
        content: dict[str, Any] = {
            "machine": dict(machine.rows),  # type: ignore[arg-type]
            "quick": options.quick,
            "sections": {name: report.as_json() for name, report in reports.items()},
            "goals": goals.as_json(),
        }
        options.json.write_text(json.dumps(content, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
