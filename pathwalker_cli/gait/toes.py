"""A walk on feet in one piece as the start of one on feet with toes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from pathwalker_cli.conventions import COORDINATES, LEG_JOINTS, SUFFIX
from pathwalker_cli.model.compliance import depth_under
from pathwalker_cli.model.contact import TIPS
from pathwalker_cli.model.elements.toes import toe_joints
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion


def with_toes(walker: Walker, flat: PhasedMotion) -> PhasedMotion:
    """Return the same walk with toes, in line with the foot or on the ground.

    Args:
        walker: Who walks on toes.
        flat: Its motion on the same feet without, ten coordinates.
    """
    n, more = len(COORDINATES), walker.skeleton.size - len(COORDINATES)

    def states(given: np.ndarray) -> np.ndarray:
        q, v = np.split(given.reshape(-1, 2 * n), 2, axis=1)
        both = np.hstack([_postures(walker, q), walker.skeleton.completed(v)])
        return both.reshape(*given.shape[:-1], -1)

    def algebraic(given: np.ndarray) -> np.ndarray:
        parts = np.split(given, [n, given.shape[-1] - n], axis=-1)
        pairs = zip(parts, (more, 2 * len(TIPS), more), strict=True)
        padded = [np.pad(part, [(0, 0), (0, 0), (0, width)]) for part, width in pairs]
        return np.concatenate(padded, axis=-1)

    phases = (
        replace(
            phase,
            states=states(phase.states),
            inner_states=states(phase.inner_states),
            algebraic=algebraic(phase.algebraic),
        )
        for phase in flat.phases
    )
    return replace(flat, phases=tuple(phases))


def _postures(walker: Walker, q: np.ndarray) -> np.ndarray:
    """Return postures (n, 10) with those of further joints, (n, size).

    Toes are in line with the foot; where that would press them into the ground, they lie on it and
    are as deep as their joint presses them.
    """
    completed = walker.skeleton.completed(q)
    for joint, tip in zip(toe_joints(), TIPS, strict=True) if walker.parts.toes else ():
        s, length = SUFFIX[joint.side], walker.patient.toes_length(joint.side)
        stiffness = walker.values[joint.numbers[0].address]
        chain = ("pelvis_tilt", *(f"{name}_{s}" for name in LEG_JOINTS))
        pitch = completed[:, [walker.skeleton.index(name) for name in chain]].sum(axis=1)
        height = walker.frames(completed, [f"toe_{s}"])[f"toe_{s}"][:, 1]
        level = np.arcsin(np.clip(height / length, -1.0, 1.0))  # pitch of toes that just touch
        load = stiffness * np.maximum(pitch - level, 0.0) / length
        depth = [depth_under(tip, each, walker.values, walker.weight) for each in load]
        deep = np.arcsin(np.clip((height + depth) / length, -1.0, 1.0))
        completed[:, walker.skeleton.index(*joint.coordinates)] = np.minimum(deep - pitch, 0.0)
    return completed
