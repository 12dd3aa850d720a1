"""All that can be checked of a run folder without solving again."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.cost_terms import cost_terms, goal_values
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.atomic import refuse_special
from pathwalker_cli.nlp.optimality import optimality
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.results.metrics import METRICS_HASH, metrics_hash, sha256
from pathwalker_cli.results.run_folder import CONFIG, PATIENT, Run, load_run
from pathwalker_cli.results.tables import TABLES
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.stride.verify import equation_residual, reintegrate, second_engine_residual

_SAME: Final = 1e-6
"""Relative difference up to which two numbers of a file count as the same."""
_EQUATIONS: Final = 1e-6
"""Largest residual of the equations of motion [N, N m]."""
_ENERGY, _MOMENTUM = 5e-3, 5e-5
"""Largest share of work and of impulse that a balance may miss: some three times what meshes of the
shipped tolerances miss on 95 different children, 1.8e-3 and 1.1e-5 (docs/hard-cases.md)."""
_SLACK: Final = 10.0
"""How much more than the solver's tolerance the conditions may be off when evaluated anew."""
_SHOOTING: Final = "solved by multiple shooting: its run folder holds a description only"


@dataclass(frozen=True)
class Check:
    """One thing that was checked; without a value it does not apply, and the note says why."""

    name: str
    value: float | None
    limit: float
    unit: str
    note: str = ""

    @property
    def passed(self) -> bool:
        """Whether it is within its limit, or does not apply."""
        return self.value is None or self.value <= self.limit


