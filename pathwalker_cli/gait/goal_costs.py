"""What a motion is worth by every clinical goal, also by those that its problem did not weigh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.goals import GOALS, Goals
from pathwalker_cli.gait.problem import INTEGRALS
from pathwalker_cli.model.contact import phase_named
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, quadrature_weights

__all__ = ["goal_values", "with_goal_costs"]


def goal_values(
    motion: PhasedMotion, weight: float, comfort_ranges: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Return the value of every goal, without weights; of discomfort only if ranges are given.

    Args:
        motion: A whole stride.
        weight: Body weight with what is worn [N].
        comfort_ranges: Comfortable range by coordinate [rad].
    """
    names = tuple(name for name in GOALS if name != "discomfort" or comfort_ranges)
    goals = Goals(names, comfort_ranges=comfort_ranges)
    totals = sum(_gains(phase, goals, weight).sum(axis=0) for phase in motion.phases)
    costs = dict(zip(goals.integrals, np.asarray(totals), strict=True))
    durations = [phase.duration for phase in motion.phases]
    values = goals.values(costs, walked_distance(motion), motion.duration, durations)
    return {name: float(value) for name, value in values.items()}


def with_goal_costs(motion: PhasedMotion, goals: Goals, weight: float) -> PhasedMotion:
    """Return a motion whose integrals are those of a problem with these goals.

    Args:
        motion: A motion of a problem with these or other goals.
        goals: The goals.
        weight: Body weight with what is worn [N].
    """
    phases, reached = [], np.zeros(len(goals.integrals))
    for phase in motion.phases:
        gains = np.vstack([reached, _gains(phase, goals, weight)]).cumsum(axis=0)
        reached = gains[-1]
        integrals = np.hstack([phase.integrals[:, : len(INTEGRALS)], gains])
        phases.append(replace(phase, integrals=integrals))
    return replace(motion, phases=tuple(phases))


def _gains(phase: PhaseMotion, goals: Goals, weight: float) -> np.ndarray:
    """Return the integrals of running costs over every interval, shape (N, k)."""
    contact, n = phase_named(phase.name), len(COORDINATES)
    shape = phase.inner_states.shape[:2]
    activation = phase.smooth_at(phase.point_fractions.ravel()).reshape(*shape, -1)
    force = phase.algebraic[..., n : n + len(contact.indices)]
    columns = phase.inner_states[..., :n], phase.inner_states[..., n:], activation, force
    q, v, a, f = (list(np.moveaxis(values, -1, 0)) for values in columns)
    costs = goals.integrands(contact, q, v, a, f, list(goals.numbers(weight)))
    values = np.array([np.broadcast_to(cost, shape) for cost in costs])
    steps, weights = phase.duration * np.diff(phase.mesh), quadrature_weights(phase.degree)[1]
    return np.asarray(np.einsum("kij,i,j->ik", values.reshape(-1, *shape), steps, weights))
