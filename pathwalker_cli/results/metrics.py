"""What `metrics.json` of a run holds: built from a solution, written, and read back as one type."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from pydantic import BaseModel, ConfigDict

from pathwalker_cli.case import Case, config_text
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.cost_terms import goal_values
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.json_file import json_text
from pathwalker_cli.nlp.kernels import kernels_level
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.measures import metrics_of, numbers_in, numbers_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.versions import today, versions

METRICS_HASH: Final = "metrics_hash"
"""Key of the SHA-256 of all other metrics, by which a change is found."""

RUN_FORMAT: Final = 1
"""Number of the layout of a run folder; it grows when older ones can no longer be read."""

Number = float | None
"""A number; None for what JSON does not know."""


class RunMetrics(BaseModel):
    """Everything about a run that a script may want to know; SI units.

    Besides these it has the measures of the gait, see `stride.measures`.  What runs of older
    versions lack is None or empty.
    """

    model_config = ConfigDict(extra="allow")

    run_format: int
    problem: str
    status: str
    condition: str
    cost: Number
    effort: Number
    motion_hash: str = ""
    multipliers_hash: str | None = None
    patient: str | None = None
    smoke: bool = False
    cost_terms: dict[str, Number] = {}
    goals: dict[str, Number] = {}
    walking_speed: Number = None
    largest_violation: Number = None
    largest_violation_name: str | None = None
    violations: list[dict[str, Any]] = []
    reintegration_position_error: Number = None
    reintegration_velocity_error: Number = None
    cost_error: Number = None
    measure_errors: dict[str, Number] = {}
    second_engine_residual: Number = None
    balance: dict[str, Number] = {}
    shortfall: dict[str, Any] | None = None
    active_bounds: list[str] | None = None
    active: list[ActiveBound] | None = None
    stiffness_ranges: dict[str, tuple[float, float]] = {}
    unknowns: list[dict[str, Any]] = []
    bound_sources: dict[str, str] | None = None
    notes: list[str] | None = None
    intervals: int | None = None
    iterations: int | None = None
    stages: list[dict[str, Any]] = []
    local_optima: list[dict[str, Any]] = []
    seconds_build: Number = None
    seconds_solve: float = 0.0
    seconds_verify: Number = None
    start: str | None = None
    warm_start: str | None = None
    dynamics_backend: str | None = None
    published_model: bool = False
    date: str | None = None
    versions: dict[str, str | None] = {}
    kernels: str | None = None
    input_hashes: dict[str, str | None] = {}
    verdict: dict[str, Any] | None = None

    def content(self) -> dict[str, Any]:
        """Return what was set as plain values, with the hash of all of it."""
        plain = self.model_dump(mode="json", exclude_unset=True)
        return plain | {METRICS_HASH: metrics_hash(plain)}

    @property
    def bounds(self) -> tuple[ActiveBound, ...]:
        """Bounds that hold the solution back; older runs have them as text only."""
        if self.active is not None:
            return tuple(self.active)
        return tuple(filter(None, map(ActiveBound.parsed, self.active_bounds or ())))


@dataclass(frozen=True)
class RunInputs:
    """What a run was made from, taken before the solve: an earlier run may change meanwhile.

    SHA-256 of the resolved config, of the patient's file, of what is kept of the patient, and of
    the motion of the run that it began with, if there is one.
    """

    hashes: Mapping[str, str]
    warm_start: str = ""


def sha256(content: bytes) -> str:
    """Return the SHA-256 of some bytes in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def run_inputs(case: Case, warm_start: str | Path | None = None) -> RunInputs:
    """Return what a run is made from."""
    kept = {"config": config_text(case.config), "patient_kept": case.patient_text}
    hashes = {name: sha256(text.encode()) for name, text in kept.items()}
    if case.content_hash is not None:
        hashes["patient"] = case.content_hash
    if warm_start is not None:
        hashes["warm_start"] = sha256((Path(warm_start) / "motion.npz").read_bytes())
    return RunInputs(hashes, "" if warm_start is None else str(warm_start))


def metrics_hash(metrics: Mapping[str, Any]) -> str:
    """Return the SHA-256 of all metrics but the one that holds it."""
    return sha256(json_text({k: v for k, v in metrics.items() if k != METRICS_HASH}).encode())


