"""One container for every time series: measured motion, initial guess and result."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline


@dataclass(frozen=True)
class Trajectory:
    """Named columns over time.

    Args:
        time: Strictly increasing instants [s], shape (n,).
        names: Column names, m of them.
        values: SI units and radians, shape (n, m).
        units: Unit of each column, m of them.

    Raises:
        ValueError: If the shapes do not fit or time does not increase.
    """

    time: np.ndarray
    names: tuple[str, ...]
    values: np.ndarray
    units: tuple[str, ...]

    def __post_init__(self) -> None:
        """Check the shapes and make the arrays read-only."""
        time = np.array(self.time, dtype=float)
        values = np.array(self.values, dtype=float)
        if values.shape != (time.size, len(self.names)) or len(self.units) != len(self.names):
            raise ValueError(
                f"shapes do not fit: time {time.shape}, values {values.shape}, "
                f"{len(self.names)} names, {len(self.units)} units"
            )
        if time.size > 1 and not np.all(np.diff(time) > 0):
            raise ValueError("time must increase from row to row")
        for array in (time, values):
            array.setflags(write=False)
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "names", tuple(self.names))
        object.__setattr__(self, "units", tuple(self.units))

    @property
    def duration(self) -> float:
        """Time between the first and the last row [s]."""
        return float(self.time[-1] - self.time[0])

    def __getitem__(self, name: str) -> np.ndarray:
        """Return the column of that name, shape (n,)."""
        return self.values[:, self.names.index(name)]

    def select(self, names: tuple[str, ...]) -> Trajectory:
        """Return the trajectory of these columns only, in this order."""
        index = [self.names.index(name) for name in names]
        units = tuple(self.units[i] for i in index)
        return Trajectory(self.time, tuple(names), self.values[:, index], units)

    def at(self, time: np.ndarray) -> np.ndarray:
        """Return values by cubic spline at these instants [s], shape (len(time), m)."""
        return np.asarray(CubicSpline(self.time, self.values, axis=0)(time))

    def rates_at(self, time: np.ndarray) -> np.ndarray:
        """Return time derivatives by cubic spline at these instants [s], shape (len(time), m)."""
        return np.asarray(CubicSpline(self.time, self.values, axis=0)(time, 1))
