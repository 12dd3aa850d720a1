"""What the program shall reach, beside what it reached."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from report import Report, Table, shown

__all__ = ["goals_table"]


@dataclass(frozen=True)
class Goal:
    """A limit that a figure shall not exceed.

    Args:
        what: What is measured.
        key: Its key in the reports; `{n}` stands for the intervals that are compared.
        limit: The limit.
        unit: Its unit.
    """

    what: str
    key: str
    limit: float
    unit: str


GOALS: Final = (
    Goal("pathwalker --help", "pathwalker --help", 0.3, "CPU s"),
    Goal(
        "MAPD-Barefoot, {n} intervals, synthetic start, nothing cached",
        "mapd-barefoot, {n}, cold", 20.0, "CPU s",
    ),
    Goal("the same, cached", "mapd-barefoot, {n}, cached", 10.0, "CPU s"),
    Goal(
        "MAPD-Orthosis, one start, cached, {n} intervals",
        "mapd-orthosis, {n}, cached", 12.0, "CPU s",
    ),
    Goal(
        "MAPD-Orthosis, one start, cached, refined as shipped",
        "mapd-orthosis, shipped, cached", 12.0, "CPU s",
    ),
    Goal("one iteration on {n} intervals, the slower problem", "iteration", 0.05, "CPU s"),
    Goal("one spring 5 % softer, warm, {n} intervals", "warm", 0.5, "CPU s"),
    Goal("100 draws of strengths, two cores, {n} intervals", "draws, {n}", 60.0, "wall s"),
    Goal("100 draws of strengths, two cores, mesh as shipped", "draws, shipped", 60.0, "wall s"),
    Goal(
        "seconds per iteration from {n} intervals to the finest mesh; 1: linear",
        "growth", 1.0, "1",
    ),
)  # fmt: skip
PEAK_LIMIT: Final = 1024.0


def goals_table(reports: Mapping[str, Report], intervals: int, quick: bool) -> Table:
    """Return goals and what was reached.

    Args:
        reports: Reports of the sections that ran.
        intervals: Intervals of the mesh on which problems were compared.
        quick: Whether sizes were toys.
    """
    reached: dict[str, float] = {}
    peaks: dict[str, float] = {}
    for report in reports.values():
        reached |= report.reached
        peaks |= report.peaks
    table = Table("Goals", ("what", "goal", "reached", "unit", "met"))
    if quick:
        table.notes = ("Toy sizes and few repetitions: they prove that the suite runs, no more.",)
    for goal in GOALS:
        what, key = (text.format(n=intervals) for text in (goal.what, goal.key))
        _add(table, what, goal.limit, reached.get(key), goal.unit)
    most = max(peaks, key=lambda name: peaks[name], default="")
    where = f"peak memory of any process ({most})" if most else "peak memory of any process"
    _add(table, where, PEAK_LIMIT, peaks.get(most), "MB")
    return table


def _add(table: Table, what: str, limit: float, value: float | None, unit: str) -> None:
    """Add a row."""
    if value is None:
        table.rows.append([what, limit, "not measured", unit, "-"])
    else:
        table.rows.append([what, limit, shown(value), unit, "yes" if value <= limit else "no"])
