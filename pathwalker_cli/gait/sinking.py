"""A walk on soles that roll as the start of one on soles that give way."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pathwalker_cli.model.compliance import depth_under
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, joined


def sunk(walker: Walker, rolling: PhasedMotion) -> PhasedMotion:
    """Return the same walk with the feet as deep in the ground as their loads press them.

    Args:
        walker: Who walks on soles that give way.
        rolling: Its motion on soles that roll, of a stride or a step.
    """
    steps = []
    for step in walker.pattern.phases:
        parts = [p for p in rolling.phases if walker.pattern.phase(p.name).step == step.step]
        if parts:
            steps.append(joined(step.name, [_pressed(walker, part) for part in parts]))
    return PhasedMotion(tuple(steps), rolling.parameters)


def _pressed(walker: Walker, phase: PhaseMotion) -> PhaseMotion:
    """Return a phase with the forces of both feet, and its postures as these press them."""
    pattern, n = walker.pattern, walker.skeleton.size
    rows = pattern.indices(pattern.phase(phase.name).forces)
    accelerations, given, reserves = np.split(phase.algebraic, [n, n + len(rows)], axis=-1)
    forces = np.zeros((*given.shape[:2], len(pattern.forces)))
    forces[..., rows] = given
    states, inner = phase.states.copy(), phase.inner_states.copy()
    for at in np.ndindex(given.shape[:2]):
        inner[at][:n] = _deep(walker, inner[at][:n], forces[at][1::2])
    states[0, :n] = _deep(walker, states[0, :n], forces[0, 0, 1::2])
    states[1:] = inner[:, -1]
    algebraic = np.concatenate([accelerations, forces, reserves], axis=-1)
    return replace(phase, states=states, inner_states=inner, algebraic=algebraic)


def _deep(walker: Walker, q: np.ndarray, loads: np.ndarray) -> np.ndarray:
    """Return the posture nearest to q (10,) in which loaded feet are as deep as they should be."""
    places = zip(walker.pattern.points, loads.tolist(), strict=True)
    depths = [depth_under(place, load, walker.values, walker.weight) for place, load in places]
    lift = np.zeros(2 * len(loads))
    lift[1::2] = np.where(loads > 0.0, -np.array(depths) - walker.contact_points(q)[:, 1], 0.0)
    jacobian = walker.rigid_body.point_jacobian(q, walker.rigid_body.parameters)
    return np.asarray(q + np.linalg.pinv(np.asarray(jacobian)) @ lift)
