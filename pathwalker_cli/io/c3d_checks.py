"""What a C3D file must hold before it is worth evaluating; each refusal is one sentence."""

from __future__ import annotations

import os
import struct
from collections.abc import Sequence
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.errors import DataError, placed
from pathwalker_cli.io.c3d import LEAST_FRAMES, Recording, read_c3d
from pathwalker_cli.io.c3d_plates import CHANNELS

LEAST_RATE: Final = 50.0
"""Frames per second below which foot strikes blur [1/s]; the plates' 20 Hz filter needs 40."""

SPAN: Final = (0.25, 4.0)
"""Height of the markers over the floor's lowest one as a share of the body's height: a person is
inside, whatever the posture; a wrong unit is off by 10 or 1000."""

_MOST_NAMES: Final = 40
"""Markers of a file that a message names."""

_BLOCK: Final = 512
_INTEL: Final = 84
_ENDLESS: Final = 65535
"""Last frame in the header of recordings too long for its 16 bits."""


def c3d_files(paths: Sequence[str | Path]) -> tuple[Path, ...]:
    """Return C3D files in order; a folder stands for all that are in it.

    Raises:
        DataError: If a path does not exist, a folder holds none, or two files have one name.
    """
    files: list[Path] = []
    for path in map(Path, paths):
        if os.path.isdir(path):  # False too for what cannot be a path
            inside = sorted(p for p in path.iterdir() if p.suffix.lower() == ".c3d")
            if not inside:
                raise DataError("no C3D file in this folder", where=str(path), allowed="*.c3d")
            files += inside
        elif os.path.isfile(path):
            files.append(path)
        else:
            raise DataError("no such recording", where=str(path), mend="check the path")
    unique = tuple({path.resolve(): path for path in files}.values())
    stems = [path.stem for path in unique]
    twice = next((path for path in unique if stems.count(path.stem) > 1), None)
    if twice:
        raise DataError(
            f"two recordings are called {twice.stem}", where=str(twice), mend="rename one of them"
        )
    return unique


def readable_recording(path: Path, subject: str | None = None) -> Recording:
    """Read a recording and check that it is a motion.

    Raises:
        DataError: If the file is damaged, or lacks frames.
    """
    with placed(str(path)):
        try:
            recording = read_c3d(path, subject)
        except (ValueError, LookupError, ArithmeticError, TypeError, MemoryError) as problem:
            raise DataError(f"is damaged: {problem}", mend="export the recording again") from None
        _check_length(path)
        _check_frames(recording)
    return recording


def check_markers(recording: Recording, names: Sequence[str], height: float, path: Path) -> None:
    """Refuse a recording that lacks markers, or whose markers or plates cannot be right.

    The height is that of the patient [m].
    """
    names = tuple(dict.fromkeys(names))
    with placed(str(path)):
        _check_markers(recording, names)
        _check_unit(recording, names, height)
        _check_signals(recording)


def require_plates(recording: Recording) -> None:
    """Refuse a recording without force plates."""
    if not recording.plates:
        raise DataError(
            "has no force plates that can be read",
            where=recording.name,
            allowed=f"plates of types {min(CHANNELS)} to {max(CHANNELS)} with their channels",
            mend="use ik for joint angles alone, or export the analog channels too",
        )


def _check_length(path: Path) -> None:
    """Refuse a file that is shorter than its header says; readers drop the missing frames."""
    with path.open("rb") as file:
        header = file.read(_BLOCK)
        file.seek((header[0] - 1) * _BLOCK)
        parameters = file.read(4)
    if len(parameters) < 4 or parameters[3] != _INTEL:
        return
    points, analog, first, last, _ = struct.unpack("<5H", header[2:12])
    scale, start = struct.unpack("<fH", header[12:18])
    frame = (4 * points + analog) * (4 if scale < 0.0 else 2)
    frames = last - first + 1
    present = (path.stat().st_size - (start - 1) * _BLOCK) // frame if frame else frames
    if last != _ENDLESS and present < frames:
        raise DataError(
            f"is cut off: {max(present, 0)} of its {frames} frames are there",
            mend="copy or export the recording again",
        )


