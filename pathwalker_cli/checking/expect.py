"""How long a solve may take: measured seconds of the shipped patient, by size.

Iterations and CPU seconds are those of docs/performance.md, "Whole solves", derivatives cached.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from pathwalker_cli.config import StudyConfig

__all__ = ["FIXED", "MEASURED", "Measured", "Seconds", "expected"]


@dataclass(frozen=True)
class Measured:
    """One measured solve.

    Args:
        iterations: Iterations in all.
        seconds: CPU seconds from the shell, imports, tables and figures included.
    """

    iterations: int
    seconds: float


MEASURED: Final[dict[str, tuple[Measured, Measured]]] = {
    "mapd-barefoot": (Measured(183, 13.1), Measured(222, 12.3)),
    "mapd-healthy": (Measured(145, 10.4), Measured(162, 8.8)),
    "mapd-orthosis": (Measured(311, 19.1), Measured(405, 23.3)),
    "mapd-ws-orthosis": (Measured(324, 20.1), Measured(596, 38.7)),
    "ls-barefoot": (Measured(69, 7.4), Measured(127, 9.8)),
}
"""By problem: on 64 intervals without refinement, and refined from 48 intervals on."""

FIXED: Final = 4.0
"""CPU seconds of imports, figures and tables, whatever is solved."""

_INTERVALS: Final = (64, 48)
_DEGREE: Final = 3
"""Intervals that the two measured solves began with, and their collocation points."""

_SPREAD: Final = (0.6, 2.0)
"""Shares of the measured seconds between which other children and starts end: those of the
tests' ten-year-old are 1.6 times those of the shipped patient, other starts need up to 1.9."""

_VERDICT: Final = 2.0
"""Factor by which judging the springs makes a solve with orthoses longer."""


@dataclass(frozen=True)
class Seconds:
    """CPU seconds on the machine of docs/performance.md.

    Args:
        likely: As the shipped patient would take.
        least: Few iterations.
        most: Many iterations.
        iterations: Iterations that `likely` stands for.
    """

    likely: float
    least: float
    most: float
    iterations: int

    def __str__(self) -> str:
        """Say it for people."""
        return (
            f"about {self.likely:.0f} s ({self.least:.0f} to {self.most:.0f}) of one core on the "
            f"machine of docs/performance.md, {self.iterations} iterations"
        )


def expected(config: StudyConfig, intervals: int) -> Seconds:
    """Return how long a solve may take.

    Args:
        config: The study.
        intervals: Intervals of its first mesh; unknowns, and seconds per iteration, are in
            proportion to their collocation points.
    """
    refined = config.mesh.refinements > 0
    measured = MEASURED[config.problem][refined]
    size = intervals * config.mesh.degree / (_INTERVALS[refined] * _DEGREE)
    verdict = _VERDICT if config.verdict and config.condition == "orthosis" else 1.0
    solve = (measured.seconds - FIXED) * size * config.starts * verdict
    return Seconds(
        FIXED + solve,
        FIXED + _SPREAD[0] * solve,
        FIXED + _SPREAD[1] * solve,
        measured.iterations * config.starts,
    )
