"""What one percent of every number changes, as files and as tables for the terminal."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measures import measure_of, measures_in

FILES: Final = ("sensitivity.csv", "sensitivity_check.csv", "sensitivity.json")

_LABEL, _CELL = 41, 9
"""Widths of the columns on the terminal."""

SHOWN: Final = 1e-3
"""Elasticity [% per %] below which a cell shows a dot: it moves nothing that matters."""


@dataclass(frozen=True)
class Sensitivity:
    """The answer to one number.

    Args:
        place: An unknown by name, or a place in the patient's file.
        value: The number now in SI units; None where several numbers change by one factor.
        derivatives: Derivative of every measure by the relative change of the number, so that
            0.01 of it is what one percent does; SI units.
        elasticities: The same relative to the measure: percent per percent; None where the
            measure is 0.
    """

    place: str
    value: float | None
    derivatives: Mapping[str, float]
    elasticities: Mapping[str, float | None]


@dataclass(frozen=True)
class Check:
    """One answer beside the central difference of two solves, a relative step up and down.

    `changed` counts inequalities that are active in one of the solves and not in the optimum.
    """

    place: str
    step: float
    derivatives: Mapping[str, float]
    iterations: int
    seconds: float
    changed: int


@dataclass(frozen=True)
class Sensitivities:
    """All answers around an optimum, whose measures are `base`; SI units.

    `active` counts its active inequalities, `doubtful` those of which that is not clear; `seconds`
    leaves out the solve of the optimum and checks.
    """

    problem: str
    patient: str
    tolerance: float
    base: Mapping[str, float]
    rows: tuple[Sensitivity, ...]
    checks: tuple[Check, ...]
    active: int
    doubtful: int
    seconds: float

    def row(self, place: str) -> Sensitivity:
        """Return the answer to one number."""
        return next(row for row in self.rows if row.place == place)


def label_of(place: str) -> str:
    """Return the name of a number for people."""
    if place in STIFFNESSES:
        return measure_of(place).label
    return place.replace("segment_lengths.", "length of ").replace("_", " ").replace(".", ", ")


def agreement(result: Sensitivities, check: Check) -> float:
    """Return the largest difference between a check and the KKT system.

    Each measure counts relative to its finite difference, but not to less than what an elasticity
    of 0.001 would be: ratios of zeros mean nothing.
    """
    own, worst = result.row(check.place).derivatives, 0.0
    for key, slope in check.derivatives.items():
        least = SHOWN * abs(result.base[key])
        worst = max(worst, abs(own[key] - slope) / max(abs(slope), least, 1e-300))
    return worst


def write_sensitivities(result: Sensitivities, folder: Path) -> None:
    """Write `sensitivity.csv`, its checks if there are any, and `sensitivity.json`."""
    header = ["number", "value [SI]", "measure", "at the optimum [SI]",
              "derivative [SI per SI]", "derivative by relative change [SI]",
              "elasticity [% per %]"]  # fmt: skip
    rows = [
        (row.place, row.value, key, result.base[key], slope / row.value if row.value else None,
         slope, row.elasticities[key])
        for row in result.rows
        for key, slope in row.derivatives.items()
    ]  # fmt: skip
    write_table(folder / FILES[0], header, rows)
    if result.checks:
        header = ["number", "relative step [1]", "measure", "from the KKT system [SI]",
                  "from two solves [SI]", "difference [%]", "active set changed"]  # fmt: skip
        write_table(folder / FILES[1], header, _check_rows(result))
    write_json(folder / FILES[2], sensitivity_content(result))


def _check_rows(result: Sensitivities) -> Iterator[tuple[Any, ...]]:
    for check in result.checks:
        own = result.row(check.place).derivatives
        for key, slope in check.derivatives.items():
            difference = 100.0 * (own[key] / slope - 1.0) if slope else None
            yield check.place, check.step, key, own[key], slope, difference, check.changed


def sensitivity_content(result: Sensitivities) -> dict[str, Any]:
    """Return everything as JSON; SI units."""
    return {
        "problem": result.problem,
        "patient": result.patient,
        "tolerance": result.tolerance,
        "active_inequalities": result.active,
        "doubtful_inequalities": result.doubtful,
        "seconds": result.seconds,
        "optimum": result.base,
        "elasticities": {row.place: row.elasticities for row in result.rows},
        "largest_difference_in_checks": {c.place: agreement(result, c) for c in result.checks},
    }


def sensitivity_lines(result: Sensitivities) -> Iterator[str]:
    """Yield the lines of the terminal: elasticities of what every study compares."""
    shown = [m for m in measures_in("studies") if m.key in result.base]
    yield "Elasticities at the optimum, % per %"
    yield f"{'one percent more of':<{_LABEL}}" + "".join(f"{m.short:>{_CELL}}" for m in shown)
    for row in result.rows:
        cells = (elasticity_text(row.elasticities.get(measure.key)) for measure in shown)
        yield f"{label_of(row.place):<{_LABEL}}" + "".join(f"{cell:>{_CELL}}" for cell in cells)
    yield ""
    yield (
        f"'.' is less than {SHOWN:g}; a spring moves with the others following. "
        f"{result.active} limits hold the optimum; of {result.doubtful} it is not clear whether "
        "they do. Beyond a step at which a limit begins or ceases to hold, the numbers are wrong."
    )
    yield f"{len(result.rows)} numbers in {result.seconds:.1f} s, no problem solved again."
    for check in result.checks:
        kept = f"{check.changed} limits change" if check.changed else "the same limits hold"
        yield (
            f"check of {label_of(check.place)}: within {100 * agreement(result, check):.2g} % of "
            f"two solves at {100 * check.step:g} % more and less ({kept}; {check.iterations} "
            f"iterations, {check.seconds:.1f} s)"
        )


def elasticity_text(elasticity: float | None) -> str:
    """Return an elasticity [% per %] as a cell shows it."""
    if elasticity is None:
        return "-"
    return f"{elasticity:.3f}" if abs(elasticity) >= SHOWN else "."
