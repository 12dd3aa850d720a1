"""The terms of the objective, evaluated on a motion: equations (8), (9), (10) and goals."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.gait.goals import Goals
from pathwalker_cli.gait.problem import EXCITATION, GaitProblem, GaitWeights
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import Sample

__all__ = ["cost_terms", "prediction_terms", "walked_distance"]


def cost_terms(
    motion: PhasedMotion, gait: GaitProblem, weights: GaitWeights, samples: tuple[Sample, ...] = ()
) -> dict[str, float]:
    """Return the terms of the objective by name; they add up to the cost.

    Args:
        motion: A whole stride.
        gait: The problem that it solves.
        weights: Weights of the terms.
        samples: Recorded instants of a passage; without them the stride is a prediction.
    """
    totals = dict(zip(gait.integrals, motion.phases[-1].integrals[-1], strict=True))
    terms = prediction_terms(motion, totals, gait.goals, weights)
    if samples:
        terms["fit"] = weights.fit * squared_distance(motion, samples)
        terms["excitation_regularisation"] = weights.excitation * float(totals[EXCITATION])
    return terms


def prediction_terms(
    motion: PhasedMotion, costs: Mapping[str, float], goals: Goals, weights: GaitWeights
) -> dict[str, float]:
    """Return the terms of equations (9) and (10) and those of clinical goals by name.

    Args:
        motion: A whole stride.
        costs: Integrals of the running costs over it by name, without weights.
        goals: The goals that count.
        weights: Weights of the terms.
    """
    distance, time = walked_distance(motion), motion.duration
    terms = {
        "effort_per_distance": weights.effort * costs["effort"] / distance,
        "rate_regularisation": weights.rate * costs["rate"] / distance,
        "acceleration_regularisation": weights.acceleration * costs["acceleration"] / distance,
        "walking_speed": -weights.walking_speed * distance / time,
    }
    durations = [phase.duration for phase in motion.phases]
    for name, value in goals.values(costs, distance, time, durations).items():
        terms[name] = weights.goals[name] * value
    return {name: float(value) for name, value in terms.items()}


def walked_distance(motion: PhasedMotion) -> float:
    """Return how far the pelvis gets in a motion of a gait problem [m]."""
    return float(motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0])


def squared_distance(motion: PhasedMotion, samples: tuple[Sample, ...]) -> float:
    """Return the sum over instants and coordinates of (q - q_recorded)^2 [rad^2 and m^2]."""
    total = 0.0
    for sample in samples:
        state = motion.phases[sample.phase].states_at(np.array([sample.fraction]))[0]
        total += float(np.sum((state[: len(COORDINATES)] - sample.data) ** 2))
    return total
