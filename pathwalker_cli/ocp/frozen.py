"""Second-order stand-ins for costly scalar functions, so that derivatives need not run through them.

A curve found by Newton's method is expensive to differentiate twice.  In its place stands the
Taylor polynomial about an anchor that is numerically equal to the argument: its first and second
derivatives are those of the curve.  After the derivatives of a block are taken, the anchors are
replaced by their arguments, so value, slope and curvature are computed once per evaluation.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca

__all__ = ["FrozenTerms"]


@dataclass
class FrozenTerms:
    """Collects anchors and what they stand for while expressions are being built."""

    anchors: list[ca.SX] = field(default_factory=list)
    arguments: list[ca.SX] = field(default_factory=list)

    def taylor(
        self,
        expansion: Callable[..., tuple[ca.SX, ca.SX, ca.SX]],
        *arguments: ca.SX,
    ) -> ca.SX:
        """Return the second-order stand-in of a scalar function.

        Args:
            expansion: Returns value, gradient (n,) and Hessian (n, n) at the n anchors given.
            arguments: The n scalar expressions at which the function is wanted.
        """
        anchors = [ca.SX.sym(f"anchor{len(self.anchors) + i}") for i in range(len(arguments))]
        self.anchors += anchors
        self.arguments += list(arguments)
        value, gradient, hessian = expansion(*anchors)
        delta = ca.vertcat(*arguments) - ca.vertcat(*anchors)
        return value + ca.dot(gradient, delta) + ca.bilin(hessian, delta, delta) / 2

    @property
    def anchor_vector(self) -> ca.SX:
        """All anchors, shape (k,)."""
        return ca.vertcat(*self.anchors) if self.anchors else ca.SX(0, 1)

    @property
    def argument_vector(self) -> ca.SX:
        """What the anchors stand for, shape (k,)."""
        return ca.vertcat(*self.arguments) if self.arguments else ca.SX(0, 1)
