"""C3D recordings in: markers in metres, events, analog channels and force plates.

Positions keep the axes of the laboratory; `inverse.markers` turns them into the walking plane.
"""

from __future__ import annotations

import math
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import numpy as np

from pathwalker_cli.conventions import Side
from pathwalker_cli.errors import DataError

EventKind = Literal["foot_strike", "toe_off"]

LEAST_FRAMES: Final = 20
"""Frames that the zero-lag filter needs at the ends, and fewer than any step has."""

METRES: Final = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
"""Length of the units of C3D files [m]."""

_LONGEST: Final = 60.0
"""Time to read a file [s]; a minute of walking takes less than a second."""
_PROBE: Final = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import ezc3d
try:
    ezc3d.c3d(sys.argv[1])
except MemoryError:
    sys.exit(3)
"""
"""Reads a file within 4 GB of memory."""
_TOO_LARGE: Final = 3
"""How that process ends if they are too few."""

_KINDS: Final[dict[str, EventKind]] = {"foot strike": "foot_strike", "foot off": "toe_off"}
_SIDES: Final[dict[str, Side]] = {"left": "left", "right": "right"}


@dataclass(frozen=True)
class Event:
    """A foot strike or toe-off.

    Args:
        side: "right" or "left".
        kind: "foot_strike" or "toe_off".
        frame: Frame of the recording, from 0.
    """

    side: Side
    kind: EventKind
    frame: int


@dataclass(frozen=True)
class ForcePlate:
    """A Kistler plate (C3D type 3) with its eight channels.

    Args:
        name: Name for messages, "plate 1".
        corners: Corners 1 to 4 in the laboratory [m], shape (4, 3).
        half_length: Distance of the sensors from the centre along the plate's x (a) [m].
        half_width: Distance of the sensors from the centre along the plate's y (b) [m].
        depth: Depth of the sensors below the surface [m].
        channels: x12, x34, y14, y23, z1, z2, z3, z4 [N], shape (samples, 8).
    """

    name: str
    corners: np.ndarray
    half_length: float
    half_width: float
    depth: float
    channels: np.ndarray


@dataclass(frozen=True)
class Recording:
    """What one C3D file holds.

    Args:
        name: Name of the trial.
        rate: Marker frames per second [1/s].
        markers: Marker names without the subject's name.
        positions: Marker positions in the laboratory [m], NaN where missing, shape (n, m, 3).
        events: Foot strikes and toe-offs in order of time.
        plates: Force plates.
        samples_per_frame: Analog samples per marker frame.
    """

    name: str
    rate: float
    markers: tuple[str, ...]
    positions: np.ndarray
    events: tuple[Event, ...]
    plates: tuple[ForcePlate, ...]
    samples_per_frame: int

    @property
    def time(self) -> np.ndarray:
        """Time of the frames from the first one on [s], shape (n,)."""
        return np.arange(self.positions.shape[0]) / self.rate

    def marker(self, name: str) -> np.ndarray:
        """Return the positions of one marker [m], shape (n, 3).

        Raises:
            DataError: If the recording has no such marker.
        """
        if name not in self.markers:
            raise DataError(
                f"has no marker {name}",
                where=self.name,
                allowed=", ".join(self.markers),
                mend="correct the name in the file or in the marker set",
            )
        return self.positions[:, self.markers.index(name)]


def read_c3d(path: str | Path) -> Recording:
    """Read a recording.

    Args:
        path: The C3D file.

    Raises:
        DataError: If the file is missing, is not C3D, or holds units or plates that are not known.
    """
    path = Path(path)
    content = _open(path)
    parameters = content["parameters"]
    rate = float(_value(parameters, "POINT", "RATE", path)[0])
    first_frame = int(content["header"]["points"]["first_frame"]) + 1
    points = content["data"]["points"]
    # labels beyond the last point name nothing
    labels = _value(parameters, "POINT", "LABELS", path)[: points.shape[1]]
    samples = content["data"]["analogs"].shape[2]
    return Recording(
        name=path.stem,
        rate=rate,
        markers=tuple(str(label).rpartition(":")[2].strip() for label in labels),
        positions=_positions(points, _unit(parameters, path)),
        events=_events(parameters, rate, first_frame, points.shape[2]),
        plates=_plates(content, path),
        samples_per_frame=samples // points.shape[2] if points.shape[2] else 0,
    )


def _open(path: Path) -> Any:
    """Return ezc3d's view of a file."""
    if not path.is_file():
        raise DataError("no such recording", where=str(path), mend="check the path")
    try:
        import ezc3d
    except ImportError:
        raise DataError(
            "C3D files need ezc3d", where=str(path), mend="install it: pip install ezc3d"
        ) from None
    _probe(path)
    try:
        return ezc3d.c3d(str(path))
    except (OSError, RuntimeError, ValueError) as problem:
        reason = str(problem).strip().splitlines()[0] if str(problem).strip() else "unreadable"
        raise DataError(f"not a C3D file: {reason}", where=str(path)) from None


