"""An evaluation as `evaluation.json` and `evaluation.csv`: SI units and radians."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.evaluation.evaluate import Change, Evaluation, Row
from pathwalker_cli.evaluation.paper import PaperClaim, PaperNumber
from pathwalker_cli.evaluation.spread import Spread
from pathwalker_cli.io.csv_file import write_table

__all__ = ["evaluation_content", "write_csv"]

_COLUMNS: Final = (
    "run",
    "quantity",
    "unit",
    "value",
    "recorded_mean",
    "recorded_min",
    "recorded_max",
    "recorded_count",
    "position",
    "paper",
)


def evaluation_content(
    evaluations: Sequence[Evaluation], changes: Sequence[Change] = ()
) -> dict[str, Any]:
    """Return everything that was evaluated, ready for JSON.

    Args:
        evaluations: One or more gaits beside the recordings.
        changes: Changes from barefoot to orthosis.
    """
    return {
        "runs": [_run(each) for each in evaluations],
        "changes": {change.quantity.key: _change(change) for change in changes},
    }


def write_csv(path: str | Path, evaluations: Iterable[Evaluation]) -> None:
    """Write one row per run and quantity; empty cells for what is not known."""
    write_table(
        path, _COLUMNS, (_cells(each.gait.name, row) for each in evaluations for row in each.rows)
    )


def _run(evaluation: Evaluation) -> dict[str, Any]:
    """Return one gait and its quantities."""
    gait, recorded = evaluation.gait, evaluation.recorded
    return {
        "name": gait.name,
        "problem": gait.problem,
        "patient": gait.walker.patient.id,
        "condition": gait.walker.condition,
        "recordings": [trial.name for trial in recorded.trials] if recorded else [],
        "one_trial": evaluation.one_trial,
        "notes": list(evaluation.notes),
        "quantities": {row.quantity.key: _row(row) for row in evaluation.rows},
    }


def _row(row: Row) -> dict[str, Any]:
    """Return one quantity."""
    return {
        "value": row.value,
        "unit": row.quantity.unit,
        "recorded": _spread(row.recorded),
        "position": row.position,
        "paper": _paper(row.paper),
        "paper_recorded": _paper(row.paper_recorded),
    }


def _spread(found: Spread | None) -> dict[str, float] | None:
    """Return mean and range of recorded values."""
    if found is None:
        return None
    return {"mean": found.mean, "min": found.low, "max": found.high, "count": found.count}


def _change(change: Change) -> dict[str, Any]:
    """Return one change."""
    return {
        "barefoot": change.barefoot,
        "orthosis": change.orthosis,
        "change": change.value,
        "unit": change.quantity.unit,
        "recorded": change.recorded,
        "paper": _paper(change.paper),
    }


def _paper(printed: PaperNumber | PaperClaim | None) -> dict[str, Any] | None:
    """Return what the article prints: the value in SI units, and as it stands there."""
    if printed is None:
        return None
    found: dict[str, Any] = {"printed": str(printed), "place": printed.place}
    if isinstance(printed, PaperNumber):
        low, high = printed.bounds
        found |= {"value": printed.value, "min": low, "max": high}
        found |= {"printed_unit": printed.unit, "note": printed.note}
    return found


def _cells(run: str, row: Row) -> list[Any]:
    """Return the cells of a row of the CSV file."""
    spread = row.recorded
    recorded = (spread.mean, spread.low, spread.high, spread.count) if spread else (None,) * 4
    value = None if row.paper is None else row.paper.value
    key, unit = row.quantity.key, row.quantity.unit
    return [run, key, unit, row.value, *recorded, row.position or "", value]
