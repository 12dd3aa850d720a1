"""An evaluation as tables for the terminal, 80 columns wide, and as JSON and CSV in SI units."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.evaluation.evaluate import Change, Evaluation, Row
from pathwalker_cli.evaluation.paper import PATIENT, PaperClaim, PaperNumber
from pathwalker_cli.evaluation.recorded import Spread
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.stride.measure import Measure

_LITERATURE: Final = 2.0
"""Peak vertical force over that of healthy walking in earlier predictions, article, section 1."""


def evaluation_lines(evaluation: Evaluation) -> Iterator[str]:
    """Yield one line per measure: of the run, recorded mean and range, the article's number."""
    gait, patient = evaluation.gait, evaluation.gait.walker.patient.id
    compared = evaluation.recorded is not None
    yield f"{gait.name}: {gait.problem}, patient {patient}"
    head = ("recorded", "run is") if compared else ("", "")
    yield _line("", "run", *head, "paper" if patient == PATIENT else "", "unit")
    if compared:
        yield _line("", "", "mean [min, max]", "", "", "")
    for section, rows in groupby(evaluation.rows, lambda row: row.measure.section):
        yield section
        for row in rows:
            measure = row.measure
            recorded = spread_text(row.recorded, measure) if compared else ""
            yield _line(measure.row, measure.text(row.value), recorded, row.position or "",
                        str(row.paper or ""), measure.shown_unit)  # fmt: skip


def change_lines(changes: Sequence[Change]) -> Iterator[str]:
    """Yield one line per measure: barefoot, orthosis, the change, also recorded and printed."""
    paper = "paper" if any(change.paper is not None for change in changes) else ""
    recorded = "recorded" if any(change.recorded is not None for change in changes) else ""
    yield "From barefoot to orthosis"
    yield _change_line("", "barefoot", "orthosis", "change", "[%]", recorded, paper, "unit")
    for section, rows in groupby(changes, lambda change: change.measure.section):
        yield section
        for row in rows:
            measure = row.measure
            yield _change_line(
                measure.row, measure.text(row.barefoot), measure.text(row.orthosis),
                measure.text(row.value, sign=True), row.percent,
                measure.text(row.recorded, sign=True) if recorded else "",
                str(row.paper or ""), measure.shown_unit,
            )  # fmt: skip


def evaluation_notes(evaluations: Sequence[Evaluation]) -> tuple[str, ...]:
    """Return what the reader of the tables should know, one sentence each."""
    notes = [
        f"{each.gait.name}: {note}" for each in evaluations for note in (*each.notes, *each.unusual)
    ]
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
    rows = [row for row in evaluation.rows if row.measure.key.startswith("peak_vertical_force")]
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
    return f" {label:<22}{ours:>6}  {recorded:>20}  {is_:<6}{paper:>11}  {unit}".rstrip()


def _change_line(
    label: str, barefoot: str, orthosis: str, change: str, share: str, recorded: str, paper: str,
    unit: str,
) -> str:  # fmt: skip
    """Return a line of the table of changes."""
    ours = f"{barefoot:>8}{orthosis:>9}{change:>9}{share:>6}"
    return f" {label:<22}{ours}{recorded:>9}{paper:>7}  {unit}".rstrip()


def spread_text(values: Spread | None, measure: Measure) -> str:
    """Return "mean [min, max]", "-" for none."""
    if values is None:
        return "-"
    return f"{measure.text(values.mean)} [{measure.text(values.low)}, {measure.text(values.high)}]"


def evaluation_content(
    evaluations: Sequence[Evaluation], changes: Sequence[Change] = ()
) -> dict[str, Any]:
    """Return everything that was evaluated, ready for JSON."""
    return {
        "runs": [_run(each) for each in evaluations],
        "changes": {change.measure.key: _change(change) for change in changes},
    }


def write_csv(path: Path, evaluations: Iterable[Evaluation]) -> None:
    """Write one row per run and measure; empty cells for what is not known."""
    header = ("run", "quantity", "unit", "value", "recorded_mean", "recorded_min", "recorded_max",
              "recorded_count", "position", "paper")  # fmt: skip
    write_table(path, header, (_cells(each, row) for each in evaluations for row in each.rows))


def _run(evaluation: Evaluation) -> dict[str, Any]:
    """Return one gait and its measures."""
    gait, recorded = evaluation.gait, evaluation.recorded
    return {
        "name": gait.name,
        "problem": gait.problem,
        "patient": gait.walker.patient.id,
        "condition": gait.walker.condition,
        "recordings": [trial.name for trial in recorded.trials] if recorded else [],
        "one_trial": evaluation.one_trial,
        "notes": list(evaluation.notes),
        "unusual": list(evaluation.unusual),
        "quantities": {row.measure.key: _row(row) for row in evaluation.rows},
    }


def _row(row: Row) -> dict[str, Any]:
    """Return one measure."""
    return {
        "value": row.value,
        "unit": row.measure.unit,
        "recorded": _spread(row.recorded),
        "position": row.position,
        "paper": _paper(row.paper),
        "paper_recorded": _paper(row.paper_recorded),
    }


def _spread(values: Spread | None) -> dict[str, float] | None:
    """Return mean and range of recorded values."""
    if values is None:
        return None
    return {"mean": values.mean, "min": values.low, "max": values.high, "count": values.count}


def _change(change: Change) -> dict[str, Any]:
    """Return one change."""
    return {
        "barefoot": change.barefoot,
        "orthosis": change.orthosis,
        "change": change.value,
        "unit": change.measure.unit,
        "recorded": change.recorded,
        "paper": _paper(change.paper),
    }


def _paper(printed: PaperNumber | PaperClaim | None) -> dict[str, Any] | None:
    """Return what the article prints: the value in SI units, and as it stands there."""
    if printed is None:
        return None
    content: dict[str, Any] = {"printed": str(printed), "place": printed.place}
    if isinstance(printed, PaperNumber):
        low, high = printed.bounds
        content |= {"value": printed.value, "min": low, "max": high}
        content |= {"printed_unit": printed.unit, "note": printed.note}
    return content


def _cells(evaluation: Evaluation, row: Row) -> list[Any]:
    """Return the cells of a row of the CSV file."""
    values = row.recorded
    recorded = (values.mean, values.low, values.high, values.count) if values else (None,) * 4
    paper = None if row.paper is None else row.paper.value
    return [evaluation.gait.name, row.measure.key, row.measure.unit, row.value, *recorded,
            row.position, paper]  # fmt: skip
