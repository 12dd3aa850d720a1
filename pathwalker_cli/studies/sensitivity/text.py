"""Sensitivities as files and as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measure_of, measures_in
from pathwalker_cli.studies.sensitivity.result import Check, Sensitivities, Sensitivity

__all__ = [
    "FILES",
    "agreement",
    "label_of",
    "sensitivity_content",
    "sensitivity_lines",
    "write_sensitivities",
]

FILES: Final = ("sensitivity.csv", "sensitivity_check.csv", "sensitivity.json")

_LABEL, _CELL = 41, 9
"""Widths of the columns on the terminal."""

_SHOWN: Final = 1e-3
"""Elasticity [% per %] below which a cell shows a dot: it moves nothing that matters."""


def label_of(place: str) -> str:
    """Return the name of a number for people."""
    if place in STIFFNESSES:
        return measure_of(place).label
    return place.replace("segment_lengths.", "length of ").replace("_", " ").replace(".", ", ")


def write_sensitivities(result: Sensitivities, folder: Path) -> None:
    """Write `sensitivity.csv`, its checks if there are any, and `sensitivity.json`."""
    folder.mkdir(parents=True, exist_ok=True)
    header = ["number", "value [SI]", "measure", "at the optimum [SI]",
              "derivative [SI per SI]", "derivative by relative change [SI]",
              "elasticity [% per %]"]  # fmt: skip
    rows = [
        (
            row.place,
            row.value,
            key,
            result.base[key],
            slope / row.value if row.value else None,
            slope,
            row.elasticities[key],
        )
        for row in result.rows
        for key, slope in row.derivatives.items()
    ]
    write_table(folder / FILES[0], header, rows)
    if result.checks:
        write_table(folder / FILES[1], _CHECK_HEADER, _check_rows(result))
    write_json(folder / FILES[2], sensitivity_content(result))


_CHECK_HEADER: Final = (
    "number", "relative step [1]", "measure", "from the KKT system [SI]",
    "from two solves [SI]", "difference [%]", "active set changed",
)  # fmt: skip


def _check_rows(result: Sensitivities) -> Iterator[tuple[Any, ...]]:
    for check in result.checks:
        own = result.row(check.place).derivatives
        for key, found in check.derivatives.items():
            difference = 100.0 * (own[key] / found - 1.0) if found else None
            yield check.place, check.step, key, own[key], found, difference, check.changed


def sensitivity_content(result: Sensitivities) -> dict[str, Any]:
    """Return everything as JSON; SI units."""
    return {
        "problem": result.config.problem,
        "patient": result.patient,
        "tolerance": result.config.solver.tolerance,
        "active_inequalities": result.active,
        "doubtful_inequalities": result.doubtful,
        "seconds": result.seconds,
        "optimum": dict(result.base),
        "elasticities": {row.place: dict(row.elasticities) for row in result.rows},
        "largest_difference_in_checks": {c.place: agreement(result, c) for c in result.checks},
    }


def agreement(result: Sensitivities, check: Check) -> float:
    """Return the largest difference between a check and the KKT system.

    Each measure counts relative to its finite difference, but not to less than what an elasticity
    of 0.001 would be: ratios of zeros mean nothing.
    """
    own, worst = result.row(check.place).derivatives, 0.0
    for key, found in check.derivatives.items():
        least = _SHOWN * abs(result.base[key])
        worst = max(worst, abs(own[key] - found) / max(abs(found), least, 1e-300))
    return worst


def sensitivity_lines(result: Sensitivities) -> Iterator[str]:
    """Yield the lines of the terminal: elasticities of what every study compares."""
    shown = [m for m in measures_in("studies") if m.key in result.base]
    yield "Elasticities at the optimum, % per %"
    yield f"{'one percent more of':<{_LABEL}}" + "".join(f"{m.short:>{_CELL}}" for m in shown)
    for row in result.rows:
        cells = "".join(f"{_cell(row, measure):>{_CELL}}" for measure in shown)
        yield f"{label_of(row.place):<{_LABEL}}{cells}"
    yield ""
    yield (
        f"'.' is less than {_SHOWN:g}; a spring moves with the others following. "
        f"{result.active} inequalities are active, {result.doubtful} of all are in doubt: "
        "beyond a change of the active set the numbers no longer hold."
    )
    yield f"{len(result.rows)} numbers in {result.seconds:.1f} s, no problem solved again."
    for check in result.checks:
        kept = f"{check.changed} inequalities change" if check.changed else "the active set stays"
        yield (
            f"check of {label_of(check.place)}: within {100 * agreement(result, check):.2g} % of "
            f"two solves at {100 * check.step:g} % more and less ({kept}; {check.iterations} "
            f"iterations, {check.seconds:.1f} s)"
        )


def _cell(row: Sensitivity, measure: Measure) -> str:
    elasticity = row.elasticities.get(measure.key)
    if elasticity is None:
        return "-"
    return f"{elasticity:.3f}" if abs(elasticity) >= _SHOWN else "."
