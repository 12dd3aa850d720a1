"""The compact recordings that stand beside a patient: angles, events and forces as CSV."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pathwalker_cli.conventions import (
    COORDINATES,
    SIDES,
    SUFFIX,
    Condition,
    Side,
    coordinate_unit,
)
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d import LEAST_FRAMES
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.csv_file import read_cells, write_table
from pathwalker_cli.io.trajectory_csv import read_trajectory, write_trajectory
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory


def foot_columns(side: Side) -> tuple[str, str, str]:
    """Return the columns about one foot: force forward and up, centre of pressure forward."""
    suffix = SUFFIX[side]
    return f"force_{suffix}_x", f"force_{suffix}_z", f"cop_{suffix}_x"


FORCE_COLUMNS: Final = {
    name: unit
    for side in SIDES
    for name, unit in zip(foot_columns(side), ("N", "N", "m"), strict=True)
}
"""Columns of a table of ground forces with their units: right foot, then left."""

_ANGLE_COLUMNS: Final = {name: coordinate_unit(name) for name in COORDINATES}

_EVENT_COLUMNS: Final = ["side", "event", "frame", "time [s]"]


@dataclass(frozen=True)
class CompactRecording:
    """One recorded trial.

    Args:
        motion: Coordinates in every frame, unfiltered.
        events: Foot strikes and toe-offs; frames count the rows of `motion`.
        forces: Columns force_r_x, force_r_z, cop_r_x and the same on the left, NaN where not
            measured (centre of pressure: or not loaded); None if there is no such file.
    """

    name: str
    motion: Trajectory
    events: tuple[Event, ...]
    forces: Trajectory | None


def write_recording(folder: str | Path, recording: CompactRecording) -> None:
    """Write `<trial>_angles.csv`, `<trial>_events.csv` and `<trial>_forces.csv` into a folder."""
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    stem = folder / recording.name
    write_trajectory(f"{stem}_angles.csv", recording.motion)
    time = recording.motion.time
    events = ([e.side, e.kind, e.frame, f"{time[e.frame]:.6g}"] for e in recording.events)
    write_table(f"{stem}_events.csv", _EVENT_COLUMNS, events)
    if recording.forces is not None:
        write_trajectory(f"{stem}_forces.csv", recording.forces)


def recording_names(patient: Patient, condition: Condition) -> tuple[str, ...]:
    """Return the names of a patient's trials."""
    return tuple(sorted({n for folder in _folders(patient, condition) for n in names_in(folder)}))


def start_names(patient: Patient, condition: Condition) -> tuple[str, ...]:
    """Return the names of the trials that a search may begin with: what a run keeps, it keeps."""
    return next(filter(None, map(names_in, _folders(patient, condition))), ())


def names_in(folder: Path) -> tuple[str, ...]:
    """Return the names of the trials in a folder."""
    return tuple(sorted(p.name.removesuffix("_angles.csv") for p in folder.glob("*_angles.csv")))


def read_recording(patient: Patient, condition: Condition, name: str) -> CompactRecording:
    """Read one trial of a patient.

    Raises:
        DataError: If there is no such trial, or a file of it cannot be used.
    """
    for folder in _folders(patient, condition):
        if name in names_in(folder):
            return read_compact(folder, name)
    raise DataError(
        f"patient {patient.id} has no {condition} recording '{name}'",
        allowed=", ".join(recording_names(patient, condition)) or "none are there",
        mend="import C3D files first",
    )


def read_compact(folder: Path, name: str) -> CompactRecording:
    """Read one trial that stands in a folder.

    Raises:
        DataError: If a file of it cannot be used.
    """
    stem = folder / name
    motion = _read_table(Path(f"{stem}_angles.csv"), _ANGLE_COLUMNS)
    frames = motion.time.size
    if frames < LEAST_FRAMES:
        raise DataError(
            f"has {frames} rows", where=f"{stem}_angles.csv", allowed=f"at least {LEAST_FRAMES}"
        )
    path = Path(f"{stem}_forces.csv")
    forces = _read_table(path, FORCE_COLUMNS, missing=True) if path.is_file() else None
    if forces is not None and forces.time.size != frames:
        raise DataError(
            f"has {forces.time.size} rows",
            where=str(path),
            allowed=f"{frames}, as many as {name}_angles.csv",
            mend="import the recording again",
        )
    events = _read_events(Path(f"{stem}_events.csv"), frames)
    return CompactRecording(name, motion, events, forces)


def _read_table(path: Path, columns: Mapping[str, str], missing: bool = False) -> Trajectory:
    """Read a table that must have these columns in these units."""
    table = read_trajectory(path, missing)
    if dict(zip(table.names, table.units, strict=True)) != columns or table.names != (*columns,):
        allowed = ", ".join(f"{column} [{unit}]" for column, unit in columns.items())
        raise DataError("has other columns", where=str(path), allowed=allowed)
    return table


def _folders(patient: Patient, condition: Condition) -> list[Path]:
    """Return the folders of a condition's recordings, those that count first before others."""
    return [folder / condition for folder in patient.recordings]


def _read_events(path: Path, frames: int) -> tuple[Event, ...]:
    """Return the events in a file."""
    rows = read_cells(path, "import the recording again")
    if not rows or rows[0] != _EVENT_COLUMNS:
        raise DataError(
            "has another header", where=f"{path}, row 1", allowed=",".join(_EVENT_COLUMNS)
        )
    return tuple(_event(row, f"{path}, row {n}", frames) for n, row in enumerate(rows[1:], start=2))


def _event(row: list[str], place: str, frames: int) -> Event:
    """Return the event in a row."""
    side, kind, frame = (*row, "", "", "")[:3]
    if side not in SIDES or kind not in ("foot_strike", "toe_off"):
        raise DataError(
            f"'{side},{kind}' is no event",
            where=place,
            allowed="right or left, foot_strike or toe_off",
        )
    if not (frame.isdecimal() and len(frame) < 10) or int(frame) >= frames:
        raise DataError(f"frame is '{frame}'", where=place, allowed=f"0 to {frames - 1}")
    return Event("right" if side == "right" else "left",
                 "toe_off" if kind == "toe_off" else "foot_strike", int(frame))  # fmt: skip
