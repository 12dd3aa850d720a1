"""A perturbation as files and as a table for the terminal, beside the article's table 5."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.evaluation.paper import PATIENT, paper_number
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.measures import measure_of, measures_in
from pathwalker_cli.studies.measures import COMPARED
from pathwalker_cli.studies.perturbation.result import Perturbation, Perturbed

__all__ = [
    "FILES",
    "paper_changes",
    "perturbation_content",
    "perturbation_lines",
    "verdict",
    "write_perturbation",
]

FILES: Final = ("perturbation.csv", "perturbation.json")

_PAPER_PROBLEM: Final = "mapd-orthosis"
_PAPER_FACTOR: Final = 0.95

_LABEL, _CELL = 18, 9
"""Widths of the columns on the terminal."""


def paper_changes(result: Perturbation, row: Perturbed) -> dict[str, float]:
    """Return what the article prints for a row, as shares; empty for any other row.

    Args:
        result: All rows: the article is about one patient and one problem.
        row: The row.
    """
    same = (result.patient, result.config.problem) == (PATIENT, _PAPER_PROBLEM)
    if not same or row.factor != _PAPER_FACTOR:
        return {}
    numbers = {
        key: paper_number(_PAPER_PROBLEM, f"{key}_after_-5%_{row.spring}") for key in COMPARED
    }
    return {key: number.value for key, number in numbers.items() if number is not None}


def write_perturbation(result: Perturbation, folder: Path) -> None:
    """Write `perturbation.csv` and `perturbation.json`."""
    keys = [m.key for m in measures_in("studies") if m.key in result.base]
    header = ["spring", "factor [1]", "stiffness [N m/rad]", "status"]
    header += [measure_of(key).column for key in keys]
    header += [f"change of {key} [%]" for key in keys]
    header += [f"change of {key} in the article [%]" for key in COMPARED]
    header += ["note", "iterations", "seconds [s]"]
    rows = [_cells(result, row, keys) for row in result.rows]
    base: list[Any] = ["", 1.0, None, "converged", *(result.base[key] for key in keys)]
    base += [None] * (len(keys) + len(COMPARED)) + ["the optimum", None, None]
    write_table(folder / FILES[0], header, [base, *rows])
    write_json(folder / FILES[1], perturbation_content(result))


def _cells(result: Perturbation, row: Perturbed, keys: list[str]) -> list[Any]:
    """Return a row of the table; empty cells for what is not known."""
    paper = paper_changes(result, row)
    changes = [_percent(row.changes.get(key)) for key in keys]
    printed = [_percent(paper.get(key)) for key in COMPARED]
    values = [row.values.get(key) for key in keys]
    return [row.spring, row.factor, row.stiffness, row.status, *values, *changes, *printed,
            row.note, row.iterations, row.seconds]  # fmt: skip


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def perturbation_content(result: Perturbation) -> dict[str, Any]:
    """Return everything as JSON: SI units, changes as shares."""
    return {
        "problem": result.config.problem,
        "patient": result.patient,
        "tolerance": result.config.solver.tolerance,
        "intervals": result.intervals,
        "seconds": result.seconds,
        "optimum": dict(result.base),
        "stiffness_ranges": {name: list(pair) for name, pair in result.ranges.items()},
        "at_limit": spring_ends(result.base, result.ranges),
        "rows": [
            {
                "spring": row.spring,
                "factor": row.factor,
                "stiffness": row.stiffness,
                "status": row.status,
                "values": dict(row.values),
                "changes": dict(row.changes),
                "changes_article": paper_changes(result, row),
                "cost_falls": row.falls,
                "no_true_optimum": row.unexplained,
                "note": row.note,
                "iterations": row.iterations,
                "seconds": row.seconds,
            }
            for row in result.rows
        ],
    }


def perturbation_lines(result: Perturbation) -> Iterator[str]:
    """Yield the table of the terminal: changes in %, ours above the article's, then notes."""
    yield f"{result.config.problem}, patient {result.patient}, {result.intervals} intervals"
    yield "Changes [%] when one spring is moved and everything else is optimal again"
    heads = [measure_of(key).short for key in COMPARED]
    yield _line("", *heads, "iter", "s")
    for row in result.rows:
        numbers = [_signed(row.changes, key, 4) for key in COMPARED]
        yield _line(row.label, *numbers, str(row.iterations), f"{row.seconds:.1f}")
        paper = paper_changes(result, row)
        if paper:
            yield _line("  article", *(_signed(paper, key, 3) for key in COMPARED), "", "")
    yield ""
    for row in result.rows:
        label = measure_of(row.spring).label
        before = result.base[row.spring]
        note = f"; {row.note}" if row.note else ""
        yield f"{label}: {before:.4g} -> {row.stiffness:.4g} N m/rad{note}"
    yield ""
    yield verdict(result)
    solves = sum(row.seconds for row in result.rows)
    yield (
        f"{len(result.rows)} solves to a tolerance of {result.config.solver.tolerance:g} in "
        f"{solves:.1f} s, {result.seconds:.1f} s in all"
    )


def verdict(result: Perturbation) -> str:
    """Return in one sentence whether the optimum is one, as far as these springs tell."""
    if result.better:
        best = min(result.better, key=lambda row: row.changes["cost"])
        return (
            f"NO TRUE OPTIMUM: the cost falls for {', '.join(row.label for row in result.better)}, "
            f"by {-100.0 * best.changes['cost']:.2g} % at best, although springs like that were "
            "allowed; solve again from several starts"
        )
    falling = [row.label for row in result.rows if row.falls]
    if falling:
        return (
            f"The cost falls only outside the range of real springs ({', '.join(falling)}): an "
            "optimum within it"
        )
    return "The cost falls for no spring that was moved, as it must around an optimum"


def _line(label: str, *cells: str) -> str:
    *numbers, iterations, seconds = cells
    parts = [f"{cell:>{_CELL}}" for cell in numbers]
    return f"{label:<{_LABEL}}{''.join(parts)}{iterations:>6}{seconds:>6}".rstrip()


def _signed(changes: Mapping[str, float], key: str, digits: int) -> str:
    """Return a change in % with its sign."""
    # adding 0.0 makes +0.000 of -0.000
    change = round(100.0 * changes[key], digits) + 0.0 if key in changes else None
    return "-" if change is None else f"{change:+.{digits}f}"
