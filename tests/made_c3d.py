"""C3D files of a made motion, in order or broken in one way."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np

from pathwalker_cli.inverse.kinematics import marker_paths
from pathwalker_cli.inverse.markers import load_marker_set, marker_points
from pathwalker_cli.io import c3d_write
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_checks import check_markers, readable_recording
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.c3d_plates import METRES, ForcePlate
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient

FRAMES, PER_FRAME = 120, 2
EVENTS = (Event("left", "foot_strike", 10), Event("right", "toe_off", 20),
          Event("right", "foot_strike", 50), Event("left", "toe_off", 60),
          Event("left", "foot_strike", 90), Event("right", "toe_off", 100),
          Event("right", "foot_strike", 115))  # fmt: skip


@cache
def motion() -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return a made motion and the paths of its markers [m], shape (FRAMES, 3) each."""
    patient = load_patient("sreenivasa2017-patient")
    points = marker_points(load_marker_set(), patient, "barefoot")
    phase = np.linspace(0.0, 2.0, FRAMES)[:, None]
    q = 0.2 * np.sin(phase * np.arange(1, 11)) + [0, 0.6, 0, -0.3, 0.8, 0, -0.2, 0.9, 0, 0]
    q[:, 0], q[:, 1] = 0.6 * phase[:, 0], 0.6
    placed = marker_paths(pinocchio_model(patient, "barefoot"), points, q)
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
    positions = np.empty((frames, len(paths), 3))
    for column, path_of_marker in enumerate(paths.values()):
        positions[:, column] = scale * METRES[unit] * path_of_marker[:frames]
    if unseen:
        positions[:, list(paths).index(unseen)] = np.nan
    plates = (_plate(frames, nan_channel, flat_plate),) if plate else ()
    recording = Recording(path.stem, rate, tuple(paths), positions, EVENTS if events else (),
                          plates, PER_FRAME)  # fmt: skip
    c3d_write.write_c3d(path, recording, unit)
    return path


def checked(path: Path, markers: tuple[str, ...], height: float) -> Recording:
    """Read a recording and check that these markers can be evaluated."""
    recording = readable_recording(path)
    check_markers(recording, markers, height, path)
    return recording


def _plate(frames: int, nan_channel: bool, flat: bool) -> ForcePlate:
    """Return a long plate that both feet load from frame 15 to 110."""
    force = np.zeros((frames * PER_FRAME, 3))
    force[15 * PER_FRAME : 110 * PER_FRAME, 2] = 240.0
    if nan_channel:
        force[40, 2] = np.nan
    corners = np.array([[2.0, 0.3, 0], [-1.0, 0.3, 0], [-1.0, -0.3, 0], [2.0, -0.3, 0]])
    return ForcePlate("plate 1", corners * (not flat), force, np.zeros_like(force))


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
