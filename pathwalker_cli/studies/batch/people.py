"""Who and what a study lists: patients by id, file, folder or pattern, problems by config."""

from __future__ import annotations

import glob
from collections.abc import Iterator
from pathlib import Path

from pathwalker_cli.config import StudyConfig, find_config, load_config
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.patient import Patient, load_patient, shipped_patients
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.studies.batch.names import slug

__all__ = ["listed_patients", "listed_problems"]


def listed_patients(
    entries: tuple[str, ...], folder: Path, source: Path, where: str
) -> dict[str, Patient]:
    """Return all patients by what a config calls them: a shipped id or a full path.

    Args:
        entries: Shipped ids, files, folders and patterns.
        folder: Folder that they are relative to.
        source: The study's file, which is no patient.
        where: The study, for messages.

    Raises:
        ConfigError: If an entry leads to nobody, or to somebody who is there already.
        PatientError: If the file of a patient is refused.
    """
    found: dict[str, Patient] = {}
    owners: dict[str, str] = {}
    for entry in entries:
        for name in _names(entry, folder, source, f"{where}: patients"):
            patient = load_patient(name)
            if name in found:
                what = f"'{entry}' leads to {name}, which is listed already"
                raise ConfigError(what, where=f"{where}: patients", mend="list it once")
            if patient.id in owners:
                what = f"{name} and {owners[patient.id]} have the same id, {patient.id}"
                mend = "give one of them another id"
                raise ConfigError(what, where=f"{where}: patients", mend=mend)
            found[name], owners[patient.id] = patient, name
    return found


def _names(entry: str, folder: Path, source: Path, where: str) -> Iterator[str]:
    """Yield what an entry leads to, in order of the names."""
    if entry in shipped_patients():
        yield entry
        return
    pattern = any(mark in entry for mark in "*?[")
    paths = glob.glob(entry, root_dir=folder, recursive=True) if pattern else [entry]
    files = [file for path in sorted(paths) for file in _files((folder / path).resolve())]
    files = [file for file in files if file != source]
    if not files:
        raise ConfigError(
            f"'{entry}' leads to no patient",
            where=where,
            allowed=f"{', '.join(shipped_patients())}, or a YAML file, a folder or a pattern such "
            "as children/*.yaml, relative to the study's file",
        )
    yield from map(str, files)


def _files(path: Path) -> list[Path]:
    """Return the file of a patient, or all files of patients in a folder."""
    if not path.is_dir():
        return [path] if path.exists() else []
    if (path / "patient.yaml").is_file():
        return [path / "patient.yaml"]
    return sorted([*path.glob("*.yaml"), *path.glob("*/patient.yaml")])


def listed_problems(entries: tuple[str, ...], folder: Path, where: str) -> dict[str, StudyConfig]:
    """Return the config of every problem by its name, which is that of its file.

    Args:
        entries: Names of shipped configs, or config files.
        folder: Folder that they are relative to.
        where: The study, for messages.

    Raises:
        ConfigError: If a config is missing or refused, or a name stands twice.
    """
    found: dict[str, StudyConfig] = {}
    for entry in entries:
        beside = folder / entry
        path = beside if beside.is_file() else find_config(Path(entry))
        if not path.is_file():
            raise ConfigError(
                f"'{entry}' is no config of a problem",
                where=f"{where}: problems",
                allowed=f"{', '.join(PROBLEMS)}, or a YAML file relative to the study's file",
            )
        name = slug(path.stem)
        if name in found:
            raise ConfigError(
                f"two problems are named {name}",
                where=f"{where}: problems",
                mend="list one of them, or rename its file",
            )
        found[name] = load_config(path)
    return found
