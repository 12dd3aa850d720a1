"""What a little softer or stiffer spring does: each one moved, all the rest solved again.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, section 2.4 and table 5.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field, field_validator

from pathwalker_cli.case import Case
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.io.fields import Quantity, invalid
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.studies.base import NeighbourStudy, require_optimum, resolver_of
from pathwalker_cli.studies.journal import Journal
from pathwalker_cli.studies.measures import measures
from pathwalker_cli.studies.perturbation.result import Perturbation, Perturbed, remark
from pathwalker_cli.studies.springs import Ranges, Spring, free_springs, spring_ranges

__all__ = ["PerturbationStudy", "moved_springs", "perturb"]

POINTS: Final = "points"
"""Folder of the solved neighbours."""

_NOISE: Final = 100.0
"""Change of the cost that means nothing, in optimality tolerances of the solves, relative: costs
of the shipped patient solved to 1e-8 and to 1e-9 change by the same within 40 of them."""

Told = Callable[["Perturbed"], None]
Factor = Annotated[float, Quantity("", 0.1, 10.0, above="is it in percent?")]


class PerturbationStudy(NeighbourStudy):
    """Which springs are moved, by how much, and how exactly the rest is solved again."""

    factors: Annotated[tuple[Factor, ...], Field(min_length=1)] = (0.95,)
    springs: tuple[Spring, ...] = ()
    tolerance: Annotated[float, Quantity("", 1e-10, 1e-4)] = 1e-8

    @field_validator("factors")
    @classmethod
    def _once(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if len(set(value)) != len(value) or 1.0 in value:
            raise invalid("names a factor twice, or 1", allowed="different factors that change")
        return value


def perturb(
    study: PerturbationStudy, run: Run, folder: Path, told: Told | None = None
) -> Perturbation:
    """Move every spring of an optimum and solve all the rest again.

    Args:
        study: What to move.
        run: The converged run whose springs are moved.
        folder: The study's folder; solved neighbours are kept in it and not solved again.
        told: Is told of every neighbour.

    Raises:
        ConfigError: If a spring to be moved is prescribed, or cannot be had so soft or stiff.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    began = time.perf_counter()
    case = run.case.with_values({"solver.tolerance": study.tolerance})
    resolver = resolver_of(run, study.tolerance)
    base = require_optimum(resolver, run, study.tolerance)
    ranges = spring_ranges(base)
    plan = _plan(study, case, measures(base), ranges)
    journal = Journal(folder / POINTS, run, resolver)
    rows = []
    for row in _solved(plan, journal, base, study.tolerance):
        rows.append(row)
        if told is not None:
            told(row)
    order = {key: i for i, key in enumerate((s, f) for s, _ in plan for f in study.factors)}
    rows.sort(key=lambda row: order[row.spring, row.factor])
    patient = base.solver.walker.patient.id
    seconds = time.perf_counter() - began
    return Perturbation(
        case.config, patient, base.motion.intervals, measures(base), ranges, tuple(rows), seconds
    )


def moved_springs(study: PerturbationStudy, free: tuple[str, ...]) -> tuple[str, ...]:
    """Return the springs that a study moves.

    Args:
        study: The study.
        free: Springs that its problem may choose.

    Raises:
        ConfigError: If one is prescribed.
    """
    for spring in study.springs:
        if spring not in free:
            raise ConfigError(
                f"{spring} is prescribed by the problem and has no optimum",
                where="springs",
                allowed=", ".join(free) or "none: the problem prescribes all springs",
            )
    return study.springs or free


_Point = tuple[float, float, Case]
"""Factor, stiffness [N m/rad] and case of a neighbour."""


def _plan(
    study: PerturbationStudy, case: Case, base: Mapping[str, float], ranges: Ranges
) -> list[tuple[str, list[_Point]]]:
    """Return the neighbours by spring, nearest ones first."""
    plan = []
    for spring in moved_springs(study, free_springs(ranges)):
        points = []
        for factor in sorted(study.factors, key=lambda factor: abs(np.log(factor))):
            # rounded, so that a restart on another machine asks for the very same number
            stiffness = round(factor * base[spring], 6)
            held = {**case.config.bounds.stiffness, spring: (stiffness, stiffness)}
            where = f"{spring} x {factor:g}"
            moved = case.with_values({"bounds.stiffness": held}, where)
            points.append((factor, stiffness, moved))
        plan.append((spring, points))
    return plan


def _solved(
    plan: list[tuple[str, list[_Point]]], journal: Journal, base: Optimum, tolerance: float
) -> Iterator[Perturbed]:
    """Yield all neighbours; those further away start from nearer ones on the same side."""
    ranges, before = spring_ranges(base), measures(base)
    for spring, points in plan:
        nearest = {True: base, False: base}
        for factor, stiffness, case in points:
            name = f"{spring}-x{factor:g}"
            optimum = journal.resolve(name, case, nearest[factor < 1.0])
            if optimum.converged:
                nearest[factor < 1.0] = optimum
            yield _perturbed(spring, (factor, stiffness), optimum, before, ranges, tolerance)


def _perturbed(
    spring: str,
    moved: tuple[float, float],
    optimum: Optimum,
    before: Mapping[str, float],
    ranges: Ranges,
    tolerance: float,
) -> Perturbed:
    """Return one neighbour in numbers."""
    values = measures(optimum) if optimum.converged else {}
    changes = {key: value / before[key] - 1.0 for key, value in values.items()}
    change = changes.get("cost", 0.0)
    falls = change < -_NOISE * tolerance
    end = spring_ends(before, ranges).get(spring, "")
    note, explained = remark(end, moved[1], ranges[spring], change if falls else 0.0)
    return Perturbed(
        spring=spring,
        factor=moved[0],
        stiffness=moved[1],
        status=optimum.result.status,
        values=values,
        changes=changes,
        falls=falls,
        note=note if values else f"not converged: {optimum.result.status}",
        unexplained=falls and not explained,
        iterations=optimum.result.iterations,
        seconds=optimum.result.seconds,
    )
