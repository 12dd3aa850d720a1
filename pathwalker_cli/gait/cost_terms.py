"""What a motion is worth: the terms of its objective, and every clinical goal."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.gait.costs import BASE, GOALS, Costs, Instant, Totals, Weights
from pathwalker_cli.model.contact import phase_named
from pathwalker_cli.model.elements.muscle import excitation_from_rate
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import (
    PhasedMotion,
    PhaseMotion,
    lagrange_weights,
    quadrature_weights,
)
from pathwalker_cli.ocp.problem import Sample


def cost_terms(
    motion: PhasedMotion, costs: Costs, weights: Weights, samples: tuple[Sample, ...] = ()
) -> dict[str, float]:
    """Return the terms of the objective of a whole stride by name; they add up to the cost."""
    totals = dict(zip(costs.integrals, motion.phases[-1].integrals[-1], strict=True))
    terms = prediction_terms(motion, totals, costs, weights)
    if samples:
        last = terms.pop("excitation_regularisation")
        terms["fit"] = weights["fit"] * _squared_distance(motion, samples)
        terms["excitation_regularisation"] = last
    return terms


def prediction_terms(
    motion: PhasedMotion, integrals: Mapping[str, float], costs: Costs, weights: Weights
) -> dict[str, float]:
    """Return the weighed terms by name, but for that of recorded instants.

    `integrals` are those of the running costs over a whole stride by name, without weights.
    """
    return costs.values(weights, _totals(motion, integrals))


def goal_values(
    motion: PhasedMotion, walker: Walker, comfort_ranges: Mapping[str, tuple[float, float]]
) -> dict[str, float]:
    """Return every goal of a whole stride without its weight; discomfort only with ranges [rad]."""
    walker = walker.with_parameters(motion.parameters)
    names = tuple(name for name in GOALS if name != "discomfort" or comfort_ranges)
    costs = Costs(names, comfort_ranges=comfort_ranges)
    gains = sum(_goal_gains(phase, costs, walker).sum(axis=0) for phase in motion.phases)
    integrals = [i for term in costs.goals.values() for i in term.integrals]
    totals = _totals(motion, dict(zip(integrals, np.asarray(gains), strict=True)))
    return {name: float(value) for name, value in costs.goal_values(totals).items()}


def with_goal_costs(motion: PhasedMotion, costs: Costs, walker: Walker) -> PhasedMotion:
    """Return a motion, of a problem with any goals, whose integrals are those of these goals."""
    walker = walker.with_parameters(motion.parameters)
    base = sum(len(term.integrals) for term in BASE.values())
    phases, reached = [], np.zeros(len(costs.integrals) - base)
    for phase in motion.phases:
        gains = np.vstack([reached, _goal_gains(phase, costs, walker)]).cumsum(axis=0)
        reached = gains[-1]
        phases.append(replace(phase, integrals=np.hstack([phase.integrals[:, :base], gains])))
    return replace(motion, phases=tuple(phases))


def walked_distance(motion: PhasedMotion) -> float:
    """Return how far the pelvis gets in a motion of a gait problem [m]."""
    x = COORDINATES.index("pelvis_tx")
    return float(motion.phases[-1].states[-1, x] - motion.phases[0].states[0, x])


def _squared_distance(motion: PhasedMotion, samples: tuple[Sample, ...]) -> float:
    """Return the sum over instants and coordinates of (q - q_recorded)^2 [rad^2 and m^2]."""
    states = (motion.phases[s.phase].states_at(np.array([s.fraction]))[0] for s in samples)
    n, pairs = len(COORDINATES), zip(states, samples, strict=True)
    return sum(float(np.sum((state[:n] - s.data[:n]) ** 2)) for state, s in pairs)


def _totals(motion: PhasedMotion, integrals: Mapping[str, float]) -> Totals:
    durations = [phase.duration for phase in motion.phases]
    phases = [phase_named(phase.name) for phase in motion.phases]
    return Totals(integrals, walked_distance(motion), motion.duration, durations, phases)


def _goal_gains(phase: PhaseMotion, costs: Costs, walker: Walker) -> np.ndarray:
    """Return the integrals of the goals' running costs over every interval, shape (N, k)."""
    contact, n = walker.pattern.phase(phase.name), walker.skeleton.size
    shape = phase.inner_states.shape[:2]
    fractions = phase.point_fractions.ravel()
    activation, rate = (
        at(fractions).reshape(*shape, -1) for at in (phase.smooth_at, phase.controls_at)
    )
    q, v = np.split(phase.inner_states, 2, axis=-1)
    vdot, force, reserve = np.split(phase.algebraic, [n, n + len(contact.forces)], axis=-1)
    excitation = excitation_from_rate(rate, activation)
    air = walker.pattern.in_the_air(contact)
    places = walker.contact_motion(q.reshape(-1, n).T, v.reshape(-1, n).T)
    position, velocity = (np.asarray(values).T.reshape(*shape, -1) for values in places)
    heights, speeds = position[..., 1::2][..., air], velocity[..., ::2][..., air]
    elements = walker.element_forces(*(x.reshape(-1, x.shape[-1]) for x in (q, v, activation)))
    loads = walker.cuff_forces(q.reshape(-1, n), v.reshape(-1, n), elements)
    cuffs = loads.reshape(*shape, -1)
    steps, (times, weights) = phase.duration * np.diff(phase.mesh), quadrature_weights(phase.degree)
    changes = np.einsum("jk,ik...->ij...", lagrange_weights(times, times, derivative=True), force)
    force_rate = changes / steps[:, None, None]
    columns = q, v, activation, force, rate, excitation, vdot, reserve, q, heights, speeds, cuffs
    *moved, slopes = (list(np.moveaxis(values, -1, 0)) for values in (*columns, force_rate))
    names = walker.skeleton.coordinates
    point = Instant(contact, *moved, force_rate=slopes, coordinates=names)
    running = costs.integrands(point, list(costs.numbers(walker)), costs.goals)
    values = np.array([np.broadcast_to(cost, shape) for cost in running])
    return np.asarray(np.einsum("kij,i,j->ik", values.reshape(-1, *shape), steps, weights))
