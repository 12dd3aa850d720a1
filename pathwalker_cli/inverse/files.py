"""Files of recorded gait: per trial CSV, .mot and .sto, tables over trials, `strengths.yaml`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.inverse.figures import save_recorded_figures
from pathwalker_cli.inverse.laboratory import angles, moments
from pathwalker_cli.inverse.recorded import strength_lines
from pathwalker_cli.inverse.residuals import COMPONENTS, ResidualTable
from pathwalker_cli.inverse.strengths import StrengthTable
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.text import trial_content
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.io.c3d_write import write_copy
from pathwalker_cli.io.csv_file import as_text, write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.io.opensim import (
    force_table,
    plate_table,
    torque_table,
    write_opensim,
    write_trc,
)
from pathwalker_cli.io.recordings import write_recording
from pathwalker_cli.io.trajectory_csv import write_trajectory
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Strengths
from pathwalker_cli.versions import today, versions

ORIGIN: Final = "study.json"
"""File that says whose recorded gait was studied, how and when."""

READING: Final = "_reading.json"
"""End of the name of the file that says how a C3D file was read."""

_MARKERS: Final = ("point", "rms [m]", "largest [m]", "frames seen", "frames bridged")


def write_kinematics(folder: Path, trials: Sequence[Trial], patient: Patient, limit: float) -> None:
    """Write trials and figures below a folder per condition, and the table of marker distances.

    From `limit` on, a mean distance of the markers is a warning [body heights].
    """
    for condition in dict.fromkeys(trial.condition for trial in trials):
        own = [trial for trial in trials if trial.condition == condition]
        for trial in own:
            write_trial(folder / condition, trial, patient, limit)
        save_recorded_figures(own, folder / condition, patient.body_mass)
    if any(trial.markers for trial in trials):
        rows = [[t.condition, t.name, *row] for t in trials for row in _marker_rows(t)]
        write_table(folder / "marker_residuals.csv", ["condition", "trial", *_MARKERS], rows)


def write_dynamics(
    folder: Path,
    trials: Sequence[Trial],
    tables: Sequence[ResidualTable],
    strengths: StrengthTable,
    patient: Patient,
    config: InverseDynamicsConfig,
) -> None:
    """Write what `write_kinematics` writes, residuals, stances, strengths, and whose they are."""
    write_kinematics(folder, trials, patient, config.largest_marker_distance)
    _write_residuals(folder / "residuals.csv", tables)
    _write_stances(folder / "stances.csv", trials)
    if strengths.strengths is not None:
        _write_strengths(folder / "strengths.csv", strengths)
        source = strengths_source(config.method)
        write_strengths_yaml(folder / "strengths.yaml", strengths.strengths, source)
    content = {
        "patient": patient.id,
        "age": patient.age,
        "body_mass": patient.body_mass,
        "height": patient.height,
        "method": config.method,
        "date": today(),
        "versions": versions(),
        "notes": list(patient.notes),
    }
    write_json(folder / ORIGIN, content)


def strengths_source(method: str) -> str:
    """Return where strengths come from, for the head of their block."""
    return f"inverse dynamics of recorded barefoot gait, method {method}"


def write_trial(folder: Path, trial: Trial, patient: Patient, limit: float) -> None:
    """Write one trial: angles, events, forces, torques and markers, as far as there are any.

    From `limit` on, a mean distance of the markers is a warning [body heights].
    """
    write_recording(folder, trial)
    stem = str(folder / trial.name)
    write_opensim(f"{stem}_angles.mot", trial.motion)
    if trial.forces is not None:
        write_opensim(f"{stem}_grf.mot", force_table(trial.forces))
    if trial.tau is not None:
        write_trajectory(f"{stem}_torques.csv", trial.tau)
        write_opensim(f"{stem}_torques.sto", torque_table(trial.tau))
    if trial.markers is not None:
        write_table(f"{stem}_residuals.csv", _MARKERS, _marker_rows(trial))
        write_json(f"{stem}{READING}", trial_content(trial, patient, limit))


def write_exchange(folder: Path, trial: Trial, body_mass: float) -> None:
    """Write what other programs read: .trc, plates as .mot, and a copy of the C3D file.

    The copy holds our angles and, with torques, moments per `body_mass` [kg] beside what the file
    has.  Of a trial that comes from no C3D file nothing is written.
    """
    if trial.walk is None or trial.walk.source is None:
        return
    stem = str(folder / trial.name)
    write_trc(f"{stem}_markers.trc", trial.walk)
    if trial.walk.plates:
        write_opensim(f"{stem}_plates.mot", plate_table(trial.motion.time, trial.walk.plates))
    curves = angles(trial) | moments(trial, body_mass)
    write_copy(Path(f"{stem}_pathwalker.c3d"), trial.walk.source, curves, trial.first_frame)


def _marker_rows(trial: Trial) -> list[list[object]]:
    """Return one row per marker point of a trial."""
    if trial.markers is None:
        return []
    rows: list[list[object]] = []
    rms = trial.markers.rms()
    for name, distances in zip(trial.markers.names, trial.markers.distances.T, strict=True):
        marker = name.partition(" ")[0]
        bridged = sum(gap.frames for gap in trial.gaps if gap.marker == marker and gap.bridged)
        seen = distances[np.isfinite(distances)]
        largest = seen.max() if seen.size else None
        rows.append([name, as_text(rms[name]), as_text(largest), seen.size - bridged, bridged])
    return rows


def _write_stances(path: Path, trials: Iterable[Trial]) -> None:
    """Write which stances are measured, and why the others are not."""
    rows = [
        [trial.condition, trial.name, item.stance.side, item.stance.strike, item.stance.toe_off,
         None if item.plate is None else item.plate + 1, "yes" if item.measured else "no",
         item.reason]
        for trial in trials
        for item in trial.stances
    ]  # fmt: skip
    header = ["condition", "trial", "side", "strike [frame]", "toe-off [frame]", "plate",
              "measured", "reason"]  # fmt: skip
    write_table(path, header, rows)


def _write_residuals(path: Path, tables: Sequence[ResidualTable]) -> None:
    """Write mean and RMS residuals per trial and mean, min and max of the means over trials."""
    header = ["condition", "part", "trial", "frames"]
    for what, per in (("mean", ""), ("rms", ""), ("mean", "/kg")):
        header += [f"{name} {what} [{unit}{per}]" for name, unit in COMPONENTS.items()]
    rows: list[list[object]] = []
    for table in tables:
        for item in table.trials:
            values = [*item.mean, *item.rms, *(item.mean / table.body_mass)]
            row = [item.trial, item.frames, *(as_text(value, 5) for value in values)]
            rows.append([table.condition, table.part, *row])
        for name, mean in table.range.items():
            values = [*mean, *[None] * len(COMPONENTS), *(mean / table.body_mass)]
            row = [f"{name} over trials", None, *(as_text(value, 5) for value in values)]
            rows.append([table.condition, table.part, *row])
    write_table(path, header, rows)


def _write_strengths(path: Path, table: StrengthTable) -> None:
    """Write all strengths with their origin, the patient's file and what is uncertain."""
    header = ["generator", "strength [N m]", "patient file [N m]", "deviation [%]", "stances",
              "peak torque [N m]", "angle [rad]", "speed [rad/s]", "least of single stances [N m]",
              "largest of single stances [N m]", "remark"]  # fmt: skip
    rows: list[list[object]] = []
    for row in table.rows:
        deviation = "" if row.deviation is None else f"{100.0 * row.deviation:.1f}"
        origin: list[object] = [None] * 6
        if (peak := row.peak) is not None:
            values = (peak.torque, peak.angle, peak.speed, min(peak.single), max(peak.single))
            origin = [len(peak.single), *(as_text(value, 5) for value in values)]
        strength = (as_text(row.value, 5), as_text(row.given, 5), deviation)
        rows.append([row.generator, *strength, *origin, row.remark])
    write_table(path, header, rows)


def write_strengths_yaml(path: Path, strengths: Strengths, source: str) -> None:
    """Write strengths [N m] as a patient's file takes them, below a line about their source."""
    lines = [f"# Maximum isometric torques [N m]: {source}", "strengths:"]
    lines += strength_lines(strengths)
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
