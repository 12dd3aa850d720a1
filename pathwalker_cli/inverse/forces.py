"""From force plates to the ground reaction force and centre of pressure of each foot.

A force counts only if one foot alone, and all of it, stood on one plate; everything else is NaN,
which means "not measured".  A foot in the air has zero force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import GRAVITY, SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import stances, swings
from pathwalker_cli.inverse.dynamics import FORCE_CUTOFF, low_pass, smooth_rates
from pathwalker_cli.inverse.markers import WalkingPlane
from pathwalker_cli.inverse.stance_checks import (
    EDGE,
    LOADED,
    Evidence,
    StanceForce,
    judge,
    outside,
)
from pathwalker_cli.io.c3d import Event, ForcePlate, Recording
from pathwalker_cli.io.recordings import FORCE_COLUMNS
from pathwalker_cli.trajectory import Trajectory

_FAR: Final = 0.2
"""Distance beyond which it does not matter how far a load lies from a foot [m]."""


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


@dataclass(frozen=True)
class GroundForces:
    """Forces on both feet.

    Args:
        table: Columns of `FORCE_COLUMNS` in every frame, NaN where not measured (centre of
            pressure: or without load).
        stances: What is known about every stance.
        plane: How the walking direction lies in the plates' laboratory axes.
    """

    table: Trajectory
    stances: tuple[StanceForce, ...]
    plane: WalkingPlane


def force_columns(time: np.ndarray, feet: Mapping[Side, np.ndarray]) -> Trajectory:
    """Return the table of ground forces.

    Args:
        time: Time of the frames [s], shape (n,).
        feet: Per side, force forward and up [N] and centre of pressure forward [m], shape (n, 3).
    """
    values = np.hstack([feet[side] for side in SIDES])
    return Trajectory(time, tuple(FORCE_COLUMNS), values, tuple(FORCE_COLUMNS.values()))


def ground_forces(
    recording: Recording,
    model: pin.Model,
    motion: Trajectory,
    plane: WalkingPlane | None = None,
    cutoff: float = FORCE_CUTOFF,
) -> GroundForces:
    """Return the forces on both feet over the frames of a recording.

    Args:
        recording: The recording.
        model: The walker, for the extents of its feet and its weight.
        motion: Its coordinates in every frame, from `inverse_kinematics`.
        plane: How the walking direction lies in the plates' laboratory axes; that in which the
            loads lie under the feet if left out.
        cutoff: Cut-off frequency of the plate channels [Hz].

    Raises:
        DataError: If the recording has no force plates.
    """
    if not recording.plates:
        raise DataError("has no force plates", where=recording.name)
    loads = [_load(plate, recording, cutoff) for plate in recording.plates]
    feet = foot_extents(model, motion.values)
    plane = plane or plate_direction(loads, feet, recording.events)
    up = np.stack([load.force[:, 2] for load in loads], axis=1)
    points = np.stack(
        [plane.project(centre_of_pressure(load, LOADED))[:, 0] for load in loads], axis=1
    )
    seen = Evidence(recording.events, up, points, feet, _carried(model, motion))
    judged = tuple(judge(stance, seen) for stance in stances(recording.events))
    table = _compose(recording, judged, [plane.project(load.force) for load in loads], points)
    return GroundForces(table, judged, plane)


def foot_extents(model: pin.Model, q: np.ndarray) -> dict[Side, np.ndarray]:
    """Return the forward positions of heel and toe [m] per side, each of shape (n, 2)."""
    return {side: points[..., 0] for side, points in foot_points(model, q).items()}


def foot_points(model: pin.Model, q: np.ndarray) -> dict[Side, np.ndarray]:
    """Return heel and toe (forward, up) [m] per side in poses (n, 10), each of shape (n, 2, 2)."""
    data: Any = model.createData()
    frames = [model.getFrameId(f"{p}_{SUFFIX[s]}") for s in SIDES for p in ("heel", "toe")]
    points = np.empty((len(q), len(frames), 3))
    for row, pose in enumerate(q):
        pin.framesForwardKinematics(model, data, pose)
        points[row] = [data.oMf[frame].translation for frame in frames]
    each = np.split(points[:, :, [0, 2]], len(SIDES), axis=1)
    return dict(zip(SIDES, each, strict=True))


def plate_direction(
    loads: Sequence[PlateLoad], feet: Mapping[Side, np.ndarray], events: Sequence[Event]
) -> WalkingPlane:
    """Return the laboratory direction of walking for which the loads lie under the standing feet.

    Markers may have been turned into the walking plane while the plates were left as they were,
    so the markers' direction does not tell.

    Args:
        loads: Loads of the plates at the marker frames.
        feet: Heel and toe per side [m].
        events: Foot strikes and toe-offs; without a stance that loads a plate, the direction does
            not matter and is +x.
    """
    standing = {side: np.full(feet[side].shape, np.nan) for side in SIDES}
    for stance in stances(events):
        rows = slice(stance.strike, stance.toe_off)
        standing[stance.side][rows] = feet[stance.side][rows]
    misses: list[tuple[float, WalkingPlane]] = []
    for plane in (WalkingPlane(axis, sign) for axis in (0, 1) for sign in (1, -1)):
        points = [plane.project(centre_of_pressure(load, 5.0 * LOADED))[:, 0] for load in loads]
        gaps = np.array([[outside(point, standing[side]) for side in SIDES] for point in points])
        nearest = np.fmin(gaps[:, 0], gaps[:, 1])
        seen = nearest[np.isfinite(nearest)]
        if seen.size:
            misses.append((float(np.minimum(seen, _FAR).mean()), plane))
    return min(misses, key=lambda item: item[0])[1] if misses else WalkingPlane(0, 1)


def _load(plate: ForcePlate, recording: Recording, cutoff: float) -> PlateLoad:
    """Return the load at the marker frames, unloaded level removed and filtered."""
    channels = plate.channels
    idle = np.abs(channels[:, 4:].sum(axis=1)) < LOADED
    if idle.any():
        channels = channels - np.median(channels[idle], axis=0)
    per_frame = recording.samples_per_frame
    smooth = low_pass(channels, recording.rate * per_frame, cutoff)
    return plate_load(plate, smooth[::per_frame][: recording.positions.shape[0]])


def _carried(model: pin.Model, motion: Trajectory) -> np.ndarray:
    """Return the vertical force that the motion of the centre of mass takes [N], shape (n,)."""
    data: Any = model.createData()
    q, v, vdot = smooth_rates(motion)
    up = np.empty(q.shape[0])
    for row in range(up.size):
        pin.centerOfMass(model, data, q[row], v[row], vdot[row])
        up[row] = data.acom[0][2]
    return pin.computeTotalMass(model) * (GRAVITY + up)


def _compose(
    recording: Recording,
    judged: Sequence[StanceForce],
    forces: Sequence[np.ndarray],
    points: np.ndarray,
) -> Trajectory:
    """Return force and centre of pressure of both feet from measured stances and swings."""
    frames = recording.positions.shape[0]
    feet = {side: np.full((frames, 3), np.nan) for side in SIDES}
    for side, foot in feet.items():
        for off, strike in swings(recording.events, side):
            foot[off + 1 : strike, :2] = 0.0
    for item in judged:
        if item.plate is not None and item.measured:
            rows = slice(max(item.stance.strike - EDGE, 0), item.stance.toe_off + EDGE)
            point = points[rows, item.plate]
            force = np.where(np.isfinite(point)[:, None], forces[item.plate][rows], 0.0)
            feet[item.stance.side][rows] = np.column_stack([force, point])
    return force_columns(recording.time, feet)
