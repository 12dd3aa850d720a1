"""The content of `metrics.json`: everything about a run that a script may want to know."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.goal_costs import goal_values
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.json_file import json_text
from pathwalker_cli.io.yaml_file import yaml_text
from pathwalker_cli.nlp.kernels import kernels_level
from pathwalker_cli.patient import Patient
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.versions import today, versions

__all__ = [
    "METRICS_HASH",
    "RUN_FORMAT",
    "RunInputs",
    "metrics_hash",
    "patient_hash",
    "run_inputs",
    "run_metrics",
    "sha256",
    "stiffness_ranges",
]

METRICS_HASH: Final = "metrics_hash"
"""Key of the SHA-256 of all other metrics, by which a change is found."""

RUN_FORMAT: Final = 1
"""Number of the layout of a run folder; it grows when older ones can no longer be read."""


@dataclass(frozen=True)
class RunInputs:
    """What a run was made from, taken before the solve: files may change while it lasts.

    Args:
        hashes: SHA-256 of the resolved config, of the patient's file, of what is kept of the
            patient, and of an earlier motion.
        patient: The patient as YAML in one piece.
        warm_start: Run that it began with; "" without one.
    """

    hashes: Mapping[str, str]
    patient: str
    warm_start: str = ""


def sha256(content: bytes) -> str:
    """Return the SHA-256 of some bytes in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def run_inputs(
    config_text: str, patient: Patient, warm_start: str | Path | None = None
) -> RunInputs:
    """Return what a run is made from.

    Args:
        config_text: The resolved config as text.
        patient: The patient, without variation.
        warm_start: Folder of the run to begin with.
    """
    kept = _patient_text(patient)
    hashes = {"config": sha256(config_text.encode()), "patient_kept": sha256(kept.encode())}
    if (read := patient_hash(patient)) is not None:
        hashes["patient"] = read
    if warm_start is not None:
        hashes["warm_start"] = sha256((Path(warm_start) / "motion.npz").read_bytes())
    return RunInputs(hashes, kept, "" if warm_start is None else str(warm_start))


def patient_hash(patient: Patient) -> str | None:
    """Return the SHA-256 of the file that a patient was read from; None if there is none."""
    return None if patient.source is None else sha256(patient.content)


def _patient_text(patient: Patient) -> str:
    """Return a patient as YAML that `load_patient` reads, the orthosis in its place."""
    content = patient.model_dump(mode="json", exclude_none=True)
    return yaml_text(content, "The patient of this run, before any variation of the config.")


def stiffness_ranges(solution: GaitSolution) -> dict[str, tuple[float, float]]:
    """Return the range of every free stiffness [N m/rad]; empty when barefoot."""
    found = {name: solution.bounds.table.find(name) for name in STIFFNESSES}
    return {name: pair for name, pair in found.items() if pair is not None}


def run_metrics(solution: GaitSolution, inputs: RunInputs) -> dict[str, Any]:
    """Return all metrics, ready for strict JSON: SI units, None for what is not a number."""
    began = time.perf_counter()
    residual = solution.second_engine
    verify = solution.seconds["verify"] + time.perf_counter() - began
    metrics = {
        "run_format": RUN_FORMAT,
        **_outcome(solution),
        **metrics_of(stride_of(solution.last_iterate)),
        **_proof(solution, residual),
        **_effort(solution),
        "seconds_verify": verify,
        **_origin(solution, solution.config, inputs),
    }
    return {key: _strict(value) for key, value in metrics.items()}


def metrics_hash(metrics: Mapping[str, Any]) -> str:
    """Return the SHA-256 of all metrics but the one that holds it."""
    return sha256(json_text({k: v for k, v in metrics.items() if k != METRICS_HASH}).encode())


def _outcome(solution: GaitSolution) -> dict[str, Any]:
    """Return what was asked for, how it ended and at which cost."""
    return {
        "problem": solution.config.problem,
        "status": solution.status,
        "patient": solution.walker.patient.id,
        "condition": solution.walker.condition,
        "smoke": solution.config.smoke,
        "cost": solution.cost,
        "cost_terms": solution.cost_terms,
        "goals": goal_values(
            solution.last_motion, solution.walker.weight, solution.config.cost.comfort_ranges
        ),
    }


def _proof(solution: GaitSolution, residual: float) -> dict[str, Any]:
    """Return what speaks for the result, and what held it back."""
    errors, worst = solution.reintegration, solution.violations[0]
    return {
        "largest_violation": worst.amount,
        "largest_violation_name": worst.name,
        "violations": [asdict(violation) for violation in solution.violations],
        "reintegration_position_error": errors.worst_position,
        "reintegration_velocity_error": errors.worst_velocity,
        "second_engine_residual": residual,
        "balance": asdict(balance(solution.last_iterate)),
        "shortfall": None if solution.shortfall is None else solution.shortfall.as_dict(),
        "active_bounds": [str(bound) for bound in solution.active],
        "stiffness_ranges": stiffness_ranges(solution),
        "bound_sources": solution.bounds.sources,
        "notes": solution.walker.patient.notes,
    }


def _effort(solution: GaitSolution) -> dict[str, Any]:
    """Return mesh, iterations and times."""
    return {
        "intervals": solution.last_motion.intervals,
        "iterations": solution.iterations,
        "stages": [asdict(stage) for stage in solution.stages],
        "local_optima": [asdict(optimum) for optimum in solution.optima],
        "seconds_build": solution.seconds["build"],
        "seconds_solve": solution.seconds["solve"],
    }


def _origin(solution: GaitSolution, config: StudyConfig, inputs: RunInputs) -> dict[str, Any]:
    """Return where the run comes from."""
    return {
        "start": solution.start,
        "warm_start": inputs.warm_start or None,
        "dynamics_backend": solution.walker.backend,
        "published_model": config.model.published,
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
