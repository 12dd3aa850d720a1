"""Derivatives of an optimum in physical terms: of its cost, its motion and its stiffnesses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.nlp.kkt import Answer, KktSystem

__all__ = ["Derivative", "Neighbourhood"]

_STEP = 1e-4
"""Relative change of a number of the problem by which its derivatives are taken."""


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
    """What surrounds an optimum to first order, and the cost to second order in the springs.

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
    def springs(self) -> tuple[str, ...]:
        """Names of the stiffnesses that the problem is free to choose."""
        places = list(self.optimum.program.layout.parameters)
        return tuple(STIFFNESSES[places.index(place)] for place in self.kkt.free)

    @cached_property
    def _scale(self) -> np.ndarray:
        """Stiffness [N m/rad] per solver unit of every free spring."""
        return np.asarray(self.optimum.program.layout.scale[self.kkt.free])

    @cached_property
    def cost_gradient(self) -> np.ndarray:
        """Derivatives of the cost in the free springs [1/(N m/rad)]; 0 inside their limits."""
        return np.asarray(self.kkt.parameter_gradient / self._scale)

    @cached_property
    def cost_hessian(self) -> np.ndarray:
        """Second derivatives of the cost in the free springs [1/(N m/rad)^2]."""
        return np.asarray(self.kkt.parameter_hessian / np.outer(self._scale, self._scale))

    def curvature(self, spring: str) -> float:
        """Return the second derivative of the cost in one stiffness while the others follow.

        Args:
            spring: Name of the spring.

        Returns:
            The derivative [1/(N m/rad)^2].
        """
        which = self.springs.index(spring)
        return self.kkt.curvature(which) / float(self._scale[which]) ** 2

    def by_spring(self, spring: str) -> Derivative:
        """Return the derivatives by one stiffness [N m/rad] while the others follow."""
        which = self.springs.index(spring)
        held = self.kkt.held(which)
        step = _STEP * float(self.optimum.stiffness[STIFFNESSES.index(spring)])
        return self._derivative(held, 1.0 / self._scale[which], step, {})

    def by_factor(self, place: str) -> Derivative:
        """Return the derivatives by a factor on a place in the patient's file, the springs follow.

        Args:
            place: The place; what the config scales there already is scaled on.
        """
        scale = self.optimum.config.variation.scale
        below, above = (
            self._moved({"variation.scale": {**scale, place: scale.get(place, 1.0) * factor}})
            for factor in (1.0 - _STEP, 1.0 + _STEP)
        )
        answer = self.kkt.answer(below.program, above.program, _STEP)
        return self._derivative(answer, 1.0, _STEP, {1: above, -1: below})

    def changed_activity(self, other: Optimum) -> int:
        """Return how many inequalities are clearly active in one optimum, clearly not in the other.

        Args:
            other: An optimum on the same mesh.
        """
        return self.kkt.changed(other.kkt)

    def _moved(self, values: Mapping[str, Any]) -> Optimum:
        """Return the optimum's unknowns in the program of other numbers."""
        return self._resolver.restored(self.optimum.case.with_values(values), self.optimum.result)

    def _derivative(
        self, answer: Answer, factor: float, step: float, ends: Mapping[int, Optimum]
    ) -> Derivative:
        result = self.optimum.result
        below, above = (
            replace(
                ends.get(sign, self.optimum),
                result=replace(
                    result,
                    unknowns=result.unknowns + sign * step * factor * answer.unknowns,
                    objective=result.objective + sign * step * factor * answer.cost,
                ),
            )
            for sign in (-1, 1)
        )
        return Derivative(answer.cost * factor, below, above, step)
