"""How far the answers spread if the numbers of the patient are uncertain: draw, solve, count."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

from pydantic import Field

from pathwalker_cli.case import Case
from pathwalker_cli.errors import InputError, PatientError
from pathwalker_cli.io.fields import Quantity
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import NeighbourStudy, require_optimum, resolver_of
from pathwalker_cli.studies.measures import measures
from pathwalker_cli.studies.pool import Job, Solved, solve_jobs
from pathwalker_cli.studies.springs import spring_ranges
from pathwalker_cli.studies.uncertainty.draws import Distribution, Draws, draw, inputs_of
from pathwalker_cli.studies.uncertainty.result import Uncertainty

__all__ = ["UncertaintyStudy", "draw_cases", "uncertainty"]

DRAWS: Final = "draws"
"""Folder of the solved draws."""

Told = Callable[[Solved], None]


class UncertaintyStudy(NeighbourStudy):
    """What is uncertain, and how often it is drawn."""

    quantities: Annotated[dict[str, Distribution], Field(min_length=1)]
    draws: Annotated[int, Field(ge=2, le=100000)] = 100
    seed: Annotated[int, Field(ge=0)] = 0
    tolerance: Annotated[float, Quantity("", 1e-10, 1e-3)] = 1e-6


def uncertainty(
    study: UncertaintyStudy, run: Run, folder: Path, workers: int, told: Told | None = None
) -> Uncertainty:
    """Solve all draws from the optimum of a run.

    Args:
        study: What to draw.
        run: The converged run to start from.
        folder: The study's folder; solved draws are kept in it and not solved again.
        workers: Processes to solve on.
        told: Is told of every draw.

    Raises:
        ConfigError: If a place is wrong.
        PatientError: If a patient that was drawn is refused.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    began = time.perf_counter()
    case = run.case.with_values({"solver.tolerance": study.tolerance})
    draws = draw(inputs_of(study.quantities, case.unvaried), study.draws, study.seed)
    jobs = [Job(f"draw-{i:05d}", drawn) for i, drawn in enumerate(draw_cases(case, draws))]
    base = require_optimum(resolver_of(run, study.tolerance), run, study.tolerance)
    solved = list(solve_jobs(jobs, run, folder / DRAWS, study.tolerance, workers, told))
    solved.sort(key=lambda end: end.name)
    return Uncertainty(
        config=case.config,
        patient=base.solver.walker.patient.id,
        intervals=base.motion.intervals,
        base=measures(base),
        ranges=spring_ranges(base),
        draws=draws,
        solved=tuple(solved),
        seconds=time.perf_counter() - began,
        workers=min(workers, len(jobs)),
    )


def draw_cases(case: Case, draws: Draws) -> list[Case]:
    """Return the case of every draw; all are checked before any is solved.

    Args:
        case: The base; what it varies already is varied still.
        draws: What was drawn.

    Raises:
        PatientError: If a patient that was drawn is refused.
    """
    cases = []
    for number in range(len(draws.values)):
        variation = case.config.variation.merged(draws.variation(number))
        drawn = replace(case, config=case.config.model_copy(update={"variation": variation}))
        try:
            _ = drawn.patient
        except InputError as error:
            raise PatientError(
                f"draw {number} gives a patient who is refused: {error.what}",
                where="quantities",
                allowed=error.allowed,
                mend="choose smaller spreads",
            ) from None
        cases.append(drawn)
    return cases
