"""A landscape as files and in plain words on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.studies.landscape.result import Landscape, Point, Region
from pathwalker_cli.studies.measures import measures_with

FILES: Final = ("landscape.csv", "landscape.json")


def write_tables(landscape: Landscape, folder: Path) -> None:
    """Write every local optimum as a row, and the result in short."""
    measures = measures_with(landscape.further)
    header = ("point", "dorsiflexion_stiffness [N m/rad]", "plantarflexion_stiffness [N m/rad]",
              "branch", "status", "cost_increase [1]", *(measure.column for measure in measures),
              "solves", "iterations", "seconds")  # fmt: skip
    rows, least = [], landscape.best.cost
    for point in landscape.points:
        more = (point.cost - least) / abs(least) if np.isfinite(point.cost) else None
        numbers = [point.measures.get(measure.key) for measure in measures]
        rows.append((point.name, point.k_d, point.k_p, point.branch, point.status, more, *numbers,
                     point.times, point.iterations, point.seconds))  # fmt: skip
    write_table(folder / FILES[0], header, rows)
    write_json(folder / FILES[1], landscape_content(landscape))


def landscape_content(landscape: Landscape) -> dict[str, Any]:
    """Return the content of the summary."""
    return {
        "problem": landscape.problem,
        "patient": landscape.patient,
        "side": landscape.side,
        "dorsiflexion_stiffness": landscape.k_d.tolist(),
        "plantarflexion_stiffness": landscape.k_p.tolist(),
        "best": _point_content(landscape.best),
        "start": _point_content(landscape.optimum),
        "released": None if landscape.released is None else _point_content(landscape.released),
        "better_than_start": landscape.better_than_start,
        "tolerance": landscape.tolerance,
        "region": _region_content(landscape.region),
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


def _region_content(region: Region | None) -> dict[str, Any] | None:
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


def _point_content(point: Point) -> dict[str, Any]:
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


def landscape_lines(landscape: Landscape) -> list[str]:
    """Return the result line by line: label and text."""
    rows = [
        ("best springs found", _point(landscape.best, landscape.side)),
        ("", f"cost {landscape.best.cost:.5g}, {_gait(landscape.best)}"),
        *_against_start(landscape),
        *_region(landscape),
        *_proof(landscape),
    ]
    return [f"{label:<22}{text}" for label, text in rows]


def _springs(k_d: float, k_p: float) -> str:
    degrees = f"{np.deg2rad(k_d):.2f} and {np.deg2rad(k_p):.2f} N m/deg"
    return f"K_D {k_d:.1f}, K_P {k_p:.1f} N m/rad ({degrees})"


def _point(point: Point, side: str) -> str:
    where = "both sides" if side == "both" else f"{side} side"
    return f"{_springs(point.k_d, point.k_p)}, {where}"


def _gait(point: Point) -> str:
    knees = ", ".join(
        f"{side} {np.rad2deg(point.measures[f'min_stance_knee_flexion_{side}']):.1f}"
        for side in ("left", "right")
    )
    return f"{point.measures['walking_speed']:.3f} m/s, least knee flexion {knees} deg"


def _against_start(landscape: Landscape) -> Iterator[tuple[str, str]]:
    """Say how the best point compares with the optimum that the study began with."""
    start, better = landscape.optimum, landscape.better_than_start
    if landscape.side == "both":
        text = f"cost {start.cost:.5g}: its springs are not tied to be equal on both sides"
        yield "optimum, springs free", text
        return
    text = f"cost {start.cost:.5g} with {_springs(start.k_d, start.k_p)}"
    yield "optimum at the start", text
    if better > 1e-3:
        yield "", f"the landscape holds a local optimum that is {100 * better:.1f} % better"
    end = landscape.released
    if end is not None and end.measures:
        text = f"cost {end.cost:.5g} with {_springs(end.k_d, end.k_p)}"
        yield "freed from the best", text
    elif end is not None:
        yield "freed from the best", end.status


def _region(landscape: Landscape) -> Iterator[tuple[str, str]]:
    """Say which springs cost hardly more than the best."""
    region, share = landscape.region, 100.0 * landscape.tolerance
    label = f"within {share:g} % of it"
    if region is None:
        yield label, "no point of the grid: choose values nearer to the optimum"
        return
    for name, (low, high) in (("K_D", region.k_d), ("K_P", region.k_p)):
        degrees = f"{np.deg2rad(low):.2f} to {np.deg2rad(high):.2f} N m/deg"
        yield label, f"{name} {low:.1f} to {high:.1f} N m/rad ({degrees})"
        label = ""
    share, ends = 100.0 * region.share, "all of it lies inside the range that was looked at"
    if region.ends:
        ends = f"it reaches the end of the range at {', '.join(region.ends)} and may go on beyond"
    yield "", f"{region.points} grid points, {share:.0f} % of those solved; {ends}"
    yield "", "that region, not a point, is the recommendation"


def _proof(landscape: Landscape) -> Iterator[tuple[str, str]]:
    """Say how far the points can be trusted and what they took."""
    if landscape.checks:
        q, v = (max(errors[i] for errors in landscape.checks.values()) for i in (0, 1))
        text = f"at most {q:.1e} rad or m, {v:.1e} rad/s or m/s"
        yield "re-integration error", f"{text} at K_D, K_P {_places(landscape, landscape.checks)}"
    if landscape.rough:
        limits = "{:g} rad or m, {:g} rad/s or m/s".format(*landscape.allowed)
        where = _places(landscape, landscape.rough)
        yield "", f"the mesh of the base is too coarse at {where}: {limits} are allowed"
    points, failed, several = (
        len(some) for some in (landscape.bests, landscape.failed, landscape.branched)
    )
    yield "points", f"{points}: {failed} without a solution, {several} with several local optima"
    done = "found nothing new" if landscape.complete else "still found new optima"
    yield "", f"{landscape.sweeps} sweeps, the last {done}"
    median = float(np.median(landscape.iterations))
    text = f"{landscape.solves}, {landscape.failed_solves} without a solution, "
    text += f"{median:.0f} iterations in the median; {landscape.seconds:.0f} s in all, "
    yield "solves", f"{text}{landscape.seconds / points:.1f} s per point"


def _places(landscape: Landscape, names: Iterable[str]) -> str:
    """Return the springs of points by name [N m/rad]."""
    springs = {point.name: f"{point.k_d:.3g}, {point.k_p:.3g}" for point in landscape.points}
    return "; ".join(springs[name] for name in names)
