"""Explicit Runge-Kutta steps with error control: the integrator inside a shooting interval.

The embedded pair of Cash and Karp has order 5 and an error estimate of order 4.  None of its
weights is negative, so a running cost that is a sum of squares is not either, however wrong a step
may be.  Steps are chosen along one trajectory so that the estimate stays below a tolerance, and are
then kept: a program that moves the trajectory differentiates the same sequence of operations every
time (internal numerical differentiation, Bock 1983).

References:
    Cash, J.R., Karp, A.H. (1990) ACM Trans. Math. Softw. 16, 201-222.
    Hairer, E., Norsett, S.P., Wanner, G. (1993) Solving Ordinary Differential Equations I, II.4.
    Bock, H.G. (1983) Recent advances in parameter identification techniques for ODE. In:
        Numerical Treatment of Inverse Problems, Progress in Scientific Computing 2, 95-121.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from pathwalker_cli.errors import NotConvergedError

Slope = Callable[[float, np.ndarray], np.ndarray]
"""Returns dX/dt, shape (n,), at a time and a state X, shape (n,)."""

Edges = tuple[tuple[np.ndarray, ...], ...]
"""Ends of the steps of every interval, from 0 to 1, by phase and interval."""


@dataclass(frozen=True)
class EmbeddedPair:
    """An explicit Runge-Kutta scheme of s stages with an error estimate.

    Args:
        times: c, shape (s,).
        matrix: a, strictly lower triangular, shape (s, s).
        weights: b, shape (s,).
        error: Weights of the error estimate, shape (s,).
        order: Order of the step.
    """

    times: np.ndarray
    matrix: np.ndarray
    weights: np.ndarray
    error: np.ndarray
    order: int

    @property
    def stages(self) -> int:
        """Number of stages s."""
        return len(self.times)


def _cash_karp() -> EmbeddedPair:
    rows = (
        (),
        (1 / 5,),
        (3 / 40, 9 / 40),
        (3 / 10, -9 / 10, 6 / 5),
        (-11 / 54, 5 / 2, -70 / 27, 35 / 27),
        (1631 / 55296, 175 / 512, 575 / 13824, 44275 / 110592, 253 / 4096),
    )
    matrix = np.array([[*row, *[0.0] * (6 - len(row))] for row in rows])
    fifth = np.array([37 / 378, 0.0, 250 / 621, 125 / 594, 0.0, 512 / 1771])
    fourth = np.array([2825 / 27648, 0.0, 18575 / 48384, 13525 / 55296, 277 / 14336, 1 / 4])
    return EmbeddedPair(matrix.sum(axis=1), matrix, fifth, fifth - fourth, 5)


CASH_KARP: Final = _cash_karp()

_MOST_STEPS: Final = 200
"""In one interval; a shooting interval of a few hundredths of a second needs some five."""

_FINEST: Final = 1e5
"""Steps of which so many would fit into an interval are given up."""

_SAFETY, _LEAST, _MOST = 0.9, 0.2, 4.0
"""Step sizes aim at this share of the tolerance's step and change by these factors at most."""

_SMALLEST_RATIO: Final = 1e-10
"""Of error and tolerance, where a step makes no error at all."""

_ROUNDING, _WHOLE = 1e-12, 1e-9
"""What is left of an interval, as a share of it, that counts as nothing; and how far a number of
steps may exceed a whole one."""


@dataclass(frozen=True)
class Step:
    """One step that was taken.

    Args:
        begin: Where it begins.
        width: Its length.
        stages: States at the stages, shape (s, n).
        end: State at its end, shape (n,).
        error: Error estimate, in units of the scales, as a maximum over the state.
    """

    begin: float
    width: float
    stages: np.ndarray
    end: np.ndarray
    error: float


def _step(slope: Slope, start: np.ndarray, begin: float, width: float, scale: np.ndarray) -> Step:
    pair = CASH_KARP
    slopes, states = np.zeros((2, pair.stages, start.size))
    for k, (time, row) in enumerate(zip(pair.times, pair.matrix, strict=True)):
        states[k] = start + width * (row @ slopes)
        slopes[k] = slope(begin + width * time, states[k])
    error = float(np.abs(width * (pair.error @ slopes) / scale).max())
    return Step(begin, width, states, start + width * (pair.weights @ slopes), error)


def fixed_steps(
    slope: Slope, start: np.ndarray, edges: np.ndarray, scale: np.ndarray
) -> tuple[Step, ...]:
    """Return the steps between given edges.

    Args:
        slope: Right-hand side.
        start: State at the first edge, shape (n,).
        edges: Ends of the steps, increasing, shape (m + 1,).
        scale: What counts as 1 in the error estimate, shape (n,); inf where it does not count.
    """
    steps: list[Step] = []
    for begin, end in pairwise(edges):
        steps.append(_step(slope, start, float(begin), float(end - begin), scale))
        start = steps[-1].end
    return tuple(steps)


def adaptive_steps(
    slope: Slope, start: np.ndarray, span: tuple[float, float], scale: np.ndarray, tolerance: float
) -> tuple[Step, ...]:
    """Return steps whose error estimates are below a tolerance, in units of the scales.

    Other arguments are those of `fixed_steps`.

    Raises:
        NotConvergedError: If the steps become too many.
    """
    at, end = span
    steps: list[Step] = []
    width = end - at
    while end - at > _ROUNDING * (end - span[0]):
        left = end - at
        step = _step(slope, start, at, left / np.ceil(left / width - _WHOLE), scale)
        ratio = max(step.error / tolerance, _SMALLEST_RATIO) if np.isfinite(step.error) else np.inf
        width = step.width * float(
            np.clip(_SAFETY * ratio ** (-1 / CASH_KARP.order), _LEAST, _MOST)
        )
        if ratio <= 1.0:
            steps.append(step)
            start, at = step.end, at + step.width
        if len(steps) > _MOST_STEPS or width < (end - span[0]) / _FINEST:
            raise NotConvergedError(
                f"no step is short enough for an integration error of {tolerance:g}; "
                "the motion is too far from one that the model can make"
            )
    return tuple(steps)
