"""The table of a report: what every run walks like, beside the recordings and the change."""

from __future__ import annotations

from collections.abc import Sequence

from pathwalker_cli.evaluation.evaluate import Change
from pathwalker_cli.evaluation.tables import spread_text
from pathwalker_cli.report.content import Row, Section, Table
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in

__all__ = ["gait_section"]


def gait_section(runs: Sequence[ReportRun], changes: Sequence[Change]) -> Section:
    """Return the table of steps, times, crouch, forces and effort.

    Args:
        runs: The runs.
        changes: From barefoot to orthosis; none where there are not both.
    """
    head, columns = ["", "unit"], "ww"
    for run in runs:
        head += [run.label, *(["recorded, mean [min, max]", "is"] if _compared(run) else [])]
        columns += "nnw" if _compared(run) else "n"
    if changes:
        head += ["change", "[%]", "recorded change"]
        columns += "nnn"
    rows = [_row(measure, runs, changes) for measure in measures_in("report")]
    notes = ["BW: body weight with what is worn; is: below, in or above the recorded range"]
    notes += [note for run in runs for note in run.evaluation.notes]
    found = tuple(row for row in rows if row is not None)
    table = Table(tuple(head), found, notes=tuple(dict.fromkeys(notes)), columns=columns)
    return Section("Gait", tables=(table,))


def _compared(run: ReportRun) -> bool:
    return run.evaluation.recorded is not None


def _row(measure: Measure, runs: Sequence[ReportRun], changes: Sequence[Change]) -> Row | None:
    """Return the row of a measure, None if no run tells it."""
    found = [
        next((row for row in run.evaluation.rows if row.measure.key == measure.key), None)
        for run in runs
    ]
    if not any(found):
        return None
    cells = [measure.label.replace("flexion", "flexion (crouch)"), measure.shown_unit]
    for run, row in zip(runs, found, strict=True):
        cells.append(measure.text(row.value if row else None))
        if _compared(run):
            cells.append(spread_text(row.recorded if row else None, measure))
            cells.append((row.position or "") if row else "")
    if changes:
        cells += _change(next((c for c in changes if c.measure.key == measure.key), None))
    return Row(tuple(cells))


def _change(change: Change | None) -> tuple[str, str, str]:
    """Return the change, its share and the recorded one."""
    if change is None:
        return "-", "-", "-"
    share = f"{100.0 * change.value / change.barefoot:+.0f}" if change.barefoot else "-"
    measure = change.measure
    return (
        measure.text(change.value, sign=True), share, measure.text(change.recorded, sign=True)
    )  # fmt: skip
