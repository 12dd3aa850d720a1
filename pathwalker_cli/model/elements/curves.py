"""C2 curves made of quintic Bezier corners, exact for NumPy and CasADi alike.

A curve is a chain of knots (x, y, slope).  Two neighbours are joined by a quintic Bezier "corner"
(Millard et al. 2013, appendix): the end tangents meet at C, and with the curviness c the control
points are P0, A, A, B, B, P5, where A = P0 + c (C - P0) and B = P5 + c (C - P5).  Doubled control
points make the curvature zero at every knot, so the chain is C2.  Outside the knots the curve goes
on with its end slope.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache
from itertools import pairwise
from typing import Any

import casadi as ca
import numpy as np

from pathwalker_cli.model.choices import NEWTON_STEPS


@dataclass(frozen=True)
class BezierChain:
    """Knots of a chain of quintic Bezier corners; entries may be numbers or CasADi expressions.

    Args:
        x: Knot positions, increasing, n of them.
        y: Knot values, n of them.
        slopes: Slopes dy/dx at the knots, n of them.
        curviness: Fraction c of the way from each end point to the corner, in (0, 1).
        newton_steps: Newton steps for the curve parameter, see `newton_steps_for`.
        corners: Where the end tangents of every piece meet, n - 1 of them, for curves that may
            be straight: there tangents of almost equal slope do not tell.
    """

    x: Sequence[Any]
    y: Sequence[Any]
    slopes: Sequence[Any]
    curviness: float
    newton_steps: int = NEWTON_STEPS
    corners: Sequence[Any] | None = None

    @property
    def is_numeric(self) -> bool:
        """Whether the knots are tuples of plain numbers, so that the chain can be looked up."""
        columns = (self.x, self.y, self.slopes)
        return all(isinstance(k, tuple) and {*map(type, k)} <= {float} for k in columns)

    def corner(self, i: int) -> Any:
        """Return the x at which the end tangents of piece i meet; its middle if they coincide."""
        if self.corners is not None:
            return self.corners[i]
        x0, x1 = self.x[i], self.x[i + 1]
        turn = self.slopes[i] - self.slopes[i + 1]
        if isinstance(turn, float) and turn == 0:
            return (x0 + x1) / 2
        rise = self.y[i + 1] - self.y[i]
        return (rise - x1 * self.slopes[i + 1] + x0 * self.slopes[i]) / turn

    def controls(self, i: int) -> tuple[Any, Any]:
        """Return the inner control points A and B of piece i, scaled to [0, 1]."""
        x0, x1 = self.x[i], self.x[i + 1]
        corner, c = self.corner(i), self.curviness
        return c * (corner - x0) / (x1 - x0), 1 + c * (corner - x1) / (x1 - x0)


@dataclass(frozen=True)
class BezierPoint:
    """Value and first two derivatives of a curve at x."""

    value: Any
    slope: Any
    curvature: Any


def evaluate(chain: BezierChain, x: Any) -> BezierPoint:
    """Return y, dy/dx and d2y/dx2 on a chain of Bezier corners.

    Args:
        chain: The knots; numbers or CasADi expressions.
        x: Where to evaluate; a NumPy array or a scalar CasADi expression.

    Returns:
        Value, slope and curvature, each shaped like x; exact to about 1e-14 of the knot values.
    """
    if not chain.is_numeric:
        return _evaluated(chain, _step_sums(chain, _pieces(chain), x), x)
    if isinstance(x, ca.SX):
        return BezierPoint(*_function(chain).call([x], True, False))
    edges, pieces = _table(chain)
    return _evaluated(chain, pieces[:, edges.searchsorted(x, "right")], x)


def samples(chain: BezierChain, count: int) -> np.ndarray:
    """Return positions along a chain of numbers, `count` in each piece and the last knot.

    They are even in the curve parameter: dense where the curve bends.
    """
    parameter = np.linspace(0.0, 1.0, count, endpoint=False)
    places = [
        x0 + (x1 - x0) * _bernstein(parameter, 0, *chain.controls(i), 1)[0]
        for i, (x0, x1) in enumerate(pairwise(chain.x))
    ]
    return np.append(np.concatenate(places), chain.x[-1])


def _pieces(chain: BezierChain) -> list[list[Any]]:
    """Return begin, width, values, slopes and inner control points of all pieces, 8 rows."""
    pieces = range(len(chain.x) - 1)
    width = [chain.x[i + 1] - chain.x[i] for i in pieces]
    ends = [[row[i + k] for i in pieces] for row in (chain.y, chain.slopes) for k in (0, 1)]
    controls = zip(*map(chain.controls, pieces), strict=True)
    return [list(chain.x[:-1]), width, *ends, *map(list, controls)]


@lru_cache(maxsize=64)
def _table(chain: BezierChain) -> tuple[np.ndarray, np.ndarray]:
    """Return edges, shape (n - 2,), and pieces, shape (8, n - 1), of a chain of numbers."""
    return np.array(chain.x[1:-1]), np.array(_pieces(chain))


@dataclass(frozen=True)
class SignedCurve:
    """A curve of sign * x.

    Args:
        chain: The curve.
        sign: +1 or -1.
    """

    chain: BezierChain
    sign: float

    def __call__(self, x: Any) -> Any:
        """Return the value at x, shaped like x."""
        return evaluate(self.chain, self.sign * x).value

    def expansion(self, x: Any) -> tuple[Any, Any, Any]:
        """Return value, first and second derivative at x."""
        point = evaluate(self.chain, self.sign * x)
        return point.value, self.sign * point.slope, point.curvature


@lru_cache(maxsize=64)
def _function(chain: BezierChain) -> ca.Function:
    """Return the function x -> value, slope, curvature of a chain of numbers."""
    x = ca.SX.sym("x")
    controls = [chain.controls(i) for i in range(len(chain.x) - 1)]
    inputs = [chain.x, chain.y, chain.slopes, *zip(*controls, strict=True)]
    general = _any_chain(len(chain.x), chain.newton_steps)
    return ca.Function("chain", [x], general.call([x, *map(ca.SX, inputs)], True, False))


@lru_cache(maxsize=16)
def _any_chain(knots: int, newton_steps: int) -> ca.Function:
    """Return the function of x, knots and inner control points -> value, slope, curvature.

    CasADi copies expressions, and folds what is constant, faster than Python writes them.
    """
    x = ca.SX.sym("x")
    inputs = [ca.SX.sym(name, knots) for name in ("x", "y", "slopes")]
    inputs += [ca.SX.sym(name, knots - 1) for name in "ab"]
    xs, ys, slopes, a, b = map(ca.vertsplit, inputs)
    chain = BezierChain(xs, ys, slopes, np.nan, newton_steps)  # a and b know the curviness
    point = _evaluated(chain, _step_sums(chain, [*_pieces(chain)[:6], a, b], x), x)
    return ca.Function("chain", [x, *inputs], [point.value, point.slope, point.curvature])


def _evaluated(chain: BezierChain, piece: Any, x: Any) -> BezierPoint:
    """Return the curve at x by the row of `_pieces` that x lies in."""
    x0, width, y0, y5, s0, s5, a, b = piece
    above, below = x > chain.x[-1], x < chain.x[0]
    inside = 1 - above - below
    # outside the knots the parameter stays at the end, where value and slope are the knot's
    target = (x - x0) / width * inside + above
    u = _invert(target, a, b, chain.newton_steps)
    xs = _bernstein(u, 0, a, b, 1)
    ys = _bernstein(u, y0, y0 + s0 * a * width, y5 - s5 * (1 - b) * width, y5)
    slope = ys[1] / (xs[1] * width)
    curvature = (ys[2] * xs[1] - ys[1] * xs[2]) / (xs[1] ** 3 * width**2) * inside
    beyond = above * (x - chain.x[-1]) + below * (x - chain.x[0])
    return BezierPoint(ys[0] + slope * beyond, slope, curvature)


def newton_steps_for(chain: BezierChain, tolerance: float = 1e-14) -> int:
    """Return the Newton steps after which x(u) meets its target on every piece of a chain."""
    target = np.linspace(0.0, 1.0, 2001)
    controls = np.array([chain.controls(i) for i in range(len(chain.x) - 1)])
    a, b = controls[:, :1], controls[:, 1:]
    u = target + 0 * a
    for steps in range(1, NEWTON_STEPS):
        u = _newton_step(u, target, a, b)
        if np.abs(_bernstein(u, 0, a, b, 1)[0] - target).max() < tolerance:
            return steps
    return NEWTON_STEPS


def _step_sums(chain: BezierChain, rows: Sequence[Sequence[Any]], x: Any) -> list[Any]:
    """Return row[i] of every row where x lies in piece i: a sum of steps works for all types."""
    passed, sums = [x >= edge for edge in chain.x[1:-1]], []
    for row in rows:
        total = row[0] + 0 * x
        for step, before, after in zip(passed, row[:-1], row[1:], strict=True):
            total = total + step * (after - before)
        sums.append(total)
    return sums


def _bernstein(u: Any, p0: Any, a: Any, b: Any, p5: Any) -> tuple[Any, Any, Any]:
    """Return value and two u-derivatives of the quintic Bezier with points p0, a, a, b, b, p5."""
    w = 1 - u
    uu, ww, uw = u * u, w * w, u * w
    value = (
        p0 * ww * ww * w
        + a * 5 * uw * ww * (w + 2 * u)
        + b * 5 * uw * uu * (2 * w + u)
        + p5 * uu * uu * u
    )
    first, middle, last = a - p0, b - a, p5 - b
    rate = 5 * (first * ww * ww + 6 * middle * uw * uw + last * uu * uu)
    bend = 20 * (-first * ww * w + 3 * middle * uw * (w - u) + last * uu * u)
    return value, rate, bend


def _invert(target: Any, a: Any, b: Any, steps: int) -> Any:
    """Return u with x(u) = target on the scaled corner, by Newton's method."""
    step = _symbolic_newton_step() if isinstance(target, ca.SX) else _newton_step
    u = target
    for _ in range(steps):
        u = step(u, target, a, b)
    return u


def _newton_step(u: Any, target: Any, a: Any, b: Any) -> Any:
    """Return a better u for x(u) = target."""
    value, rate, _ = _bernstein(u, 0, a, b, 1)
    return u + (target - value) / rate


@cache
def _symbolic_newton_step() -> ca.Function:
    """Return `_newton_step` as a function: CasADi copies expressions faster than Python."""
    inputs = [ca.SX.sym(name) for name in ("u", "target", "a", "b")]
    return ca.Function("newton_step", inputs, [_newton_step(*inputs)], {"always_inline": True})
