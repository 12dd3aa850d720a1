"""Tables of a run: states, controls, ground forces and torques over time, SI units and radians."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import (
    CONTACT_FORCES,
    COORDINATES,
    GENERATORS,
    ROOT,
    SIDES,
    SUFFIX,
    coordinate_unit,
    velocity_unit,
)
from pathwalker_cli.io.atomic import atomic_open, atomic_path
from pathwalker_cli.io.trajectory_csv import write_trajectory
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import centre_of_pressure
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "TABLES",
    "controls_table",
    "forces_table",
    "states_table",
    "torques_table",
    "write_controls_csv",
    "write_forces_csv",
    "write_states_csv",
    "write_torques_csv",
]

DIGITS: Final = 9
"""Significant digits: finer than the solver's tolerance, so nothing is lost on the way."""

Column = tuple[str, str, np.ndarray]
"""Name, unit and values, shape (n,)."""


def states_table(series: GaitSeries) -> Trajectory:
    """Return coordinates, velocities and activations over time."""
    q, v, activation = series.q.T, series.v.T, series.activation.T
    return _table(
        series,
        [(n, coordinate_unit(n), x) for n, x in zip(COORDINATES, q, strict=True)]
        + [(f"{n}_velocity", velocity_unit(n), x) for n, x in zip(COORDINATES, v, strict=True)]
        + [(f"{n}_activation", "1", x) for n, x in zip(GENERATORS, activation, strict=True)],
    )


def controls_table(series: GaitSeries) -> Trajectory:
    """Return excitations and activation rates over time."""
    excitation, rate = series.excitation.T, series.activation_rate.T
    return _table(
        series,
        [(f"{n}_excitation", "1", x) for n, x in zip(GENERATORS, excitation, strict=True)]
        + [(f"{n}_activation_rate", "1/s", x) for n, x in zip(GENERATORS, rate, strict=True)],
    )


def forces_table(series: GaitSeries) -> Trajectory:
    """Return ground reaction forces on the body over time.

    Per contact point, summed per foot, and the forward position of each foot's centre of pressure,
    NaN where the foot is not loaded.
    """
    columns: list[Column] = [
        (name, "N", force) for name, force in zip(CONTACT_FORCES, series.force.T, strict=True)
    ]
    for side in SIDES:
        columns += [
            (f"foot_{SUFFIX[side]}_x", "N", series.forward_force(side)),
            (f"foot_{SUFFIX[side]}_z", "N", series.vertical_force(side)),
            (f"centre_of_pressure_{SUFFIX[side]}_x", "m", centre_of_pressure(series, side)),
        ]
    return _table(series, columns)


def torques_table(series: GaitSeries) -> Trajectory:
    """Return torques of generators and orthoses and their sum per joint over time."""
    muscle, orthosis, net = series.muscle_torque.T, series.orthosis_torque.T, series.net_torque.T
    joints = [(i, name) for i, name in enumerate(COORDINATES) if name not in ROOT]
    return _table(
        series,
        [(f"{n}_torque", "N m", x) for n, x in zip(GENERATORS, muscle, strict=True)]
        + [
            (f"orthosis_{SUFFIX[side]}_torque", "N m", x)
            for side, x in zip(SIDES, orthosis, strict=True)
        ]
        + [(f"{name}_net_torque", "N m", net[i]) for i, name in joints],
    )


def write_states_csv(path: str | Path, series: GaitSeries) -> None:
    """Write time, phase, coordinates, velocities and activations."""
    table = states_table(series)
    names = zip(table.names, table.units, strict=True)
    rows = zip(table.time, series.phase, table.values, strict=True)
    with atomic_open(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(["time [s]", "phase", *(f"{name} [{unit}]" for name, unit in names)])
        for time, phase, values in rows:
            writer.writerow([_text(time), phase, *map(_text, values)])


def write_controls_csv(path: str | Path, series: GaitSeries) -> None:
    """Write excitations and activation rates."""
    _write(path, controls_table(series))


def write_forces_csv(path: str | Path, series: GaitSeries) -> None:
    """Write ground reaction forces; no centre of pressure where a foot is not loaded."""
    _write(path, forces_table(series))


def write_torques_csv(path: str | Path, series: GaitSeries) -> None:
    """Write torques of generators and orthoses and their sum per joint."""
    _write(path, torques_table(series))


TABLES: Final = {
    "states.csv": write_states_csv,
    "controls.csv": write_controls_csv,
    "forces.csv": write_forces_csv,
    "torques.csv": write_torques_csv,
}
"""File names and what writes them."""


def _table(series: GaitSeries, columns: list[Column]) -> Trajectory:
    """Return columns as a trajectory."""
    names, units, values = zip(*columns, strict=True)
    return Trajectory(series.time, names, np.column_stack(values), units)


def _write(path: str | Path, table: Trajectory) -> None:
    """Write a table in one stroke."""
    with atomic_path(path) as temporary:
        write_trajectory(temporary, table, DIGITS)


def _text(value: float) -> str:
    """Return a number as text."""
    return f"{value:.{DIGITS}g}"
