"""What every number of patient and orthosis does to the optimum, from its KKT system.

No problem is solved again, except where a check by finite differences is asked for.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, Final

from pathwalker_cli.case import Case
from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import ConfigError, NotConvergedError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.symmetry import require_symmetry
from pathwalker_cli.io.fields import Quantity, Sides
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import SegmentLengths, Stops, Strengths
from pathwalker_cli.patient.variation import Variation, varied
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import (
    NeighbourStudy,
    Plan,
    StudyKind,
    Work,
    require_optimum,
    resolver_of,
)
from pathwalker_cli.studies.measures import all_measures, measures, slopes
from pathwalker_cli.studies.neighbours import Journal
from pathwalker_cli.studies.sensitivity.result import (
    FILES,
    Check,
    Sensitivities,
    Sensitivity,
    sensitivity_content,
    sensitivity_lines,
    write_sensitivities,
)

POINTS: Final = "points"
"""Folder of the re-solves of a check."""

_ORTHOSIS: Final = ("neutral_angle", "free_play", "preload_torque")

_STOPS: Final = ("dorsiflexion_stop", "plantarflexion_stop")

Step = Annotated[float, Quantity("", 1e-5, 0.2, above="is it in percent?")]


class SensitivityStudy(NeighbourStudy):
    """Which numbers are asked about, and which answers are checked by solving again."""

    places: tuple[str, ...] = ()
    tolerance: Annotated[float, Quantity("", 1e-12, 1e-6)] = 1e-9
    check: tuple[str, ...] = ()
    check_step: Step = 5e-4

    def solved_as(self, case: Case) -> Case:
        """Return a case with the tolerance of the study."""
        return case.with_values({"solver.tolerance": self.tolerance})


def default_places(patient: Patient, with_orthosis: bool) -> tuple[str, ...]:
    """Return the places in a patient's file that are asked about."""
    places = []
    if with_orthosis:
        places += [f"orthosis.{name}" for name in _ORTHOSIS]
        places += [f"orthosis.{n}.{s}" for n in _STOPS for s in patient.braced("orthosis")]
        places += [f"orthosis.stop_stiffness.{name}" for name in Stops.model_fields]
    places += ["strengths"]
    for name in Strengths.model_fields:
        sides = ("",) if name.startswith("lumbar") else (".right", ".left")
        places += [f"strengths.{name}{side}" for side in sides]
    return (*places, "body_mass", *(f"segment_lengths.{n}" for n in SegmentLengths.model_fields))


def asked_places(asked: SensitivityStudy, solver: GaitSolver) -> tuple[str, ...]:
    """Return the numbers that a study asks about: those that are free, and places in the file.

    A place whose number the problem chooses itself changes nothing, and is left out.
    """
    free, walker = solver.free, solver.walker
    chosen = {place for u in free for place in (u.address, *u.addresses)}
    usual = default_places(walker.patient, solver.config.condition == "orthosis")
    usual += tuple(place for place in walker.patient.numbers if walker.values.get(place))
    given = asked.places or tuple(place for place in usual if place not in chosen)
    return (*(u.name for u in free), *given)


def asked_checks(asked: SensitivityStudy, places: Sequence[str]) -> tuple[str, ...]:
    """Return the numbers whose answers are checked; a name without a side stands for both sides.

    Raises:
        ConfigError: If a check is asked for what is not asked about.
    """
    found: list[str] = []
    for name in asked.check:
        named = [p for p in places if p in (name, *(f"{name}_{side}" for side in SIDES))]
        if not named:
            raise ConfigError(f"names {name}", where="check", allowed=", ".join(places))
        found += named
    return tuple(found)


def plan(asked: SensitivityStudy, solver: GaitSolver) -> Plan:
    """Return what would be asked about.

    Raises:
        ConfigError: If a place does not exist or cannot change alone in half a cycle, or if a check
            is asked for what is not asked about.
    """
    places = asked_places(asked, solver)
    for place in places[len(solver.free) :]:
        factor = 1.0 + asked.check_step if solver.config.half_cycle else 1.0
        try:
            patient = varied(solver.walker.patient, Variation(scale={place: factor}))
        except ConfigError as error:
            raise ConfigError(
                error.what, where="places", allowed=error.allowed, mend=error.mend
            ) from None
        if solver.config.half_cycle:
            require_symmetry(Case(solver.config, patient).walker(solver.config.model.backend))
    count = len(asked_checks(asked, places))
    does = f"{len(places)} numbers asked about; two solves for each of {count} checks"
    return Plan(does, 2 * count)


