"""Second-order stand-ins for costly scalar functions: derivatives need not run through them.

A curve found by Newton's method is expensive to differentiate twice.  In its place stands the
Taylor polynomial about an anchor that is numerically equal to the argument, with symbols for
anchor, value, slope and curvature.  Its first and second derivatives are those of the curve.  After
the derivatives of a block are taken, the symbols are replaced by what they stand for, so the curve
is computed once per evaluation and never differentiated.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import casadi as ca


@dataclass
class FrozenTerms:
    """Collects symbols and what they stand for while expressions are being built."""

    symbols: list[ca.SX] = field(default_factory=list)
    meanings: list[ca.SX] = field(default_factory=list)

    def taylor(
        self,
        expansion: Callable[..., tuple[ca.SX, ca.SX, ca.SX]],
        *arguments: ca.SX,
    ) -> ca.SX:
        """Return the second-order stand-in of a scalar function.

        Args:
            expansion: Returns value, gradient (n,) and Hessian (n, n) at the n arguments given.
            arguments: The n scalar expressions at which the function is wanted.
        """
        point = ca.vertcat(*arguments)
        value, gradient, hessian = (ca.SX(term) for term in expansion(*arguments))
        anchor, at_anchor = self._stand_in(point), self._stand_in(value)
        delta = point - anchor
        bend = ca.bilin(self._stand_in(hessian), delta, delta) / 2
        return at_anchor + ca.dot(self._stand_in(gradient), delta) + bend

    def _stand_in(self, meaning: ca.SX) -> ca.SX:
        """Return fresh symbols that stand for an expression."""
        symbol = ca.SX.sym(f"frozen{len(self.symbols)}", meaning.sparsity())
        self.symbols.append(ca.SX(symbol.nz[:]))
        self.meanings.append(ca.SX(meaning.nz[:]))
        return symbol

    @property
    def symbol_vector(self) -> ca.SX:
        """All symbols, shape (k,)."""
        return ca.vertcat(*self.symbols) if self.symbols else ca.SX(0, 1)

    @property
    def meaning_vector(self) -> ca.SX:
        """What the symbols stand for, shape (k,)."""
        return ca.vertcat(*self.meanings) if self.meanings else ca.SX(0, 1)
