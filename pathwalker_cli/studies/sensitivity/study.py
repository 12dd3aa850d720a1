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
from pathwalker_cli.gait.neighbourhood import Derivative, Neighbourhood
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.io.fields import Quantity
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import SegmentLengths, Strengths
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import NeighbourStudy, require_optimum, resolver_of
from pathwalker_cli.studies.journal import Journal
from pathwalker_cli.studies.measures import all_measures, measures
from pathwalker_cli.studies.sensitivity.result import Check, Sensitivities, Sensitivity

__all__ = ["SensitivityStudy", "asked_places", "default_places", "sensitivities"]

POINTS: Final = "points"
"""Folder of the re-solves of a check."""

_ORTHOSIS: Final = ("neutral_angle", "free_play", "preload_torque")

_ORTHOSIS_PAIRS: Final = {
    "dorsiflexion_stop": SIDES,
    "plantarflexion_stop": SIDES,
    "stop_stiffness": ("dorsiflexion", "plantarflexion"),
}

Step = Annotated[float, Quantity("", 1e-5, 0.2, above="is it in percent?")]


class SensitivityStudy(NeighbourStudy):
    """Which numbers are asked about, and which answers are checked by solving again."""

    places: tuple[str, ...] = ()
    tolerance: Annotated[float, Quantity("", 1e-12, 1e-6)] = 1e-9
    check: tuple[str, ...] = ()
    check_step: Step = 5e-4


def default_places(patient: Patient, worn: bool) -> tuple[str, ...]:
    """Return the places in a patient's file that are asked about.

    Args:
        patient: The patient.
        worn: Whether the orthosis is worn.
    """
    places = [f"orthosis.{name}" for name in _ORTHOSIS] if worn else []
    places += [
        f"orthosis.{name}.{end}" for name, two in _ORTHOSIS_PAIRS.items() if worn for end in two
    ]
    places += ["strengths"]
    for name in Strengths.model_fields:
        sides = ("",) if name.startswith("lumbar") else (".right", ".left")
        places += [f"strengths.{name}{side}" for side in sides]
    return (*places, "body_mass", *(f"segment_lengths.{n}" for n in SegmentLengths.model_fields))


def asked_places(
    asked: SensitivityStudy, free: Sequence[Unknown], patient: Patient, worn: bool
) -> tuple[str, ...]:
    """Return the numbers that a study asks about: those that are free, and places in the file.

    A place whose number the problem chooses itself changes nothing, and is left out.

    Raises:
        ConfigError: If a check is asked for what is not asked about.
    """
    chosen = {place for u in free for place in (u.address, *u.addresses)}
    usual = (place for place in default_places(patient, worn) if place not in chosen)
    places = (*(u.name for u in free), *(asked.places or usual))
    unknown = [place for place in asked.check if place not in places]
    if unknown:
        raise ConfigError(f"names {unknown[0]}", where="check", allowed=", ".join(places))
    return places


def sensitivities(asked: SensitivityStudy, run: Run, folder: Path) -> Sensitivities:
    """Return the sensitivities of an optimum.

    Args:
        asked: What is asked.
        run: The converged run.
        folder: The study's folder; re-solves of checks are kept there.

    Raises:
        ConfigError: If a place does not exist, or a check is asked for what is not.
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    case = run.case.with_values({"solver.tolerance": asked.tolerance})
    resolver = resolver_of(run, asked.tolerance)
    require_optimum(resolver, run, asked.tolerance)
    around = Neighbourhood(resolver)
    began = time.perf_counter()
    patient = around.optimum.solver.walker.patient
    worn = case.config.condition == "orthosis"
    places = asked_places(asked, around.free, patient, worn)
    base = all_measures(around.optimum)
    rows = tuple(_sensitivity(around, place, base) for place in places)
    seconds = time.perf_counter() - began
    journal = Journal(folder / POINTS, run, resolver)
    checks = tuple(_check(around, journal, case, place, asked.check_step) for place in asked.check)
    kkt = around.kkt
    found = (base, rows, checks, kkt.active, kkt.doubtful, seconds)
    return Sensitivities(case.config, patient.id, *found)


def _sensitivity(around: Neighbourhood, place: str, base: Mapping[str, float]) -> Sensitivity:
    """Return the answer to one number."""
    value, unknown = _value(around.optimum, place), _unknown(around.optimum, place)
    if unknown is not None:
        found, unit = around.by_unknown(unknown), around.optimum.value(unknown)
    else:
        found, unit = around.by_factor(place), 1.0
    derivatives = {key: unit * slope for key, slope in _slopes(found).items()}
    elasticities = {key: slope / base[key] if base[key] else None
                    for key, slope in derivatives.items()}  # fmt: skip
    return Sensitivity(place, value, derivatives, elasticities)


def _slopes(found: Derivative) -> dict[str, float]:
    """Return the derivatives of all measures."""
    below, above = all_measures(found.below), all_measures(found.above)
    slopes = {key: (above[key] - below[key]) / (2.0 * found.step) for key in above if key in below}
    return {**slopes, "cost": found.cost}


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
    return float(value) if isinstance(value, int | float) else None


def _check(around: Neighbourhood, journal: Journal, case: Case, place: str, step: float) -> Check:
    """Return the central difference of two solves."""
    ends = []
    for sign in (-1.0, 1.0):
        values = _moved(around.optimum, place, 1.0 + sign * step)
        found = journal.resolve(f"{place}{sign * step:+g}", case.with_values(values))
        if not found.converged:
            raise NotConvergedError(f"the check of {place} did not converge: {found.result.status}")
        ends.append(found)
    below, above = (measures(end) for end in ends)
    unit = 2.0 * step
    return Check(
        place,
        step,
        {key: (above[key] - below[key]) / unit for key in above},
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