def _probe(path: Path) -> None:
    """Refuse a file that kills its reader, fills the memory or never ends.

    ezc3d is compiled and dies of some damaged files, which no exception tells; so it reads every
    file in a process of its own first.
    """
    words = [sys.executable, "-P", "-c", _PROBE, str(path.resolve())]
    what = ""
    try:
        done = subprocess.run(  # noqa: S603 - this Python, a text of this module, and a path
            words, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=_LONGEST
        )
        if done.returncode == _TOO_LARGE:
            what = "is damaged or too large: reading takes more than 4 GB of memory"
        elif done.returncode < 0:
            what = "is damaged: its reader dies of it"
    except subprocess.TimeoutExpired:
        what = f"is damaged: reading does not end in {_LONGEST:g} s"
    if what:
        raise DataError(what, where=str(path), mend="export the recording again")


def _value(parameters: Any, group: str, name: str, path: Path) -> Any:
    """Return a parameter's value."""
    try:
        return parameters[group][name]["value"]
    except KeyError:
        raise DataError(f"has no parameter {group}:{name}", where=str(path)) from None


def _unit(parameters: Any, path: Path) -> float:
    """Return the length of the file's unit [m]."""
    unit = str(_value(parameters, "POINT", "UNITS", path)[0]).strip().lower()
    if unit not in METRES:
        raise DataError(
            f"marker positions are in '{unit}'", where=str(path), allowed=", ".join(METRES)
        )
    return METRES[unit]


def _positions(points: np.ndarray, unit: float) -> np.ndarray:
    """Return positions [m], shape (n, m, 3); a point at exactly zero was not seen."""
    positions = np.moveaxis(points[:3], (0, 1, 2), (2, 1, 0)) * unit
    missing = ~np.isfinite(positions).all(axis=2) | (positions == 0.0).all(axis=2)
    positions[missing] = np.nan
    positions.setflags(write=False)
    return positions


def _events(parameters: Any, rate: float, first_frame: int, frames: int) -> tuple[Event, ...]:
    """Return strikes and toe-offs inside the recording; other events are left out.

    C3D counts event times from frame 1 at time zero; an event between two frames counts for the
    later one.  In the shipped recordings the plates' forces rise and fall within one frame of the
    events read this way.
    """
    group = parameters.get("EVENT", {})
    if "TIMES" not in group or not np.size(group["TIMES"]["value"]):
        return ()
    minutes, seconds = group["TIMES"]["value"]
    events = []
    for side, kind, time in zip(
        group["CONTEXTS"]["value"],
        group["LABELS"]["value"],
        60.0 * minutes + seconds,
        strict=False,
    ):
        key_side, key_kind = str(side).strip().lower(), str(kind).strip().lower()
        frame = math.ceil(round(float(time) * rate, 3)) - (first_frame - 1)
        if key_side in _SIDES and key_kind in _KINDS and 0 <= frame < frames:
            events.append(Event(_SIDES[key_side], _KINDS[key_kind], frame))
    return tuple(sorted(events, key=lambda event: event.frame))


def analog_offset_error(offset: np.ndarray, scale: np.ndarray, unsigned: bool) -> np.ndarray:
    """Return what ezc3d adds to every channel by misreading ANALOG:OFFSET, shape of `offset`.

    The parameter is a 16-bit word.  In a file of unsigned samples, an offset above 32767 reads as
    a negative number; ezc3d 1.7 then takes its absolute value instead of adding 65536.

    Args:
        offset: ANALOG:OFFSET as read [counts].
        scale: Physical units per count.
        unsigned: Whether ANALOG:FORMAT is UNSIGNED.
    """
    true = np.mod(offset, 65536) if unsigned else offset
    return (true - np.abs(offset)) * scale


def _analog(content: Any) -> np.ndarray:
    """Return the analog channels in physical units, shape (samples, channels)."""
    group = content["parameters"]["ANALOG"]
    channels = np.array(content["data"]["analogs"][0].T, dtype=float)
    used = channels.shape[1]
    offset = np.asarray(group["OFFSET"]["value"], dtype=float)[:used]
    scale = np.asarray(group["SCALE"]["value"], dtype=float)[:used]
    general = float(group["GEN_SCALE"]["value"][0])
    form = group["FORMAT"]["value"] if "FORMAT" in group else []
    unsigned = bool(form) and str(form[0]).strip().upper() == "UNSIGNED"
    return channels - analog_offset_error(offset, scale * general, unsigned)


def _plates(content: Any, path: Path) -> tuple[ForcePlate, ...]:
    """Return the force plates; only Kistler plates of type 3 are read."""
    parameters = content["parameters"]
    group = parameters.get("FORCE_PLATFORM", {})
    count = int(group["USED"]["value"][0]) if "USED" in group and len(group["USED"]["value"]) else 0
    if not count or not content["data"]["analogs"].size:
        return ()
    unit = _unit(parameters, path)
    analog = _analog(content)
    plates = []
    for index in range(count):
        kind = int(group["TYPE"]["value"][index])
        name = f"plate {index + 1}"
        if kind != 3:
            raise DataError(
                f"{name} is of type {kind}", where=str(path), allowed="type 3 (Kistler)"
            )
        a, b, depth = np.abs(group["ORIGIN"]["value"][:, index]) * unit
        columns = group["CHANNEL"]["value"][:8, index].astype(int) - 1
        corners = group["CORNERS"]["value"][:, :, index].T * unit
        plates.append(ForcePlate(name, corners, a, b, depth, analog[:, columns]))
    return tuple(plates)
