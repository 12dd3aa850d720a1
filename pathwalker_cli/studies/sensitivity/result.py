"""Sensitivities as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from pathwalker_cli.config import StudyConfig

__all__ = ["Check", "Sensitivities", "Sensitivity"]


@dataclass(frozen=True)
class Sensitivity:
    """The answer to one number.

    Args:
        place: A spring, or a place in the patient's file.
        value: The number now in SI units; None where several numbers change by one factor.
        derivatives: Derivative of every measure by the relative change of the number, so that
            0.01 of it is what one percent does; SI units.
        elasticities: The same relative to the measure: percent per percent; None where the
            measure is 0.
    """

    place: str
    value: float | None
    derivatives: Mapping[str, float]
    elasticities: Mapping[str, float | None]


@dataclass(frozen=True)
class Check:
    """One answer beside a finite difference of two solves.

    Args:
        place: What was changed.
        step: Relative change up and down.
        derivatives: Central differences of the measures by the relative change.
        iterations: Iterations of both solves together.
        seconds: Seconds of both solves.
        changed: Inequalities that are active in one of the solves and not in the optimum.
    """

    place: str
    step: float
    derivatives: Mapping[str, float]
    iterations: int
    seconds: float
    changed: int


@dataclass(frozen=True)
class Sensitivities:
    """All answers.

    Args:
        config: The problem.
        patient: Id of the patient.
        base: Measures of the optimum; SI units.
        rows: The answers.
        checks: Those that were checked.
        active: Number of active inequalities at the optimum.
        doubtful: Number of those that are neither clearly active nor clearly inactive.
        seconds: Wall seconds of the answers, without solving the optimum and without checks.
    """

    config: StudyConfig
    patient: str
    base: Mapping[str, float]
    rows: tuple[Sensitivity, ...]
    checks: tuple[Check, ...]
    active: int
    doubtful: int
    seconds: float

    def row(self, place: str) -> Sensitivity:
        """Return the answer to one number."""
        return next(row for row in self.rows if row.place == place)
