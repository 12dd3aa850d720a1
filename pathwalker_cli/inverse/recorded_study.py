"""All files of a study of recorded gait."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

from pathwalker_cli.conventions import Condition
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.recorded_figures import save_recorded_figures
from pathwalker_cli.inverse.recorded_files import (
    write_marker_table,
    write_residuals,
    write_stances,
    write_strengths,
    write_strengths_yaml,
    write_trial,
)
from pathwalker_cli.inverse.study_tables import ResidualTable, StrengthTable
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.patient import Patient
from pathwalker_cli.versions import today, versions

__all__ = ["ORIGIN", "strengths_source", "write_dynamics", "write_kinematics", "write_origin"]

ORIGIN: Final = "study.json"
"""File that says whose recorded gait was studied, how and when."""


def write_kinematics(folder: Path, trials: Sequence[StudyTrial], body_mass: float) -> None:
    """Write trials and figures below a folder per condition, and the table of marker distances.

    Args:
        folder: Where; it must exist.
        trials: The trials.
        body_mass: Mass of the patient [kg].
    """
    for condition, own in _by_condition(trials).items():
        for trial in own:
            write_trial(folder / condition, trial)
        save_recorded_figures(own, folder / condition, body_mass)
    if any(trial.markers for trial in trials):
        write_marker_table(folder / "marker_residuals.csv", trials)


def write_dynamics(
    folder: Path,
    trials: Sequence[StudyTrial],
    tables: Sequence[ResidualTable],
    strengths: StrengthTable,
    body_mass: float,
    method: str,
) -> None:
    """Write what `write_kinematics` writes, and residuals, stances and strengths.

    Args:
        folder: Where; it must exist.
        trials: The trials.
        tables: Their residuals.
        strengths: Strengths, written if there are any.
        body_mass: Mass of the patient [kg].
        method: Name of the method, for the head of `strengths.yaml`.
    """
    write_kinematics(folder, trials, body_mass)
    write_residuals(folder / "residuals.csv", tables)
    write_stances(folder / "stances.csv", trials)
    if strengths.strengths is not None:
        write_strengths(folder / "strengths.csv", strengths)
        source = strengths_source(method)
        write_strengths_yaml(folder / "strengths.yaml", strengths.strengths, source)


def write_origin(folder: Path, patient: Patient, method: str) -> None:
    """Write whose gait was studied, by which method, when and with which versions."""
    content = {
        "patient": patient.id,
        "age": patient.age,
        "body_mass": patient.body_mass,
        "height": patient.height,
        "method": method,
        "date": today(),
        "versions": versions(),
        "notes": list(patient.notes),
    }
    write_json(folder / ORIGIN, content)


def strengths_source(method: str) -> str:
    """Return where strengths come from, for the head of their block."""
    return f"inverse dynamics of recorded barefoot gait, method {method}"


def _by_condition(trials: Iterable[StudyTrial]) -> dict[Condition, list[StudyTrial]]:
    """Return the trials of each condition."""
    found: dict[Condition, list[StudyTrial]] = {}
    for trial in trials:
        found.setdefault(trial.condition, []).append(trial)
    return found
