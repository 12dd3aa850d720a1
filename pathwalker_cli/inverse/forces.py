"""Ground reaction force and centre of pressure of each foot from the force plates.

A force counts only if one foot alone, and all of it, stood on one plate; everything else is NaN,
which means "not measured".  A foot in the air has zero force.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import GRAVITY, SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import Stance, stances, swings
from pathwalker_cli.inverse.direction import WalkingPlane
from pathwalker_cli.inverse.filters import FORCE_CUTOFF, low_pass, smooth_rates
from pathwalker_cli.inverse.plates import PlateLoad, centre_of_pressure, plate_load
from pathwalker_cli.inverse.stance_checks import (
    EDGE,
    LOADED,
    Evidence,
    StanceForce,
    judge,
    outside,
)
from pathwalker_cli.io.c3d import ForcePlate, Recording
from pathwalker_cli.io.recordings import FORCE_COLUMNS
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "BOTH",
    "GroundForces",
    "foot_extents",
    "foot_points",
    "force_columns",
    "ground_forces",
    "plate_direction",
]

BOTH: Final[tuple[Side, Side]] = ("right", "left")

_FAR: Final = 0.2
"""Distance beyond which it does not matter how far a load lies from a foot [m]."""


@dataclass(frozen=True)
class GroundForces:
    """Forces on both feet.

    Args:
        time: Time of the frames [s], shape (n,).
        force: Per side, force on the foot (forward, up) [N], NaN where not measured, shape (n, 2).
        centre: Per side, forward position of the centre of pressure [m], NaN without load, (n,).
        stances: What is known about every stance.
        plane: How the walking direction lies in the plates' laboratory axes.
    """

    time: np.ndarray
    force: dict[Side, np.ndarray]
    centre: dict[Side, np.ndarray]
    stances: tuple[StanceForce, ...]
    plane: WalkingPlane

    def trajectory(self) -> Trajectory:
        """Return the forces as `FORCE_COLUMNS`."""
        return force_columns(self.time, self.force, self.centre)


def force_columns(
    time: np.ndarray, force: Mapping[Side, np.ndarray], centre: Mapping[Side, np.ndarray]
) -> Trajectory:
    """Return forces as the columns force_r_x, force_r_z, cop_r_x and the same on the left.

    Args:
        time: Time of the frames [s], shape (n,).
        force: Per side, force on the foot (forward, up) [N], shape (n, 2).
        centre: Per side, forward position of the centre of pressure [m], shape (n,).
    """
    columns = [column for side in BOTH for column in (*force[side].T, centre[side])]
    values = np.stack(columns, axis=1)
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
        plane: How the walking direction lies in the plates' laboratory axes; found from where the
            loads lie under the feet if left out.
        cutoff: Cut-off frequency of the plate channels [Hz].

    Raises:
        DataError: If the recording has no force plates.
    """
    if not recording.plates:
        raise DataError("has no force plates", where=recording.name)
    loads = [_load(plate, recording, cutoff) for plate in recording.plates]
    feet = foot_extents(model, motion.values)
    found = stances(recording.events)
    plane = plane or plate_direction(loads, feet, found)
    up = np.stack([load.force[:, 2] for load in loads], axis=1)
    points = np.stack(
        [plane.project(centre_of_pressure(load, LOADED))[:, 0] for load in loads], axis=1
    )
    seen = Evidence(recording.events, up, points, feet, _carried(model, motion))
    judged = tuple(judge(stance, seen) for stance in found)
    force, centre = _compose(recording, judged, [plane.project(x.force) for x in loads], points)
    return GroundForces(recording.time, force, centre, judged, plane)


def foot_extents(model: pin.Model, q: np.ndarray) -> dict[Side, np.ndarray]:
    """Return the forward positions of heel and toe [m] per side, each of shape (n, 2)."""
    found = foot_points(model, q)[:, :, 0]
    return {"right": found[:, :2], "left": found[:, 2:]}


def foot_points(model: pin.Model, q: np.ndarray) -> np.ndarray:
    """Return right heel and toe, left heel and toe (forward, up) [m] in poses, shape (n, 4, 2)."""
    data: Any = model.createData()
    frames = [model.getFrameId(f"{p}_{SUFFIX[s]}") for s in SIDES for p in ("heel", "toe")]
    found = np.empty((q.shape[0], len(frames), 3))
    for row, pose in enumerate(q):
        pin.framesForwardKinematics(model, data, pose)
        found[row] = [data.oMf[frame].translation for frame in frames]
    return found[:, :, [0, 2]]


def plate_direction(
    loads: list[PlateLoad],
    feet: Mapping[Side, np.ndarray],
    found: tuple[Stance, ...],
) -> WalkingPlane:
    """Return the laboratory direction of walking for which the loads lie under the standing feet.

    Markers may have been turned into the walking plane while the plates were left as they were,
    so the markers' direction does not tell.

    Args:
        loads: Loads of the plates at the marker frames.
        feet: Heel and toe per side [m].
        found: The stances; if none loads a plate, the direction does not matter and is +x.
    """
    standing = {side: np.full(feet[side].shape, np.nan) for side in SIDES}
    for stance in found:
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
    judged: tuple[StanceForce, ...],
    forces: list[np.ndarray],
    points: np.ndarray,
) -> tuple[dict[Side, np.ndarray], dict[Side, np.ndarray]]:
    """Return force and centre of pressure per side from measured stances and swings."""
    frames = recording.positions.shape[0]
    force: dict[Side, np.ndarray] = {}
    centre: dict[Side, np.ndarray] = {}
    for side in BOTH:
        force[side] = np.full((frames, 2), np.nan)
        centre[side] = np.full(frames, np.nan)
        for off, strike in swings(recording.events, side):
            force[side][off + 1 : strike] = 0.0
    for item in judged:
        if item.plate is None or not item.measured:
            continue
        side, plate = item.stance.side, item.plate
        rows = np.arange(max(item.stance.strike - EDGE, 0), min(item.stance.toe_off + EDGE, frames))
        loaded = np.isfinite(points[rows, plate])
        force[side][rows] = np.where(loaded[:, None], forces[plate][rows], 0.0)
        centre[side][rows] = points[rows, plate]
    return force, centre
