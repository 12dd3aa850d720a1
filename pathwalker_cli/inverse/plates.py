"""Force, moment and centre of pressure of Kistler plates in laboratory axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.io.c3d import ForcePlate

__all__ = [
    "PlateLoad",
    "centre_of_pressure",
    "plate_channels",
    "plate_load",
    "wrench_axis_at_ground",
]


@dataclass(frozen=True)
class PlateLoad:
    """What a plate measures, at its sensors' level below its centre.

    Args:
        force: Ground reaction force on the body [N], laboratory axes, shape (samples, 3).
        moment: Moment about the plate's centre at the sensors' level [N m], laboratory axes.
        centre: Centre of the plate's surface in the laboratory [m], shape (3,).
        depth: Depth of the sensors below the surface [m].
    """

    force: np.ndarray
    moment: np.ndarray
    centre: np.ndarray
    depth: float


def plate_load(plate: ForcePlate, channels: np.ndarray | None = None) -> PlateLoad:
    """Return the load of a plate from its eight channels.

    Args:
        plate: The plate.
        channels: Its channels, already filtered or averaged [N], shape (samples, 8); those of the
            plate if left out.
    """
    x12, x34, y14, y23, z1, z2, z3, z4 = (plate.channels if channels is None else channels).T
    a, b = plate.half_length, plate.half_width
    force = np.stack([x12 + x34, y14 + y23, z1 + z2 + z3 + z4], axis=-1)
    moment = np.stack(
        [
            b * (z1 + z2 - z3 - z4),
            a * (-z1 + z2 + z3 - z4),
            b * (-x12 + x34) + a * (y14 - y23),
        ],
        axis=-1,
    )
    axes = _axes(plate.corners)
    return PlateLoad(force @ axes, moment @ axes, plate.corners.mean(axis=0), plate.depth)


def plate_channels(
    force: np.ndarray, point: np.ndarray, half_length: float, half_width: float, depth: float
) -> np.ndarray:
    """Return the channels of a plate that carries a force at a point; the inverse of `plate_load`.

    Args:
        force: Force on the body in the plate's axes [N], shape (samples, 3).
        point: Where it acts on the surface, from the centre along the plate's x and y [m],
            shape (samples, 2).
        half_length: Distance of the sensors from the centre along x [m].
        half_width: Distance of the sensors from the centre along y [m].
        depth: Depth of the sensors below the surface [m].

    Returns:
        x12, x34, y14, y23, z1, z2, z3, z4 [N], shape (samples, 8), without moment about z.
    """
    fx, fy, fz = force.T
    x, y = point.T
    across, along = (y * fz + depth * fy) / half_width, -(x * fz + depth * fx) / half_length
    corners = [fz + across - along, fz + across + along, fz - across + along, fz - across - along]
    return np.stack([fx / 2, fx / 2, fy / 2, fy / 2, *(z / 4 for z in corners)], axis=1)


def _axes(corners: np.ndarray) -> np.ndarray:
    """Return the plate's unit axes in the laboratory, one a row."""
    x = corners[0] - corners[1]
    z = np.cross(x, corners[0] - corners[3])
    y = np.cross(z, x)
    return np.stack([axis / np.linalg.norm(axis) for axis in (x, y, z)])


def centre_of_pressure(load: PlateLoad, least_force: float) -> np.ndarray:
    """Return where the force's line of action meets the plate's surface [m], shape (samples, 3).

    Without a moment about a horizontal axis at the surface; NaN where the vertical force is below
    `least_force` [N].
    """
    fx, fy, fz = load.force.T
    mx, my, _ = load.moment.T
    with np.errstate(divide="ignore", invalid="ignore"):
        x = -(my + load.depth * fx) / fz
        y = (mx - load.depth * fy) / fz
    point = np.stack([x, y, np.zeros_like(fz)], axis=-1) + load.centre
    point[fz < least_force] = np.nan
    return point


def wrench_axis_at_ground(load: PlateLoad) -> np.ndarray:
    """Return the published evaluation's centre of pressure [m], shape (samples, 3).

    It is the point of the wrench's axis that is nearest to the plate's centre, F x M / |F|^2, set
    down to z = 0; the depth of the sensors is not considered.
    """
    square = (load.force**2).sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        point = np.cross(load.force, load.moment) / square + load.centre
    point[:, 2] = 0.0
    return point
