"""C3D recordings in: markers in metres, events, analog channels and force plates.

Positions keep the axes of the laboratory; `inverse.walk` turns them into the walking plane.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.errors import DataError, placed
from pathwalker_cli.io.c3d_events import Event, continued, read_events
from pathwalker_cli.io.c3d_plates import METRES, ForcePlate, read_plates

LEAST_FRAMES: Final = 20
"""Frames that the zero-lag filter needs at the ends, and fewer than any step has."""

_FARTHEST: Final = 1e5
"""Distance beyond which no laboratory reaches, even with mm taken for m [m]."""

STORED: Final[Mapping[str, tuple[str, Mapping[str, float]]]] = {
    "Angles": ("ANGLE_UNITS", {"deg": np.pi / 180.0, "rad": 1.0}),
    "Moment": ("MOMENT_UNITS", {"nmm": 1e-3, "nm": 1.0}),
}
"""By kind of what a model computed: where its unit stands, and units in SI, the usual one first."""

_MODELLED: Final = re.compile(r"(Angles?|Moment|Force|Power|GRF)(_.*)?$")
"""Ends of labels of what a model computed: no places in the laboratory."""

_LONGEST: Final = 60.0
"""Time to read a file [s]; a minute of walking takes less than a second."""
_PROBE: Final = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (4 << 30, 4 << 30))
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
import ezc3d
try:
    ezc3d.c3d(sys.argv[1])
except Exception as problem:
    sys.exit(str(problem) or type(problem).__name__)
"""
"""Reads a file within 4 GB of memory, or says why not."""
_TOO_FEW: Final = ("MemoryError", "bad_alloc", "bad_array_new_length")
"""How it says that they are too few."""


@dataclass(frozen=True)
class Recording:
    """What one C3D file holds.

    Args:
        rate: Marker frames per second [1/s].
        markers: Marker names without the subject's name.
        positions: Marker positions in the laboratory [m], NaN where missing, shape (n, m, 3).
        samples_per_frame: Analog samples per marker frame.
        first_frame: Number that the recording program gives the first frame.
        subjects: Whom the file names before its markers.
        remarks: What a user should know about how the file was read, a sentence each.
        numbers: What the file says about the subject, e.g. Bodymass, as it stands there.
        stored: What a model of the laboratory left in it, e.g. LKneeAngles, NaN where missing,
            shape (n, 3) each: angles [rad], moments [N m, of many programs per kg], others as they
            stand there.
        source: The file, None of motion that was made.
    """

    name: str
    rate: float
    markers: tuple[str, ...]
    positions: np.ndarray
    events: tuple[Event, ...]
    plates: tuple[ForcePlate, ...]
    samples_per_frame: int
    first_frame: int = 1
    subjects: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()
    numbers: Mapping[str, float] = field(default_factory=dict)
    stored: Mapping[str, np.ndarray] = field(default_factory=dict)
    source: Path | None = None

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


def read_c3d(path: str | Path, subject: str | None = None) -> Recording:
    """Read a recording, with one subject's markers alone if a subject is named.

    Raises:
        DataError: If the file is missing, is not C3D, or holds units that are not known.
    """
    path = Path(path)
    content = open_c3d(path)
    with placed(str(path)):
        return _recording(content, path, subject)


def _recording(content: Any, path: Path, subject: str | None) -> Recording:
    """Return what ezc3d's view of a file holds."""
    parameters = content["parameters"]
    rate = float(_value(parameters, "POINT", "RATE")[0])
    first_frame = int(content["header"]["points"]["first_frame"]) + 1
    points = content["data"]["points"]
    _value(parameters, "POINT", "LABELS")
    # labels beyond the last point name nothing
    labels = [str(label) for label in continued(parameters["POINT"], "LABELS")][: points.shape[1]]
    parts = [label.rpartition(":") for label in labels]
    subjects = tuple(dict.fromkeys(part[0].strip() for part in parts if part[1]))
    if subject is not None and subject not in subjects:
        allowed = ", ".join(subjects) or "none is named"
        raise DataError(f"names no subject {subject}", allowed=allowed)
    every = [i for i, part in enumerate(parts) if subject in (None, part[0].strip())]
    kinds = {i: kind[1] for i in every if (kind := _MODELLED.search(parts[i][2].strip()))}
    own = [i for i in every if i not in kinds]
    unit = _unit(parameters)
    samples = content["data"]["analogs"].shape[2]
    plates, remarks = read_plates(content, unit)
    return Recording(
        name=path.stem,
        rate=rate,
        markers=tuple(parts[i][2].strip() for i in own),
        positions=_seen(points[:, own], unit),
        events=read_events(parameters.get("EVENT", {}), rate, first_frame, points.shape[2]),
        plates=plates,
        samples_per_frame=samples // points.shape[2] if points.shape[2] else 0,
        first_frame=first_frame,
        subjects=subjects,
        remarks=remarks,
        numbers=_numbers(parameters),
        stored={
            parts[i][2].strip(): _seen(points[:, [i]], _scale(kind, parameters))[:, 0]
            for i, kind in kinds.items()
        },
        source=path,
    )


