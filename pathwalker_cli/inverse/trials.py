"""The trials of a study of recorded gait, whatever their source and method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from pathwalker_cli.conventions import Condition, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.c3d_trials import Progress, c3d_trials
from pathwalker_cli.inverse.cycles import Stance, gait_cycles, stances
from pathwalker_cli.inverse.dynamics import (
    MOTION_CUTOFF,
    frame_rate,
    generalised_forces,
    inverse_dynamics,
    smooth_rates,
)
from pathwalker_cli.inverse.published import AVERAGED_TRIALS, flagged_cycles, published_torques
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.inverse.study import InverseDynamicsConfig, RecordedConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_checks import c3d_files, require_plates
from pathwalker_cli.io.recordings import (
    CompactRecording,
    foot_columns,
    names_in,
    read_compact,
    read_recording,
    recording_names,
)
from pathwalker_cli.io.trajectory_csv import read_trajectory
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory


def kinematics_trials(
    config: RecordedConfig, patient: Patient, progress: Progress = print
) -> tuple[Trial, ...]:
    """Evaluate the C3D files of a study as far as angles, events and, with plates, forces.

    Raises:
        DataError: If a recording cannot be used.
    """
    trials: list[Trial] = []
    for condition in config.recorded_conditions:
        files = c3d_files(config.c3d.of(condition))
        found = c3d_trials(files, patient, condition, config, progress=progress)
        trials += [trial for trial, _ in found]
    return tuple(trials)


def dynamics_trials(
    config: InverseDynamicsConfig, patient: Patient, progress: Progress = print
) -> tuple[Trial, ...]:
    """Evaluate the trials of a study as far as joint torques.

    Raises:
        DataError: If there is no trial, a recording cannot be used, or no force is known.
    """
    require_trials(config, patient)
    evaluate = _c3d_dynamics if config.source == "c3d" else recorded_trials
    trials: list[Trial] = []
    for condition in config.conditions:
        trials += evaluate(config, patient, condition, progress)
    _require_forces(trials)
    return tuple(trials)


def _c3d_dynamics(
    config: InverseDynamicsConfig, patient: Patient, condition: Condition, progress: Progress
) -> list[Trial]:
    """Return the trials of one condition from C3D files."""
    published = config.method == "published"
    files = c3d_files(config.c3d.of(condition))
    if published:
        averaged = AVERAGED_TRIALS[condition]
        names = [name for name in averaged if not config.trials or name in config.trials]
        used = [file for file in files if file.stem in names]
        if files and not used:
            raise DataError(
                f"none of the {len(files)} {condition} files is a trial of the published tables",
                allowed=", ".join(averaged),
                mend="use method default for other recordings",
            )
        files = tuple(used)
    trials = []
    found = c3d_trials(files, patient, condition, config, config.trials, progress)
    for trial, recording in found:
        require_plates(recording)
        if published:
            trials.append(_published(trial, recording, patient))
        else:
            trials.append(with_torques(trial, patient, config.motion_cutoff))
    return trials


def recorded_trials(
    config: InverseDynamicsConfig, patient: Patient, condition: Condition, progress: Progress
) -> list[Trial]:
    """Return the trials of one condition from the files beside the patient's file.

    Unlike `dynamics_trials` it accepts that there is none, and trials without forces.

    Raises:
        DataError: If a recording cannot be used.
    """
    trials = []
    for name in recording_names(patient, condition):
        if not config.trials or name in config.trials:
            progress(f"{condition} {name}")
            recording = read_recording(patient, condition, name)
            trial = _trial(recording, condition, stances=recorded_stances(recording))
            trials.append(with_torques(trial, patient, config.motion_cutoff))
    return trials


def read_trials(
    folder: Path, condition: Condition, stances: Sequence[Mapping[str, str]]
) -> tuple[Trial, ...]:
    """Return the trials of one condition as far as the folder of an earlier study tells.

    Rows of its `stances.csv` go by heading without unit.

    Raises:
        DataError: If a file of a trial cannot be used.
    """
    trials = []
    for name in names_in(folder / condition):
        torques = folder / condition / f"{name}_torques.csv"
        tau = read_trajectory(torques, missing=True) if torques.is_file() else None
        own = [row for row in stances if (row["condition"], row["trial"]) == (condition, name)]
        recording = read_compact(folder / condition, name)
        trials.append(_trial(recording, condition, tau, tuple(map(_stance, own))))
    return tuple(trials)


def _stance(row: Mapping[str, str]) -> StanceForce:
    """Return what a row of `stances.csv` says about a stance."""
    side: Side = "right" if row["side"] == "right" else "left"
    reason = "" if row["measured"] == "yes" else row["reason"] or "not measured"
    return StanceForce(Stance(side, int(row["strike"]), int(row["toe-off"])), None, reason)


def _trial(
    recording: CompactRecording,
    condition: Condition,
    tau: Trajectory | None = None,
    stances: tuple[StanceForce, ...] = (),
) -> Trial:
    """Return a trial that was read from tables."""
    cycles = gait_cycles(recording.events)
    return Trial(**vars(recording), condition=condition, cycles=cycles, tau=tau, stances=stances)


def with_torques(trial: Trial, patient: Patient, cutoff: float = MOTION_CUTOFF) -> Trial:
    """Return a trial with its torques, its motion cut off at a frequency [Hz], if forces are known.

    Raises:
        DataError: If the frames are too few for the cut-off frequency.
    """
    if trial.forces is None:
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
    tau = inverse_dynamics(model, *smooth_rates(trial.motion, cutoff), trial.forces)
    return replace(trial, tau=generalised_forces(trial.motion.time, tau))


def _published(trial: Trial, recording: Recording, patient: Patient) -> Trial:
    """Return a trial with cycles, forces and torques of the published method."""
    model = pinocchio_model(patient, trial.condition, published=True)
    values, forces = published_torques(model, recording, trial.motion.values)
    tau, cycles = generalised_forces(trial.motion.time, values), flagged_cycles(recording)
    return replace(trial, cycles=cycles, forces=forces, tau=tau, published=True)


def recorded_stances(recording: CompactRecording) -> tuple[StanceForce, ...]:
    """Return which stances of a compact recording are measured: their forces are all there."""
    judged = []
    for stance in stances(recording.events):
        known = False
        if recording.forces is not None:
            up = recording.forces[foot_columns(stance.side)[1]]
            known = bool(np.isfinite(up[stance.strike : stance.toe_off]).all())
        judged.append(StanceForce(stance, None, "" if known else "no force in the recording"))
    return tuple(judged)


def require_trials(config: InverseDynamicsConfig, patient: Patient) -> None:
    """Refuse a study without trials, or with names of trials that are not there."""
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


def _require_forces(trials: Sequence[Trial]) -> None:
    """Refuse trials of which no stance is measured."""
    stances = [item for trial in trials for item in trial.stances]
    if any(item.measured for item in stances) or any(trial.published for trial in trials):
        return
    first = trials[0].name
    if all(trial.tau is None for trial in trials):
        raise DataError(
            "no trial has ground forces",
            where=first,
            allowed="recordings with force plates",
            mend="import such, or use ik for joint angles alone",
        )
    among = f" of {len(trials)} trials" if len(trials) > 1 else ""
    reasons = sorted({item.reason for item in stances if item.reason})
    raise DataError(
        f"no stance{among} is measured ({'; '.join(reasons) or 'there is none'})",
        where=first,
        allowed="one foot alone on a plate that carries 85 to 115 % of the body",
        mend="add such trials; if the share is far off, check body_mass in the patient's file",
    )
