"""Continuation over a graph of problems: each is solved from its neighbours, again and again.

The problems are not convex: where a solve ends depends on where it began.  The graph is walked
outwards from a solved root, then swept: a solution that lies further from all local optima of a
neighbour than neighbours do as a rule is on a branch that the neighbour does not know yet, and the
neighbour is tried from it.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Generic, Protocol, TypeVar

import numpy as np

Values = tuple[float, ...]


class Solved(Protocol):
    """What must be known of the end of a solve."""

    @property
    def cost(self) -> float:
        """Value of the objective."""

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""


End = TypeVar("End", bound=Solved)
Solve = Callable[[str, Values, End | None], End]
"""Name, values and start to the end of a solve."""


@dataclass(frozen=True)
class Graph:
    """Points by name, in order, and who is whose neighbour; the root is solved already."""

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
class Rules(Generic[End]):
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

    distance: Callable[[End, End], float]
    signature: Callable[[End], np.ndarray]
    scale: Callable[[End], float] = lambda end: abs(end.cost)
    cost_tolerance: float = 1e-3
    signature_tolerance: float = 0.1
    jump: float = 2.0
    sweeps: int = 4
    halvings: int = 2

    def same(self, one: End, other: End) -> bool:
        """Return whether two solutions of one point are the same local optimum."""
        a, b = np.asarray(self.signature(one)), np.asarray(self.signature(other))
        near = np.abs(a - b) <= self.signature_tolerance * np.maximum(np.abs(a), np.abs(b))
        apart = abs(one.cost - other.cost)
        return bool(near.all()) and apart <= self.cost_tolerance * self.scale(other)


@dataclass(frozen=True)
class Attempt(Generic[End]):
    """One solve, for a point; its name is unique in the exploration."""

    name: str
    point: str
    end: End


@dataclass(frozen=True)
class Branch(Generic[End]):
    """A local optimum of a point: where so many solves ended, one of them of this name.

    Its number at the point counts from 0, in the order in which they turned up.
    """

    number: int
    name: str
    end: End
    times: int = 1


@dataclass(frozen=True)
class Exploration(Generic[End]):
    """All local optima of all points, best first, none where every solve failed; and every solve.

    It is complete if the last sweep found nothing new.
    """

    branches: dict[str, tuple[Branch[End], ...]]
    attempts: tuple[Attempt[End], ...]
    sweeps: int
    complete: bool

    def best(self, point: str) -> Branch[End] | None:
        """Return the best local optimum of a point."""
        return next(iter(self.branches[point]), None)

    @property
    def failed(self) -> tuple[str, ...]:
        """Points without any solution."""
        return tuple(point for point, known in self.branches.items() if not known)


def explore(
    graph: Graph,
    root: End,
    solve: Solve[End],
    rules: Rules[End],
    seeds: Mapping[str, Sequence[tuple[str, End]]] | None = None,
) -> Exploration[End]:
    """Solve all points of a graph from one another.

    The names of solves depend on nothing but the way to them, so that a journal can be read.

    Args:
        graph: The points.
        root: The solution at the root.
        solve: Solves a point, or one in between, from a solution nearby.
        rules: When two solutions are one, and how long to look.
        seeds: Further starts by point, each with a name.
    """
    explorer = _Explorer(graph, solve, rules)
    explorer.keep(graph.root, graph.root, root)
    for point in graph.outwards[1:]:
        explorer.reach(point)
    for point, starts in (seeds or {}).items():
        for label, start in starts:
            explorer.attempt(f"{point}.from.{label}", point, graph.points[point], start)
    sweeps, gained = 0, True
    while gained and sweeps < rules.sweeps:
        gained = explorer.sweep(inwards=sweeps % 2 == 0)
        sweeps += 1
    branches = {point: tuple(explorer.ranked(point)) for point in graph.points}
    return Exploration(branches, tuple(explorer.attempts), sweeps, not gained)


@dataclass
class _Explorer(Generic[End]):
    """The state of an exploration."""

    graph: Graph
    solve: Solve[End]
    rules: Rules[End]
    branches: dict[str, list[Branch[End]]] = field(default_factory=dict)
    attempts: list[Attempt[End]] = field(default_factory=list)
    tried: set[tuple[str, str, int]] = field(default_factory=set)

    def ranked(self, point: str) -> list[Branch[End]]:
        """Return the local optima of a point, best first."""
        return sorted(self.branches.get(point, ()), key=lambda b: (b.end.cost, b.number))

    def keep(self, point: str, name: str, end: End) -> bool:
        """Take note of a solution; return whether the point gained an optimum by it."""
        known = self.branches.setdefault(point, [])
        for i, branch in enumerate(known):
            if self.rules.same(end, branch.end):
                known[i] = replace(branch, times=branch.times + 1)
                if end.cost < branch.end.cost:
                    known[i] = replace(known[i], name=name, end=end)
                return False
        known.append(Branch(len(known), name, end))
        return True

    def attempt(self, name: str, point: str, values: Values, start: End) -> bool:
        """Solve a point from a start; return whether the point gained an optimum by it."""
        end = self.solve(name, values, start)
        self.attempts.append(Attempt(name, point, end))
        return end.converged and self.keep(point, name, end)

    def reach(self, point: str) -> None:
        """Solve a point for the first time, from the best neighbour that leads there."""
        near = [p for p in self.graph.neighbours[point] if self.ranked(p)]
        for source in sorted(near, key=lambda p: self.ranked(p)[0].end.cost):
            self.follow(source, point)
            if self.ranked(point):
                return

    def follow(self, source: str, target: str) -> bool:
        """Solve a point from the best optimum of a neighbour, in smaller steps if that fails."""
        branch = self.ranked(source)[0]
        self.tried.add((source, target, branch.number))
        name = f"{target}.from.{source}-{branch.number}"
        ends = tuple(np.asarray(self.graph.points[p]) for p in (source, target))
        end = self._step(name, target, ends, (0.0, 1.0), branch.end, 0)
        return end is not None and self.keep(target, name, end)

    def _step(
        self,
        name: str,
        target: str,
        ends: tuple[np.ndarray, ...],
        share: tuple[float, float],
        start: End,
        level: int,
    ) -> End | None:
        """Solve from one share of the way to another; None if even the smallest step fails."""
        label = name if share == (0.0, 1.0) else f"{name}.{share[0]:g}-{share[1]:g}"
        at = ends[1] if share[1] == 1.0 else ends[0] + share[1] * (ends[1] - ends[0])
        end = self.solve(label, tuple(at.tolist()), start)
        self.attempts.append(Attempt(label, target, end))
        if end.converged:
            return end
        if level == self.rules.halvings:
            return None
        half = 0.5 * (share[0] + share[1])
        first = self._step(name, target, ends, (share[0], half), start, level + 1)
        if first is None:
            return None
        return self._step(name, target, ends, (half, share[1]), first, level + 1)

    def sweep(self, inwards: bool) -> bool:
        """Try points from neighbours on branches unknown to them; return whether any gained."""
        distances = list(self._distances())
        limit = self.rules.jump * float(np.median(distances)) if distances else 0.0
        gained = False
        for target in self.graph.outwards[:: -1 if inwards else 1]:
            for source in self.graph.neighbours[target]:
                if self._worth_it(source, target, limit):
                    gained |= self.follow(source, target)
        return gained

    def _worth_it(self, source: str, target: str, limit: float) -> bool:
        from_, to = self.ranked(source), self.ranked(target)
        if not from_ or (source, target, from_[0].number) in self.tried:
            return False
        return all(self.rules.distance(from_[0].end, branch.end) > limit for branch in to)

    def _distances(self) -> Iterator[float]:
        for pair in self.graph.edges:
            one, other = (self.ranked(point) for point in pair)
            if one and other:
                yield self.rules.distance(one[0].end, other[0].end)
