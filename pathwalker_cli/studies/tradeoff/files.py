"""The files of a trade-off: every point as a row, and the figure."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.studies.measures import MEASURES, write_table
from pathwalker_cli.studies.tradeoff.figures import save_tradeoff_figure
from pathwalker_cli.studies.tradeoff.result import Tradeoff

__all__ = ["ENTRIES", "tradeoff_content", "write_tradeoff"]

_TABLE: Final = "tradeoff.csv"

ENTRIES: Final = frozenset({"base", "points", "runs", "figures", _TABLE})
"""Everything that the folder of a trade-off holds."""

_HEADER: Final = (
    "walking_speed_weight [s^2/m^2]",
    "status",
    "mesh",
    "dominated",
    *(measure.column for measure in MEASURES),
    "reintegration_position_error [rad or m]",
    "reintegration_velocity_error [rad/s or m/s]",
    "intervals",
    "cost_on_base_mesh [1]",
    "local_optima",
    "iterations",
)


def write_tradeoff(folder: Path, tradeoff: Tradeoff) -> None:
    """Write table and figure into a folder.

    Args:
        folder: The folder; made if it does not exist.
        tradeoff: The trade-off.
    """
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    write_table(folder / _TABLE, _HEADER, _rows(tradeoff))
    if tradeoff.solved:
        save_tradeoff_figure(folder / "figures", tradeoff)


def tradeoff_content(tradeoff: Tradeoff) -> dict[str, Any]:
    """Return a trade-off as plain values; SI units."""
    return {
        "problem": tradeoff.problem,
        "patient": tradeoff.patient,
        "condition": tradeoff.condition,
        "points": [
            {
                "walking_speed_weight": point.weight,
                "status": point.status,
                "mesh": point.mesh_status if point.solved else None,
                "dominated": tradeoff.dominated(point) if point.solved else None,
                "measures": dict(point.measures),
                "local_optima": point.branches,
                "iterations": point.iterations,
            }
            for point in tradeoff.points
        ],
        "front": [point.weight for point in tradeoff.front],
        "recorded_walking_speed": None if tradeoff.recorded is None else list(tradeoff.recorded),
        "solves": tradeoff.solves,
        "failed_solves": tradeoff.failed_solves,
        "median_iterations": tradeoff.median_iterations,
        "seconds": tradeoff.seconds,
        "seconds_refined": tradeoff.seconds_refined,
        "sweeps": tradeoff.sweeps,
        "sweeps_found_nothing_new": tradeoff.complete,
    }


def _rows(tradeoff: Tradeoff) -> Iterator[list[Any]]:
    """Yield one row for every weight; cells without a number stay empty."""
    for point in tradeoff.points:
        numbers = [point.measures.get(measure.key) for measure in MEASURES]
        dominated = "yes" if point.solved and tradeoff.dominated(point) else "no"
        if not point.solved:
            empty = [None] * (len(_HEADER) - 2)
            yield [point.weight, point.status, *empty]
            continue
        yield [
            point.weight, point.status, point.mesh_status, dominated, *numbers, *point.errors,
            point.intervals, point.cost_on_base, point.branches, point.iterations,
        ]  # fmt: skip
