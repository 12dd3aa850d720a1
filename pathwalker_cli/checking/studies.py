"""Configs of studies: each read by what its command reads it with, and what it would solve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pathwalker_cli.checking.patient import walker_rows
from pathwalker_cli.checking.prediction import described, ready_solver
from pathwalker_cli.checking.report import Changes, Checked, Row
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import ConfigError, placed
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.variation import Variation, varied
from pathwalker_cli.studies.base import NeighbourStudy, base_case, load_study
from pathwalker_cli.studies.batch.cases import load_cases
from pathwalker_cli.studies.landscape.study import LandscapeStudy, axis_values
from pathwalker_cli.studies.perturbation.study import PerturbationStudy, moved_springs
from pathwalker_cli.studies.sensitivity.study import SensitivityStudy, asked_places
from pathwalker_cli.studies.springs import Ranges, free_springs, require_springs
from pathwalker_cli.studies.tradeoff.study import TradeoffStudy, require_prediction
from pathwalker_cli.studies.uncertainty.draws import draw, inputs_of
from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy, draw_cases

__all__ = [
    "check_batch",
    "check_landscape",
    "check_perturbation",
    "check_sensitivity",
    "check_tradeoff",
    "check_uncertainty",
]


def check_perturbation(path: str, changes: Changes = ()) -> Checked:
    """Return what `perturb` would do."""
    study = load_study(path, PerturbationStudy, changes)
    solver = _base(study, path, springs=True)
    with placed(path):
        springs = moved_springs(study, free_springs(_ranges(solver)))
    solves = len(springs) * len(study.factors)
    factors = ", ".join(f"{factor:g}" for factor in study.factors)
    what = f"moves {', '.join(springs)}, each to {factors} times its optimum"
    return _study(path, "perturbation", solver, solves, what)


def check_sensitivity(path: str, changes: Changes = ()) -> Checked:
    """Return what `sensitivity` would do."""
    study = load_study(path, SensitivityStudy, changes)
    solver = _base(study, path)
    patient, with_orthosis = solver.walker.patient, solver.walker.orthosis is not None
    with placed(path):
        places = asked_places(study, solver.free, patient, with_orthosis)
        for place in places[len(solver.free) :]:
            _check_place(place, patient)
    solves = 2 * len(study.check)
    what = f"{len(places)} numbers asked about; two solves for each of {len(study.check)} checks"
    return _study(path, "sensitivity", solver, solves, what)


def _check_place(place: str, patient: Patient) -> None:
    """Refuse what is no number of the patient's file."""
    try:
        varied(patient, Variation(scale={place: 1.0}))
    except ConfigError as error:
        mend = error.mend
        raise ConfigError(error.what, where="places", allowed=error.allowed, mend=mend) from None


def check_uncertainty(path: str, changes: Changes = ()) -> Checked:
    """Return what `uncertainty` would do."""
    study = load_study(path, UncertaintyStudy, changes)
    solver = _base(study, path, springs=True)
    with placed(path):
        draws = draw(inputs_of(study.quantities, solver.case.unvaried), study.draws, study.seed)
        draw_cases(solver.case, draws)
    what = f"{study.draws} draws of {len(draws.inputs)} numbers, seed {study.seed}"
    return _study(path, "uncertainty", solver, study.draws, what)


def check_landscape(path: str, changes: Changes = ()) -> Checked:
    """Return what `landscape` would do."""
    study = load_study(path, LandscapeStudy, changes)
    solver = _base(study, path, springs=True)
    ranges = _ranges(solver)
    with placed(path):
        sizes = [
            axis_values(
                getattr(study, kind), ranges[f"{kind}_stiffness_{study.sides[0]}"], kind
            ).size
            for kind in ("dorsiflexion", "plantarflexion")
        ]
    solves = sizes[0] * sizes[1] + 4 * study.leaps
    what = (
        f"a grid of {sizes[0]} x {sizes[1]} stiffnesses, springs {study.side}, up to "
        f"{study.sweeps} sweeps: points with several neighbours are solved more than once"
    )
    return _study(path, "landscape", solver, solves, what, "at least ")


def check_tradeoff(path: str, changes: Changes = ()) -> Checked:
    """Return what `tradeoff` would do."""
    study = load_study(path, TradeoffStudy, changes)
    solver = _base(study, path)
    with placed(path):
        require_prediction(solver.config)
    count = len(study.walking_speed_weights)
    what = f"{count} weights of walking speed, up to {study.sweeps} sweeps to and fro"
    return _study(path, "tradeoff", solver, count, what, "at least ")


def check_batch(path: str, changes: Changes = ()) -> Checked:
    """Return what `batch` would do; every case is checked as a prediction is."""
    batch = load_cases(path, changes)
    notes: list[str] = []
    seconds = 0.0
    for case in batch.cases:
        checked = described(ready_solver(case.study, f"{path}, case {case.name}"), path)
        seconds += checked.content["expected_seconds"]["likely"]
        notes += [note for note in checked.notes if note not in notes]
    patients = list(dict.fromkeys(case.patient for case in batch.cases))
    problems = list(dict.fromkeys(case.problem for case in batch.cases))
    rows: list[Row] = [
        ("patients", f"{len(patients)}: {', '.join(patients)}"),
        ("problems", ", ".join(problems)),
        ("solves", f"{len(batch.cases)} cases: {', '.join(case.name for case in batch.cases)}"),
        (
            "expected time",
            f"about {seconds:.0f} s of one core in all, on the machine of docs/performance.md",
        ),
    ]
    content: dict[str, Any] = {
        "patients": patients,
        "problems": problems,
        "cases": [case.name for case in batch.cases],
        "solves": len(batch.cases),
        "expected_seconds": {"likely": round(seconds, 1)},
    }
    return Checked(path, "study of many cases", tuple(rows), content, tuple(notes))


def _base(study: NeighbourStudy, path: str, springs: bool = False) -> GaitSolver:
    """Return the solver of the base of a study.

    Raises:
        InputError: If the base is wrong, or has no springs where they are needed.
    """
    with placed(f"{path}, base"):
        case = base_case(study)
        if springs:
            require_springs(case.config, study.base)
    if isinstance(study, PerturbationStudy | SensitivityStudy | UncertaintyStudy):
        case = case.with_values({"solver.tolerance": study.tolerance})
    return ready_solver(case, f"{path}, base {Path(study.base).name}")


def _ranges(solver: GaitSolver) -> Ranges:
    lower, upper = solver.bounds.table.arrays(STIFFNESSES)
    return dict(zip(STIFFNESSES, zip(lower.tolist(), upper.tolist(), strict=True), strict=True))


def _study(
    path: str, kind: str, solver: GaitSolver, solves: int, what: str, about: str = ""
) -> Checked:
    base = described(solver, path)
    rows: list[Row] = [
        (
            "base",
            f"{solver.config.problem}, {solver.walker.condition}, solved unless --run is given",
        ),
        *walker_rows(solver.walker),
        ("does", what),
        ("solves", f"{about}{solves} neighbours of the base, each from its solution"),
        ("expected time", f"for the base {_seconds(base)}"),
    ]
    content = {
        "base": base.content,
        "solves": solves,
        "solves_are_least": bool(about),
        "does": what,
    }
    return Checked(path, kind, tuple(rows), content, base.notes)


def _seconds(base: Checked) -> str:
    row = dict(base.rows)
    return row["expected time"]
