"""OpenSim's text tables: .mot for motions and forces, .sto for joint torques, .trc for markers.

Forces and markers follow OpenSim's axes (x forward, y up, z to the right); coordinates keep the
names and signs of `conventions`.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pathwalker_cli.conventions import SIDES, SUFFIX, TRANSLATIONS
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_plates import LOADED, ForcePlate, centre_of_pressure
from pathwalker_cli.trajectory import Trajectory


def write_opensim(path: str | Path, table: Trajectory, digits: int = 8) -> None:
    """Write a table as .mot or .sto: SI units and radians, NaN as `nan`.

    The file's stem becomes the table's name; units are not written, OpenSim expects these.
    """
    header = [
        Path(path).stem,
        "version=1",
        f"nRows={table.time.size}",
        f"nColumns={len(table.names) + 1}",
        "inDegrees=no",
        "endheader",
        "\t".join(("time", *table.names)),
    ]
    rows = np.column_stack([table.time, table.values])
    with atomic_open(path) as file:
        file.write("\n".join(header) + "\n")
        for row in rows:
            file.write("\t".join(f"{value:.{digits}g}" for value in row) + "\n")


def force_table(forces: Trajectory) -> Trajectory:
    """Return ground forces in OpenSim's columns and axes.

    Per foot force `ground_force_r_vx`, point of application `ground_force_r_px` (z = 0: the
    walker is flat) and free moment `ground_torque_r_x` (zero) with their y and z.  Forces that were
    not measured stay NaN; the point of a foot without load is 0.

    Args:
        forces: Columns force_r_x [N], force_r_z [N], cop_r_x [m] and the same on the left; cop_r_z
            [m] if points may lie off the floor.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    zero = np.zeros(forces.time.size)
    for side in SIDES:
        foot = SUFFIX[side]
        forward, up = forces[f"force_{foot}_x"], forces[f"force_{foot}_z"]
        for stem in (f"force_{foot}_v", f"force_{foot}_p", f"torque_{foot}_"):
            names += [f"ground_{stem}{axis}" for axis in "xyz"]
        point, height = (
            np.where(up == 0.0, 0.0, forces[name]) if name in forces.names else zero
            for name in (f"cop_{foot}_x", f"cop_{foot}_z")
        )
        columns += [forward, up, zero, point, height, *[zero] * 4]
    units = ("N", "N", "N", "m", "m", "m", "N m", "N m", "N m") * 2
    return Trajectory(forces.time, tuple(names), np.column_stack(columns), units)


def opensim_axes(values: np.ndarray) -> np.ndarray:
    """Return vectors (..., 3) forward, left, up in OpenSim's axes: forward, up, right."""
    return values[..., [0, 2, 1]] * [1.0, 1.0, -1.0] + 0.0  # no -0.0


def plate_table(time: np.ndarray, plates: Sequence[ForcePlate]) -> Trajectory:
    """Return the loads of plates as OpenSim's external loads take them.

    Of each plate the force `plate_1_vx`, the point where it acts on the surface `plate_1_px` and
    the moment about the vertical through there `plate_1_torque_y`, with their y and z; a plate
    without load acts at the middle of its surface.  Time [s] is of shape (n,).
    The plates have x along the walk and z up, and a load a frame.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    for plate in plates:
        stem, force, about = plate.name.replace(" ", "_"), plate.force, np.zeros_like(plate.force)
        point = centre_of_pressure(plate, LOADED)
        point = np.where(np.isfinite(point), point, plate.centre)
        about[:, 2] = (plate.moment - np.cross(point - plate.centre, force))[:, 2]
        for part, values in (("v", force), ("p", point), ("torque_", about)):
            names += [f"{stem}_{part}{axis}" for axis in "xyz"]
            columns.append(opensim_axes(values))
    units = ("N", "N", "N", "m", "m", "m", "N m", "N m", "N m") * len(plates)
    return Trajectory(time, tuple(names), np.hstack(columns), units)


def write_trc(path: str | Path, recording: Recording) -> None:
    """Write the markers that some frame shows as .trc [mm]; where one is not seen, cells are empty.

    The markers have x along the walk and z up.
    """
    seen = np.isfinite(recording.positions[..., 0]).any(axis=0)
    names = [name for name, there in zip(recording.markers, seen, strict=True) if there]
    positions = 1e3 * opensim_axes(recording.positions[:, seen])
    frames, rate, first = len(positions), f"{recording.rate:g}", recording.first_frame
    facts = {
        "DataRate": rate, "CameraRate": rate, "NumFrames": frames, "NumMarkers": len(names),
        "Units": "mm", "OrigDataRate": rate, "OrigDataStartFrame": first, "OrigNumFrames": frames,
    }  # fmt: skip
    axes = (f"{axis}{number}" for number in range(1, len(names) + 1) for axis in "XYZ")
    header = [
        ("PathFileType", "4", "(X/Y/Z)", Path(path).name),
        facts,
        map(str, facts.values()),
        ("Frame#", "Time", *(cell for name in names for cell in (name, "", ""))),
        ("", "", *axes),
        (),
    ]
    with atomic_open(path) as file:
        for line in header:
            file.write("\t".join(line) + "\n")
        for row, (time, values) in enumerate(zip(recording.time, positions, strict=True), first):
            cells = (f"{x:.4f}" if np.isfinite(x) else "" for x in values.ravel())
            file.write("\t".join((str(row), f"{time:.6f}", *cells)) + "\n")


def torque_table(tau: Trajectory) -> Trajectory:
    """Return generalised forces under the names of OpenSim's inverse dynamics: hip_r_moment."""
    names = tuple(f"{n}_{'force' if n in TRANSLATIONS else 'moment'}" for n in tau.names)
    return Trajectory(tau.time, names, tau.values, tau.units)
