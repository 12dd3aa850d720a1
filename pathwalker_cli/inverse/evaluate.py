"""The trials of a study of recorded gait, whatever their source and method."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import COORDINATES, SUFFIX, Condition, force_unit
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import GaitCycle, gait_cycles, stances
from pathwalker_cli.inverse.direction import WalkingPlane
from pathwalker_cli.inverse.dynamics import gait_torques
from pathwalker_cli.inverse.filters import frame_rate
from pathwalker_cli.inverse.forces import BOTH, GroundForces, force_columns
from pathwalker_cli.inverse.gaps import Gap
from pathwalker_cli.inverse.kinematics import MarkerResiduals
from pathwalker_cli.inverse.markers import load_marker_set, marker_points
from pathwalker_cli.inverse.process import ProcessedTrial, process_trial
from pathwalker_cli.inverse.published import published_torques
from pathwalker_cli.inverse.published_tables import (
    AVERAGED_TRIALS,
    PublishedTrial,
    flagged_cycles,
)
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.inverse.study import InverseDynamicsConfig, RecordedConfig
from pathwalker_cli.io.c3d import Event, Recording
from pathwalker_cli.io.c3d_checks import c3d_files, checked_recording, require_plates
from pathwalker_cli.io.recordings import CompactRecording, read_recording, recording_names
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "Progress",
    "StudyTrial",
    "dynamics_trials",
    "imported_trial",
    "kinematics_trials",
    "recorded_trials",
    "require_trials",
]

Progress = Callable[[str], None]
"""Called with "barefoot 3053179" before a trial is evaluated."""


@dataclass(frozen=True)
class StudyTrial:
    """What one trial tells.

    Args:
        name: Name of the trial.
        condition: "barefoot" or "orthosis".
        motion: Coordinates in every frame, unfiltered.
        events: Foot strikes and toe-offs.
        cycles: Gait cycles that the study looks at.
        forces: Columns force_r_x, force_r_z, cop_r_x and the same on the left, or None.
        tau: Residuals and joint torques, NaN where a force is not measured, or None.
        stances: What the plates know about every stance.
        markers: Distances of the markers from the walker, None without C3D.
        gaps: Gaps in the marker paths.
        published: What the published method keeps for its own tables.
    """

    name: str
    condition: Condition
    motion: Trajectory
    events: tuple[Event, ...]
    cycles: tuple[GaitCycle, ...]
    forces: Trajectory | None = None
    tau: Trajectory | None = None
    stances: tuple[StanceForce, ...] = ()
    markers: MarkerResiduals | None = None
    gaps: tuple[Gap, ...] = ()
    published: PublishedTrial | None = None


def imported_trial(
    path: Path, patient: Patient, condition: Condition, config: RecordedConfig
) -> StudyTrial:
    """Evaluate one C3D file: angles, events and, with force plates, forces.

    Raises:
        DataError: If the recording cannot be used.
    """
    return _from_c3d(path, patient, condition, config)[0]


def kinematics_trials(
    config: RecordedConfig, patient: Patient, progress: Progress = print
) -> tuple[StudyTrial, ...]:
    """Evaluate the C3D files of a study as far as joint angles.

    Raises:
        DataError: If a recording cannot be used.
    """
    trials = []
    for condition in config.recorded_conditions:
        for path in c3d_files(config.c3d.of(condition)):
            progress(f"{condition} {path.stem}")
            trials.append(imported_trial(path, patient, condition, config))
    return tuple(trials)


def dynamics_trials(
    config: InverseDynamicsConfig, patient: Patient, progress: Progress = print
) -> tuple[StudyTrial, ...]:
    """Evaluate the trials of a study as far as joint torques.

    Raises:
        DataError: If there is no trial, a recording cannot be used, or no force is known.
    """
    require_trials(config, patient)
    trials: list[StudyTrial] = []
    for condition in config.conditions:
        if config.source == "c3d":
            found = _c3d_dynamics(config, patient, condition, progress)
        else:
            found = recorded_trials(config, patient, condition, progress)
        trials += found
    _require_forces(trials)
    return tuple(trials)


def _wanted(config: InverseDynamicsConfig, condition: Condition, name: str) -> bool:
    """Return whether a trial belongs to the study."""
    if config.trials and name not in config.trials:
        return False
    return config.method == "default" or name in AVERAGED_TRIALS[condition]


def _c3d_dynamics(
    config: InverseDynamicsConfig, patient: Patient, condition: Condition, progress: Progress
) -> list[StudyTrial]:
    """Return the trials of one condition from C3D files."""
    trials = []
    files = c3d_files(config.c3d.of(condition))
    for path in files:
        if not _wanted(config, condition, path.stem):
            continue
        progress(f"{condition} {path.stem}")
        trial, recording, forces = _from_c3d(path, patient, condition, config)
        require_plates(recording, path)
        if config.method == "published":
            trials.append(_published(trial, recording, patient))
        else:
            trials.append(_with_torques(trial, patient, forces, config.motion_cutoff))
    if files and not trials and config.method == "published":
        raise DataError(
            f"none of the {len(files)} {condition} files is a trial of the published tables",
            allowed=", ".join(AVERAGED_TRIALS[condition]),
            mend="use method default for other recordings",
        )
    return trials


def recorded_trials(
    config: InverseDynamicsConfig, patient: Patient, condition: Condition, progress: Progress
) -> list[StudyTrial]:
    """Return the trials of one condition from the files beside the patient's file.

    Unlike `dynamics_trials` it accepts that there is none, and trials without forces.

    Raises:
        DataError: If a recording cannot be used.
    """
    trials = []
    for name in recording_names(patient, condition):
        if config.trials and name not in config.trials:
            continue
        progress(f"{condition} {name}")
        recording = read_recording(patient, condition, name)
        trial = StudyTrial(
            name=name,
            condition=condition,
            motion=recording.motion,
            events=recording.events,
            cycles=gait_cycles(recording.events),
            forces=recording.forces,
            stances=_stances(recording),
        )
        forces = _ground_forces(recording, trial.stances) if recording.forces else None
        trials.append(_with_torques(trial, patient, forces, config.motion_cutoff))
    return trials


def _from_c3d(
    path: Path, patient: Patient, condition: Condition, config: RecordedConfig
) -> tuple[StudyTrial, Recording, GroundForces | None]:
    """Return a trial without torques, its recording and its forces."""
    marker_set = load_marker_set(config.markers)
    names = tuple(point.marker for point in marker_points(marker_set, patient, condition))
    recording = checked_recording(path, names, patient.height)
    found: ProcessedTrial = process_trial(path, patient, condition, marker_set, config.longest_gap)
    trial = StudyTrial(
        name=found.name,
        condition=condition,
        motion=found.motion,
        events=found.events,
        cycles=gait_cycles(found.events),
        forces=found.forces.trajectory() if found.forces else None,
        stances=found.forces.stances if found.forces else (),
        markers=found.markers,
        gaps=found.gaps,
    )
    return trial, recording, found.forces


def _with_torques(
    trial: StudyTrial, patient: Patient, forces: GroundForces | None, cutoff: float
) -> StudyTrial:
    """Return a trial with its torques, if its forces are known."""
    if forces is None:
        return trial
    highest = 0.5 * frame_rate(trial.motion)
    if cutoff >= highest:
        raise DataError(
            f"motion_cutoff is {cutoff:g} Hz, but {2.0 * highest:g} frames per second show nothing "
            f"from {highest:g} Hz on",
            where=trial.name,
            allowed=f"less than {highest:g} Hz",
            mend="set motion_cutoff lower",
        )
    model = pinocchio_model(patient, trial.condition)
    return replace(trial, tau=gait_torques(model, trial.motion, forces, cutoff))


def _published(trial: StudyTrial, recording: Recording, patient: Patient) -> StudyTrial:
    """Return a trial with forces and torques of the published method."""
    model: pin.Model = pinocchio_model(patient, trial.condition, published=True)
    tau, forces = published_torques(model, recording, trial.motion.values)
    units = tuple(force_unit(name) for name in COORDINATES)
    return replace(
        trial,
        cycles=flagged_cycles(recording),
        forces=force_columns(trial.motion.time, forces.force, forces.centre),
        tau=Trajectory(trial.motion.time, COORDINATES, tau, units),
        published=PublishedTrial(recording, trial.motion.values, tau),
    )


def _stances(recording: CompactRecording) -> tuple[StanceForce, ...]:
    """Return which stances of a compact recording are measured: their forces are all there."""
    judged = []
    for stance in stances(recording.events):
        known = False
        if recording.forces is not None:
            up = recording.forces[f"force_{SUFFIX[stance.side]}_z"]
            known = bool(np.isfinite(up[stance.strike : stance.toe_off]).all())
        judged.append(StanceForce(stance, None, "" if known else "no force in the recording"))
    return tuple(judged)


def _ground_forces(recording: CompactRecording, judged: tuple[StanceForce, ...]) -> GroundForces:
    """Return the forces of a compact recording; they are in the walking plane already."""
    columns = recording.forces
    if columns is None:
        raise ValueError("the recording has no forces")
    force = {
        side: np.stack([columns[f"force_{SUFFIX[side]}_{axis}"] for axis in "xz"], axis=1)
        for side in BOTH
    }
    centre = {side: columns[f"cop_{SUFFIX[side]}_x"] for side in BOTH}
    return GroundForces(columns.time, force, centre, judged, WalkingPlane(0, 1))


def require_trials(config: InverseDynamicsConfig, patient: Patient) -> None:
    """Refuse a study without trials, or with names of trials that are not there.

    Raises:
        DataError: If so.
    """
    there: list[str] = []
    for condition in config.conditions:
        if config.source == "c3d":
            there += [path.stem for path in c3d_files(config.c3d.of(condition))]
        else:
            there += recording_names(patient, condition)
    if not there:
        raise DataError(
            f"patient {patient.id} has no {' or '.join(config.conditions)} recordings",
            mend="import C3D files into recordings/<condition> beside the patient's file, or set "
            "source to c3d",
        )
    unknown = sorted(set(config.trials) - set(there))
    if unknown:
        what = f"there is no trial {', '.join(unknown)}"
        raise DataError(what, where="trials", allowed=", ".join(there))


def _require_forces(trials: list[StudyTrial]) -> None:
    """Refuse trials of which no stance is measured."""
    if any(item.measured for trial in trials for item in trial.stances):
        return
    if any(trial.published for trial in trials):
        return
    first = trials[0]
    if all(trial.tau is None for trial in trials):
        raise DataError("no trial has ground forces", where=first.name, mend="import C3D files")
    among = f" of {len(trials)} trials" if len(trials) > 1 else ""
    reasons = sorted({item.reason for t in trials for item in t.stances if item.reason})
    raise DataError(
        f"no stance{among} is measured ({'; '.join(reasons) or 'there is none'})",
        where=first.name,
        allowed="one foot alone on a plate that carries 85 to 115 % of the body",
        mend="add such trials; if the share is far off, check body_mass in the patient's file",
    )
