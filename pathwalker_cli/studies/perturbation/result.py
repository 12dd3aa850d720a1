"""What moved springs change: one row per spring with its reason, as files and as a table."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.case import Case
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.evaluation.paper import PATIENT, paper_number
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.measures import COMPARED, Ranges, range_content

FILES: Final = ("perturbation.csv", "perturbation.json")

_PAPER_PROBLEM: Final = "mapd-orthosis"
_PAPER_FACTOR: Final = 0.95

_LABEL, _CELL = 18, 9
"""Widths of the columns on the terminal."""

_STIFFNESS: Final = "N m/rad"


@dataclass(frozen=True)
class Perturbed:
    """One number moved.

    Args:
        name: Its name, e.g. that of a spring.
        label: Its name for people, e.g. "K_D left".
        unit: SI unit.
        factor: Its value over that of the optimum.
        value: Its value [unit].
        status: How the solve of everything else ended.
        values: Measures and unknowns of the gait that results, SI units; empty if it did not
            converge.
        changes: Their change over the optimum's value, as a share.
        changes_article: What the article prints of them, as shares.
        cost_falls: Whether the cost falls by more than the solves are exact to.
        no_true_optimum: Whether it falls although the optimum could have had this value.
        note: Why the cost changes as it does, "" if there is nothing to say.
        iterations: Iterations of the solve.
        seconds: Wall seconds of the solve.
    """

    name: str
    label: str
    unit: str
    factor: float
    value: float
    status: str
    values: Mapping[str, float]
    changes: Mapping[str, float]
    changes_article: Mapping[str, float]
    cost_falls: bool
    no_true_optimum: bool
    note: str
    iterations: int
    seconds: float

    @property
    def moved(self) -> str:
        """What was done to it, e.g. "K_D left x 0.95"."""
        return f"{self.label} x {self.factor:g}"

    @property
    def spring(self) -> bool:
        """Whether it is a spring."""
        return self.unit == _STIFFNESS

    def content(self) -> dict[str, Any]:
        """Return it as plain values; what is no spring has its unit beside it."""
        plain = {key: value for key, value in vars(self).items() if key not in _ABOUT}
        if self.name in STIFFNESSES:
            return {"spring": self.name, "factor": self.factor, "stiffness": self.value, **plain}
        about = {"number": self.name, "factor": self.factor, "value": self.value}
        return {**about, "label": self.label, "unit": self.unit, **plain}


_ABOUT: Final = frozenset({"name", "label", "unit", "factor", "value"})


@dataclass(frozen=True)
class Perturbation:
    """All numbers moved; SI units.

    `seconds` leaves out the solve of the optimum from nothing.
    """

    problem: str
    patient: str
    tolerance: float
    intervals: int
    optimum: Mapping[str, float]
    ranges: Ranges
    measures: tuple[Measure, ...]
    rows: tuple[Perturbed, ...]
    seconds: float

    @property
    def noun(self) -> str:
        """What was moved: springs, or other numbers too."""
        return "spring" if all(row.spring for row in self.rows) else "number"


def remark(
    end: str, value: float, limits: tuple[float, float], fall: float, unit: str = _STIFFNESS
) -> tuple[str, bool]:
    """Return what to know about a moved number, and whether its cost may fall.

    Args:
        end: "lower" or "upper" if the optimum sits at that end of the range, else "".
        value: What is prescribed [unit].
        limits: The range [unit].
        fall: Change of the cost, as a share, if it falls; 0 otherwise.
        unit: SI unit.
    """
    low, high = limits
    limit = {"lower": low, "upper": high}.get(end)
    at = "" if limit is None else f"the optimum sits at its {end} limit of {limit:g} {unit}; "
    less, more = ("softer", "stiffer") if unit == _STIFFNESS else ("less", "more")
    outside = less if value < low else more if value > high else ""
    if outside:
        change = "the cost falls" if fall else "the cost may fall"
        real = f"{value:.4g} {unit} is {outside} than any in [{low:g}, {high:g}]"
        return f"{at}{real}: {change}", True
    if fall:
        return f"{at}no true optimum: better by {-100.0 * fall:.2g} %", False
    if limit is not None:
        return f"{at}moving into the range raises the cost in proportion", False
    return "", False


def paper_changes(case: Case, name: str, factor: float) -> dict[str, float]:
    """Return what the article prints for a moved spring, as shares; empty for any other."""
    same = (case.unvaried.id, case.config.problem) == (PATIENT, _PAPER_PROBLEM)
    if not same or factor != _PAPER_FACTOR:
        return {}
    numbers = {key: paper_number(_PAPER_PROBLEM, f"{key}_after_-5%_{name}") for key in COMPARED}
    return {key: number.value for key, number in numbers.items() if number is not None}


def write_tables(result: Perturbation, folder: Path) -> None:
    """Write `perturbation.csv` and `perturbation.json`."""
    keys = [measure.key for measure in result.measures]
    springs = result.noun == "spring"
    header = [*(("spring", "factor [1]", "stiffness [N m/rad]") if springs
                else ("number", "factor [1]", "value [SI]")), "status"]  # fmt: skip
    header += [measure.column for measure in result.measures]
    header += [f"change of {key} [%]" for key in keys]
    header += [f"change of {key} in the article [%]" for key in COMPARED]
    header += ["note", "iterations", "seconds [s]"]
    base: list[Any] = ["", 1.0, None, "converged", *(result.optimum[key] for key in keys)]
    base += [None] * (len(keys) + len(COMPARED)) + ["the optimum", None, None]
    write_table(folder / FILES[0], header, [base, *(_cells(row, keys) for row in result.rows)])
    write_json(folder / FILES[1], perturbation_content(result))


def _cells(row: Perturbed, keys: list[str]) -> list[Any]:
    """Return a row of the table; empty cells for what is not known."""
    changes = [_percent(row.changes.get(key)) for key in keys]
    printed = [_percent(row.changes_article.get(key)) for key in COMPARED]
    values = [row.values.get(key) for key in keys]
    return [row.name, row.factor, row.value, row.status, *values, *changes, *printed,
            row.note, row.iterations, row.seconds]  # fmt: skip


def _percent(share: float | None) -> float | None:
    return None if share is None else 100.0 * share


def perturbation_content(result: Perturbation) -> dict[str, Any]:
    """Return everything as JSON: SI units, changes as shares."""
    return {
        "problem": result.problem,
        "patient": result.patient,
        "tolerance": result.tolerance,
        "intervals": result.intervals,
        "seconds": result.seconds,
        "optimum": result.optimum,
        **range_content(result.ranges),
        "at_limit": spring_ends(result.optimum, result.ranges),
        "rows": [row.content() for row in result.rows],
    }


def perturbation_lines(result: Perturbation) -> Iterator[str]:
    """Yield the table of the terminal: changes in %, ours above the article's, then notes."""
    yield f"{result.problem}, patient {result.patient}, {result.intervals} intervals"
    yield f"Changes [%] when one {result.noun} is moved and everything else is optimal again"
    width = max([_LABEL, *(len(row.moved) + 1 for row in result.rows)])
    yield _line(width, "", *(measure_of(key).short for key in COMPARED), "iter", "s")
    for row in result.rows:
        numbers = [_signed(row.changes, key, 4) for key in COMPARED]
        yield _line(width, row.moved, *numbers, str(row.iterations), f"{row.seconds:.1f}")
        if row.changes_article:
            printed = (_signed(row.changes_article, key, 3) for key in COMPARED)
            yield _line(width, "  article", *printed, "", "")
    yield ""
    for row in result.rows:
        note = f"; {row.note}" if row.note else ""
        yield f"{row.label}: {result.optimum[row.name]:.4g} -> {row.value:.4g} {row.unit}{note}"
    yield ""
    yield verdict(result)
    solves = sum(row.seconds for row in result.rows)
    yield (
        f"{len(result.rows)} solves to a tolerance of {result.tolerance:g} in "
        f"{solves:.1f} s, {result.seconds:.1f} s in all"
    )


