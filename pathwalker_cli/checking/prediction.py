"""A config of one problem: everything that a solve would read, without the solve."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from pathwalker_cli.case import Case
from pathwalker_cli.checking.expect import expected
from pathwalker_cli.checking.plausible import odd_patient
from pathwalker_cli.checking.report import Changes, Checked, Row
from pathwalker_cli.checking.sense import contradictions, oddities
from pathwalker_cli.config import load_config
from pathwalker_cli.config.values import changed_values
from pathwalker_cli.conventions import CONDITIONS, STIFFNESSES
from pathwalker_cli.errors import DataError, placed
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.model.healthy import healthy_strength
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Strengths
from pathwalker_cli.results.run_folder import ENTRIES, check_target, default_folder
from pathwalker_cli.results.text import notes_together, orthosis_rows
from pathwalker_cli.studies.batch.checks import check_patient

__all__ = [
    "check_prediction",
    "described",
    "orthosis_content",
    "patient_content",
    "patient_remarks",
    "patient_rows",
    "ready_solver",
    "walker_rows",
]


def check_prediction(path: str, changes: Changes = (), problem: str = "") -> Checked:
    """Return what a solve of a config would do.

    Args:
        path: The config, a file or the name of a shipped one.
        changes: Overrides "dotted.key=value".
        problem: Problem that it must be of.

    Raises:
        InputError: The first thing that is wrong.
    """
    config = load_config(path, problem, changes)
    with placed(path):
        case = Case.of(config)
    return described(ready_solver(case, path), path)


def ready_solver(case: Case, where: str) -> GaitSolver:
    """Return the solver of a case, with everything checked that needs no solve.

    Args:
        case: The case.
        where: Its file, for messages.

    Raises:
        InputError: The first thing that is wrong.
    """
    with placed(where):
        check_patient(case)
        solver = _solver(case)
        for error in contradictions(solver):
            raise error
    return solver


def _solver(case: Case) -> GaitSolver:
    """Return the solver; what lacks for a recorded start is an error of the start."""
    try:
        solver = GaitSolver(case)
        _ = solver.stride
    except DataError as error:
        key = "start.trial" if case.config.start.trial else "start.gait"
        raise error.at(f"{key}: {error.where}" if error.where else key) from None
    return solver


def described(solver: GaitSolver, path: str) -> Checked:
    """Return what a solver would solve."""
    config, walker = solver.config, solver.walker
    patient = walker.patient
    durations = solver.stride.durations[: len(solver.gait.phases)]
    program = CollocationProgram(
        solver.blocks, solver.prediction, meshing.first(durations, config.mesh)
    )
    intervals = sum(len(mesh) - 1 for mesh in program.meshes)
    unknowns, rows = program.size, program.rows
    seconds = expected(config, intervals)
    weights = _weights(solver)
    names = [phase.name for phase in solver.gait.phases]
    springs, mirrored = _free_springs(solver), config.half_cycle
    shooting = config.transcription == "multiple-shooting"
    folder = default_folder(config, patient.id)
    recordings = {c: recording_names(patient, c) for c in CONDITIONS}
    changed = {
        key: f"{_short(now)} (default {_short(usual)})"
        for key, (now, usual) in changed_values(config).items()
    }
    bounds = _bounds(solver)
    table: list[Row] = [
        ("problem", f"{config.problem}, {walker.condition}"),
        *walker_rows(walker),
        ("phases", f"{len(names)}: {', '.join(names)}" + "; then their mirror image" * mirrored),
        ("start", solver.stride.name + (f", {config.starts} starts" * (config.starts > 1))),
        (
            "size",
            f"{intervals} intervals of degree {config.mesh.degree} to begin with, {unknowns:,} "
            f"unknowns, {rows:,} rows; free parameters: {len(springs)}",
        ),
        *(("bounds", f"{name}: {text}") for name, text in bounds.items()),
        *(("cost, weights", f"{name.replace('_', ' ')}: {value:g}") for name, value in weights),
        ("not the default", "; ".join(f"{k}: {v}" for k, v in changed.items()) or "nothing"),
        ("recordings", _recordings(recordings)),
        ("output", _output(folder)),
        ("expected time", str(seconds) + ("; shooting takes minutes more" if shooting else "")),
    ]
    content: dict[str, Any] = {
        "problem": config.problem,
        "condition": walker.condition,
        "patient": patient_content(patient),
        "orthosis": orthosis_content(patient) if walker.orthosis is not None else None,
        "phases": names,
        "start": solver.stride.name,
        "starts": config.starts,
        "intervals": intervals,
        "unknowns": unknowns,
        "rows": rows,
        "free_parameters": springs,
        "bounds": bounds,
        "cost_weights": dict(weights),
        "not_default": changed,
        "recordings": {condition: list(found) for condition, found in recordings.items()},
        "output": str(folder),
        "output_state": _output(folder),
        "expected_seconds": {
            "likely": round(seconds.likely, 1),
            "least": round(seconds.least, 1),
            "most": round(seconds.most, 1),
        },
    }
    notes = (*oddities(solver), *patient_remarks(patient))
    return Checked(path, "prediction", tuple(table), content, notes)


def walker_rows(walker: Walker) -> list[Row]:
    """Return who walks, and what is worn."""
    rows = patient_rows(walker.patient)
    if walker.orthosis is not None:
        rows += orthosis_rows(walker.patient.require_orthosis())
    return rows


def patient_remarks(patient: Patient) -> tuple[str, ...]:
    """Return what is unusual about a patient, then what was filled in."""
    return (*odd_patient(patient), *notes_together(patient.notes))


def orthosis_content(patient: Patient) -> dict[str, Any] | None:
    """Return what is worn as plain values, in the units of the file."""
    return patient.orthosis.model_dump(mode="json") if patient.orthosis is not None else None


def patient_rows(patient: Patient) -> list[Row]:
    """Return who a patient is."""
    source = f", {_shown(patient.source)}" if patient.source else ""
    rows = [
        ("patient", f"{patient.id}{source}"),
        (
            "",
            f"{patient.sex}, {patient.age:g} years, {patient.body_mass:g} kg, {patient.height:g} m",
        ),
    ]
    shares = strength_shares(patient)
    sides = [
        f"{name.replace('_', ' ')} {' / '.join(f'{100 * share:.0f}' for share in values)} %"
        for name, values in shares.items()
    ]
    if sides:
        text = "right / left, of a healthy child of this mass and height: "
        rows.append(("strengths", text + ", ".join(sides)))
    return rows


def _shown(path: Path) -> Path:
    """Return a path as seen from here where it lies below."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def patient_content(patient: Patient) -> dict[str, Any]:
    """Return who a patient is as plain values."""
    return {
        "id": patient.id,
        "file": str(patient.source) if patient.source else None,
        "sex": patient.sex,
        "age": patient.age,
        "body_mass": patient.body_mass,
        "height": patient.height,
        "strengths_of_healthy": {k: list(v) for k, v in strength_shares(patient).items()},
    }


