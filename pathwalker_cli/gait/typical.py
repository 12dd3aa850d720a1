"""Walks of made-up children that come with the package, scaled to another child: where to begin.

They are optima of the same problem, found once (`benchmarks/typical_walks.py`).  They scale by
dynamic similarity: lengths by leg length l, forces by weight, times by sqrt(l) (Hof 1996);
activations by what a muscle has to give then, and can.

References:
    Hof AL (1996). Scaling gait data to body size. Gait & Posture 4:222-223.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, LEG_JOINTS, ROOT, SUFFIX
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.motion_file import read_arrays, read_motion
from pathwalker_cli.model.compliance import depth_under
from pathwalker_cli.model.contact import TIPS, Feet, contact_pattern
from pathwalker_cli.model.elements.toes import toe_joints
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.ocp.problem import BoundTable
from pathwalker_cli.paths import shipped


@dataclass(frozen=True)
class TypicalWalk:
    """A stride of a made-up child.

    Args:
        name: Its child, e.g. "half-9y".
        motion: The stride.
        leg_length: Of the child [m].
        weight: Of the child with what it wears [N].
        strengths: Isometric torques of its muscles in the order of `conventions.GENERATORS` [N m].
    """

    name: str
    motion: PhasedMotion
    leg_length: float
    weight: float
    strengths: np.ndarray

    @property
    def phases(self) -> tuple[str, ...]:
        """Names of its phases."""
        return tuple(phase.name for phase in self.motion.phases)

    @classmethod
    def read(cls, path: Path) -> TypicalWalk:
        """Read the file of a walk.

        Raises:
            DataError: If it is missing or damaged.
        """
        arrays = read_arrays(path)
        size = float(arrays["leg_length"]), float(arrays["weight"])
        return cls(path.stem, read_motion(path), *size, arrays["strengths"])

    def scaled(self, walker: Walker, parameters: np.ndarray) -> PhasedMotion:
        """Return the stride of a walker of other size and strength.

        Args:
            walker: Who walks.
            parameters: Values of its unknowns, shape (k,).
        """
        length, mass = self._size(walker)
        needed = self._needed(walker)
        phases = (_scaled(phase, length, mass, needed) for phase in self.motion.phases)
        return PhasedMotion(tuple(phases), parameters)

    def distance(self, walker: Walker) -> float:
        """Return how different the muscles are: root mean square of log(activation needed)."""
        return float(np.sqrt(np.mean(np.log(self._needed(walker)) ** 2)))

    def _size(self, walker: Walker) -> tuple[float, float]:
        """Return how many times as tall and as heavy a walker is."""
        return walker.leg_length / self.leg_length, walker.weight / self.weight

    def _needed(self, walker: Walker) -> np.ndarray:
        """Return by what activations grow where a walker's muscles give the same walk, (14,)."""
        length, mass = self._size(walker)
        return np.asarray(mass * length * self.strengths / walker.max_isometric_torque)


def typical_walks(walker: Walker) -> list[TypicalWalk]:
    """Return the walks in a walker's condition with its phases, of the most similar child first.

    Soles that give way begin with the walks of soles that roll.  There are none for rarer patterns.
    """
    feet: Feet = "sole" if walker.parts.compliant else walker.parts.feet
    phases = contact_pattern(feet, walker.parts.contact).names
    paths = sorted((shipped("configs") / "walks").glob(f"*-{feet}-{walker.condition}.npz"))
    walks = (TypicalWalk.read(path) for path in paths)
    fitting = [walk for walk in walks if walk.phases == phases]
    return sorted(fitting, key=lambda walk: walk.distance(walker))


def completed(walker: Walker, motion: PhasedMotion, table: BoundTable) -> PhasedMotion:
    """Return a motion of ten coordinates with the toes of a walker, if a joint carries them.

    Postures are first brought within their bounds: toes that stand on the ground then stay there.
    """
    if not walker.parts.toes:
        return motion
    n, more = len(COORDINATES), walker.skeleton.size - len(COORDINATES)
    lower, upper = table.arrays(COORDINATES)

    def states(given: np.ndarray) -> np.ndarray:
        q, v = np.split(given.reshape(-1, 2 * n), 2, axis=1)
        q = _with_toes(walker, np.clip(q, lower, upper))
        return np.hstack([q, walker.skeleton.completed(v)]).reshape(*given.shape[:-1], -1)

    def algebraic(given: np.ndarray) -> np.ndarray:
        parts = np.split(given, [n, given.shape[-1] - n], axis=-1)
        pairs = zip(parts, (more, 2 * len(TIPS), more), strict=True)
        padded = [np.pad(part, [(0, 0), (0, 0), (0, width)]) for part, width in pairs]
        return np.concatenate(padded, axis=-1)

    return replace(
        motion,
        phases=tuple(
            replace(
                phase,
                states=states(phase.states),
                inner_states=states(phase.inner_states),
                algebraic=algebraic(phase.algebraic),
            )
            for phase in motion.phases
        ),
    )


def _with_toes(walker: Walker, q: np.ndarray) -> np.ndarray:
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
        height = np.array([walker.frames(posture)[f"toe_{s}"][1] for posture in completed])
        level = np.arcsin(np.clip(height / length, -1.0, 1.0))  # pitch of toes that just touch
        load = stiffness * np.maximum(pitch - level, 0.0) / length
        depth = [depth_under(tip, each, walker.values, walker.weight) for each in load]
        deep = np.arcsin(np.clip((height + depth) / length, -1.0, 1.0))
        completed[:, walker.skeleton.index(*joint.coordinates)] = np.minimum(deep - pitch, 0.0)
    return completed


_TRANSLATIONS: Final = np.array([name in ROOT[:2] for name in COORDINATES])


def _scaled(phase: PhaseMotion, length: float, mass: float, needed: np.ndarray) -> PhaseMotion:
    """Return a phase of a walker so many times as tall and heavy, activations times `needed`."""
    time, n = np.sqrt(length), len(COORDINATES)
    size = np.where(_TRANSLATIONS, length, 1.0)
    states = np.concatenate([size, size / time])
    forces = np.full(phase.algebraic.shape[2] - 2 * n, mass)
    algebraic = np.concatenate([size / time**2, forces, mass * length / size])
    return replace(
        phase,
        duration=phase.duration * time,
        states=phase.states * states,
        inner_states=phase.inner_states * states,
        algebraic=phase.algebraic * algebraic,
        smooth=np.clip(phase.smooth * needed, *choices.TYPICAL_ACTIVATION),
        controls=phase.controls * needed / time,
    )
