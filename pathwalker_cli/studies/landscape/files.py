"""The files of a landscape: every local optimum as a row, the result in short, the figure."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.landscape.figures import save_landscape_figure
from pathwalker_cli.studies.landscape.result import Landscape, Point, Region

__all__ = ["ENTRIES", "landscape_content", "write_landscape"]

_TABLE, _SUMMARY = "landscape.csv", "landscape.json"

ENTRIES: Final = frozenset({"base", "points", "figures", _TABLE, _SUMMARY})
"""Everything that the folder of a landscape holds."""


def _header() -> tuple[str, ...]:
    return (
        "point",
        "dorsiflexion_stiffness [N m/rad]",
        "plantarflexion_stiffness [N m/rad]",
        "branch",
        "status",
        "cost_increase [1]",
        *(measure.column for measure in measures_in("studies")),
        "solves",
        "iterations",
        "seconds",
    )  # fmt: skip


def write_landscape(folder: Path, landscape: Landscape) -> None:
    """Write table, summary and figure into a folder.

    Args:
        folder: The folder; made if it does not exist.
        landscape: The landscape.
    """
    (folder / "figures").mkdir(parents=True, exist_ok=True)
    write_table(folder / _TABLE, _header(), _rows(landscape))
    write_json(folder / _SUMMARY, landscape_content(landscape))
    save_landscape_figure(folder / "figures", landscape)


def _rows(landscape: Landscape) -> Iterator[list[Any]]:
    """Yield one row for every local optimum, with what it costs more than the best of all."""
    least = landscape.best.cost
    for point in landscape.points:
        solved = np.isfinite(point.cost)
        more = (point.cost - least) / abs(least) if solved else None
        numbers = [point.measures.get(measure.key) for measure in measures_in("studies")]
        yield [
            point.name, point.k_d, point.k_p, point.branch, point.status, more, *numbers,
            point.times, point.iterations, point.seconds,
        ]  # fmt: skip


def landscape_content(landscape: Landscape) -> dict[str, Any]:
    """Return the content of the summary."""
    return {
        "problem": landscape.problem,
        "patient": landscape.patient,
        "side": landscape.side,
        "dorsiflexion_stiffness": landscape.k_d.tolist(),
        "plantarflexion_stiffness": landscape.k_p.tolist(),
        "best": _point(landscape.best),
        "start": _point(landscape.optimum),
        "released": None if landscape.released is None else _point(landscape.released),
        "better_than_start": landscape.better_than_start,
        "tolerance": landscape.tolerance,
        "region": _region(landscape.region),
        "reintegration": {
            name: {"position": _number(q), "velocity": _number(v)}
            for name, (q, v) in landscape.checks.items()
        },
        "reintegration_allowed": dict(
            zip(("position", "velocity"), landscape.allowed, strict=True)
        ),
        "grid_points": len(landscape.bests),
        "failed_points": [point.name for point in landscape.failed],
        "points_with_several_optima": [point.name for point in landscape.branched],
        "solves": landscape.solves,
        "failed_solves": landscape.failed_solves,
        "median_iterations": float(np.median(landscape.iterations)),
        "seconds": landscape.seconds,
        "sweeps": landscape.sweeps,
        "sweeps_found_nothing_new": landscape.complete,
    }


def _region(region: Region | None) -> dict[str, Any] | None:
    """Return a region as plain values."""
    if region is None:
        return None
    return {
        "dorsiflexion_stiffness": list(region.k_d),
        "plantarflexion_stiffness": list(region.k_p),
        "share_of_points": region.share,
        "points": region.points,
        "reaches": list(region.ends),
    }


def _point(point: Point) -> dict[str, Any]:
    """Return a point as plain values."""
    return {
        "point": point.name,
        "status": point.status,
        "dorsiflexion_stiffness": _number(point.k_d),
        "plantarflexion_stiffness": _number(point.k_p),
        "measures": dict(point.measures),
    }


def _number(value: float) -> float | None:
    """Return a number, None for what is none: JSON knows no NaN."""
    return value if np.isfinite(value) else None