def _check_frames(recording: Recording) -> None:
    """Refuse a recording that is no motion."""
    frames = recording.positions.shape[0]
    if not (np.isfinite(recording.rate) and recording.rate >= LEAST_RATE):
        raise DataError(
            f"has {recording.rate:g} frames per second",
            allowed=f"at least {LEAST_RATE:g}",
            mend="if it was recorded faster, correct POINT:RATE",
        )
    if frames < LEAST_FRAMES:
        raise DataError(
            f"has {frames} frame{'s' if frames != 1 else ''}",
            allowed=f"at least {LEAST_FRAMES}",
            mend="use the recording of a walk, not of a pose",
        )


def _check_markers(recording: Recording, markers: Sequence[str]) -> None:
    """Refuse a recording in which a marker is missing or was never seen."""
    if not recording.markers or recording.positions.size == 0:
        raise DataError("has no markers", allowed=", ".join(markers))
    missing = [name for name in markers if name not in recording.markers]
    if missing:
        raise DataError(
            f"has no marker {', '.join(missing)}",
            allowed=_some(recording.markers),
            mend="correct the names in the file or give another marker set",
        )
    twice = [name for name in markers if recording.markers.count(name) > 1]
    if twice:
        allowed, mend = "one of a name", "take the wrong one out of the file"
        if len(recording.subjects) > 1:
            allowed = f"one subject of {', '.join(recording.subjects)}"
            mend = "name the subject (--subject)"
        what = f"has {recording.markers.count(twice[0])} markers {', '.join(twice)}"
        raise DataError(what, allowed=allowed, mend=mend)
    unseen = [n for n in markers if not np.isfinite(recording.marker(n)).any()]
    if unseen:
        raise DataError(
            f"never shows marker {', '.join(unseen)}",
            mend="label it in some frames, or take it out of the marker set",
        )


def _check_unit(recording: Recording, markers: Sequence[str], height: float) -> None:
    """Refuse a recording whose lengths cannot be in the unit that it names."""
    every = np.stack([recording.marker(name) for name in markers], axis=1)
    seen = every[np.isfinite(every[..., 0]).any(axis=1)]
    # whichever axis is the vertical: a body is longer than its step
    span = float(np.median(np.nanmax(seen, axis=1) - np.nanmin(seen, axis=1), axis=0).max())
    if not SPAN[0] * height < span < SPAN[1] * height:
        raise DataError(
            f"its markers span {span:.4g} m from end to end",
            allowed=f"{SPAN[0] * height:.2g} to {SPAN[1] * height:.2g} m at a body height of "
            f"{height:g} m",
            mend="POINT:UNITS must name the unit of the positions: mm and m confused?",
        )


def _check_signals(recording: Recording) -> None:
    """Refuse a recording whose force plates have no extent or hold something else than numbers."""
    for plate in recording.plates:
        sides = np.diff(plate.corners, axis=0)[:2]
        if not np.linalg.norm(np.cross(*sides)) > 0.0:
            raise DataError(
                f"{plate.name} has no extent",
                allowed="four corners",
                mend="set FORCE_PLATFORM:CORNERS and export again",
            )
        bad = np.flatnonzero(~np.isfinite([plate.force, plate.moment]).all(axis=(0, 2)))
        if bad.size:
            raise DataError(
                f"{plate.name} holds NaN or infinity in {bad.size} samples, first in {bad[0]}",
                allowed="finite forces",
                mend="export the analog channels again",
            )


def _some(names: Sequence[str]) -> str:
    """Return names in a row, the first ones if there are many."""
    more = len(names) - _MOST_NAMES
    return ", ".join(names[:_MOST_NAMES]) + (f" and {more} more" if more > 0 else "")