def open_c3d(path: Path) -> Any:
    """Return ezc3d's view of a file.

    Raises:
        DataError: If it cannot be read.
    """
    if not path.is_file():
        raise DataError("no such recording", where=str(path), mend="check the path")
    try:
        import ezc3d
    except ImportError:
        raise DataError(
            "C3D files need ezc3d", where=str(path), mend="install it: pip install ezc3d"
        ) from None
    _probe(path)
    return ezc3d.c3d(str(path))


def _probe(path: Path) -> None:
    """Refuse a file that cannot be read, kills its reader, fills the memory or never ends.

    ezc3d is compiled and dies of some damaged files, which no exception tells; so it reads every
    file in a process of its own first.
    """
    words = [sys.executable, "-P", "-c", _PROBE, str(path.resolve())]
    what, mend = "", "export the recording again"
    try:
        done = subprocess.run(  # noqa: S603 - this Python, a text of this module, and a path
            words, stdin=subprocess.DEVNULL, capture_output=True, check=False, timeout=_LONGEST
        )
        reason = done.stderr.decode(errors="replace").strip().rpartition("\n")[2]
        if done.returncode < 0:
            what = "is damaged: its reader dies of it"
        elif done.returncode and any(word in reason for word in _TOO_FEW):
            what = "is damaged or too large: reading takes more than 4 GB of memory"
        elif done.returncode:
            what, mend = f"not a C3D file: {reason}", ""
    except subprocess.TimeoutExpired:
        what = f"is damaged: reading does not end in {_LONGEST:g} s"
    if what:
        raise DataError(what, where=str(path), mend=mend)


def _value(parameters: Any, group: str, name: str) -> Any:
    """Return a parameter's value."""
    try:
        return parameters[group][name]["value"]
    except KeyError:
        raise DataError(f"has no parameter {group}:{name}") from None


def _unit(parameters: Any) -> float:
    """Return the length of the file's unit [m]."""
    unit = str(_value(parameters, "POINT", "UNITS")[0]).strip().lower()
    if unit not in METRES:
        raise DataError(f"marker positions are in '{unit}'", allowed=", ".join(METRES))
    return METRES[unit]


def _scale(kind: str, parameters: Any) -> float:
    """Return what makes values that a model computed SI; 1 where it does not matter."""
    parameter, units = STORED.get(kind, ("", {"": 1.0}))
    return units.get(unit_of(parameter, parameters["POINT"]), next(iter(units.values())))


def unit_of(parameter: str, point: Mapping[str, Any]) -> str:
    """Return the unit that a parameter of the group POINT names, in small letters; "" without."""
    named = [*np.ravel(point[parameter]["value"] if parameter in point else ()), ""][0]
    return str(named).strip().lower()


def _seen(points: np.ndarray, unit: float) -> np.ndarray:
    """Return points in SI units, shape (n, m, 3); NaN if exactly zero or far away: not seen."""
    positions = np.moveaxis(points[:3], (0, 1, 2), (2, 1, 0)) * unit
    seen = (np.abs(positions) < _FARTHEST).all(axis=2)  # NaN is not
    missing = ~seen | (positions == 0.0).all(axis=2)
    positions[missing] = np.nan
    positions.setflags(write=False)
    return positions


def _numbers(parameters: Any) -> dict[str, float]:
    """Return the numbers of the group that processing programs keep about the subject."""
    values = {
        name: np.ravel(content["value"])
        for name, content in parameters.get("PROCESSING", {}).items()
        if name != "__METADATA__"
    }
    return {
        name: float(value[0])
        for name, value in values.items()
        if value.size == 1 and np.issubdtype(value.dtype, np.number) and np.isfinite(value[0])
    }