def verdict(result: Perturbation) -> str:
    """Return in one sentence whether the optimum is one, as far as the moved numbers tell."""
    better = [row for row in result.rows if row.no_true_optimum]
    falling = ", ".join(row.moved for row in result.rows if row.cost_falls)
    if better:
        best = min(row.changes["cost"] for row in better)
        return (
            f"NO TRUE OPTIMUM: the cost falls for {', '.join(row.moved for row in better)}, "
            f"by {-100.0 * best:.2g} % at best, although {result.noun}s like that were "
            "allowed; solve again from several starts"
        )
    if falling:
        real = "real springs" if result.noun == "spring" else "what is allowed"
        return f"The cost falls only outside the range of {real} ({falling}): an optimum within it"
    return f"The cost falls for no {result.noun} that was moved, as it must around an optimum"


def _line(width: int, label: str, *cells: str) -> str:
    *numbers, iterations, seconds = cells
    parts = [f"{cell:>{_CELL}}" for cell in numbers]
    return f"{label:<{width}}{''.join(parts)}{iterations:>6}{seconds:>6}".rstrip()


def _signed(changes: Mapping[str, float], key: str, digits: int) -> str:
    """Return a change in % with its sign."""
    # adding 0.0 makes +0.000 of -0.000
    change = round(100.0 * changes[key], digits) + 0.0 if key in changes else None
    return "-" if change is None else f"{change:+.{digits}f}"
