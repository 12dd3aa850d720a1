"""The springs of a study's base: which ones are free, in which range, and at which end of it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final, Literal

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.resolve import Optimum

__all__ = ["Ranges", "Spring", "free_springs", "require_springs", "spring_ranges"]

Spring = Literal[
    "dorsiflexion_stiffness_right",
    "dorsiflexion_stiffness_left",
    "plantarflexion_stiffness_right",
    "plantarflexion_stiffness_left",
]
"""Name of a spring, as in `conventions.STIFFNESSES`."""

Ranges = Mapping[str, tuple[float, float]]
"""Least and largest stiffness by spring [N m/rad]."""

_COLLOCATION: Final = "collocation"


def require_springs(config: StudyConfig, where: str) -> None:
    """Refuse a problem that has no springs, or whose neighbours cannot be solved.

    Args:
        config: The problem.
        where: Where it comes from, for the message.

    Raises:
        ConfigError: If nobody wears an orthosis in it, or it is solved by multiple shooting.
    """
    if config.condition != "orthosis":
        raise ConfigError(
            f"{config.problem} is walked barefoot and has no springs",
            where=where,
            allowed="a problem with orthoses, e.g. mapd-orthosis",
        )
    if config.transcription != _COLLOCATION:
        raise ConfigError(
            f"is solved by {config.transcription}, but neighbours are solved by {_COLLOCATION}",
            where=where,
            mend=f"solve it with transcription: {_COLLOCATION}",
        )


def spring_ranges(optimum: Optimum) -> dict[str, tuple[float, float]]:
    """Return the allowed range of every spring [N m/rad]; none where it follows another one."""
    alone = optimum.solver.bounds.ranges
    if all(name in alone for name in STIFFNESSES):
        return {name: alone[name] for name in STIFFNESSES}
    values = zip(STIFFNESSES, optimum.stiffness.tolist(), strict=True)
    return {name: alone.get(name, (value, value)) for name, value in values}


def free_springs(ranges: Ranges) -> tuple[str, ...]:
    """Return the springs that the problem may choose; the others are prescribed."""
    return tuple(name for name, (low, high) in ranges.items() if low < high)
