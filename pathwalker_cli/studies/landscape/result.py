"""A landscape as plain numbers, and the region of springs that cost hardly more than the best."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final

import numpy as np

ROOT: Final = "optimum"
"""Name of the point that everything begins with: the springs of the optimum."""


@dataclass(frozen=True)
class Point:
    """One local optimum at one pair of stiffnesses.

    Args:
        name: Name of the pair, e.g. "d1-p8" on the grid.
        k_d: K_D [N m/rad].
        k_p: K_P [N m/rad].
        branch: 1 for the best local optimum of the pair, then 2, ...; 0 if every solve failed.
        status: "converged" or the reason why not.
        iterations: Iterations of the solve.
        seconds: Wall seconds of it.
        measures: Measures and free numbers, SI units; none if it did not converge.
        times: How many solves ended there.
    """

    name: str
    k_d: float
    k_p: float
    branch: int
    status: str
    iterations: int
    seconds: float
    measures: Mapping[str, float]
    times: int = 1

    @property
    def cost(self) -> float:
        """Value of the objective; not a number without a solution."""
        return self.measures.get("cost", float("nan"))


@dataclass(frozen=True)
class Region:
    """Springs whose cost is at most a share above the least, interpolated between points.

    Args:
        k_d: Least and largest K_D in it [N m/rad].
        k_p: Least and largest K_P in it [N m/rad].
        share: Share of the solved grid points that lie in it.
        points: Grid points in it.
        ends: Ends of the axes that it reaches, e.g. ("K_D upper",): it may go on beyond.
    """

    k_d: tuple[float, float]
    k_p: tuple[float, float]
    share: float
    points: int
    ends: tuple[str, ...]


@dataclass(frozen=True)
class Landscape:
    """Cost and gait over K_D and K_P of a side.

    Args:
        patient: Id of the patient.
        problem: The problem.
        side: "right", "left" or "both".
        k_d: Values of K_D [N m/rad], shape (n,).
        k_p: Values of K_P [N m/rad], shape (m,).
        points: All local optima: of the grid, and of the springs of the optimum ("optimum").
        optimum: The optimum with free springs that the study began with.
        released: Where the best point ends with free springs, if it is better than that optimum.
        checks: Largest re-integration errors of some points [rad or m], [rad/s or m/s].
        allowed: Largest errors that the mesh tolerances of the base allow, in the same units.
        tolerance: Share above the least cost up to which springs belong to the region.
        solves: Solves in all.
        failed_solves: Those of them that did not converge.
        iterations: Iterations of every solve.
        seconds: Wall seconds of all of them.
        sweeps: Sweeps over the grid.
        complete: Whether the last sweep found nothing new.
        further: SI units of the unknowns beside the springs, by name.
    """

    patient: str
    problem: str
    side: str
    k_d: np.ndarray
    k_p: np.ndarray
    points: tuple[Point, ...]
    optimum: Point
    released: Point | None
    checks: Mapping[str, tuple[float, float]]
    allowed: tuple[float, float]
    tolerance: float
    solves: int
    failed_solves: int
    iterations: tuple[int, ...]
    seconds: float
    sweeps: int
    complete: bool
    further: Mapping[str, str] = field(default_factory=dict)

    @cached_property
    def best(self) -> Point:
        """The best point, on the grid or at the springs of the optimum."""
        return min((p for p in self.points if p.branch == 1), key=lambda p: p.cost)

    @cached_property
    def bests(self) -> dict[tuple[int, int], Point]:
        """Best local optimum, or failure, by place on the grid."""
        places = {}
        for point in self.points:
            i, j = np.flatnonzero(self.k_d == point.k_d), np.flatnonzero(self.k_p == point.k_p)
            if i.size and j.size and point.name != ROOT and point.branch <= 1:
                places[int(i[0]), int(j[0])] = point
        return places

    def values(self, key: str) -> np.ndarray:
        """Return a measure of the best local optima, NaN where there is none, shape (n, m)."""
        values = np.full((self.k_d.size, self.k_p.size), np.nan)
        for place, point in self.bests.items():
            values[place] = point.measures.get(key, np.nan)
        return values

    @property
    def increase(self) -> np.ndarray:
        """Cost above the least one, as a share of it, shape (n, m)."""
        least = self.best.cost
        return (self.values("cost") - least) / abs(least)

    @property
    def region(self) -> Region | None:
        """The region of nearly best springs; None if it holds no grid point."""
        return region_of(self.k_d, self.k_p, self.increase, self.tolerance)

    @property
    def branched(self) -> tuple[Point, ...]:
        """Second local optima: where there are several."""
        return tuple(p for p in self.points if p.branch == 2 and p.name != ROOT)

    @property
    def failed(self) -> tuple[Point, ...]:
        """Grid points without a solution."""
        return tuple(p for p in self.points if p.branch == 0)

    @property
    def rough(self) -> tuple[str, ...]:
        """Checked points for which the mesh of the base is too coarse."""
        (q, v), checks = self.allowed, self.checks.items()
        return tuple(name for name, errors in checks if errors[0] > q or errors[1] > v)

    @property
    def better_than_start(self) -> float:
        """By what share of its cost the best point beats the optimum that the study began with."""
        return (self.optimum.cost - self.best.cost) / abs(self.optimum.cost)


def region_of(
    k_d: np.ndarray, k_p: np.ndarray, increase: np.ndarray, tolerance: float
) -> Region | None:
    """Return the region of nearly best springs, linear between neighbouring points.

    Args:
        k_d: Values of K_D, rising [N m/rad], shape (n,).
        k_p: Values of K_P, rising [N m/rad], shape (m,).
        increase: Cost above the least, as a share, NaN where unknown, shape (n, m).
        tolerance: The share up to which a point is in it.

    Returns:
        The region; None if no grid point lies in it.
    """
    inside = increase <= tolerance
    if not inside.any():
        return None
    low_d, high_d = _extent(k_d, increase, tolerance)
    low_p, high_p = _extent(k_p, increase.T, tolerance)
    reached = {"K_D lower": inside[0], "K_D upper": inside[-1],
               "K_P lower": inside[:, 0], "K_P upper": inside[:, -1]}  # fmt: skip
    ends = tuple(name for name, edge in reached.items() if edge.any())
    known = int(np.isfinite(increase).sum())
    count = int(inside.sum())
    return Region((low_d, high_d), (low_p, high_p), count / known, count, ends)


def _extent(axis: np.ndarray, increase: np.ndarray, tolerance: float) -> tuple[float, float]:
    """Return least and largest value of the first axis at which some line is in the region."""
    edges = list(axis[(increase <= tolerance).any(axis=1)])
    above = increase - tolerance
    for i in range(axis.size - 1):
        for a, b in zip(above[i], above[i + 1], strict=True):
            if a * b < 0.0:  # NaN compares false
                edges.append(axis[i] + (axis[i + 1] - axis[i]) * a / (a - b))
    return float(min(edges)), float(max(edges))
