"""How far a number may move until the cost has risen by a share: a search by solves."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from pathwalker_cli.gait.resolve import Optimum

_SOLVES: Final = 8
"""Most solves spent on one edge."""

_NEAR: Final = 0.1
"""Share of the allowed rise by which the cost at an edge may miss it."""

_STRETCH: Final = 2.0
"""Multiple of a step up to which the limit of the range is tried at once."""

_CLOSE: Final = 0.25
"""Share of the expected distance to the edge within which a limit needs no solve: to second order
the cost rises by a sixteenth of what is allowed, or along a slope by a quarter."""

Solve = Callable[[float, Optimum, bool], Optimum]
"""Solves with the number prescribed, from a neighbour; whether to insist."""


@dataclass(frozen=True)
class Edge:
    """Where the cost has risen as far as allowed.

    Args:
        value: The number [its unit].
        limit: Whether it is the limit of the range, with less than the allowed rise there.
        rise: Rise of the cost there, as a share.
        certain: Whether solves enclose it; otherwise it is the last one that was solved.
        again: Whether the cost is good again at the limit of the range: another local optimum.
        solves: Number of solves.
        iterations: Their iterations.
    """

    value: float
    limit: bool
    rise: float
    certain: bool
    solves: int
    iterations: int
    again: bool = False


@dataclass
class _Search:
    """A search in one direction: the last point inside, and the first one outside if known."""

    inside: Optimum
    at: float
    rise: float = 0.0
    outside: float | None = None
    outside_rise: float = 0.0
    solves: int = 0
    iterations: int = 0


def find_edge(
    solve: Solve,
    optimum: Optimum,
    start: float,
    limit: float,
    share: float,
    step: float,
    look: bool = True,
) -> Edge:
    """Return where the cost has risen by a share, or the limit of the range.

    Args:
        solve: Solves with the number prescribed; the others follow.
        optimum: The optimum.
        start: Its value there.
        limit: The end of the range in the direction of the search.
        share: Allowed rise of the cost relative to its size, e.g. 0.05.
        step: Expected distance to the edge, positive.
        look: Whether to look at the limit for another optimum, where the edge lies before it.
    """
    if abs(limit - start) <= _CLOSE * step:
        return Edge(limit, True, share * abs(limit - start) / step, True, 0, 0)
    search, stretch = _Search(optimum, start), _STRETCH
    sign, size = (1.0 if limit > start else -1.0), abs(optimum.cost)
    while search.solves < _SOLVES and search.at != limit:
        if search.outside is None:
            trial = search.at + sign * step
            if _reaches(search.at, trial, limit, stretch):
                trial = limit
        else:
            trial = _between(search, share)
        end = solve(trial, search.inside, True)
        search.solves += 1
        search.iterations += end.result.iterations
        if not end.converged:
            step, stretch = abs(trial - search.at) / 2.0, 1.0
            search.outside = None
            continue
        rise = (end.cost - optimum.cost) / size
        if rise <= share * (1.0 + _NEAR):
            search.inside, search.at, search.rise = end, trial, rise
            # where the cost rises by far less than expected, the end of the range is the next guess
            step = np.inf if rise < share / 2.0 else max(step, 2.0 * abs(trial - start))
        else:
            search.outside, search.outside_rise = trial, rise
        if abs(rise - share) <= _NEAR * share and trial != limit:
            edge = Edge(trial, False, rise, True, search.solves, search.iterations)
            return (
                _looked_beyond(edge, solve, optimum, search.inside, limit, share) if look else edge
            )
    limited = search.at == limit
    return Edge(search.at, limited, search.rise, limited, search.solves, search.iterations)


def _reaches(start: float, trial: float, limit: float, stretch: float) -> bool:
    """Return whether a step, stretched, leads to a limit.

    Positive numbers count by their logarithms: what a spring adds to a hinge dies away as it grows.
    """
    if abs(trial - start) >= abs(limit - start):
        return True
    if min(start, limit) > 0.0:
        start, trial, limit = np.log([start, trial, limit])
    return bool(abs(limit - start) <= stretch * abs(trial - start))


def _looked_beyond(
    edge: Edge, solve: Solve, optimum: Optimum, inside: Optimum, limit: float, share: float
) -> Edge:
    """Return an edge inside the range, after one look at the limit."""
    end = solve(limit, inside, False)
    again = end.converged and end.cost - optimum.cost <= share * abs(optimum.cost)
    iterations = edge.iterations + end.result.iterations
    return replace(edge, again=again, solves=edge.solves + 1, iterations=iterations)


def _between(search: _Search, share: float) -> float:
    """Return where the cost should meet the share, between the points inside and outside."""
    assert search.outside is not None  # noqa: S101 - called once a point outside is known
    part = (share - search.rise) / (search.outside_rise - search.rise)
    # the cost is convex near its optimum: the true edge lies beyond the secant's
    part = min(max(part**0.5 if search.rise <= 0.0 else part, 0.1), 0.9)
    return search.at + part * (search.outside - search.at)
