"""An evaluation as tables for the terminal, 80 columns wide."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from typing import Final

from pathwalker_cli.conventions import to_degrees
from pathwalker_cli.evaluation.evaluate import Change, Evaluation
from pathwalker_cli.evaluation.paper import PATIENT
from pathwalker_cli.evaluation.quantities import Quantity
from pathwalker_cli.evaluation.spread import Spread

__all__ = [
    "change_lines",
    "evaluation_lines",
    "evaluation_notes",
    "number_text",
    "spread_text",
    "unit_text",
]

_DIGITS: Final = {
    "m/s": 3,
    "m": 3,
    "s": 3,
    "1": 3,
    "rad": 2,
    "rad^2": 3,
    "body weights": 2,
    "N": 1,
    "N m": 1,
    "N m/rad": 1,
    "s/m": 3,
    "1/min": 1,
    "J": 2,
}
"""Digits after the point by unit; angles as degrees, shares of the stride in per cent."""

_SHOWN_UNIT: Final = {"rad": "deg", "body weights": "BW", "1": ""}
"""Units that the terminal shows in another way."""

_LITERATURE: Final = 2.0
"""Peak vertical force over that of healthy walking in earlier predictions, article, section 1."""


def evaluation_lines(evaluation: Evaluation) -> Iterator[str]:
    """Yield one line per quantity: ours, recorded mean and range, and the article's number."""
    gait, patient = evaluation.gait, evaluation.gait.walker.patient.id
    compared = evaluation.recorded is not None
    yield f"{gait.name}: {gait.problem}, patient {patient}"
    yield _line("", "ours", "recorded", "ours", "paper" if patient == PATIENT else "", "unit")
    yield _line("", "", "mean [min, max]" if compared else "none", "is", "", "")
    for section, rows in groupby(evaluation.rows, lambda row: row.quantity.section):
        yield section
        for row in rows:
            yield _line(
                row.quantity.label,
                number_text(row.value, row.quantity),
                spread_text(row.recorded, row.quantity),
                row.position or "",
                str(row.paper or ""),
                unit_text(row.quantity),
            )


def change_lines(changes: Sequence[Change]) -> Iterator[str]:
    """Yield one line per quantity: barefoot, orthosis, the change, also recorded and printed."""
    paper = "paper" if any(change.paper is not None for change in changes) else ""
    yield "From barefoot to orthosis"
    yield _change_line("", "barefoot", "orthosis", "change", "[%]", "recorded", paper, "unit")
    for section, rows in groupby(changes, lambda change: change.quantity.section):
        yield section
        for row in rows:
            quantity = row.quantity
            yield _change_line(
                quantity.label,
                number_text(row.barefoot, quantity),
                number_text(row.orthosis, quantity),
                number_text(row.value, quantity, sign=True),
                f"{100.0 * row.value / row.barefoot:+.0f}" if row.barefoot else "",
                number_text(row.recorded, quantity, sign=True),
                str(row.paper or ""),
                unit_text(quantity),
            )


def evaluation_notes(evaluations: Iterable[Evaluation]) -> tuple[str, ...]:
    """Return what the reader of the tables should know, one sentence each."""
    evaluations = tuple(evaluations)
    notes = [f"{each.gait.name}: {note}" for each in evaluations for note in each.notes]
    notes += [note for each in evaluations for note in _peak_note(each)]
    if any(each.recorded is not None for each in evaluations):
        notes.append(
            "recorded values of a difference are those of single recorded strides or stances: how "
            "much the patient varies"
        )
    if any(each.gait.walker.patient.id == PATIENT for each in evaluations):
        notes.append(
            "paper: what Sreenivasa et al. (2017) print for their own solution, whose bounds are "
            "not known; they truncate"
        )
    notes.append("BW: body weight with what is worn")
    return tuple(notes)


def _peak_note(evaluation: Evaluation) -> Iterable[str]:
    """Yield how the largest vertical force compares with recordings and earlier predictions."""
    rows = [row for row in evaluation.rows if row.quantity.key.startswith("peak_vertical_force")]
    ours = [row.value for row in rows if row.value is not None]
    recorded = [row.recorded for row in rows if row.recorded is not None]
    if ours and recorded:
        largest = max(each.high for each in recorded)
        yield (
            f"{evaluation.gait.name}: the vertical force peaks at {max(ours):.2f} body weights, "
            f"{max(ours) / largest:.0%} of the largest recorded peak; earlier predictions reached "
            f"about {_LITERATURE:.0%} of normal"
        )


def _line(label: str, ours: str, recorded: str, is_: str, paper: str, unit: str) -> str:
    """Return a line of the table of an evaluation."""
    return f" {label:<22}{ours:>6}  {recorded:>20}  {is_:<5} {paper:>11}  {unit}".rstrip()


def _change_line(
    label: str, barefoot: str, orthosis: str, change: str, share: str, recorded: str, paper: str,
    unit: str,
) -> str:  # fmt: skip
    """Return a line of the table of changes."""
    ours = f"{barefoot:>8}{orthosis:>9}{change:>9}{share:>6}"
    return f" {label:<22}{ours}{recorded:>9}{paper:>7}  {unit}".rstrip()


def number_text(value: float | None, quantity: Quantity, sign: bool = False) -> str:
    """Return a value as people read it, "-" for none."""
    if value is None:
        return "-"
    shown = float(to_degrees(value)) if quantity.unit == "rad" else value
    digits = _DIGITS[quantity.unit]
    if _is_share(quantity):
        shown, digits = 100.0 * value, 1
    shown = round(shown, digits) + 0.0  # adding 0.0 makes 0.0 of -0.0
    return f"{shown:{'+' if sign else ''}.{digits}f}"


def _is_share(quantity: Quantity) -> bool:
    """Return whether people read a quantity in per cent of the stride."""
    return "_share" in quantity.key


def spread_text(found: Spread | None, quantity: Quantity) -> str:
    """Return "mean [min, max]", "-" for none."""
    if found is None:
        return "-"
    mean, low, high = (number_text(x, quantity) for x in (found.mean, found.low, found.high))
    return f"{mean} [{low}, {high}]"


def unit_text(quantity: Quantity) -> str:
    """Return the unit as people read it."""
    return "%" if _is_share(quantity) else _SHOWN_UNIT.get(quantity.unit, quantity.unit)
