"""A config of one problem: everything that a solve would read, without the solve."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.case import Case
from pathwalker_cli.checking.consistency import contradictions, oddities
from pathwalker_cli.checking.report import (
    Changes,
    Checked,
    Row,
    orthosis_content,
    patient_content,
    patient_remarks,
    walker_rows,
)
from pathwalker_cli.config import StudyConfig, load_config
from pathwalker_cli.config.values import changed_values
from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import DataError, placed
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.results.run_folder import ENTRIES, check_target, default_folder
from pathwalker_cli.studies.batch.cases import check_patient


@dataclass(frozen=True)
class Measured:
    """Iterations of one measured solve, and its CPU seconds from the shell.

    Imports, tables and figures are included.
    """

    iterations: int
    seconds: float


MEASURED: Final[dict[str, tuple[Measured, Measured]]] = {
    "mapd-barefoot": (Measured(156, 21.8), Measured(287, 34.6)),
    "mapd-healthy": (Measured(45, 11.3), Measured(88, 19.5)),
    "mapd-orthosis": (Measured(111, 21.0), Measured(133, 24.1)),
    "mapd-ws-orthosis": (Measured(122, 19.2), Measured(274, 45.3)),
    "ls-barefoot": (Measured(69, 11.1), Measured(188, 38.1)),
}
"""By problem: on 64 intervals without refinement, and refined from there on."""

FIXED: Final = 7.0
"""CPU seconds of imports, figures and tables, whatever is solved."""

_INTERVALS: Final = 64
_DEGREE: Final = 3
"""Intervals that the measured solves began with, and their collocation points."""

_SPREAD: Final = (0.6, 2.0)
"""Shares of the measured seconds between which other children and starts end: those of the
tests' ten-year-old are 1.6 times those of the shipped patient, other starts need up to 1.9."""

_COMPLIANT: Final = 3.0
"""Factor by which soles that give way make a solve longer: 1.6 with orthoses, 4 barefoot."""

_VERDICT: Final = 2.7
"""Factor by which judging the springs makes a solve with orthoses longer."""


@dataclass(frozen=True)
class Seconds:
    """CPU seconds on the machine of docs/performance.md, with few and with many iterations too.

    `likely` is what the shipped patient would take, in so many iterations.
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
    """Return how long a solve may take that begins with so many intervals.

    Unknowns, and seconds per iteration, are in proportion to their collocation points.
    """
    refined = config.mesh.refinements > 0
    measured = MEASURED[config.problem][refined]
    size = intervals * config.mesh.degree / (_INTERVALS * _DEGREE)
    verdict = _VERDICT if config.verdict and config.condition == "orthosis" else 1.0
    feet = _COMPLIANT if config.model.feet == "compliant" else 1.0
    solve = (measured.seconds - FIXED) * size * config.starts * verdict * feet
    return Seconds(
        FIXED + solve,
        FIXED + _SPREAD[0] * solve,
        FIXED + _SPREAD[1] * solve,
        measured.iterations * config.starts,
    )


def check_prediction(path: str, changes: Changes = (), problem: str = "") -> Checked:
    """Return what a solve of a config would do.

    Raises:
        InputError: The first thing that is wrong.
    """
    config = load_config(path, problem, changes)
    with placed(path):
        case = Case.of(config)
    return described(ready_solver(case, path), path)


def ready_solver(case: Case, where: str) -> GaitSolver:
    """Return the solver of a case, with everything checked that needs no solve.

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
    content, seconds = _content(solver)
    notes = (*oddities(solver), *patient_remarks(solver.walker.patient))
    return Checked(path, "prediction", tuple(_rows(solver, content, seconds)), content, notes)


