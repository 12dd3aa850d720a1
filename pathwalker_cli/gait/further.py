"""A walk in the ten coordinates of recordings as the start of one with further joints."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, LEG_JOINTS, SUFFIX
from pathwalker_cli.model.compliance import depth_under
from pathwalker_cli.model.contact import TIPS
from pathwalker_cli.model.elements import element_forces, generalised_forces
from pathwalker_cli.model.elements.toes import toe_joints
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion

_WIDEST: Final = 0.6
_HALVINGS: Final = 40
"""How far a hinge is sought from the ankle [rad], and by how many halvings: to 1e-12 rad."""


def with_further_joints(walker: Walker, plain: PhasedMotion) -> PhasedMotion:
    """Return the same walk with toes, and with orthoses as bodies of their own.

    Args:
        walker: Who walks.
        plain: Its motion without, ten coordinates.
    """
    n, skeleton = len(COORDINATES), walker.skeleton
    beside = [skeleton.index(joint.beside) if joint.beside else None for joint in skeleton.joints]

    def completed(values: np.ndarray) -> np.ndarray:
        """Return rates (..., n) with those of further joints: of the joint beside, else 0."""
        found = skeleton.completed(values)
        for i, other in enumerate(beside):
            if other is not None:
                found[..., i] = values[..., other]
        return found

    def states(given: np.ndarray) -> np.ndarray:
        q, v = np.split(given.reshape(-1, 2 * n), 2, axis=1)
        both = np.hstack([_postures(walker, q), completed(v)])
        return both.reshape(*given.shape[:-1], -1)

    def algebraic(given: np.ndarray) -> np.ndarray:
        vdot, force, reserve = np.split(given, [n, given.shape[-1] - n], axis=-1)
        tips = np.zeros((*force.shape[:-1], 2 * len(TIPS) if walker.parts.toes else 0))
        parts = completed(vdot), force, tips, skeleton.completed(reserve)
        return np.concatenate(parts, axis=-1)

    phases = (
        replace(
            phase,
            states=states(phase.states),
            inner_states=states(phase.inner_states),
            algebraic=algebraic(phase.algebraic),
        )
        for phase in plain.phases
    )
    return replace(plain, phases=tuple(phases))


def _postures(walker: Walker, q: np.ndarray) -> np.ndarray:
    """Return postures (n, 10) with those of further joints, (n, size)."""
    completed = walker.skeleton.completed(q)
    if walker.parts.toes:
        _lay_toes(walker, completed)
    _rest_hinges(walker, completed)
    return completed


def _lay_toes(walker: Walker, q: np.ndarray) -> None:
    """Set the toes of postures (n, size).

    They are in line with the foot; where that would press them into the ground, they lie on it and
    are as deep as their joint presses them.
    """
    for joint, tip in zip(toe_joints(), TIPS, strict=True):
        s, length = SUFFIX[joint.side], walker.patient.toes_length(joint.side)
        stiffness = walker.values[joint.numbers[0].address]
        chain = ("pelvis_tilt", *(f"{name}_{s}" for name in LEG_JOINTS))
        pitch = q[:, [walker.skeleton.index(name) for name in chain]].sum(axis=1)
        height = walker.frames(q, [f"toe_{s}"])[f"toe_{s}"][:, 1]
        level = np.arcsin(np.clip(height / length, -1.0, 1.0))  # pitch of toes that just touch
        load = stiffness * np.maximum(pitch - level, 0.0) / length
        depth = [depth_under(tip, each, walker.values, walker.weight) for each in load]
        deep = np.arcsin(np.clip((height + depth) / length, -1.0, 1.0))
        q[:, walker.skeleton.index(*joint.coordinates)] = np.minimum(deep - pitch, 0.0)


def _rest_hinges(walker: Walker, q: np.ndarray) -> None:
    """Set the hinges of orthoses in postures (n, size) to where spring and cuff are in balance."""
    hinges = [joint for joint in walker.skeleton.joints if joint.beside]
    names = walker.skeleton.coordinates
    columns = [names.index(joint.coordinate) for joint in hinges]
    ankles = q[:, [names.index(joint.beside) for joint in hinges]]
    low, high = ankles - _WIDEST, ankles + _WIDEST
    still, relaxed = np.zeros_like(q), [None] * len(walker.muscles)
    for _ in range(_HALVINGS if hinges else 0):
        q[:, columns] = middle = (low + high) / 2.0
        state = walker.state(q.T, still.T, relaxed)
        forces = element_forces(walker.device.forces, state, walker.values)
        total = generalised_forces(walker.device.forces, forces, names, np.zeros(len(q)))
        pushed = np.stack([total[column] for column in columns], axis=1) > 0.0
        low, high = np.where(pushed, middle, low), np.where(pushed, high, middle)