def sensitivities(asked: SensitivityStudy, run: Run, work: Work) -> Sensitivities:
    """Return the sensitivities of an optimum.

    Raises:
        ConfigError: If a place does not exist, or a check is asked for what is not.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    case = asked.solved_as(run.case)
    resolver = resolver_of(run, asked.tolerance)
    require_optimum(resolver, run, asked.tolerance)
    around = Neighbourhood(resolver)
    began = time.perf_counter()
    places = asked_places(asked, around.optimum.solver)
    checked = asked_checks(asked, places)
    base = all_measures(around.optimum)
    rows = tuple(_sensitivity(around, place, base) for place in places)
    seconds = time.perf_counter() - began
    journal = Journal(work.folder / POINTS, run, resolver)
    return Sensitivities(
        problem=case.config.problem,
        patient=case.unvaried.id,
        tolerance=asked.tolerance,
        base=base,
        rows=rows,
        checks=tuple(_check(around, journal, case, place, asked.check_step) for place in checked),
        active=around.kkt.active,
        doubtful=around.kkt.doubtful,
        seconds=seconds,
    )


def _sensitivity(around: Neighbourhood, place: str, base: Mapping[str, float]) -> Sensitivity:
    value, unknown = _value(around.optimum, place), _unknown(around.optimum, place)
    if unknown is not None:
        derivative, unit = around.by_unknown(unknown), around.optimum.value(unknown)
    else:
        derivative, unit = around.by_factor(place), 1.0
    derivatives = {key: unit * slope for key, slope in slopes(derivative).items()}
    elasticities = {key: slope / base[key] if base[key] else None
                    for key, slope in derivatives.items()}  # fmt: skip
    return Sensitivity(place, value, derivatives, elasticities)


def _unknown(optimum: Optimum, place: str) -> Unknown | None:
    """Return the unknown of that name, None where it is a place in the patient's file."""
    return next((unknown for unknown in optimum.free if unknown.name == place), None)


def _value(optimum: Optimum, place: str) -> float | None:
    """Return the number at a place, None where there are several."""
    if (unknown := _unknown(optimum, place)) is not None:
        return optimum.value(unknown)
    value: Any = optimum.solver.walker.patient
    for part in place.split("."):
        value = getattr(value, part, None)
    if isinstance(value, Sides) and len(alike := set(value.given.values())) == 1:
        (value,) = alike
    return float(value) if isinstance(value, int | float) else None


def _check(around: Neighbourhood, journal: Journal, case: Case, place: str, step: float) -> Check:
    """Return the central difference of two solves."""
    ends = []
    for sign in (-1.0, 1.0):
        values = _moved(around.optimum, place, 1.0 + sign * step)
        end = journal.resolve(f"{place}{sign * step:+g}", case.with_values(values))
        if not end.converged:
            raise NotConvergedError(f"the check of {place} did not converge: {end.result.status}")
        ends.append(end)
    below, above = (measures(end) for end in ends)
    return Check(
        place,
        step,
        {key: (above[key] - below[key]) / (2.0 * step) for key in above},
        sum(end.result.iterations for end in ends),
        sum(end.result.seconds for end in ends),
        max(around.changed_activity(end) for end in ends),
    )


def _moved(optimum: Optimum, place: str, factor: float) -> dict[str, Any]:
    """Return config values with one number scaled."""
    config = optimum.config
    if (unknown := _unknown(optimum, place)) is not None:
        return held(config, {unknown: factor * optimum.value(unknown)})
    scale = dict(config.variation.scale)
    return {"variation.scale": {**scale, place: factor * scale.get(place, 1.0)}}


def _write(result: Sensitivities, folder: Path) -> None:
    from pathwalker_cli.studies.sensitivity.figures import save_sensitivity_figure

    write_sensitivities(result, folder)
    save_sensitivity_figure(result, folder / "figures")


STUDY: Final = StudyKind(
    model=SensitivityStudy,
    files=frozenset({POINTS, "figures", *FILES}),
    varies="",
    plan=plan,
    run=sensitivities,
    write=_write,
    content=sensitivity_content,
    lines=sensitivity_lines,
    whole_cycle=False,
)
"""The study of what one percent of every number changes."""
