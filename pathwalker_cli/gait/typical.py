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

from pathwalker_cli.conventions import COORDINATES, ROOT
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.motion_file import read_arrays, read_motion
from pathwalker_cli.model.contact import Feet, contact_pattern
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
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
