"""A predicted stride as the tables of other programs.

All but the points have the instants of the run's own tables: what the solver found, not what lies
between.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from pathwalker_cli.conventions import (
    COORDINATES,
    ROOT,
    SIDES,
    SUFFIX,
    coordinate_unit,
    force_unit,
    velocity_unit,
)
from pathwalker_cli.export.osim import joint_path, optimal_forces
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.opensim import force_table, torque_table
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import body_points
from pathwalker_cli.trajectory import Trajectory

RATE: Final = 100.0
"""Frames per second of the points [1/s], as motion capture has them."""

_UNLOADED: Final = 1e-6
"""Force up to which a foot has no centre of pressure of its own [N]: the solver's tolerance."""


def motion_table(series: GaitSeries) -> Trajectory:
    """Return all coordinates [m, rad]."""
    names = series.walker.skeleton.coordinates
    return Trajectory(series.time, names, series.q, tuple(map(coordinate_unit, names)))


def state_table(series: GaitSeries) -> Trajectory:
    """Return coordinates, speeds and accelerations [SI] under OpenSim's names of its states."""
    coordinates = series.walker.skeleton.coordinates
    paths = [joint_path(name) for name in coordinates]
    names = [f"{path}/{what}" for what in ("value", "speed", "accel") for path in paths]
    rates = list(map(velocity_unit, coordinates))
    units = [*map(coordinate_unit, coordinates), *rates, *(f"{unit}^2" for unit in rates)]
    values = np.hstack([series.q, series.v, series.vdot])
    return Trajectory(series.time, tuple(names), values, tuple(units))


def ground_force_table(series: GaitSeries) -> Trajectory:
    """Return force and point of application of each foot, see `io.opensim.force_table`.

    The point is the centre of pressure, as high as the place that bears friction: within the errors
    of the mesh on the floor, and so that the moment is that of the run.
    """
    columns: dict[str, np.ndarray] = {}
    for side in SIDES:
        foot, rows = SUFFIX[side], series.walker.pattern.rows(side)
        along, up = series.force[:, ::2][:, rows], series.force[:, 1::2][:, rows]
        places = series.contact_position[:, rows]
        columns |= {
            f"force_{foot}_x": series.forward_force(side),
            f"force_{foot}_z": series.vertical_force(side),
            f"cop_{foot}_x": _centre(up, places[..., 0]),
            f"cop_{foot}_z": _centre(np.abs(along), places[..., 1]),
        }
    units = ("N", "N", "m", "m") * len(SIDES)
    values = np.column_stack(list(columns.values()))
    return force_table(Trajectory(series.time, tuple(columns), values, units))


def _centre(forces: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return the mean of places [m] weighed by forces [N], each (n, k), shape (n,)."""
    total, centre = forces.sum(axis=1), places.mean(axis=1)
    return np.divide((forces * places).sum(axis=1), total, out=centre, where=total > _UNLOADED)


def net_torque_table(series: GaitSeries) -> Trajectory:
    """Return the torques of muscles, tissue and orthoses together [N, N m], zero at the pelvis.

    Columns are those of OpenSim's inverse dynamics.
    """
    names = series.walker.skeleton.coordinates
    units = tuple(map(force_unit, names))
    return torque_table(Trajectory(series.time, names, series.net_torque, units))


def control_table(series: GaitSeries) -> Trajectory:
    """Return the controls of the model's actuators: torque over optimal force [-]."""
    walker = series.walker
    torques = dict(zip((m.name for m in walker.muscles), series.muscle_torque.T, strict=True))
    torques |= {f"passive_{name}": torque for name, torque in series.passive_torque.items()}
    forces = {name: force for name, (_, force) in optimal_forces(walker).items()}
    values = np.column_stack([torques[name] / force for name, force in forces.items()])
    names = tuple(f"/forceset/{name}" for name in forces)
    return Trajectory(series.time, names, values, ("1",) * len(names))


def points(series: GaitSeries, name: str) -> Recording:
    """Return where joints, heels and toes are, `RATE` frames a second, as a recording."""
    frames = np.arange(int(series.duration * RATE) + 1) / RATE
    places = body_points(series.walker, motion_table(series).at(frames))
    ends = (point.name for point in series.walker.parts.frames)
    markers = (*(name for name in COORDINATES if name not in ROOT), *ends)
    positions = np.zeros((frames.size, len(markers), 3))
    positions[..., [0, 2]] = np.stack([places[marker] for marker in markers], axis=1)
    return Recording(name, RATE, markers, positions, (), (), 1)
