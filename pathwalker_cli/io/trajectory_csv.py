"""Trajectories as CSV: one column per name, its unit in the header, six significant digits."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.csv_file import as_text, read_cells, write_table
from pathwalker_cli.trajectory import Trajectory

_HEADER: Final = re.compile(r"^\s*(?P<name>\w+)\s*\[(?P<unit>[^\]]*)\]\s*$")


def write_trajectory(path: str | Path, trajectory: Trajectory, digits: int = 6) -> None:
    """Write a trajectory with so many significant digits; where it is NaN, cells are empty."""
    names = zip(trajectory.names, trajectory.units, strict=True)
    header = ["time [s]", *(f"{name} [{unit}]" for name, unit in names)]
    rows = np.column_stack([trajectory.time, trajectory.values])
    write_table(path, header, ([as_text(value, digits) for value in row] for row in rows))


def read_trajectory(path: str | Path, missing: bool = False) -> Trajectory:
    """Read a trajectory; if `missing`, empty cells are allowed and become NaN.

    Raises:
        DataError: If the file cannot be read; the message names row and column.
    """
    rows = [row for row in read_cells(Path(path), "check the path", "utf-8-sig") if row]
    if not rows:
        raise DataError("is empty", where=str(path))
    names, units = _header(rows[0], path)
    values = np.empty((len(rows) - 1, len(names)))
    for index, row in enumerate(rows[1:]):
        if len(row) != len(names):
            raise DataError(
                f"has {len(row)} cells", where=f"{path}, row {index + 2}", allowed=f"{len(names)}"
            )
        values[index] = [_number(cell) for cell in row]
    for index, column in np.argwhere(~np.isfinite(values)):
        cell = rows[index + 1][column].strip()
        if cell or column == 0 or not missing:
            where = f"{path}, row {index + 2}, column {names[column]}"
            shown = f"'{cell}'" if cell else "empty"
            raise DataError(f"is {shown}", where=where, allowed="a finite number")
    time = values[:, 0]
    if time.size == 0:
        raise DataError("has no rows below its header", where=str(path))
    late = np.flatnonzero(np.diff(time) <= 0.0)
    if late.size:
        raise DataError("time does not increase", where=f"{path}, row {late[0] + 3}, column time")
    return Trajectory(time, tuple(names[1:]), values[:, 1:], tuple(units[1:]))


def _header(row: list[str], path: str | Path) -> tuple[list[str], list[str]]:
    """Return names and units of the columns; the first must be time [s]."""
    names, units = [], []
    for column, cell in enumerate(row, start=1):
        match = _HEADER.match(cell)
        if not match:
            raise DataError(
                f"'{cell}' is no column header",
                where=f"{path}, row 1, column {column}",
                allowed="name [unit], e.g. hip_r [rad]",
            )
        names.append(match["name"])
        units.append(match["unit"].strip())
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice:
        raise DataError(f"has column {twice} twice", where=f"{path}, row 1")
    if (names[0], units[0]) != ("time", "s"):
        raise DataError(
            f"starts with '{row[0]}'", where=f"{path}, row 1, column 1", allowed="time [s]"
        )
    return names, units


def _number(cell: str) -> float:
    """Return the number in a cell, NaN where there is none."""
    try:
        return float(cell)
    except ValueError:
        return math.nan
