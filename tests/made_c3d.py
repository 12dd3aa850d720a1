"""C3D files of a made motion, in order or broken in one way."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import ezc3d
import numpy as np

from pathwalker_cli.inverse.kinematics import _Fit
from pathwalker_cli.inverse.markers import load_marker_set, marker_points
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient

FRAMES, PER_FRAME = 120, 2
EVENTS = [("Left", "Foot Strike", 10), ("Right", "Foot Off", 20), ("Right", "Foot Strike", 50),
          ("Left", "Foot Off", 60), ("Left", "Foot Strike", 90), ("Right", "Foot Off", 100),
          ("Right", "Foot Strike", 115)]  # fmt: skip


@cache
def motion() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return a made motion and the paths of its markers [m], shape (FRAMES, 3) each."""
    patient = load_patient("sreenivasa2017-patient")
    model = pinocchio_model(patient, "barefoot")
    points = marker_points(load_marker_set(), patient, "barefoot")
    phase = np.linspace(0.0, 2.0, FRAMES)[:, None]
    q = 0.2 * np.sin(phase * np.arange(1, 11)) + [0, 0.6, 0, -0.3, 0.8, 0, -0.2, 0.9, 0, 0]
    q[:, 0], q[:, 1] = 0.6 * phase[:, 0], 0.6
    placed = np.array([_Fit(model, points).positions(row)[0] for row in q])
    paths = {}
    for column, point in enumerate(points):
        x, z = placed[:, column].T
        paths[point.marker] = np.column_stack([x, np.full(FRAMES, 0.1), z])
    return q, paths


def write_c3d(
    path: Path,
    unit: str = "mm",
    scale: float = 1e3,
    frames: int = FRAMES,
    events: bool = True,
    plate: bool = False,
    without: str = "",
    unseen: str = "",
    nan_channel: bool = False,
    markers: bool = True,
    rate: float = 120.0,
    flat_plate: bool = False,
) -> Path:
    """Write a C3D file of the made motion, in order or broken in one way."""
    paths = {n: p for n, p in motion()[1].items() if markers and n != without}
    points = np.ones((4, len(paths), frames))
    for column, positions in enumerate(paths.values()):
        points[:3, column] = scale * positions[:frames].T
    if unseen:
        points[:3, list(paths).index(unseen)] = np.nan
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [rate]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    file["parameters"]["POINT"]["LABELS"]["value"] = list(paths)
    file["data"]["points"] = points
    if events:
        times = np.array([[0.0] * len(EVENTS), [frame / rate for *_, frame in EVENTS]])
        file.add_parameter("EVENT", "CONTEXTS", [side for side, *_ in EVENTS])
        file.add_parameter("EVENT", "LABELS", [kind for _, kind, _ in EVENTS])
        file.add_parameter("EVENT", "TIMES", times)
    if plate:
        _add_plate(file, frames, rate, nan_channel, flat_plate)
    file.write(str(path))
    return path


def _add_plate(file: Any, frames: int, rate: float, nan_channel: bool, flat: bool) -> None:
    """Add a long plate that both feet load from frame 15 to 110."""
    file["parameters"]["ANALOG"]["RATE"]["value"] = [rate * PER_FRAME]
    file["parameters"]["ANALOG"]["LABELS"]["value"] = [f"F{i}" for i in range(8)]
    channels = np.zeros((1, 8, frames * PER_FRAME))
    channels[0, 4:, 15 * PER_FRAME : 110 * PER_FRAME] = 60.0
    if nan_channel:
        channels[0, 6, 40] = np.nan
    file["data"]["analogs"] = channels
    corners = 1e3 * np.array([[2.0, 0.3, 0], [-1.0, 0.3, 0], [-1.0, -0.3, 0], [2.0, -0.3, 0]])
    corners *= not flat
    group = "FORCE_PLATFORM"
    file.add_parameter(group, "USED", [1])
    file.add_parameter(group, "TYPE", [3])
    file.add_parameter(group, "ORIGIN", np.array([[1400.0], [275.0], [27.0]]))
    file.add_parameter(group, "CORNERS", corners.T[:, :, None])
    file.add_parameter(group, "CHANNEL", np.arange(1.0, 9.0)[:, None])


def cut(path: Path) -> Path:
    """Write a C3D file that ends in the middle of its frames."""
    data = write_c3d(path).read_bytes()
    path.write_bytes(data[: len(data) * 2 // 3])
    return path


def text(path: Path) -> Path:
    """Write something that is no C3D file."""
    path.write_text("a walk, but in words", encoding="utf-8")
    return path


def folder(path: Path) -> Path:
    """Make a folder without recordings."""
    path.mkdir()
    return path
