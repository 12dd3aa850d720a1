"""Tables of a run: states, controls, ground forces and torques over time, SI units and radians."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import (
    GENERATORS,
    SIDES,
    SUFFIX,
    coordinate_unit,
    velocity_unit,
)
from pathwalker_cli.io.atomic import atomic_path
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.trajectory_csv import write_trajectory
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import centre_of_pressure
from pathwalker_cli.trajectory import Trajectory

DIGITS: Final = 9
"""Significant digits: finer than the solver's tolerance, so nothing is lost on the way."""

Column = tuple[str, str, np.ndarray]
"""Name, unit and values, shape (n,)."""


def states_table(series: GaitSeries) -> Trajectory:
    """Return coordinates, velocities and activations over time."""
    names = series.walker.skeleton.coordinates
    return _table(
        series,
        _columns(names, "", coordinate_unit, series.q),
        _columns(names, "_velocity", velocity_unit, series.v),
        _columns(GENERATORS, "_activation", "1", series.activation),
    )


def controls_table(series: GaitSeries) -> Trajectory:
    """Return excitations and activation rates over time."""
    return _table(
        series,
        _columns(GENERATORS, "_excitation", "1", series.excitation),
        _columns(GENERATORS, "_activation_rate", "1/s", series.activation_rate),
    )


def forces_table(series: GaitSeries) -> Trajectory:
    """Return ground reaction forces on the body over time.

    Per contact point, summed per foot, and the forward position of each foot's centre of pressure,
    NaN where the foot is not loaded; then those of cuffs that yield on the legs.
    """
    feet: list[Column] = []
    for side in SIDES:
        feet += [
            (f"foot_{SUFFIX[side]}_x", "N", series.forward_force(side)),
            (f"foot_{SUFFIX[side]}_z", "N", series.vertical_force(side)),
            (f"centre_of_pressure_{SUFFIX[side]}_x", "m", centre_of_pressure(series, side)),
        ]
    for side in series.walker.shelled:
        pair = series.cuff_force[:, 2 * SIDES.index(side) :].T
        names = (f"cuff_{SUFFIX[side]}_{way}" for way in ("across", "along"))
        feet += [(name, "N", force) for name, force in zip(names, pair, strict=False)]
    return _table(series, _columns(series.walker.pattern.force_names, "", "N", series.force), feet)


def torques_table(series: GaitSeries) -> Trajectory:
    """Return torques of generators, orthoses and tissue, and the sum per joint over time."""
    orthoses = [f"orthosis_{SUFFIX[side]}" for side in SIDES]
    skeleton = series.walker.skeleton
    joints = [name for name in skeleton.coordinates if name not in skeleton.root]
    net = series.joint_torque[:, [skeleton.index(name) for name in joints]]
    return _table(
        series,
        _columns(GENERATORS, "_torque", "N m", series.muscle_torque),
        _columns(orthoses, "_torque", "N m", series.orthosis_torque),
        [(f"{name}_passive_torque", "N m", x) for name, x in series.passive_torque.items()],
        _columns(joints, "_net_torque", "N m", net),
    )


def _columns(
    names: Iterable[str], end: str, unit: str | Callable[[str], str], values: np.ndarray
) -> list[Column]:
    """Return the columns of an array, shape (n, m), each named and with its unit."""
    return [
        (f"{name}{end}", unit if isinstance(unit, str) else unit(name), column)
        for name, column in zip(names, values.T, strict=True)
    ]


def _table(series: GaitSeries, *groups: list[Column]) -> Trajectory:
    names, units, values = zip(*(column for group in groups for column in group), strict=True)
    return Trajectory(series.time, names, np.column_stack(values), units)


def _write_states(path: str | Path, series: GaitSeries) -> None:
    """Write time, phase, coordinates, velocities and activations."""
    table = states_table(series)
    names = (f"{name} [{unit}]" for name, unit in zip(table.names, table.units, strict=True))
    rows = zip(table.time.tolist(), series.phase, table.values.tolist(), strict=True)
    cells = ([time, phase, *values] for time, phase, values in rows)
    write_table(Path(path), ["time [s]", "phase", *names], cells)


def _write(table: Callable[[GaitSeries], Trajectory], path: str | Path, series: GaitSeries) -> None:
    """Write a table in one stroke; no centre of pressure where a foot is not loaded."""
    with atomic_path(path) as temporary:
        write_trajectory(temporary, table(series), DIGITS)


TABLES: Final[dict[str, Callable[[str | Path, GaitSeries], None]]] = {
    "states.csv": _write_states,
    "controls.csv": partial(_write, controls_table),
    "forces.csv": partial(_write, forces_table),
    "torques.csv": partial(_write, torques_table),
}
"""File names and what writes them."""