def run_metrics(
    solution: GaitSolution, inputs: RunInputs, more: Mapping[str, Any] | None = None
) -> RunMetrics:
    """Return all metrics of a solve."""
    measures = metrics_of(stride_of(solution.last_iterate))
    began = time.perf_counter()
    proof = _proof(solution, measures)  # runs the second engine
    verify = solution.seconds["verify"] + time.perf_counter() - began
    values = {
        **_outcome(solution),
        **measures,
        **proof,
        **_origin(solution, inputs),
        "seconds_verify": verify,
        **(more or {}),
    }
    return RunMetrics.model_validate(_strict(values))


def _outcome(solution: GaitSolution) -> dict[str, Any]:
    """Return what was asked for, how it ended and at which cost."""
    config, walker = solution.config, solution.walker
    return {
        "run_format": RUN_FORMAT,
        "problem": config.problem,
        "status": solution.status,
        "patient": walker.patient.id,
        "condition": walker.condition,
        "smoke": config.smoke,
        "cost": solution.cost,
        "cost_terms": solution.cost_terms,
        "goals": goal_values(solution.last_motion, walker, config.cost.comfort_ranges),
    }


def _proof(solution: GaitSolution, measures: Mapping[str, Any]) -> dict[str, Any]:
    """Return what speaks for the result, and what held it back."""
    errors, worst, bounds = solution.reintegration, solution.violations[0], solution.bounds
    return {
        "largest_violation": worst.amount,
        "largest_violation_name": worst.name,
        "violations": [asdict(violation) for violation in solution.violations],
        "reintegration_position_error": errors.worst_position,
        "reintegration_velocity_error": errors.worst_velocity,
        "cost_error": solution.cost_error,
        "measure_errors": _measure_errors(solution, measures),
        "second_engine_residual": solution.second_engine,
        "balance": asdict(balance(solution.last_iterate)),
        "shortfall": None if solution.shortfall is None else solution.shortfall.as_dict(),
        "active_bounds": [str(bound) for bound in solution.active],
        "active": [asdict(bound) for bound in solution.active],
        "stiffness_ranges": {
            name: pair for name in STIFFNESSES if (pair := bounds.table.find(name)) is not None
        },
        "unknowns": [
            {
                "name": unknown.name,
                "place": unknown.address,
                "value": value,
                "unit": unknown.unit,
                "range": bounds.ranges[unknown.name],
            }
            for unknown, value in zip(
                solution.walker.unknowns, solution.last_motion.parameters.tolist(), strict=True
            )
        ],
        "bound_sources": bounds.sources,
        "notes": solution.walker.patient.notes,
    }


def _measure_errors(solution: GaitSolution, measures: Mapping[str, Any]) -> dict[str, float]:
    """Return what halving all mesh intervals would change measures by, estimated [SI].

    Springs are left out: free numbers stay in the estimate.
    """
    if solution.finer_motion is None:
        return {}
    own = numbers_in(measures)
    finer = numbers_of(stride_of(gait_series(solution.walker, solution.finer_motion)))
    return {key: finer[key] - own[key] for key in own if key in finer and key not in STIFFNESSES}


def _origin(solution: GaitSolution, inputs: RunInputs) -> dict[str, Any]:
    """Return mesh, iterations, times, and where the run comes from."""
    return {
        "intervals": solution.last_motion.intervals,
        "iterations": solution.iterations,
        "stages": [asdict(stage) for stage in solution.stages],
        "local_optima": [asdict(optimum) for optimum in solution.optima],
        **{f"seconds_{part}": solution.seconds[part] for part in ("build", "solve")},
        "start": solution.start,
        "warm_start": inputs.warm_start or None,
        "dynamics_backend": solution.walker.backend,
        "published_model": solution.config.model.published,
        "date": today(),
        "versions": versions(),
        "kernels": kernels_level() or "none",
        "input_hashes": inputs.hashes,
    }


def _strict(value: Any) -> Any:
    """Return a value without anything that JSON does not know; no number becomes None."""
    if isinstance(value, Mapping):
        return {str(key): _strict(entry) for key, entry in value.items()}
    if isinstance(value, list | tuple | np.ndarray):
        return [_strict(entry) for entry in value]
    if isinstance(value, np.generic):
        return _strict(value.item())
    if isinstance(value, float) and not np.isfinite(value):
        return None
    return value
