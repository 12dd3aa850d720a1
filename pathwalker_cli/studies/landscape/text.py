"""A landscape in plain words on the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from pathwalker_cli.studies.landscape.result import Landscape, Point, Region

__all__ = ["landscape_lines"]


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
    share = 100.0 * region.share
    yield "", f"{region.points} grid points, {share:.0f} % of those solved; {_ends(region)}"
    yield "", "that region, not a point, is the recommendation"


def _ends(region: Region) -> str:
    if not region.ends:
        return "all of it lies inside the range that was looked at"
    return f"it reaches the end of the range at {', '.join(region.ends)} and may go on beyond"


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
        len(found) for found in (landscape.bests, landscape.failed, landscape.branched)
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