def strength_shares(patient: Patient) -> dict[str, tuple[float, ...]]:
    """Return strengths as shares of a healthy child's of the same size: right and left, or one."""
    if patient.strengths is None:
        return {}
    found = {}
    for name in Strengths.model_fields:
        given = getattr(patient.strengths, name)
        values = (given,) if isinstance(given, float) else (given.right, given.left)
        whole = healthy_strength(name, patient.body_mass, patient.height)
        found[name] = tuple(round(value / whole, 3) for value in values)
    return found


def _weights(solver: GaitSolver) -> list[tuple[str, float]]:
    """Return the terms of the objective with their weights; those without any are left out."""
    weights = {name: value for name, value in vars(solver.weights).items() if name != "goals"}
    if not solver.config.fits:
        weights |= {"fit": 0.0, "excitation": 0.0}
    named = {
        "effort": "effort per distance",
        "rate": "activation rates per distance",
        "acceleration": "accelerations per distance",
        "walking_speed": "reward for walking speed",
        "fit": "squared distance from the recording",
        "excitation": "squared excitations",
    }
    terms = [(named.get(name, name), value) for name, value in weights.items() if value]
    return [*terms, *((f"goal {n}", v) for n, v in solver.config.cost.goals.items() if v)]


def _free_springs(solver: GaitSolver) -> list[str]:
    """Return the stiffnesses that are sought."""
    if solver.walker.orthosis is None:
        return []
    lower, upper = solver.bounds.table.arrays(STIFFNESSES)
    return [n for n, a, b in zip(STIFFNESSES, lower, upper, strict=True) if a < b]


def _bounds(solver: GaitSolver) -> dict[str, str]:
    """Return every bound with its reason; equal phase durations stand together."""
    config = solver.config.bounds
    found: dict[str, str] = {}
    durations: dict[str, list[str]] = {}
    for name, text in solver.bounds.sources.items():
        if name.startswith("duration of "):
            durations.setdefault(text, []).append(name.removeprefix("duration of "))
        else:
            found[name] = text
    for text, names in durations.items():
        key = "every phase" if len(durations) == 1 else ", ".join(names)
        found[f"duration of {key}"] = text
    found["distance"] = f"[{config.distance[0]:g}, {config.distance[1]:g}] m per stride, config"
    found["joint speed"] = f"up to {config.joint_speed:g} rad/s, m/s, config"
    found["friction"] = f"forward force up to {config.friction:g} times the vertical, config"
    found["vertical force"] = f"at least {config.least_vertical_force:g} N per point, config"
    found["height of points in the air"] = f"at least {config.least_height:g} m, config"
    found["activations, excitations"] = "[0, 1], always"
    return found


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_short(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_short, value)) + "]"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return str(value) or '""'


def _recordings(found: Mapping[str, tuple[str, ...]]) -> str:
    there = [f"{len(names)} {condition}" for condition, names in found.items() if names]
    return f"{', '.join(there)}, beside the patient's file" if there else "none"


def _output(folder: Path) -> str:
    """Return where `solve` would write, and whether it can."""
    try:
        target = check_target(folder)
    except DataError as error:
        return f"{folder} cannot be used: {error.what}; name another folder by --out"
    holds = target.exists() and bool({path.name for path in target.iterdir()} & ENTRIES)
    return f"{folder}, {'replaces the run that is there' if holds else 'a new folder'}"
