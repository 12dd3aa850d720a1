"""The edge of the region in which the cost stays good, on costs with known edges."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any, cast

import pytest

from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.studies.verdict.edges import Edge, find_edge


def point(cost: float, converged: bool = True) -> Optimum:
    """Return what a search needs of an optimum."""
    result = SimpleNamespace(iterations=3)
    return cast("Optimum", SimpleNamespace(cost=cost, converged=converged, result=result))


def search(
    cost: Callable[[float], float], start: float, limit: float, step: float, **more: Any
) -> Edge:
    """Find the 5 % edge of a cost."""
    fails = more.get("fails", lambda stiffness, at: False)
    at = {id(None): start}

    def solve(stiffness: float, neighbour: Optimum, insist: bool) -> Optimum:
        origin = at.get(id(neighbour), start)
        found = point(cost(stiffness), not fails(stiffness, origin))
        at[id(found)] = stiffness
        kept.append(found)
        return found

    kept: list[Optimum] = []
    return find_edge(solve, point(cost(start)), start, limit, 0.05, step)


@pytest.mark.parametrize("step", [2.0, 10.0, 60.0])
@pytest.mark.parametrize("limit", [5.0, 92.0])
def test_the_edge_of_a_parabola_is_found(step: float, limit: float) -> None:
    edge = search(lambda k: 1.0 + 0.05 * ((k - 40.0) / 20.0) ** 2, 40.0, limit, step)
    assert edge.certain
    assert not edge.limit
    assert edge.rise == pytest.approx(0.05, rel=0.1)
    assert abs(edge.value - 40.0) == pytest.approx(20.0, rel=0.06)


def test_a_flat_cost_reaches_the_limit_of_the_range() -> None:
    edge = search(lambda k: 1.0 + 1e-5 * k, 40.0, 92.0, 100.0)
    assert edge.limit
    assert edge.certain
    assert (edge.value, edge.solves) == (92.0, 1)


def test_a_limit_far_closer_than_the_edge_needs_no_solve() -> None:
    edge = search(lambda k: 1.0 + 0.05 * ((k - 40.0) / 400.0) ** 2, 40.0, 92.0, 400.0)
    assert (edge.value, edge.limit, edge.certain, edge.solves) == (92.0, True, True, 0)
    assert 0.0 < edge.rise < 0.05 / 4.0


def test_a_soft_spring_is_tried_at_the_stiffest_at_once() -> None:
    """From 5 to 23 N m/rad a spring stiffens more than fourfold; from there to 92 as much again."""
    edge = search(lambda k: 1.0 + 0.03 * (1.0 - 5.0 / k), 5.0, 92.0, 18.0)
    assert (edge.value, edge.limit, edge.solves) == (92.0, True, 1)
    stiff = search(lambda k: 1.0 + 0.002 * (92.0 - k), 92.0, 5.0, 27.0)
    assert (stiff.limit, stiff.solves) == (False, 2)  # the second is a look at the limit


def test_a_slope_at_a_limit_is_followed_inwards() -> None:
    edge = search(lambda k: 1.0 + 0.002 * (92.0 - k), 92.0, 5.0, 10.0)
    assert edge.value == pytest.approx(92.0 - 25.0, rel=0.05)


def test_a_negative_cost_rises_relative_to_its_size() -> None:
    edge = search(lambda k: -2.0 + 0.1 * ((k - 40.0) / 10.0) ** 2, 40.0, 92.0, 8.0)
    assert edge.value == pytest.approx(50.0, rel=0.02)


def test_a_solve_that_fails_is_tried_nearer() -> None:
    edge = search(
        lambda k: 1.0 + 0.05 * ((k - 40.0) / 20.0) ** 2, 40.0, 92.0, 20.0,
        fails=lambda stiffness, origin: abs(stiffness - origin) > 12.0,
    )  # fmt: skip
    assert edge.value == pytest.approx(60.0, abs=8.0)
    assert edge.rise <= 0.055


def test_an_edge_that_nothing_encloses_is_not_certain() -> None:
    edge = search(lambda k: 1.0, 40.0, 92.0, 20.0, fails=lambda stiffness, origin: True)
    assert not edge.certain
    assert edge.value == 40.0


def test_a_second_basin_at_the_limit_is_seen() -> None:
    edge = search(lambda k: 1.0 + min(0.05 * ((k - 20.0) / 10.0) ** 2, 0.03 + 1e-3 * (92 - k)),
                  20.0, 92.0, 9.0)  # fmt: skip
    assert edge.again
    assert not search(lambda k: 1.0 + 0.05 * ((k - 20.0) / 10.0) ** 2, 20.0, 92.0, 9.0).again
