"""OpenSim's text tables: .mot for motions and ground forces, .sto for joint torques.

Ground forces follow OpenSim's axes (x forward, y up, z to the right); coordinates keep the names
and signs of `conventions`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import SIDES, SUFFIX, TRANSLATIONS
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.trajectory import Trajectory

_END: Final = "endheader"


def write_opensim(path: str | Path, table: Trajectory, digits: int = 8) -> None:
    """Write a table as .mot or .sto: SI units and radians, NaN as `nan`.

    Args:
        path: The file; its stem becomes the table's name.
        table: What to write; the units are those that OpenSim expects and are not written.
        digits: Significant digits.
    """
    header = [
        Path(path).stem,
        "version=1",
        f"nRows={table.time.size}",
        f"nColumns={len(table.names) + 1}",
        "inDegrees=no",
        _END,
        "\t".join(("time", *table.names)),
    ]
    rows = np.column_stack([table.time, table.values])
    with atomic_open(path) as file:
        file.write("\n".join(header) + "\n")
        for row in rows:
            file.write("\t".join(f"{value:.{digits}g}" for value in row) + "\n")


def read_opensim(path: str | Path) -> Trajectory:
    """Read a table written by OpenSim or by `write_opensim`; units are unknown and left empty.

    Raises:
        DataError: If the file is no such table, is in degrees, or ends early.
    """
    path = Path(path)
    try:
        lines = path.read_text(encoding="utf-8").splitlines()
    except (OSError, UnicodeDecodeError) as problem:
        raise DataError(f"cannot be read: {problem}", where=str(path)) from None
    stripped = [line.strip() for line in lines]
    if _END not in stripped or stripped.index(_END) + 1 >= len(lines):
        raise DataError(f"has no line '{_END}' with column names below", where=str(path))
    end = stripped.index(_END)
    pairs = (line.partition("=") for line in stripped[:end])
    entries = {key: value for key, equals, value in pairs if equals}
    if entries.get("inDegrees", "no") != "no":
        raise DataError("is in degrees", where=str(path), allowed="inDegrees=no")
    names = tuple(lines[end + 1].split())
    values = _numbers(lines[end + 2 :], len(names), path)
    rows = entries.get("nRows", str(len(values)))
    if rows.strip() != str(len(values)):
        raise DataError(f"has {len(values)} rows", where=str(path), allowed=f"nRows={rows}")
    try:
        return Trajectory(values[:, 0], names[1:], values[:, 1:], ("",) * (len(names) - 1))
    except ValueError as problem:
        raise DataError(str(problem), where=str(path)) from None


def _numbers(lines: list[str], columns: int, path: Path) -> np.ndarray:
    """Return the rows below the column names, shape (n, columns)."""
    try:
        rows = [[float(cell) for cell in line.split()] for line in lines if line.strip()]
    except ValueError as problem:
        raise DataError(f"holds a cell that is no number: {problem}", where=str(path)) from None
    if not rows or {len(row) for row in rows} != {columns}:
        raise DataError("has rows of another length", where=str(path), allowed=f"{columns} cells")
    return np.array(rows)


def force_table(forces: Trajectory) -> Trajectory:
    """Return ground forces in OpenSim's columns and axes.

    Per foot force `ground_force_r_vx`, point of application `ground_force_r_px` (y = 0, z = 0: the
    walker is flat) and free moment `ground_torque_r_x` (zero) with their y and z.  Forces that were
    not measured stay NaN; the point of a foot without load is 0.

    Args:
        forces: Columns force_r_x [N], force_r_z [N], cop_r_x [m] and the same on the left.
    """
    names: list[str] = []
    columns: list[np.ndarray] = []
    zero = np.zeros(forces.time.size)
    for side in SIDES:
        foot = SUFFIX[side]
        forward, up = forces[f"force_{foot}_x"], forces[f"force_{foot}_z"]
        for stem in (f"force_{foot}_v", f"force_{foot}_p", f"torque_{foot}_"):
            names += [f"ground_{stem}{axis}" for axis in "xyz"]
        point = np.where(up == 0.0, 0.0, forces[f"cop_{foot}_x"])
        columns += [forward, up, zero, point, *[zero] * 5]
    units = ("N", "N", "N", "m", "m", "m", "N m", "N m", "N m") * 2
    return Trajectory(forces.time, tuple(names), np.column_stack(columns), units)


def torque_table(tau: Trajectory) -> Trajectory:
    """Return generalised forces under the names of OpenSim's inverse dynamics: hip_r_moment."""
    names = tuple(f"{n}_{'force' if n in TRANSLATIONS else 'moment'}" for n in tau.names)
    return Trajectory(tau.time, names, tau.values, tau.units)
