"""Points, neighbours and local optima: what a continuation over a graph works on and returns."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np

__all__ = [
    "Attempt",
    "Branch",
    "Exploration",
    "Found",
    "Graph",
    "Rules",
    "Solve",
    "Solved",
    "Values",
]

Values = tuple[float, ...]


class Solved(Protocol):
    """What the end of a solve must tell."""

    @property
    def cost(self) -> float:
        """Value of the objective."""

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""


Found = TypeVar("Found", bound=Solved)
Solve = Callable[[str, Values, Found | None], Found]
"""Name, values and start to the end of a solve."""


@dataclass(frozen=True)
class Graph:
    """Points and who is whose neighbour.

    Args:
        points: Values of every point by its name, in order.
        edges: Pairs of neighbours.
        root: The point that is solved already.
    """

    points: Mapping[str, Values]
    edges: tuple[tuple[str, str], ...]
    root: str

    @cached_property
    def neighbours(self) -> dict[str, tuple[str, ...]]:
        """Neighbours of every point, in the order of the points."""
        pairs = {*self.edges, *((b, a) for a, b in self.edges)}
        return {a: tuple(b for b in self.points if (a, b) in pairs) for a in self.points}

    @cached_property
    def outwards(self) -> tuple[str, ...]:
        """All points that can be reached from the root, nearest first."""
        reached = [self.root]
        for point in reached:  # grows while it is walked
            reached += [near for near in self.neighbours[point] if near not in reached]
        return tuple(reached)


@dataclass(frozen=True)
class Rules(Generic[Found]):
    """When two solutions are one, and how long to look for more.

    Args:
        distance: How far two solutions of neighbours lie apart, in any unit.
        signature: Numbers by which local optima of equal cost still differ, shape (n,).
        scale: The amount that differences of cost are relative to.
        cost_tolerance: Relative difference of cost beyond which two solutions are two optima.
        signature_tolerance: The same for every number of the signature.
        jump: Multiple of the median distance of neighbours beyond which they are tried from one
            another; 0 tries all.
        sweeps: Largest number of sweeps.
        halvings: How often a step that failed is halved.
    """

    distance: Callable[[Found, Found], float]
    signature: Callable[[Found], np.ndarray]
    scale: Callable[[Found], float] = lambda found: abs(found.cost)
    cost_tolerance: float = 1e-3
    signature_tolerance: float = 0.1
    jump: float = 2.0
    sweeps: int = 4
    halvings: int = 2

    def same(self, one: Found, other: Found) -> bool:
        """Return whether two solutions of one point are the same local optimum."""
        a, b = np.asarray(self.signature(one)), np.asarray(self.signature(other))
        near = np.abs(a - b) <= self.signature_tolerance * np.maximum(np.abs(a), np.abs(b))
        apart = abs(one.cost - other.cost)
        return bool(near.all()) and apart <= self.cost_tolerance * self.scale(other)


@dataclass(frozen=True)
class Attempt(Generic[Found]):
    """One solve.

    Args:
        name: Its name, unique in the exploration.
        point: The point that it was made for.
        found: Where it ended.
    """

    name: str
    point: str
    found: Found


@dataclass(frozen=True)
class Branch(Generic[Found]):
    """A local optimum of a point.

    Args:
        number: Its number at the point, in the order in which they were found, from 0.
        name: Name of the solve.
        found: The solution.
        times: How many solves ended there.
    """

    number: int
    name: str
    found: Found
    times: int = 1


@dataclass(frozen=True)
class Exploration(Generic[Found]):
    """All local optima of all points.

    Args:
        branches: By point, best first; none where every solve failed.
        attempts: Every solve, those at points in between and those that failed too.
        sweeps: Sweeps that were made.
        complete: Whether the last sweep found nothing new.
    """

    branches: dict[str, tuple[Branch[Found], ...]]
    attempts: tuple[Attempt[Found], ...]
    sweeps: int
    complete: bool

    def best(self, point: str) -> Branch[Found] | None:
        """Return the best local optimum of a point."""
        return next(iter(self.branches[point]), None)

    @property
    def failed(self) -> tuple[str, ...]:
        """Points without any solution."""
        return tuple(point for point, found in self.branches.items() if not found)
