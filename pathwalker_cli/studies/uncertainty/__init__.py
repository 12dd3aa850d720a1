"""How far the answers spread if the numbers of the patient are uncertain: draw, solve, count."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

from pydantic import Field, model_validator

from pathwalker_cli.case import Case
from pathwalker_cli.config.learnt import config_values
from pathwalker_cli.errors import ConfigError, InputError, PatientError
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import Quantity, invalid
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import (
    NeighbourStudy,
    Plan,
    StudyKind,
    Work,
    require_optimum,
    resolver_of,
)
from pathwalker_cli.studies.measures import free_units, measures, measures_with, ranges_of
from pathwalker_cli.studies.neighbours import Solved, solve_all
from pathwalker_cli.studies.uncertainty.draws import Distribution, Draws, draw, inputs_of
from pathwalker_cli.studies.uncertainty.files import FILES, uncertainty_content, write_tables
from pathwalker_cli.studies.uncertainty.result import Uncertainty
from pathwalker_cli.studies.uncertainty.text import uncertainty_lines

DRAWS: Final = "draws"
"""Folder of the solved draws."""

_EVERY: Final = 10
"""Draws between two lines of progress."""


class UncertaintyStudy(NeighbourStudy):
    """What is uncertain, and how often it is drawn."""

    quantities: dict[str, Distribution] = Field(default_factory=dict)
    learnt: bool = False
    draws: Annotated[int, Field(ge=2, le=100000)] = 100
    seed: Annotated[int, Field(ge=0)] = 0
    tolerance: Annotated[float, Quantity("", 1e-10, 1e-3)] = 1e-6

    @model_validator(mode="after")
    def _something(self) -> UncertaintyStudy:
        if not self.quantities and not self.learnt:
            raise invalid(
                "draws nothing", allowed="quantities, learnt: true, or both of them",
            )  # fmt: skip
        return self

    def solved_as(self, case: Case) -> Case:
        """Return a case with the tolerance of the study."""
        return case.with_values({"solver.tolerance": self.tolerance})

    def drawn(self, case: Case) -> tuple[Draws, list[Case]]:
        """Return what is drawn, and the case of every draw; see `draw_cases`."""
        learnt = case.config.learnt if self.learnt else None
        if self.learnt and learnt is None:
            raise ConfigError(
                "is true, but the base has no learnt numbers", where="learnt",
                mend="choose a base with `learnt: FILE`, e.g. predict-orthosis",
            )  # fmt: skip
        inputs = inputs_of(self.quantities, case.unvaried)
        draws = draw(inputs, self.draws, self.seed, learnt)
        return draws, draw_cases(case, draws)


def draw_cases(case: Case, draws: Draws) -> list[Case]:
    """Return the case of every draw; all are checked before any is solved.

    Raises:
        PatientError: If a patient that was drawn is refused.
    """
    cases = []
    for number in range(len(draws.values)):
        variation = case.config.variation.merged(draws.variation(number))
        drawn = case.with_values(config_values(draws.learnt(number)))
        drawn = replace(drawn, config=drawn.config.model_copy(update={"variation": variation}))
        try:
            _ = drawn.patient
            if drawn.config.free:  # what is drawn may leave a range that no orthosis can have
                _ = gait_bounds(drawn.walker(), drawn.config.bounds, drawn.config.free)
        except InputError as error:
            raise PatientError(
                f"draw {number} gives a patient who is refused: {error.what}",
                where="quantities",
                allowed=error.allowed,
                mend="choose smaller spreads",
            ) from None
        cases.append(drawn)
    return cases


def plan(study: UncertaintyStudy, solver: GaitSolver) -> Plan:
    """Return how much would be drawn; every patient is checked.

    Raises:
        ConfigError: If a place is wrong.
        PatientError: If a patient that was drawn is refused.
    """
    draws, _ = study.drawn(solver.case)
    does = f"{study.draws} draws of {len(draws.inputs)} numbers, seed {study.seed}"
    return Plan(does, study.draws)


def uncertainty(study: UncertaintyStudy, run: Run, work: Work) -> Uncertainty:
    """Solve all draws from the optimum of a run.

    Raises:
        ConfigError: If a place is wrong.
        PatientError: If a patient that was drawn is refused.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    began = time.perf_counter()
    case = study.solved_as(run.case)
    draws, drawn = study.drawn(case)
    cases = {f"draw-{i:05d}": each for i, each in enumerate(drawn)}
    base = require_optimum(resolver_of(run, study.tolerance), run, study.tolerance)

    def tell(done: int, solved: Solved) -> None:
        if solved.status != "converged":
            work.report(f"{solved.name}: {solved.status}")
        if done % _EVERY == 0 or done == study.draws:
            work.report(f"{done} of {study.draws} draws")

    folder = work.folder / DRAWS
    solved = solve_all(cases, run, folder, study.tolerance, work.workers, tell)
    numbers, further = measures(base), free_units(base.solver.walker.unknowns)
    return Uncertainty(
        config=case.config,
        patient=case.unvaried.id,
        intervals=base.motion.intervals,
        base=numbers,
        ranges=ranges_of(base),
        measures=tuple(m for m in measures_with(further) if m.key in numbers),
        further=further,
        draws=draws,
        solved=tuple(solved),
        seconds=time.perf_counter() - began,
        workers=min(work.workers, len(cases)),
    )


def _write(result: Uncertainty, folder: Path) -> None:
    from pathwalker_cli.studies.uncertainty.figures import save_uncertainty_figures

    write_tables(result, folder)
    save_uncertainty_figures(result, folder / "figures")


def _failed(result: Uncertainty, folder: Path) -> str:
    if not result.failed:
        return ""
    return (
        f"{len(result.failed)} of {len(result.solved)} draws did not converge; {folder} holds "
        "the others, and what was drawn for these"
    )


STUDY: Final = StudyKind(
    model=UncertaintyStudy,
    files=frozenset({DRAWS, "figures", *FILES}),
    varies="numbers",
    plan=plan,
    run=uncertainty,
    write=_write,
    content=uncertainty_content,
    lines=uncertainty_lines,
    failed=_failed,
)
"""The study of uncertain numbers of the patient."""
