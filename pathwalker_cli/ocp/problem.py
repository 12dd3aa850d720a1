"""A multi-phase optimal control problem as data; it knows nothing of walking or of solvers.

In every phase a semi-explicit differential-algebraic equation holds at each instant,

    dx/dt = f(x, z, y, p),   0 = r(x, z, y, p),   dy/dt = u,

with states x, algebraic variables z, smooth states y that are driven by the piecewise linear
controls u, and free parameters p.  Phases follow each other with continuous x, y and u and
have free durations.  Running costs are integrals of the integrands over all phases; objective
and boundary rows may combine them with the first and the last instant.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import casadi as ca
import numpy as np

from pathwalker_cli.nlp.frozen import FrozenTerms

INFINITY = float("inf")

Instant = tuple[ca.SX, ca.SX, ca.SX]
"""States, smooth states and controls at one instant."""


@dataclass(frozen=True)
class Variables:
    """A named vector of unknowns.

    Args:
        symbol: SX of shape (n,), in physical units.
        names: n names.
        scale: What counts as 1 for the solver, shape (n,).
    """

    symbol: ca.SX
    names: tuple[str, ...]
    scale: np.ndarray

    @classmethod
    def make(cls, prefix: str, names: tuple[str, ...], scale: float | np.ndarray) -> Variables:
        """Return fresh unknowns; a scalar scale holds for all of them."""
        sizes = np.full(len(names), scale) if np.isscalar(scale) else np.asarray(scale, float)
        return cls(ca.SX.sym(prefix, len(names)), names, sizes)

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return len(self.names)

    @cached_property
    def rate(self) -> ca.SX:
        """Symbols of their rates of change, which running costs alone may know."""
        return ca.SX.sym("rate", self.size)


@dataclass(frozen=True)
class Rows:
    """Named constraint rows.

    Args:
        value: SX of shape (n,), in physical units.
        names: n names.
        scale: What counts as 1 for the solver, shape (n,).
        lower: Default lower bounds in physical units, shape (n,).
        upper: Default upper bounds in physical units, shape (n,).
    """

    value: ca.SX = field(default_factory=lambda: ca.SX(0, 1))
    names: tuple[str, ...] = ()
    scale: np.ndarray = field(default_factory=lambda: np.zeros(0))
    lower: np.ndarray = field(default_factory=lambda: np.zeros(0))
    upper: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def make(
        cls,
        value: ca.SX,
        names: tuple[str, ...],
        scale: float | np.ndarray = 1.0,
        lower: float | np.ndarray = 0.0,
        upper: float | np.ndarray = 0.0,
    ) -> Rows:
        """Return rows; equalities with value 0 unless bounds are given."""
        full = [np.broadcast_to(np.asarray(k, float), (len(names),)) for k in (scale, lower, upper)]
        return cls(value, names, *full)

    @staticmethod
    def join(*parts: Rows) -> Rows:
        """Return all rows one after the other."""
        return Rows(
            ca.vertcat(*(part.value for part in parts)),
            tuple(name for part in parts for name in part.names),
            *(
                np.concatenate([getattr(part, key) for part in parts])
                for key in ("scale", "lower", "upper")
            ),
        )


@dataclass(frozen=True)
class Phase:
    """One phase of the problem, in the symbols of its `MultiPhaseProblem`.

    Args:
        algebraic: The algebraic variables z of this phase.
        derivative: f, SX of shape (number of states,).
        residual: r, equality rows that hold at every collocation point.
        path: Inequality rows that hold at every collocation point.
        end: Rows that hold at the last instant of the phase.
        fixed_at_end: Names in `path` that rows in `end` or bounds already fix at the last instant.
        integrands: Running costs, SX of shape (number of integrals,).
        frozen: Stand-ins used in these expressions.
    """

    name: str
    algebraic: Variables
    derivative: ca.SX
    residual: Rows
    path: Rows
    end: Rows
    fixed_at_end: tuple[str, ...]
    integrands: ca.SX
    frozen: FrozenTerms = field(default_factory=FrozenTerms)


@dataclass(frozen=True)
class Boundary:
    """What ties first instant, last instant, durations and integrals together.

    Args:
        first: Symbols (x, y, u) at the first instant.
        last: Symbols (x, y, u) at the last instant.
        durations: Symbols of the phase durations [s].
        integrals: Symbols of the integrals at the end.
        rows: Boundary rows, e.g. periodicity or a least speed.
        objective: What is minimised, scalar SX.
    """

    first: Instant
    last: Instant
    durations: ca.SX
    integrals: ca.SX
    rows: Rows
    objective: ca.SX


@dataclass(frozen=True)
class MultiPhaseProblem:
    """The structure of a problem; its numbers come apart from it in `ProblemNumbers`.

    Args:
        states: x.
        smooth: y.
        controls: u = dy/dt.
        parameters: p, free parameters.
        shared: Symbols of the constants of the problem (model numbers, weights), SX (k,).
        point_data: Symbols of numbers that differ from instant to instant, SX (m,).
        integrals: Names of the running costs.
        integral_scale: What counts as 1 for each running cost.
        node_rows: Rows in y and u that hold at every mesh node.
        boundary: Boundary rows and objective.
        sample: Term of the objective at every instant of `ProblemNumbers.samples`, scalar SX in
            states, point data and constants.
    """

    states: Variables
    smooth: Variables
    controls: Variables
    parameters: Variables
    shared: ca.SX
    point_data: ca.SX
    integrals: tuple[str, ...]
    integral_scale: np.ndarray
    phases: tuple[Phase, ...]
    node_rows: Rows
    boundary: Boundary
    sample: ca.SX = field(default_factory=lambda: ca.SX(0))

    def inputs(self, phase: Phase) -> list[ca.SX]:
        """Return the symbols in the expressions of a phase.

        They are x, z, y, u, p, shared, point data, dz/dt; only running costs know the last.
        """
        return [
            self.states.symbol,
            phase.algebraic.symbol,
            self.smooth.symbol,
            self.controls.symbol,
            self.parameters.symbol,
            self.shared,
            self.point_data,
            phase.algebraic.rate,
        ]

    def substituted(
        self, phase: Phase, expressions: list[ca.SX], values: list[ca.SX], tag: str = ""
    ) -> tuple[list[ca.SX], FrozenTerms]:
        """Return expressions of a phase with its `inputs` replaced by values, and its stand-ins."""
        symbols, frozen = self.inputs(phase), phase.frozen
        outer = ca.Function("expressions", [*symbols, frozen.symbol_vector], expressions)
        if not any(ca.depends_on(k, frozen.symbol_vector) for k in expressions if k.numel()):
            unused = ca.SX.zeros(frozen.symbol_vector.numel())
            return outer.call([*values, unused], True, False), FrozenTerms()
        inner = ca.Function("meanings", symbols, [frozen.meaning_vector])
        renewed = ca.SX.sym(f"frozen{tag}", frozen.symbol_vector.numel())
        (meanings,) = inner.call(values, True, False)
        return outer.call([*values, renewed], True, False), FrozenTerms([renewed], [meanings])


@dataclass(frozen=True)
class BoundTable:
    """Bounds by name, optionally by phase and for the last instant of a phase.

    Args:
        entries: Maps (name,), (name, phase) or (name, phase, "end") to (lower, upper) in
            physical units; the most specific entry counts.
    """

    entries: Mapping[tuple[str, ...], tuple[float, float]]

    def find(self, name: str, phase: str = "", at_end: bool = False) -> tuple[float, float] | None:
        """Return the bounds of a quantity, or None where the table has none."""
        keys: list[tuple[str, ...]] = [(name, phase, "end")] if at_end else []
        keys += [(name, phase), (name,)]
        return next((self.entries[key] for key in keys if key in self.entries), None)

    def arrays(
        self, names: tuple[str, ...], phase: str = "", at_end: bool = False
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return lower and upper bounds of several quantities; free where there is no entry."""
        pairs = [self.find(name, phase, at_end) or (-INFINITY, INFINITY) for name in names]
        lower, upper = np.array(pairs, float).reshape(-1, 2).T
        return lower, upper

    def of_rows(self, rows: Rows, phase: str = "") -> tuple[np.ndarray, np.ndarray]:
        """Return scaled bounds of rows: their own, or the entry where there is one."""
        lower, upper = rows.lower.copy(), rows.upper.copy()
        for i, name in enumerate(rows.names):
            if (found := self.find(name, phase)) is not None:
                lower[i], upper[i] = found
        return lower / rows.scale, upper / rows.scale

    def replace(self, changes: Mapping[tuple[str, ...], tuple[float, float]]) -> BoundTable:
        """Return a table in which these entries are added or replaced."""
        return BoundTable({**self.entries, **changes})


@dataclass(frozen=True)
class Sample:
    """An instant at which a motion is compared with something.

    Args:
        phase: Number of the phase.
        fraction: Share of the phase that has gone by, in [0, 1].
        data: Point data of the instant, shape (m,).
    """

    phase: int
    fraction: float
    data: np.ndarray


@dataclass(frozen=True)
class ProblemNumbers:
    """The numbers of a problem; changing them never needs new derivatives.

    Args:
        shared: Values of `MultiPhaseProblem.shared`, shape (k,).
        bounds: Bounds on unknowns (by variable name; durations as "duration") and on rows whose
            defaults are to be replaced.
        point_data: Returns the point data, shape (m,), for a phase number and a fraction of that
            phase in [0, 1].
        samples: Instants at which `MultiPhaseProblem.sample` is added to the objective.
    """

    shared: np.ndarray
    bounds: BoundTable
    point_data: Callable[[int, float], np.ndarray]
    samples: tuple[Sample, ...] = ()