@dataclass(frozen=True)
class Verification:
    """All checks of a run, or of the table of a study, which has no patient."""

    folder: Path
    problem: str
    patient: str
    checks: tuple[Check, ...]

    @property
    def passed(self) -> bool:
        """Whether all checks passed."""
        return all(check.passed for check in self.checks)

    def as_dict(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        checks = [asdict(check) | {"passed": check.passed} for check in self.checks]
        return {
            "folder": str(self.folder),
            "problem": self.problem,
            "patient": self.patient,
            "passed": self.passed,
            "checks": checks,
        }


def verify_run(folder: str | Path) -> Verification:
    """Check a run from its files alone.

    Raises:
        DataError: If it is no run folder, or a file of it is missing, damaged or foreign.
        NotConvergedError: If the run did not converge.
    """
    run = load_run(folder)
    solver = GaitSolver(run.case)
    series = gait_series(solver.walker, run.motion)
    numbers = metrics_of(stride_of(series))
    checks = (
        *_files(run, series),
        *_numbers(run, solver, numbers),
        *_dynamics(run, series, numbers),
        *_solution(run, solver),
    )
    return Verification(Path(folder), run.config.problem, solver.walker.patient.id, checks)


def _files(run: Run, series: GaitSeries) -> Iterator[Check]:
    """Yield whether config, patient and tables are those that the run was written with."""
    hashes = run.metrics["input_hashes"]
    for name, key in ((CONFIG, "config"), (PATIENT, "patient_kept")):
        if key in hashes:
            refuse_special(run.folder / name)
            yield _as_written(name, hashes[key], sha256((run.folder / name).read_bytes()))
    kept = run.metrics.get(METRICS_HASH)
    yield _as_written("metrics.json, all of it", kept, metrics_hash(run.metrics))
    with tempfile.TemporaryDirectory() as made:
        for name, write in TABLES.items():
            write(Path(made) / name, series)
            yield _same_table(run.folder / name, Path(made) / name)


def _as_written(name: str, before: str | None, now: str) -> Check:
    """Return whether a file has the hash that the run keeps, if it keeps one."""
    if before is None:
        return Check(name, None, 0.0, "", "an older run, which keeps no hash of it")
    same = before == now
    return Check(name, float(not same), 0.0, "", "" if same else "changed since the run")


def _same_table(path: Path, expected: Path) -> Check:
    """Return the largest relative difference of two tables."""
    if not path.is_file():
        raise DataError("is missing", where=str(path), mend="solve again")
    try:
        cells = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
    except (OSError, UnicodeDecodeError):
        raise DataError("is damaged", where=str(path), mend="solve again") from None
    wanted = [line.split(",") for line in expected.read_text(encoding="utf-8").splitlines()]
    if [len(row) for row in cells] != [len(row) for row in wanted] or cells[:1] != wanted[:1]:
        return Check(path.name, math.inf, _SAME, "relative", "has other rows or columns")
    columns = [[abs(_float(cell)) for cell in column] for column in zip(*wanted[1:], strict=True)]
    scales = [max(filter(math.isfinite, column), default=0.0) or 1.0 for column in columns]
    return _largest(path.name, (
        (f"line {i}, {heading}", 0.0 if one == two else abs(_float(one) - _float(two)) / scale)
        for i, rows in enumerate(zip(cells[1:], wanted[1:], strict=True), start=2)
        for one, two, heading, scale in zip(*rows, wanted[0], scales, strict=True)
    ))  # fmt: skip


def _float(cell: str) -> float:
    """Return the number in a cell, NaN for anything else."""
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _largest(name: str, differences: Iterable[tuple[str, float]]) -> Check:
    """Return the largest of relative differences by place; NaN counts as infinite."""
    known = ((place, d if math.isfinite(d) else math.inf) for place, d in differences)
    place, worst = max(known, key=lambda pair: pair[1], default=("", 0.0))
    return Check(name, worst, _SAME, "relative", f"in {place}" if worst else "")


def _numbers(run: Run, solver: GaitSolver, numbers: dict[str, Any]) -> Iterator[Check]:
    """Yield whether metrics.json says what follows from the motion."""
    metrics, ranges = run.metrics, run.config.cost.comfort_ranges
    made = dict(numbers)
    if run.config.transcription == "collocation":
        terms = cost_terms(
            run.motion, solver.gait.costs, solver.config.cost.weights, solver.samples
        )
        made |= {"cost_terms": terms, "cost": sum(terms.values())}
    if "goals" in metrics:
        made["goals"] = goal_values(run.motion, solver.walker, ranges)
    yield _largest("metrics.json", _differences(metrics, made))


def _differences(kept: Any, made: Any, place: str = "") -> Iterator[tuple[str, float]]:
    """Yield the place of every value that was made anew, and its relative difference.

    It is infinite if only one is a number.
    """
    if isinstance(made, Mapping | list | tuple):
        entries = made.items() if isinstance(made, Mapping) else enumerate(made)
        for name, entry in entries:
            try:
                other = kept[name]
            except (LookupError, TypeError):
                other = None
            yield from _differences(other, entry, f"{place}.{name}".lstrip("."))
    elif isinstance(kept, int | float) and isinstance(made, int | float):
        yield place, abs(kept - made) / max(abs(kept), abs(made), 1e-3)
    else:
        yield place, 0.0 if kept == made else math.inf


def _dynamics(run: Run, series: GaitSeries, numbers: dict[str, Any]) -> Iterator[Check]:
    """Yield engines, integrator and conservation laws."""
    config = run.config
    if config.transcription != "collocation":
        yield Check("dynamics", None, 0.0, "", _SHOOTING)
        return
    walker, mesh = series.walker, config.mesh
    unit = "N or N m"
    yield Check("numeric Pinocchio", second_engine_residual(series), _EQUATIONS, unit)
    for backend in dict.fromkeys((walker.backend, "direct")):
        other = run.case.walker(backend)
        yield Check(f"back end {backend}", equation_residual(series, other), _EQUATIONS, unit)
    errors = reintegrate(walker, run.motion)
    refined = mesh.refinements > 0
    note = "" if refined else "the mesh was not to be refined"
    for name, error, limit, unit in (
        ("position", errors.worst_position, mesh.position_tolerance, "rad or m"),
        ("velocity", errors.worst_velocity, mesh.velocity_tolerance, "rad/s or m/s"),
    ):
        yield Check(f"re-integrated {name}", error if refined else None, limit, unit, note)
    balances = balance(series)
    work, ground = "work of the ground", balances.contact_work
    if walker.pattern.yielding:
        work, ground = "ground that gives work", max(0.0, -balances.ground_loss)
    shares = (
        ("work against energy", balances.energy / balances.work_scale, _ENERGY),
        (work, ground / balances.work_scale, _ENERGY),
        ("impulse against momentum", balances.impulse / balances.impulse_scale, _MOMENTUM),
        ("angular impulse", balances.angular_impulse / balances.angular_scale, _MOMENTUM),
    )
    for name, share, limit in shares:
        yield Check(name, share if refined else None, limit, "share", note)
    pull = max(0.0, -numbers["min_vertical_force"])
    yield Check("ground pulls", pull, _EQUATIONS, "N")


def _solution(run: Run, solver: GaitSolver) -> Iterator[Check]:
    """Yield the first-order conditions of the nonlinear program."""
    if run.config.transcription != "collocation" or run.multipliers is None:
        why = "no multipliers are kept"
        yield Check("optimality", None, 0.0, "", _SHOOTING if run.multipliers else why)
        return
    phases = run.motion.phases[: len(solver.gait.phases)]
    motion = replace(run.motion, phases=phases)
    program = CollocationProgram(solver.blocks, solver.prediction, motion.meshes)
    unknowns = program.to_unknowns(motion)
    if (program.size, program.rows) != (
        run.multipliers.unknowns.size,
        run.multipliers.rows.size,
    ):
        yield Check("optimality", math.inf, 0.0, "", "multipliers of another program")
        return
    conditions, tolerances = optimality(program, unknowns, run.multipliers), run.config.solver
    tolerance = _SLACK * tolerances.tolerance
    # rounding of a motion that is written and read
    met = _SLACK * tolerances.constraint_tolerance
    scale = max(1.0, float(np.abs(unknowns).max()))
    yield Check("rows and bounds", conditions.infeasibility / scale, met, "solver units")
    yield Check("stationarity", conditions.stationarity, tolerance, "solver units")
    yield Check("complementarity", conditions.complementarity, tolerance, "solver units")
    yield Check("signs of multipliers", conditions.wrong_sign, tolerance, "solver units")