def _content(solver: GaitSolver) -> tuple[dict[str, Any], Seconds]:
    """Return what would be solved as plain values, and the time to expect."""
    config, walker, patient = solver.config, solver.walker, solver.walker.patient
    durations = solver.stride.durations[: len(solver.gait.phases)]
    mesh = meshing.first(durations, config.mesh)
    program = CollocationProgram(solver.blocks, solver.prediction, mesh)
    intervals = sum(len(mesh) - 1 for mesh in program.meshes)
    seconds, folder = expected(config, intervals), default_folder(config, patient.id)
    content = {
        "problem": config.problem,
        "condition": walker.condition,
        "patient": patient_content(patient),
        "orthosis": orthosis_content(patient) if walker.device.worn else None,
        "phases": [phase.name for phase in solver.gait.phases],
        "start": solver.stride.name,
        "starts": config.starts,
        "intervals": intervals,
        "unknowns": program.size,
        "rows": program.rows,
        "free_parameters": [unknown.name for unknown in solver.free],
        "bounds": _bounds(solver),
        "cost_weights": _weights(solver),
        "not_default": {
            key: f"{_short(now)} (default {_short(usual)})"
            for key, (now, usual) in changed_values(config).items()
        },
        "recordings": {c: list(recording_names(patient, c)) for c in CONDITIONS},
        "output": str(folder),
        "output_state": _output(folder),
        "expected_seconds": {
            name: round(getattr(seconds, name), 1) for name in ("likely", "least", "most")
        },
    }
    return content, seconds


def _rows(solver: GaitSolver, content: Mapping[str, Any], seconds: Seconds) -> Iterator[Row]:
    """Yield the same for people, label and text."""
    config, walker, names = solver.config, solver.walker, content["phases"]
    yield "problem", f"{config.problem}, {walker.condition}"
    yield from walker_rows(walker)
    mirrored = "; then their mirror image" * config.half_cycle
    yield "phases", f"{len(names)}: {', '.join(names)}{mirrored}"
    yield "start", content["start"] + (f", {config.starts} starts" * (config.starts > 1))
    yield (
        "size",
        f"{content['intervals']} intervals of degree {config.mesh.degree} to begin with, "
        f"{content['unknowns']:,} unknowns, {content['rows']:,} rows; free parameters: "
        f"{len(content['free_parameters'])}",
    )
    yield from (("bounds", f"{name}: {text}") for name, text in content["bounds"].items())
    for name, weight in content["cost_weights"].items():
        yield "cost, weights", f"{name.replace('_', ' ')}: {weight:g}"
    changed = "; ".join(f"{key}: {text}" for key, text in content["not_default"].items())
    yield "not the default", changed or "nothing"
    recorded = ", ".join(f"{len(n)} {c}" for c, n in content["recordings"].items() if n)
    yield "recordings", f"{recorded}, beside the patient's file" if recorded else "none"
    yield "output", content["output_state"]
    shooting = config.transcription == "multiple-shooting"
    yield "expected time", str(seconds) + ("; shooting takes minutes more" if shooting else "")


def _weights(solver: GaitSolver) -> dict[str, float]:
    """Return the terms of the objective with their weights; those without any are left out."""
    weights = solver.config.cost.weights
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
    return {named.get(name, f"goal {name}"): value for name, value in weights.items() if value}


def _bounds(solver: GaitSolver) -> dict[str, str]:
    """Return every bound with its reason; equal phase durations stand together."""
    config = solver.config.bounds
    bounds: dict[str, str] = {}
    durations: dict[str, list[str]] = {}
    for name, text in solver.bounds.sources.items():
        if name.startswith("duration of "):
            durations.setdefault(text, []).append(name.removeprefix("duration of "))
        else:
            bounds[name] = text
    for text, names in durations.items():
        key = "every phase" if len(durations) == 1 else ", ".join(names)
        bounds[f"duration of {key}"] = text
    bounds["distance"] = f"[{config.distance[0]:g}, {config.distance[1]:g}] m per stride, config"
    bounds["joint speed"] = f"up to {config.joint_speed:g} rad/s, m/s, config"
    bounds["friction"] = f"forward force up to {config.friction:g} times the vertical, config"
    if not solver.walker.parts.compliant:
        bounds["vertical force"] = f"at least {config.least_vertical_force:g} N per point, config"
        bounds["height of points in the air"] = f"at least {config.least_height:g} m, config"
    bounds["activations, excitations"] = "[0, 1], always"
    return bounds


def _short(value: Any) -> str:
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{k}: {_short(v)}" for k, v in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(_short, value)) + "]"
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    return str(value) or '""'


def _output(folder: Path) -> str:
    """Return where `solve` would write, and whether it can."""
    try:
        target = check_target(folder)
    except DataError as error:
        return f"{folder} cannot be used: {error.what}; name another folder by --out"
    holds = target.exists() and bool({path.name for path in target.iterdir()} & ENTRIES)
    return f"{folder}, {'replaces the run that is there' if holds else 'a new folder'}"
