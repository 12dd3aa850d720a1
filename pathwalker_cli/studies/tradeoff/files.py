"""The files of a trade-off: every point as a row, and the figure."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.tradeoff.figures import save_tradeoff_figure
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff

__all__ = ["ENTRIES", "tradeoff_content", "tradeoff_of_content", "write_tradeoff"]

_TABLE, _SUMMARY = "tradeoff.csv", "tradeoff.json"

ENTRIES: Final = frozenset({"base", "points", "runs", "figures", _TABLE, _SUMMARY})
"""Everything that the folder of a trade-off holds."""


def _header() -> tuple[str, ...]:
    return (
        "walking_speed_weight [s^2/m^2]",
        "status",
        "mesh",
        "dominated",
        *(measure.column for measure in measures_in("studies")),
        "reintegration_position_error [rad or m]",
        "reintegration_velocity_error [rad/s or m/s]",
        "intervals",
        "cost_on_base_mesh [1]",
        "local_optima",
        "iterations",
    )  # fmt: skip


def write_tradeoff(folder: Path, tradeoff: Tradeoff) -> None:
    """Write table, summary and figure into a folder.

    Args:
        folder: The folder; made if it does not exist.
        tradeoff: The trade-off.
    """
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    write_table(folder / _TABLE, _header(), _rows(tradeoff))
    write_json(folder / _SUMMARY, tradeoff_content(tradeoff))
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
                "errors": list(map(_number, point.errors)),
                "intervals": point.intervals,
                "cost_on_base_mesh": _number(point.cost_on_base),
                "local_optima": point.branches,
                "iterations": point.iterations,
            }
            for point in tradeoff.points
        ],
        "base_weight": tradeoff.base_weight,
        "optimum": dict(tradeoff.optimum),
        "front": [point.weight for point in tradeoff.front],
        "recorded_walking_speed": None if tradeoff.recorded is None else list(tradeoff.recorded),
        "tolerances": list(tradeoff.tolerances),
        "solves": tradeoff.solves,
        "failed_solves": tradeoff.failed_solves,
        "median_iterations": tradeoff.median_iterations,
        "seconds": tradeoff.seconds,
        "seconds_refined": tradeoff.seconds_refined,
        "sweeps": tradeoff.sweeps,
        "sweeps_found_nothing_new": tradeoff.complete,
    }


def tradeoff_of_content(content: Mapping[str, Any]) -> Tradeoff:
    """Return a trade-off as its summary tells it; what the solves took is left out.

    Raises:
        KeyError, TypeError, ValueError: If it is not what `tradeoff_content` returns.
    """
    points = tuple(
        FrontPoint(
            name=f"w{entry['walking_speed_weight']:g}",
            weight=float(entry["walking_speed_weight"]),
            status=str(entry["status"]),
            mesh_status=str(entry["mesh"] or ""),
            measures={name: float(value) for name, value in entry["measures"].items()},
            errors=(_value(entry["errors"][0]), _value(entry["errors"][1])),
            intervals=int(entry["intervals"]),
            cost_on_base=_value(entry["cost_on_base_mesh"]),
            branches=int(entry["local_optima"]),
            iterations=int(entry["iterations"]),
        )
        for entry in content["points"]
    )
    recorded = content["recorded_walking_speed"]
    return Tradeoff(
        patient=str(content["patient"]),
        problem=str(content["problem"]),
        condition=str(content["condition"]),
        points=points,
        base_weight=float(content["base_weight"]),
        optimum=content["optimum"],
        recorded=None if recorded is None else (float(recorded[0]), float(recorded[1])),
        tolerances=(float(content["tolerances"][0]), float(content["tolerances"][1])),
        solves=int(content["solves"]),
        failed_solves=int(content["failed_solves"]),
        iterations=(),
        seconds=float(content["seconds"]),
        seconds_refined=float(content["seconds_refined"]),
        sweeps=int(content["sweeps"]),
        complete=bool(content["sweeps_found_nothing_new"]),
    )


def _number(value: float) -> float | None:
    """Return a number, None for what is none: JSON knows no NaN."""
    return value if np.isfinite(value) else None


def _value(number: float | None) -> float:
    return float("nan") if number is None else float(number)


def _rows(tradeoff: Tradeoff) -> Iterator[list[Any]]:
    """Yield one row for every weight; cells without a number stay empty."""
    for point in tradeoff.points:
        numbers = [point.measures.get(measure.key) for measure in measures_in("studies")]
        dominated = "yes" if point.solved and tradeoff.dominated(point) else "no"
        if not point.solved:
            empty = [None] * (len(_header()) - 2)
            yield [point.weight, point.status, *empty]
            continue
        yield [
            point.weight, point.status, point.mesh_status, dominated, *numbers, *point.errors,
            point.intervals, point.cost_on_base, point.branches, point.iterations,
        ]  # fmt: skip
