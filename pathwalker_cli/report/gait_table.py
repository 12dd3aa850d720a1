"""The table of a report: what every run walks like, beside the recordings and the change."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Final

from pathwalker_cli.evaluation.evaluate import Change
from pathwalker_cli.evaluation.evaluate import Row as QuantityRow
from pathwalker_cli.evaluation.quantities import Quantity, quantity_of
from pathwalker_cli.evaluation.text import number_text, spread_text, unit_text
from pathwalker_cli.report.content import Row, Section, Table
from pathwalker_cli.report.runs import ReportRun

__all__ = ["gait_section"]

_BOTH: Final = ("right", "left")
_SHOWN: Final = (
    "walking_speed",
    *(f"step_length_{side}" for side in _BOTH),
    "cadence",
    "stride_time",
    *(f"{stem}_{side}" for stem in ("stance_share", "stance_time") for side in _BOTH),
    *(f"{stem}_{side}" for stem in ("swing_share", "swing_time") for side in _BOTH),
    "double_support_share",
    "double_support_time",
    *(f"min_stance_knee_flexion_{side}" for side in _BOTH),
    *(f"peak_vertical_force_{side}" for side in _BOTH),
    "effort_per_distance",
)
"""Quantities in the order of the page."""

_LABELS: Final = {
    "min_stance_knee_flexion": "least stance knee flexion (crouch)",
    "peak_vertical_force": "peak vertical force",
}
"""Names of quantities that say less without the heading they have elsewhere."""


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
    rows = [_row(quantity_of(key), runs, changes) for key in _SHOWN]
    notes = ["BW: body weight with what is worn; is: below, in or above the recorded range"]
    notes += [note for run in runs for note in run.evaluation.notes]
    found = tuple(row for row in rows if row is not None)
    table = Table(tuple(head), found, notes=tuple(dict.fromkeys(notes)), columns=columns)
    return Section("Gait", tables=(table,))


def _compared(run: ReportRun) -> bool:
    return run.evaluation.recorded is not None


def _row(quantity: Quantity, runs: Sequence[ReportRun], changes: Sequence[Change]) -> Row | None:
    """Return the row of a quantity, None if no run tells it."""
    found = [_found(run, quantity) for run in runs]
    if not any(found):
        return None
    cells = [_label(quantity), unit_text(quantity)]
    for run, row in zip(runs, found, strict=True):
        cells.append(number_text(row.value if row else None, quantity))
        if _compared(run):
            cells.append(spread_text(row.recorded if row else None, quantity))
            cells.append((row.position or "") if row else "")
    if changes:
        cells += _change(next((c for c in changes if c.quantity.key == quantity.key), None))
    return Row(tuple(cells))


def _found(run: ReportRun, quantity: Quantity) -> QuantityRow | None:
    try:
        return run.evaluation.row(quantity.key)
    except KeyError:
        return None


def _label(quantity: Quantity) -> str:
    """Return what a quantity is called without its heading."""
    stem, _, side = quantity.key.rpartition("_")
    return f"{_LABELS[stem]}, {side}" if stem in _LABELS else quantity.label


def _change(change: Change | None) -> tuple[str, str, str]:
    """Return the change, its share and the recorded one."""
    if change is None:
        return "-", "-", "-"
    share = f"{100.0 * change.value / change.barefoot:+.0f}" if change.barefoot else "-"
    quantity = change.quantity
    return (number_text(change.value, quantity, sign=True), share,
            number_text(change.recorded, quantity, sign=True))  # fmt: skip
