"""C3D files out: what `c3d.read_c3d` reads, for motion that was made and not recorded."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_events import Event, EventKind
from pathwalker_cli.io.c3d_plates import METRES, ForcePlate, plate_axes

_LABELS: Final[dict[EventKind, str]] = {"foot_strike": "Foot Strike", "toe_off": "Foot Off"}

_SIX_COMPONENTS: Final = 2
"""Type of the plates that are written: three forces, three moments."""


def write_c3d(path: Path, recording: Recording, unit: str = "mm", description: str = "") -> None:
    """Write a recording.

    Args:
        path: The file; an earlier one is replaced.
        recording: Markers, events and force plates; its name is not written.
        unit: Unit of lengths in the file: "mm", "cm" or "m".
        description: What the file holds, for TRIAL:DESCRIPTION.
    """
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
