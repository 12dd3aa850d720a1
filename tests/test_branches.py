"""Continuation over a graph, on toys whose basins are known."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
import pytest

from pathwalker_cli.studies.branches import Exploration, Graph, Rules, Values, explore


@dataclass(frozen=True)
class End:
    """Where a toy solve ended: basin 0 lies at x = 0, basin 1 at x = 1, both drift with t."""

    cost: float
    x: float
    converged: bool = True


@dataclass
class Toy:
    """Two basins over t in [0, 9]: the first is best below 4.5, the second above.

    A start leads to the nearer basin; far leaps (over more than `reach`) fail.  From `fold` on the
    first basin is gone: whoever starts in it falls into the second.
    """

    fold: float = np.inf
    reach: float = np.inf
    names: list[str] = field(default_factory=list)
    at: dict[int, float] = field(default_factory=dict)

    def solve(self, name: str, values: Values, start: End | None) -> End:
        self.names.append(name)
        t = float(np.sum(values))
        if start is not None and abs(t - self.at.get(id(start), t)) > self.reach:
            return End(0.0, 0.5, converged=False)
        basin = 0 if start is None or start.x % 1.0 < 0.5 else 1
        end = self.end(1 if t >= self.fold else basin, t)
        self.kept.append(end)
        self.at[id(end)] = t
        return end

    kept: list[End] = field(default_factory=list)

    def end(self, basin: int, t: float) -> End:
        cost = 10.0 + t if basin == 0 else 19.0 - t
        return End(cost, 0.6 * basin + 0.01 * t)

    def root(self, basin: int, t: float) -> End:
        end = self.end(basin, t)
        self.kept.append(end)
        self.at[id(end)] = t
        return end


def line(count: int = 10) -> Graph:
    names = [f"t{i}" for i in range(count)]
    points = {name: (float(i),) for i, name in enumerate(names)}
    return Graph(points, tuple(pairwise(names)), "t0")


RULES: Rules[End] = Rules(lambda a, b: abs(a.x - b.x), lambda end: np.array([end.x + 1.0]))


def basins(found: Exploration[End]) -> Iterator[int]:
    for branches in found.branches.values():
        yield int(branches[0].end.x >= 0.5)


def test_points_are_solved_outwards_from_the_nearest() -> None:
    toy = Toy()
    graph = Graph(line(5).points, line(5).edges, "t2")
    found = explore(graph, toy.root(0, 2.0), toy.solve, RULES)
    assert toy.names[:4] == ["t1.from.t2-0", "t3.from.t2-0", "t0.from.t1-0", "t4.from.t3-0"]
    assert found.complete
    assert len(found.attempts) == 4, "neighbours on one branch are not tried again"


def test_a_better_branch_found_at_the_far_end_comes_back_as_far_as_it_is_better() -> None:
    toy = Toy(fold=8.0)
    found = explore(line(), toy.root(0, 0.0), toy.solve, RULES)
    assert list(basins(found)) == [0] * 5 + [1] * 5
    assert found.complete
    both = [point for point, branches in found.branches.items() if len(branches) == 2]
    assert both == ["t4", "t5", "t6", "t7"], "t4 learns of the other branch and does not hand it on"
    assert found.branches["t6"][0].end.cost < found.branches["t6"][1].end.cost


def test_without_sweeps_the_first_way_decides() -> None:
    toy = Toy(fold=8.0)
    rules = Rules(RULES.distance, RULES.signature, sweeps=0)
    found = explore(line(), toy.root(0, 0.0), toy.solve, rules)
    assert list(basins(found)) == [0] * 8 + [1] * 2
    assert not found.complete


def test_the_number_of_sweeps_is_limited() -> None:
    """One sweep brings the other branch all the way; only a second one would show that."""
    toy = Toy(fold=8.0)
    rules = Rules(RULES.distance, RULES.signature, sweeps=1)
    found = explore(line(), toy.root(0, 0.0), toy.solve, rules)
    assert found.sweeps == 1
    assert not found.complete


def test_seeds_lead_to_branches_that_no_neighbour_has() -> None:
    toy = Toy()
    seeds = {"t9": [("other", toy.root(1, 9.0))]}
    found = explore(line(), toy.root(0, 0.0), toy.solve, RULES, seeds)
    assert "t9.from.other" in toy.names
    assert list(basins(found)) == [0] * 5 + [1] * 5


def test_steps_that_fail_are_halved() -> None:
    toy = Toy(reach=0.5)
    found = explore(line(2), toy.root(0, 0.0), toy.solve, RULES)
    assert toy.names == ["t1.from.t0-0", "t1.from.t0-0.0-0.5", "t1.from.t0-0.0.5-1"]
    assert len(found.branches["t1"]) == 1
    assert sum(not attempt.end.converged for attempt in found.attempts) == 1


def test_points_that_cannot_be_reached_stay_without_a_solution() -> None:
    toy = Toy(reach=0.1)
    found = explore(line(3), toy.root(0, 0.0), toy.solve, RULES)
    assert found.failed == ("t1", "t2")
    assert found.best("t1") is None
    counts = Counter(toy.names)
    assert max(counts.values()) == 1, "nothing is tried twice"


def test_names_are_unique_and_the_same_every_time() -> None:
    first, second = Toy(fold=8.0), Toy(fold=8.0)
    for toy in (first, second):
        explore(line(), toy.root(0, 0.0), toy.solve, RULES)
    assert first.names == second.names
    assert len(set(first.names)) == len(first.names)


def test_a_plane_is_filled_from_the_corner_of_the_other_basin() -> None:
    points = {f"{i}-{j}": (float(i), float(j)) for i in range(5) for j in range(5)}
    edges = [(f"{a}-{b}", f"{i}-{j}") for i in range(5) for j in range(5)
             for a, b in ((i - 1, j), (i, j - 1)) if min(a, b) >= 0]  # fmt: skip
    toy = Toy(fold=8.0)
    found = explore(Graph(points, tuple(edges), "0-0"), toy.root(0, 0.0), toy.solve, RULES)
    for name, values in points.items():
        assert found.branches[name][0].end.cost == min(10.0 + sum(values), 19.0 - sum(values))


def test_a_better_end_of_the_same_optimum_takes_its_place() -> None:
    ends = iter([End(10.001, 0.0), End(10.0, 0.0)])
    rules = Rules(lambda a, b: 1.0, RULES.signature, jump=0.0, sweeps=1)
    graph = Graph({"a": (0.0,), "b": (1.0,), "c": (0.5,)}, (("a", "b"), ("c", "b")), "a")
    found = explore(
        graph, End(1.0, 0.0), lambda *_: next(ends, End(10.0, 0.0)), rules,
        {"b": [("again", End(1.0, 0.0))]},
    )  # fmt: skip
    best = found.best("b")
    assert best is not None
    assert (best.end.cost, best.number, best.times) == (10.0, 0, 3)


@pytest.mark.parametrize(
    ("cost", "x", "same"), [(10.0, 0.0, True), (10.2, 0.0, False), (10.0, 0.3, False)]
)
def test_what_counts_as_the_same_optimum(cost: float, x: float, same: bool) -> None:
    assert RULES.same(End(cost, x), End(10.0, 0.0)) == same
