"""From the file of a study to its cases: every patient, problem and override, by name, checked."""

from __future__ import annotations

import glob
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from itertools import product
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig, find_config, load_config, place_of, with_values
from pathwalker_cli.errors import ConfigError, InputError, PatientError, placed
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.recorded import recorded_passage, recorded_stride, start_recording
from pathwalker_cli.gait.symmetry import require_symmetry
from pathwalker_cli.patient import Patient, load_patient, shipped_patients
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.results.run_folder import warm_start_run
from pathwalker_cli.studies.batch.schema import (
    BatchStudy,
    NamedCase,
    case_name,
    flat,
    load_batch,
    short_keys,
    slug,
)

_QUIET: Final = {"figures": "none"}
"""Overrides of every case unless the study has others: nobody looks at a hundred figures."""


@dataclass(frozen=True)
class BatchCase:
    """One patient in one problem with its overrides; its run folder has its name.

    `values` is what the grid varies, by dotted key; `variant` names overrides that belong together.
    """

    name: str
    problem: str
    study: Case
    values: Mapping[str, Any] = field(default_factory=dict)
    variant: str = ""
    warm_start: Path | None = None

    @property
    def patient(self) -> str:
        """Id of the patient."""
        return self.study.unvaried.id


@dataclass(frozen=True)
class Batch:
    """A study of many cases, checked; its name is that of its file."""

    name: str
    cases: tuple[BatchCase, ...]


def load_cases(path: str | Path, changes: tuple[str, ...] = ()) -> Batch:
    """Read a study and check every case before the first is solved.

    Raises:
        InputError: If study, patient, config, warm start or a combination of them is wrong.
    """
    study, source = load_batch(path, changes)
    where = str(path)
    folders = {key: place_of(key, source, changes) for key in ("patients", "problems")}
    patients = listed_patients(study.patients, folders["patients"], source, where)
    problems = {
        name: with_values(config, flat(_QUIET | study.set), f"{where}, set, problem {name}")
        for name, config in listed_problems(study.problems, folders["problems"], where).items()
    }
    warm_starts = _warm_starts(study, problems, source, where)
    cases: dict[str, BatchCase] = {}
    known: dict[str, str] = {}
    for entry, patient in patients.items():
        for name, config in problems.items():
            base = Case(config.model_copy(update={"patient": entry}), patient)
            for case in _variants(study, name, base, where):
                _check_new(case, cases, known, where)
                check_case(case.name, case.study, where)
                cases[case.name] = replace(case, warm_start=warm_starts.get(name))
    return Batch(source.stem, tuple(cases.values()))


def _variants(study: BatchStudy, problem: str, base: Case, where: str) -> Iterator[BatchCase]:
    """Yield all cases of one patient in one problem."""
    short = short_keys(study.grid)
    for combination in product(*study.grid.values()):
        values = dict(zip(study.grid, combination, strict=True))
        for variant in study.cases or (NamedCase(name="all"),):
            label = variant.name if study.cases else ""
            shown = {short[key]: value for key, value in values.items()}
            name = case_name(base.unvaried.id, problem, shown, label)
            changes = {**values, **flat(variant.set)}
            config = with_values(base.config, flat(changes), f"{where}, case {name}")
            yield BatchCase(name, problem, replace(base, config=config).landed, values, label)


def _check_new(
    case: BatchCase, cases: Mapping[str, BatchCase], known: dict[str, str], where: str
) -> None:
    """Refuse a case whose name or content is there already."""
    content = case.study.config.model_dump_json()
    if case.name in cases or content in known:
        other = known.get(content, case.name)
        same = f"cases {other} and {case.name} are the same"
        raise ConfigError(
            same if content in known else f"two cases are named {case.name}",
            where=where,
            mend="look for what stands twice in patients, problems, grid or cases",
        )
    known[content] = case.name


def _warm_starts(
    study: BatchStudy, problems: Mapping[str, StudyConfig], source: Path, where: str
) -> dict[str, Path]:
    """Return the folder of the run that the cases of each problem begin with."""
    folders = {}
    for name, folder in study.warm_start.items():
        place = f"{where}: warm_start.{name}"
        if name not in problems:
            raise ConfigError("is no problem of this study", where=place,
                              allowed=", ".join(problems))  # fmt: skip
        folders[name] = (source.parent / folder).resolve()
        check_warm_start(folders[name], problems[name], place)
    return folders


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
    patients: dict[str, Patient] = {}
    owners: dict[str, str] = {}
    for entry in entries:
        for name in _names(entry, folder, source, f"{where}: patients"):
            patient = load_patient(name)
            if name in patients:
                what = f"'{entry}' leads to {name}, which is listed already"
                raise ConfigError(what, where=f"{where}: patients", mend="list it once")
            if patient.id in owners:
                what = f"{name} and {owners[patient.id]} have the same id, {patient.id}"
                mend = "give one of them another id"
                raise ConfigError(what, where=f"{where}: patients", mend=mend)
            patients[name], owners[patient.id] = patient, name
    return patients


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

    Raises:
        ConfigError: If a config is missing or refused, or a name stands twice.
    """
    problems: dict[str, StudyConfig] = {}
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
        if name in problems:
            raise ConfigError(
                f"two problems are named {name}",
                where=f"{where}: problems",
                mend="list one of them, or rename its file",
            )
        problems[name] = load_config(path)
    return problems


def check_case(name: str, case: Case, where: str) -> None:
    """Refuse a case that could not even begin.

    Raises:
        InputError: If the patient lacks what the problem needs, or a value does not fit.
    """
    config = case.config
    with placed(f"{where}, case {name}"):
        check_patient(case)
        if config.starts > 1:
            raise ConfigError(
                f"is {config.starts}",
                where="starts",
                allowed="1, as the cores belong to the cases",
                mend="spread the starts as cases, e.g. grid: {start.knee_flexion: [0.5, 0.7, 0.9]}",
            )
        walker = case.walker(config.model.backend)
        gait_bounds(walker, config.bounds, config.free)
        if config.half_cycle:
            require_symmetry(walker)
        if config.start.gait == "recorded":
            recording = start_recording(walker, config.start)
            (recorded_passage if config.fits else recorded_stride)(walker, recording)


def check_patient(case: Case) -> None:
    """Refuse a patient without what the problem needs.

    Raises:
        PatientError: If orthosis or strengths lack.
    """
    config, patient = case.config, case.unvaried
    if config.condition == "orthosis" and patient.orthosis is None:
        raise PatientError(
            f"patient {patient.id} has no orthosis, which problem {config.problem} needs",
            where=str(patient.source),
            mend="add the orthosis to the file, or choose a barefoot problem for this patient",
        )
    _ = patient.max_isometric_torque


def check_warm_start(folder: Path, config: StudyConfig, where: str) -> None:
    """Refuse an earlier run that the cases of a problem cannot begin with.

    Raises:
        InputError: If it is missing, damaged, not converged or about something else.
    """
    try:
        warm_start_run(folder, config)
    except InputError as error:
        inner = error.where.removeprefix("--warm-start").strip()
        place = f"{where}: {inner}" if inner else where
        raise error.at(place) from None
