"""Derivatives of an optimum in physical terms: of its cost, its motion and its free numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from pathwalker_cli.gait import choices
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.nlp.kkt import Answer, KktSystem


@dataclass(frozen=True)
class Derivative:
    """What a number of the problem does to the optimum, per unit of that number.

    Args:
        cost: Derivative of the optimal cost.
        below: The optimum extrapolated to one step less.
        above: The optimum extrapolated to one step more.
        step: That step.
    """

    cost: float
    below: Optimum
    above: Optimum
    step: float


class Neighbourhood:
    """What surrounds an optimum to first order, and the cost to second order in its unknowns.

    Args:
        resolver: The solver whose optimum it is; the tighter its tolerance, the better.
    """

    def __init__(self, resolver: Resolver) -> None:
        self._resolver = resolver
        self.optimum = resolver.optimum

    @property
    def kkt(self) -> KktSystem:
        """The KKT system at the optimum."""
        return self.optimum.kkt

    @property
    def free(self) -> tuple[Unknown, ...]:
        """The unknowns that the problem is free to choose."""
        return self.optimum.free

    @cached_property
    def _scale(self) -> np.ndarray:
        """Size of a solver unit of every free unknown."""
        return np.asarray(self.optimum.program.scale[self.kkt.free])

    @cached_property
    def cost_gradient(self) -> np.ndarray:
        """Derivatives of the cost in the free unknowns [1/unit]; 0 inside their limits."""
        return np.asarray(self.kkt.parameter_gradient / self._scale)

    @cached_property
    def cost_hessian(self) -> np.ndarray:
        """Second derivatives of the cost in the free unknowns [1/(unit unit)]."""
        return np.asarray(self.kkt.parameter_hessian / np.outer(self._scale, self._scale))

    def rise(self, changes: Mapping[Unknown, float]) -> float:
        """Return the rise of the cost to second order if unknowns move by so much [their unit].

        The others follow.
        """
        moved = [self.free.index(unknown) for unknown in changes]
        rest = [i for i in range(len(self.free)) if i not in moved]
        step, hessian = np.array(list(changes.values())), self.cost_hessian
        bend = hessian[np.ix_(moved, moved)]
        if rest:
            cross = hessian[np.ix_(moved, rest)]
            bend = bend - cross @ np.linalg.lstsq(hessian[np.ix_(rest, rest)], cross.T)[0]
        return float(self.cost_gradient[moved] @ step + step @ bend @ step / 2.0)

    def curvature(self, unknown: Unknown) -> float:
        """Return the second derivative of the cost in one of `free`; others follow [1/unit^2]."""
        which = self.free.index(unknown)
        return self.kkt.curvature(which) / float(self._scale[which]) ** 2

    def by_unknown(self, unknown: Unknown) -> Derivative:
        """Return the derivatives by one unknown [its unit] while the others follow."""
        which = self.free.index(unknown)
        held = self.kkt.held(which)
        step = choices.DIFFERENCE * max(abs(self.optimum.value(unknown)), 0.01 * unknown.scale)
        return self._derivative(held, 1.0 / self._scale[which], step, {})

    def by_factor(self, place: str) -> Derivative:
        """Return the derivatives by a factor on a place in the patient's file, the unknowns follow.

        What the config scales there already is scaled on.
        """
        scale = self.optimum.config.variation.scale
        below, above = (
            self._moved({"variation.scale": {**scale, place: scale.get(place, 1.0) * factor}})
            for factor in (1.0 - choices.DIFFERENCE, 1.0 + choices.DIFFERENCE)
        )
        answer = self.kkt.answer(below.program, above.program, choices.DIFFERENCE)
        return self._derivative(answer, 1.0, choices.DIFFERENCE, {1: above, -1: below})

    def changed_activity(self, other: Optimum) -> int:
        """Return how many inequalities are clearly active here, clearly not in another optimum.

        Both are on the same mesh.
        """
        return self.kkt.changed(other.kkt)

    def _moved(self, values: Mapping[str, Any]) -> Optimum:
        """Return the optimum's unknowns in the program of other numbers."""
        return self._resolver.restored(self.optimum.case.with_values(values), self.optimum.result)

    def _derivative(
        self, answer: Answer, factor: float, step: float, ends: Mapping[int, Optimum]
    ) -> Derivative:
        below, above = (
            self.optimum.moved(answer, sign * step * factor, ends.get(sign, self.optimum))
            for sign in (-1, 1)
        )
        return Derivative(answer.cost * factor, below, above, step)
