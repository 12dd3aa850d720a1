"""Files about recorded gait and about the patient, and what they hold."""

from __future__ import annotations

from typing import Any

from pathwalker_cli.checking.plausible import odd_orthosis
from pathwalker_cli.checking.prediction import (
    orthosis_content,
    patient_content,
    patient_remarks,
    patient_rows,
)
from pathwalker_cli.checking.report import Changes, Checked, Row
from pathwalker_cli.conventions import CONDITIONS
from pathwalker_cli.errors import ConfigError, placed
from pathwalker_cli.inverse.evaluate import require_trials
from pathwalker_cli.inverse.markers import MarkerSet, load_marker_set, marker_points
from pathwalker_cli.inverse.study import (
    InverseDynamicsConfig,
    RecordedConfig,
    load_inverse_dynamics,
    load_inverse_kinematics,
)
from pathwalker_cli.io.c3d_checks import c3d_files, checked_recording
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.io.yaml_file import load_yaml
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import OrthosisData, Patient, load_patient
from pathwalker_cli.results.text import orthosis_rows

__all__ = [
    "check_dynamics",
    "check_kinematics",
    "check_markers",
    "check_orthosis",
    "check_patient_file",
]


def check_kinematics(path: str, changes: Changes = ()) -> Checked:
    """Return what `ik` would do."""
    config = load_inverse_kinematics(path, changes)
    with placed(path):
        patient = load_patient(config.patient)
        found = _c3d(config, patient)
    return _recorded(path, "inverse kinematics", patient, found, "C3D files")


def check_dynamics(path: str, changes: Changes = ()) -> Checked:
    """Return what `id` would do."""
    config: InverseDynamicsConfig = load_inverse_dynamics(path, changes)
    with placed(path):
        patient = load_patient(config.patient)
        require_trials(config, patient)
        if config.source == "c3d":
            found = _c3d(config, patient)
            return _recorded(path, "inverse dynamics", patient, found, "C3D files")
        found = {c: list(recording_names(patient, c)) for c in config.conditions}
        for condition in config.conditions:
            for name in found[condition]:
                read_recording(patient, condition, name)
    return _recorded(path, "inverse dynamics", patient, found, "recordings beside the patient")


def check_markers(path: str, changes: Changes = ()) -> Checked:
    """Return what a marker set holds."""
    _require_none(changes, path)
    found: MarkerSet = load_marker_set(path)
    with placed(path):
        patient = load_patient("sreenivasa2017-patient")
        points = {c: marker_points(found, patient, c) for c in CONDITIONS}
    rows: list[Row] = []
    for condition, own in points.items():
        markers = list(dict.fromkeys(point.marker for point in own))
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
    found = load_yaml(path, OrthosisData, ConfigError)
    content = {"orthosis": found.model_dump(mode="json")}
    return Checked(path, "orthosis", tuple(orthosis_rows(found)), content, (*odd_orthosis(found),))


def _require_none(changes: Changes, path: str) -> None:
    """Refuse overrides of what is no config."""
    if changes:
        raise ConfigError(
            f"overrides keys of configs, and {path} is none",
            where=f"--set {changes[0]}",
            mend="check that file in a call of its own",
        )


def _c3d(config: RecordedConfig, patient: Patient) -> dict[str, list[str]]:
    """Return the C3D files of a study by condition, each looked into."""
    markers = load_marker_set(config.markers)
    found: dict[str, list[str]] = {}
    with placed("c3d"):
        files = {c: c3d_files(config.c3d.of(c)) for c in config.recorded_conditions}
    for condition, paths in files.items():
        names = [point.marker for point in marker_points(markers, patient, condition)]
        for file in paths:
            checked_recording(file, names, patient.height)
        found[condition] = [file.stem for file in paths]
    return found


def _recorded(
    path: str, kind: str, patient: Patient, found: dict[str, list[str]], where: str
) -> Checked:
    rows = [*patient_rows(patient)]
    rows += [(c, f"{len(n)} {where}: {', '.join(n)}") for c, n in found.items() if n]
    content: dict[str, Any] = {"patient": patient_content(patient), "trials": found}
    return Checked(path, kind, tuple(rows), content, patient_remarks(patient))
