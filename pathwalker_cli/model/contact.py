"""The walking pattern as data: which contact forces act in which phase.

Phases, in order, follow Sreenivasa et al. (2017), section 2.3: one right and one left step.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pathwalker_cli.conventions import CONTACT_FORCES
from pathwalker_cli.errors import InputError

__all__ = ["PHASES", "PHASE_NAMES", "ContactPhase", "phase_named"]


@dataclass(frozen=True)
class ContactPhase:
    """A stretch of gait in which the same contact forces act.

    Args:
        name: Name of the phase.
        forces: Active components in `conventions.CONTACT_FORCES`; each stands for one
            direction in which its point does not move.
    """

    name: str
    forces: tuple[str, ...]

    @property
    def points(self) -> tuple[str, ...]:
        """Contact points on the ground, e.g. ("heel_r", "toe_r")."""
        return tuple(dict.fromkeys(force[:-2] for force in self.forces))

    @property
    def indices(self) -> tuple[int, ...]:
        """Positions of the active forces in `conventions.CONTACT_FORCES`."""
        return tuple(CONTACT_FORCES.index(force) for force in self.forces)

    def touched_down(self, following: ContactPhase) -> tuple[str, ...]:
        """Return the directions in which new points are stopped when the next phase begins."""
        return tuple(f for f in following.forces if f[:-2] not in self.points)

    def lifted_off(self, following: ContactPhase) -> tuple[str, ...]:
        """Return the forces that have faded to zero when the next phase begins.

        While its foot stays on the ground a point loses its vertical force only: the friction
        of a rigid foot may pass from heel to toe at once.
        """
        gone = [f for f in self.forces if f[:-2] not in following.points]
        feet_left = {point[-1] for point in following.points}
        return tuple(f for f in gone if f.endswith("z") or f[-3] not in feet_left)


def _flat(side: str) -> tuple[str, ...]:
    return (f"heel_{side}_x", f"heel_{side}_z", f"toe_{side}_z")


def _toe(side: str) -> tuple[str, ...]:
    return (f"toe_{side}_x", f"toe_{side}_z")


def _heel(side: str) -> tuple[str, ...]:
    return (f"heel_{side}_x", f"heel_{side}_z")


PHASES: Final = (
    ContactPhase("right_flat", _flat("r")),
    ContactPhase("right_toe", _toe("r")),
    ContactPhase("right_toe_left_heel", _toe("r") + _heel("l")),
    ContactPhase("right_toe_left_flat", _toe("r") + _flat("l")),
    ContactPhase("left_flat", _flat("l")),
    ContactPhase("left_toe", _toe("l")),
    ContactPhase("left_toe_right_heel", _toe("l") + _heel("r")),
    ContactPhase("left_toe_right_flat", _toe("l") + _flat("r")),
)
"""The eight phases of a stride."""

PHASE_NAMES: Final = tuple(phase.name for phase in PHASES)


def phase_named(phase: str | int) -> ContactPhase:
    """Return a phase by its name or by its position in `PHASES`.

    Raises:
        InputError: If there is no such phase.
    """
    if isinstance(phase, int) and 0 <= phase < len(PHASES):
        return PHASES[phase]
    for candidate in PHASES:
        if candidate.name == phase:
            return candidate
    raise InputError(f"there is no phase {phase!r}", allowed=", ".join(PHASE_NAMES))
