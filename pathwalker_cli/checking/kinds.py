"""What a file is, by the keys that it holds, and who checks it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Any, Final, NamedTuple

from pydantic import BaseModel

from pathwalker_cli.checking.consistency import odd_orthosis
from pathwalker_cli.checking.prediction import check_prediction
from pathwalker_cli.checking.report import (
    Changes,
    Checked,
    Row,
    orthosis_content,
    patient_content,
    patient_remarks,
    patient_rows,
)
from pathwalker_cli.checking.studies import check_batch, check_study
from pathwalker_cli.config import StudyConfig, config_content, find_config
from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import ConfigError, placed
from pathwalker_cli.inverse.c3d_trials import read_markers
from pathwalker_cli.inverse.markers import MarkerSet, load_marker_set, marker_points
from pathwalker_cli.inverse.study import (
    InverseDynamicsConfig,
    InverseKinematicsConfig,
    RecordedConfig,
    load_inverse_dynamics,
    load_inverse_kinematics,
)
from pathwalker_cli.inverse.trials import require_trials
from pathwalker_cli.io.c3d_checks import c3d_files
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.io.yaml_file import load_yaml
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import OrthosisData, Patient, load_patient, shipped_patients
from pathwalker_cli.problems import problem_named
from pathwalker_cli.results.text import orthosis_rows
from pathwalker_cli.studies.batch.schema import BatchStudy
from pathwalker_cli.studies.registry import STUDIES


def _check_recorded(
    kind: str,
    load: Callable[[str, Changes], InverseKinematicsConfig | InverseDynamicsConfig],
    path: str,
    changes: Changes = (),
) -> Checked:
    """Return what `ik` or `id` would do."""
    config = load(path, changes)
    with placed(path):
        patient = load_patient(config.patient)
        where = "C3D files"
        if isinstance(config, InverseDynamicsConfig):
            require_trials(config, patient)
            where = "C3D files" if config.source == "c3d" else "recordings beside the patient"
        if where == "C3D files":
            trials = _c3d(config, patient)
        else:
            trials = {c: list(recording_names(patient, c)) for c in config.conditions}
            for condition in config.conditions:
                for name in trials[condition]:
                    read_recording(patient, condition, name)
    rows = [*patient_rows(patient)]
    rows += [(c, f"{len(n)} {where}: {', '.join(n)}") for c, n in trials.items() if n]
    content: dict[str, Any] = {"patient": patient_content(patient), "trials": trials}
    return Checked(path, kind, tuple(rows), content, patient_remarks(patient))


def check_markers(path: str, changes: Changes = ()) -> Checked:
    """Return what a marker set holds."""
    _require_none(changes, path)
    marker_set: MarkerSet = load_marker_set(path)
    with placed(path):
        patient = load_patient("sreenivasa2017-patient")
        points = {c: marker_points(marker_set, patient, c) for c in CONDITIONS}
    rows: list[Row] = []
    for condition, own in points.items():
        markers = dict.fromkeys(point.marker for point in own)
        text = f"{len(markers)} markers at {len(own)} points: {', '.join(markers)}"
        rows.append((condition, text))
    names = {c: sorted({point.marker for point in own}) for c, own in points.items()}
    return Checked(path, "marker set", tuple(rows), {"markers": names})


def check_patient_file(path: str, changes: Changes = ()) -> Checked:
    """Return who a patient is; the models of both conditions are built."""
    _require_none(changes, path)
    patient = load_patient(path)
    with placed(path):
        if patient.strengths is not None:
            build_walker(patient, "barefoot")
            if patient.orthosis is not None:
                build_walker(patient, "orthosis")
    recordings = {c: recording_names(patient, c) for c in CONDITIONS}
    rows = [
        *patient_rows(patient),
        *(orthosis_rows(patient.orthosis) if patient.orthosis else [("orthosis", "none")]),
        ("recorded", ", ".join(patient.recorded) or "nothing"),
        ("recordings", ", ".join(f"{len(n)} {c}" for c, n in recordings.items() if n) or "none"),
    ]
    content = {"patient": patient_content(patient), "orthosis": orthosis_content(patient)}
    missing = ["strengths are not given: nothing can be predicted yet"] * (
        patient.strengths is None
    )
    return Checked(path, "patient", tuple(rows), content, (*missing, *patient_remarks(patient)))


def check_orthosis(path: str, changes: Changes = ()) -> Checked:
    """Return what an orthosis is."""
    _require_none(changes, path)
    orthosis = load_yaml(path, OrthosisData, ConfigError)
    content = {"orthosis": orthosis.model_dump(mode="json")}
    return Checked(
        path, "orthosis", tuple(orthosis_rows(orthosis)), content, (*odd_orthosis(orthosis),)
    )


def _require_none(changes: Changes, path: str) -> None:
    if changes:
        raise ConfigError(
            f"overrides keys of configs, and {path} is none",
            where=f"--set {changes[0]}",
            mend="check that file in a call of its own",
        )


def _c3d(config: RecordedConfig, patient: Patient) -> dict[str, list[str]]:
    """Return the C3D files of a study by condition, each looked into."""
    trials: dict[str, list[str]] = {}
    with placed("c3d"):
        files = {c: c3d_files(config.c3d.of(c)) for c in config.recorded_conditions}
    for condition, paths in files.items():
        for file in paths:
            read_markers(file, patient, condition, config)
        trials[condition] = [file.stem for file in paths]
    return trials


Check = Callable[[str, Changes], Checked]


class Kind(NamedTuple):
    """What a kind of file is read as, who checks it, and the command or key that takes it."""

    model: type[BaseModel]
    check: Check
    taken_by: str


KINDS: Final[dict[str, Kind]] = {
    "prediction": Kind(StudyConfig, check_prediction, "pathwalker solve PROBLEM"),
    **{
        entry.name: Kind(entry.load().model, partial(check_study, command), f"pathwalker {command}")
        for command, entry in STUDIES.items()
    },
    "cohort": Kind(BatchStudy, check_batch, "pathwalker batch"),
    "inverse-kinematics": Kind(
        InverseKinematicsConfig,
        partial(_check_recorded, "inverse kinematics", load_inverse_kinematics),
        "pathwalker ik",
    ),
    "inverse-dynamics": Kind(
        InverseDynamicsConfig,
        partial(_check_recorded, "inverse dynamics", load_inverse_dynamics),
        "pathwalker id",
    ),
    "markers": Kind(
        MarkerSet,
        check_markers,
        "--markers of pathwalker import, and the key markers of configs of ik and id",
    ),
    "patient": Kind(
        Patient, check_patient_file, "the key patient of a config, or --set patient=FILE"
    ),
    "orthosis": Kind(OrthosisData, check_orthosis, "the key orthosis of a patient's file"),
}
"""Every kind of file by its name."""


def check_file(path: str, problem: str = "", changes: Changes = ()) -> Checked:
    """Return what would be done with a file, after all checks that need no solve.

    It is a path, the name of a shipped config, or a patient; if a problem is named, it must be of
    that.

    Raises:
        InputError: The first thing that is wrong.
    """
    if problem:
        problem_named(problem)
        try:
            return check_prediction(path, changes, problem)
        except ConfigError as error:
            raise another_kind(path, "prediction") or error from None
    kind = _kind_of(path)
    # A shipped marker set is read where it lies: it has no loader that knows names.
    file = str(find_config(Path(path))) if kind == "markers" else path
    return KINDS[kind].check(file, changes)


def another_kind(path: str, kind: str) -> ConfigError | None:
    """Return what to say of a file that is refused as a kind, if it is of another; None if not."""
    try:
        actual = _kind_of(path)
    except ConfigError:
        return None
    if actual == kind:
        return None
    a = "an" if actual[0] in "aeiou" else "a"
    return ConfigError(
        f"is {a} {actual} file",
        where=path,
        allowed=f"a file for {KINDS[kind].taken_by}",
        mend=f"this file is for {KINDS[actual].taken_by}",
    )


def _kind_of(path: str) -> str:
    """Return what a file, a shipped config or a patient is."""
    if path in shipped_patients() or (Path(path) / "patient.yaml").is_file():
        return "patient"
    source, mapping, _ = config_content(path)
    return _kind(mapping, source, path)


def _kind(mapping: Mapping[str, Any], source: Path, where: str) -> str:
    """Return what a file is: the kind that knows most of its keys; its name settles a tie."""
    if "problem" in mapping:
        return "prediction"
    if mapping.get("study") in KINDS:
        return str(mapping["study"])
    known = {name: len(mapping.keys() & _keys(model)) for name, (model, _, _) in KINDS.items()}
    most = max(known.values())
    likely = [name for name, count in known.items() if count == most]
    named = [name for name in likely if name in source.stem]
    if len(named) == 1 or len(likely) == 1:
        return (named or likely)[0]
    shown = ", ".join(mapping) or "none"
    raise ConfigError(
        f"its keys ({shown}) do not tell what it is",
        where=where,
        allowed=", ".join(KINDS),
        mend="name a problem in it, or let the file's name begin with its kind",
    )


def _keys(model: type[BaseModel]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}
