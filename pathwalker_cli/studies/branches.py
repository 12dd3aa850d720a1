"""Continuation over a graph of problems: each is solved from its neighbours, again and again.

The problems are not convex: where a solve ends depends on where it began.  The graph is walked
outwards from a solved root, then swept: a solution that lies further from all local optima of a
neighbour than neighbours do as a rule is on a branch that the neighbour does not know yet, and the
neighbour is tried from it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Generic

import numpy as np

from pathwalker_cli.studies.graph import (
    Attempt,
    Branch,
    Exploration,
    Found,
    Graph,
    Rules,
    Solve,
    Values,
)

__all__ = ["explore"]


def explore(
    graph: Graph,
    root: Found,
    solve: Solve[Found],
    rules: Rules[Found],
    seeds: Mapping[str, Sequence[tuple[str, Found]]] | None = None,
) -> Exploration[Found]:
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
class _Explorer(Generic[Found]):
    """The state of an exploration."""

    graph: Graph
    solve: Solve[Found]
    rules: Rules[Found]
    branches: dict[str, list[Branch[Found]]] = field(default_factory=dict)
    attempts: list[Attempt[Found]] = field(default_factory=list)
    tried: set[tuple[str, str, int]] = field(default_factory=set)

    def ranked(self, point: str) -> list[Branch[Found]]:
        """Return the local optima of a point, best first."""
        return sorted(self.branches.get(point, ()), key=lambda b: (b.found.cost, b.number))

    def keep(self, point: str, name: str, found: Found) -> bool:
        """Take note of a solution; return whether the point gained an optimum by it."""
        known = self.branches.setdefault(point, [])
        for i, branch in enumerate(known):
            if self.rules.same(found, branch.found):
                known[i] = replace(branch, times=branch.times + 1)
                if found.cost < branch.found.cost:
                    known[i] = replace(known[i], name=name, found=found)
                return False
        known.append(Branch(len(known), name, found))
        return True

    def attempt(self, name: str, point: str, values: Values, start: Found) -> bool:
        """Solve a point from a start; return whether the point gained an optimum by it."""
        found = self.solve(name, values, start)
        self.attempts.append(Attempt(name, point, found))
        return found.converged and self.keep(point, name, found)

    def reach(self, point: str) -> None:
        """Solve a point for the first time, from the best neighbour that leads there."""
        near = [p for p in self.graph.neighbours[point] if self.ranked(p)]
        for source in sorted(near, key=lambda p: self.ranked(p)[0].found.cost):
            self.follow(source, point)
            if self.ranked(point):
                return

    def follow(self, source: str, target: str) -> bool:
        """Solve a point from the best optimum of a neighbour, in smaller steps if that fails."""
        branch = self.ranked(source)[0]
        self.tried.add((source, target, branch.number))
        name = f"{target}.from.{source}-{branch.number}"
        ends = tuple(np.asarray(self.graph.points[p]) for p in (source, target))
        found = self._step(name, target, ends, (0.0, 1.0), branch.found, 0)
        return found is not None and self.keep(target, name, found)

    def _step(
        self,
        name: str,
        target: str,
        ends: tuple[np.ndarray, ...],
        share: tuple[float, float],
        start: Found,
        level: int,
    ) -> Found | None:
        """Solve from one share of the way to another; None if even the smallest step fails."""
        label = name if share == (0.0, 1.0) else f"{name}.{share[0]:g}-{share[1]:g}"
        at = ends[1] if share[1] == 1.0 else ends[0] + share[1] * (ends[1] - ends[0])
        found = self.solve(label, tuple(at.tolist()), start)
        self.attempts.append(Attempt(label, target, found))
        if found.converged:
            return found
        if level == self.rules.halvings:
            return None
        half = 0.5 * (share[0] + share[1])
        first = self._step(name, target, ends, (share[0], half), start, level + 1)
        if first is None:
            return None
        return self._step(name, target, ends, (half, share[1]), first, level + 1)

    def sweep(self, inwards: bool) -> bool:
        """Try points from neighbours on branches unknown to them; return whether any gained."""
        limit = self.rules.jump * self._usual_distance()
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
        return all(self.rules.distance(from_[0].found, branch.found) > limit for branch in to)

    def _usual_distance(self) -> float:
        """Return the median distance of neighbours."""
        found = list(self._distances())
        return float(np.median(found)) if found else 0.0

    def _distances(self) -> Iterator[float]:
        for pair in self.graph.edges:
            one, other = (self.ranked(point) for point in pair)
            if one and other:
                yield self.rules.distance(one[0].found, other[0].found)
