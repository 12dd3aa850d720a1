"""Study configs from files: YAML in, validated frozen models out."""

from __future__ import annotations

import os
from pathlib import Path

from pathwalker_cli.config.overrides import apply_change
from pathwalker_cli.config.schema import StudyConfig
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.yaml_file import read_mapping, validate
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.variation import varied

__all__ = ["find_config", "load_config", "patient_path", "study_patient"]


def load_config(path: str | Path, problem: str = "", changes: tuple[str, ...] = ()) -> StudyConfig:
    """Read a study config.

    Args:
        path: The YAML file, or the name of a shipped one, e.g. "mapd-orthosis".
        problem: Problem that was asked for; it must be the config's own.
        changes: Overrides "dotted.key=value", as from the command line.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    source = find_config(Path(path))
    mapping, lines = read_mapping(source, ConfigError)
    for change in changes:
        apply_change(mapping, change)
    config = validate(mapping, StudyConfig, where=str(path), error=ConfigError, lines=lines)
    if problem and config.problem != problem:
        raise ConfigError(
            f"is a config for {config.problem}, but {problem} was asked for",
            where=f"{path}, problem",
            mend=f"use configs/{problem}.yaml, or ask for {config.problem}",
        )
    return config.model_copy(update={"patient": patient_path(config.patient, source)})


def find_config(path: Path) -> Path:
    """Return the file, or the shipped config of that name where there is no such file."""
    if not os.path.isfile(path):  # False too for what cannot be a path
        for name in (path.name, f"{path.name}.yaml"):
            candidate = shipped("configs") / name
            if os.path.isfile(candidate) and path.parent.name in ("", "configs"):
                return candidate
    return path


def patient_path(patient: str, config_file: Path) -> str:
    """Return a patient path relative to the config's folder as a full path; ids stay."""
    candidate = config_file.parent / patient
    return str(candidate.resolve()) if "/" in patient or os.path.isfile(candidate) else patient


def study_patient(config: StudyConfig) -> Patient:
    """Return the patient of a study, with its variation.

    Raises:
        PatientError: If there is no such patient or its file is refused.
        ConfigError: If the variation does not fit the patient.
    """
    return varied(load_patient(config.patient), config.variation)
