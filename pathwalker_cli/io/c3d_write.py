"""C3D files out: motion that was made, and copies of recordings with curves added."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d import STORED, Recording, open_c3d, unit_of
from pathwalker_cli.io.c3d_events import Event, EventKind, continued
from pathwalker_cli.io.c3d_plates import METRES, ForcePlate, analog_channels, plate_axes

_LABELS: Final[dict[EventKind, str]] = {"foot_strike": "Foot Strike", "toe_off": "Foot Off"}

_SPELT: Final = {"deg": "deg", "nmm": "Nmm"}
"""Units as recording programs write them."""

_MOST: Final = 255
"""Labels that one parameter holds."""

_SIX_COMPONENTS: Final = 2
"""Type of the plates that are written: three forces, three moments."""


def write_c3d(path: Path, recording: Recording, unit: str = "mm", description: str = "") -> None:
    """Write a recording but for its name, in "mm", "cm" or "m", in the place of an earlier file."""
    import ezc3d

    frames, count = recording.positions.shape[:2]
    points = np.ones((4, count, frames))
    points[:3] = np.moveaxis(recording.positions, (0, 1, 2), (2, 1, 0)) / METRES[unit]
    file: Any = ezc3d.c3d()
    point = file["parameters"]["POINT"]
    point["RATE"]["value"] = [recording.rate]
    point["UNITS"]["value"] = [unit]
    point["LABELS"]["value"] = list(recording.markers)
    file["data"]["points"] = points
    if description:
        file.add_parameter("TRIAL", "DESCRIPTION", [description])
    if recording.events:
        _add_events(file, recording.events, recording.rate)
    if recording.plates:
        _add_plates(file, recording.plates, recording.rate * recording.samples_per_frame, unit)
    file.write(str(path))


def _add_events(file: Any, events: Sequence[Event], rate: float) -> None:
    """Add events; C3D counts their times [min, s] from the first frame."""
    times = np.array([[0.0] * len(events), [event.frame / rate for event in events]])
    file.add_parameter("EVENT", "CONTEXTS", [event.side.capitalize() for event in events])
    file.add_parameter("EVENT", "LABELS", [_LABELS[event.kind] for event in events])
    file.add_parameter("EVENT", "TIMES", times)


def _add_plates(file: Any, plates: Sequence[ForcePlate], rate: float, unit: str) -> None:
    """Add force plates and their channels: forces [N] and moments [N times the file's unit]."""
    channels = np.concatenate(
        [values @ plate_axes(plate.corners).T / scale
         for plate in plates
         for values, scale in ((plate.force, 1.0), (plate.moment, METRES[unit]))],
        axis=1,
    ).T  # fmt: skip
    analog = file["parameters"]["ANALOG"]
    analog["RATE"]["value"] = [rate]
    analog["LABELS"]["value"] = [f"F{i}" for i in range(len(channels))]
    analog["UNITS"]["value"] = [*["N"] * 3, *[f"N{unit}"] * 3] * len(plates)
    file["data"]["analogs"] = channels[None]
    corners = np.stack([plate.corners.T for plate in plates], axis=2)
    group = "FORCE_PLATFORM"
    file.add_parameter(group, "USED", [len(plates)])
    file.add_parameter(group, "TYPE", [_SIX_COMPONENTS] * len(plates))
    file.add_parameter(group, "ORIGIN", np.zeros((3, len(plates))))
    file.add_parameter(group, "CORNERS", corners / METRES[unit])
    numbers = np.arange(1.0, len(channels) + 1.0).reshape(len(plates), -1)
    file.add_parameter(group, "CHANNEL", numbers.T)


def write_copy(
    path: Path, source: Path, curves: Mapping[str, np.ndarray], first_frame: int
) -> tuple[str, ...]:
    """Write a copy of a C3D file with angles and moments added.

    Args:
        path: The copy.
        source: The file.
        curves: Angles [rad] and moments [N m/kg] by name, e.g. LKneeAngles, NaN where not known,
            shape (n,) each: the first component; the others are 0.
        first_frame: Number that the recording program gives their first frame.

    Returns:
        The names in the copy: where the file has one of them, all of them end in "_PathWalker".

    Raises:
        DataError: If the file cannot be read, or holds what the library does not write.
    """
    file = open_c3d(source)
    point, data = file["parameters"]["POINT"], file["data"]
    taken = {str(label).rpartition(":")[2].strip() for label in continued(point, "LABELS")}
    names = tuple(name + "_PathWalker" * bool(taken & curves.keys()) for name in curves)
    first = first_frame - int(file["header"]["points"]["first_frame"]) - 1
    added = np.full((4, len(curves), data["points"].shape[2]), np.nan)
    for row, (name, values) in zip(added.swapaxes(0, 1), curves.items(), strict=True):
        parameter, units = next(unit for end, unit in STORED.items() if name.endswith(end))
        usual = next(iter(units))
        if unit_of(parameter, point) not in units:
            file.add_parameter("POINT", parameter, [_SPELT[usual]])
        unit = units[unit_of(parameter, point)]
        known = np.flatnonzero(np.isfinite(values))
        row[:, first + known] = 0.0
        row[0, first + known] = values[known] / unit
    masks = np.zeros((7, *added.shape[1:]), dtype=bool)
    unseen = np.where(np.isnan(added[:1]), -1.0, 0.0)
    meta = data["meta_points"]
    meta["camera_masks"] = np.concatenate([meta["camera_masks"], masks], axis=1)
    meta["residuals"] = np.concatenate([meta["residuals"], unseen], axis=1)
    data["points"] = np.concatenate([data["points"], added], axis=1)
    last = max((key for key in point if key.startswith("LABELS")), key=lambda key: (len(key), key))
    labels = [*point[last]["value"], *names]
    if len(labels) > _MOST:
        last, labels = f"LABELS{int(last[6:] or 1) + 1}", list(names)
    file.add_parameter("POINT", last, labels)
    point["SCALE"]["value"] = [-1.0]  # points become floats, offsets of channels 0
    if data["analogs"].size:
        data["analogs"] = analog_channels(file).T[None]
    try:
        file.write(str(path))
    except (RuntimeError, NotImplementedError, LookupError, TypeError, ValueError) as problem:
        reason = str(problem).strip().partition("\n")[0]
        raise DataError(f"cannot be copied: {reason}", where=str(source)) from None
    return names
