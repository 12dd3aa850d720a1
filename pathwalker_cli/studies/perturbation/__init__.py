"""What a little softer or stiffer spring does: each one moved, all the rest solved again.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, section 2.4 and table 5.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field, field_validator

from pathwalker_cli.case import Case
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import Quantity, invalid
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.studies.base import (
    NeighbourStudy,
    Plan,
    StudyKind,
    Work,
    require_optimum,
    resolver_of,
)
from pathwalker_cli.studies.measures import (
    Ranges,
    free_units,
    measures,
    measures_with,
    ranges_of,
)
from pathwalker_cli.studies.neighbours import Journal
from pathwalker_cli.studies.perturbation.result import (
    FILES,
    Perturbation,
    Perturbed,
    paper_changes,
    perturbation_content,
    perturbation_lines,
    remark,
    write_tables,
)

POINTS: Final = "points"
"""Folder of the solved neighbours."""

_NOISE: Final = 100.0
"""Change of the cost that means nothing, in optimality tolerances of the solves, relative: costs
of the shipped patient solved to 1e-8 and to 1e-9 change by the same within 40 of them."""

Factor = Annotated[float, Quantity("", 0.1, 10.0, above="is it in percent?")]


class PerturbationStudy(NeighbourStudy):
    """Which numbers are moved, by how much, and how exactly the rest is solved again."""

    factors: Annotated[tuple[Factor, ...], Field(min_length=1)] = (0.95,)
    springs: tuple[str, ...] = ()
    tolerance: Annotated[float, Quantity("", 1e-10, 1e-4)] = 1e-8

    @field_validator("factors")
    @classmethod
    def _once(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(set(value)) != len(value) or 1.0 in value:
            raise invalid("names a factor twice, or 1", allowed="different factors that change")
        return value

    def solved_as(self, case: Case) -> Case:
        """Return a case with the tolerance of the study."""
        return case.with_values({"solver.tolerance": self.tolerance})


def moved_numbers(study: PerturbationStudy, solver: GaitSolver) -> tuple[Unknown, ...]:
    """Return the numbers that a study moves: springs, and what else the problem chooses.

    Raises:
        ConfigError: If one is prescribed or none of the problem's, or the problem chooses nothing.
    """
    free = {unknown.name: unknown for unknown in solver.free}
    allowed = ", ".join(free) or "none: the problem prescribes all springs"
    if not free:
        raise ConfigError("there is nothing to move", where="springs", allowed=allowed)
    known = {unknown.name for unknown in solver.walker.unknowns}
    for i, name in enumerate(study.springs):
        if name not in free:
            what = "is prescribed by" if name in known else "is no number of"
            why = " and has no optimum" if name in known else ""
            raise ConfigError(
                f"{name} {what} the problem{why}", where=f"springs[{i}]", allowed=allowed
            )
    return tuple(free[name] for name in study.springs or free)


def plan(study: PerturbationStudy, solver: GaitSolver) -> Plan:
    """Return what would be moved."""
    names = [unknown.name for unknown in moved_numbers(study, solver)]
    factors = ", ".join(f"{factor:g}" for factor in study.factors)
    does = f"moves {', '.join(names)}, each to {factors} times its optimum"
    return Plan(does, len(names) * len(study.factors))


def perturb(study: PerturbationStudy, run: Run, work: Work) -> Perturbation:
    """Move every number of an optimum and solve all the rest again.

    Raises:
        ConfigError: If a number to be moved is prescribed, or cannot be had so small or large.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    began = time.perf_counter()
    case = study.solved_as(run.case)
    resolver = resolver_of(run, study.tolerance)
    base = require_optimum(resolver, run, study.tolerance)
    before, ranges = measures(base), ranges_of(base)
    further = free_units(base.solver.walker.unknowns)
    moved = moved_numbers(study, base.solver)
    cases = {  # all are there before any is solved
        (unknown, factor): _moved(case, unknown, factor, before)
        for unknown in moved
        for factor in study.factors
    }
    journal = Journal(work.folder / POINTS, run, resolver)
    rows = {}
    for unknown in moved:
        nearest = {True: base, False: base}
        # those further away start from nearer ones on the same side
        for factor in sorted(study.factors, key=lambda factor: abs(np.log(factor))):
            value, at = cases[unknown, factor]
            end = journal.resolve(f"{unknown.name}-x{factor:g}", at, nearest[factor < 1.0])
            if end.converged:
                nearest[factor < 1.0] = end
            row = _perturbed(unknown, factor, value, end, before, ranges, study.tolerance)
            work.report(
                f"{row.moved}: {row.status}, {row.iterations} iterations, {row.seconds:.1f} s"
            )
            rows[unknown, factor] = row
    return Perturbation(
        problem=case.config.problem,
        patient=base.solver.walker.patient.id,
        tolerance=study.tolerance,
        intervals=base.motion.intervals,
        optimum=before,
        ranges=ranges,
        measures=tuple(m for m in measures_with(further) if m.key in before),
        rows=tuple(rows[key] for key in cases),
        seconds=time.perf_counter() - began,
    )


def _moved(
    case: Case, unknown: Unknown, factor: float, before: Mapping[str, float]
) -> tuple[float, Case]:
    """Return what a number is moved to [its unit], and the case in which it is."""
    # rounded, so that a restart on another machine asks for the very same number
    value = round(factor * before[unknown.name], 6)
    values = held(case.config, {unknown: value})
    return value, case.with_values(values, f"{unknown.name} x {factor:g}")


def _perturbed(
    unknown: Unknown,
    factor: float,
    value: float,
    optimum: Optimum,
    before: Mapping[str, float],
    ranges: Ranges,
    tolerance: float,
) -> Perturbed:
    values = measures(optimum) if optimum.converged else {}
    changes = {k: after / before[k] - 1.0 for k, after in values.items() if before[k]}
    change = changes.get("cost", 0.0)
    falls = change < -_NOISE * tolerance
    end = spring_ends(before, ranges).get(unknown.name, "")
    limits = ranges[unknown.name]
    note, explained = remark(end, value, limits, change if falls else 0.0, unknown.unit)
    return Perturbed(
        name=unknown.name,
        label=unknown.label,
        unit=unknown.unit,
        factor=factor,
        value=value,
        status=optimum.result.status,
        values=values,
        changes=changes,
        changes_article=paper_changes(optimum.case, unknown.name, factor),
        cost_falls=falls,
        no_true_optimum=falls and not explained,
        note=note if values else f"not converged: {optimum.result.status}",
        iterations=optimum.result.iterations,
        seconds=optimum.result.seconds,
    )


def _write(result: Perturbation, folder: Path) -> None:
    from pathwalker_cli.studies.perturbation.figures import save_perturbation_figure

    write_tables(result, folder)
    save_perturbation_figure(result, folder / "figures")


def _failed(result: Perturbation, folder: Path) -> str:
    failed = ", ".join(row.moved for row in result.rows if not row.values)
    return failed and f"no solution was found for {failed}; {folder} holds the others"


STUDY: Final = StudyKind(
    model=PerturbationStudy,
    files=frozenset({POINTS, "figures", *FILES}),
    varies="numbers",
    plan=plan,
    run=perturb,
    write=_write,
    content=perturbation_content,
    lines=perturbation_lines,
    failed=_failed,
)
"""The study of moved springs and other numbers."""
