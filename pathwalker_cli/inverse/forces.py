"""From force plates to the ground reaction force and centre of pressure of each foot.

A force counts only if one foot alone, and all of it, stood on one plate; everything else is NaN,
which means "not measured".  A foot in the air has zero force.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import GRAVITY, SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import stances, swings
from pathwalker_cli.inverse.dynamics import FORCE_CUTOFF, low_pass, smooth_rates
from pathwalker_cli.inverse.plate_checks import Footprint, plate_faults
from pathwalker_cli.inverse.stance_checks import (
    EDGE,
    Evidence,
    StanceForce,
    judge,
    off_plate,
    outside,
)
from pathwalker_cli.inverse.walk import about_vertical, turned
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.c3d_plates import LOADED, ForcePlate, centre_of_pressure
from pathwalker_cli.io.recordings import FORCE_COLUMNS
from pathwalker_cli.model.contact import POINTS
from pathwalker_cli.model.urdf import frame_positions
from pathwalker_cli.trajectory import Trajectory

_FAR: Final = 0.2
"""Distance beyond which it does not matter how far a load lies from a foot [m]."""

_TOES: Final = 0.39
"""How far toes reach beyond the toe marker on the second metatarsal head, as a share of heel to toe
marker: the head lies at 72 % of the foot's length."""

_HOW_TO_MEND: Final = "; import --mend-plates, or mend_plates: true in a config, mends it"

_HEADINGS: Final = {"+x": (1.0, 0.0), "-x": (-1.0, 0.0), "+y": (0.0, 1.0), "-y": (0.0, -1.0)}


@dataclass(frozen=True)
class GroundForces:
    """Forces on both feet.

    Args:
        table: Columns of `FORCE_COLUMNS` in every frame, NaN where not measured (centre of
            pressure: or without load).
        stances: What is known about every stance.
        remarks: What was found wrong with the plates, a sentence each.
        loads: The plates with x along the walk and their loads in every frame, filtered.
    """

    table: Trajectory
    stances: tuple[StanceForce, ...]
    remarks: tuple[str, ...] = ()
    loads: tuple[ForcePlate, ...] = ()


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
    aside: Mapping[Side, np.ndarray] | None = None,
    ahead: Mapping[Side, np.ndarray] | None = None,
    mend: bool = False,
) -> GroundForces:
    """Return the forces on both feet over the frames of a recording.

    Args:
        recording: The recording; its plates have x along the walk if `aside` is given.
        model: The walker, for the extents of its feet and its weight.
        motion: Its coordinates in every frame, from `inverse_kinematics`.
        aside: Per side, sideways position of the foot [m], shape (n,).  Without it the markers
            were laid into the walking plane, and the plates are turned to that of their axes for
            which the loads lie under the feet.
        ahead: Per side, how far the foot stood ahead of the walker's [m], shape (n,); the centre of
            pressure is given where it is under the walker's foot.
        mend: Whether to mend plates that are not stored as they stand.

    Raises:
        DataError: If the recording has no force plates.
    """
    if not recording.plates:
        raise DataError("has no force plates", where=recording.name)
    feet = foot_extents(model, motion.values)
    if ahead is not None:
        feet = {side: ends + ahead[side][:, None] for side, ends in feet.items()}
    loads = plate_loads(recording)
    if aside is None:
        direction = plate_direction(loads, feet, recording.events)
        axes = about_vertical(np.array(_HEADINGS[direction]))
        loads = list(turned(replace(recording, plates=tuple(loads)), axes).plates)
    weight = GRAVITY * pin.computeTotalMass(model)
    prints = _footprints(model, feet, aside)
    faults = plate_faults(loads, stances(recording.events), prints, weight)
    done, how = ("mended", "") if mend else ("not used", _HOW_TO_MEND)
    remarks = tuple(f"{loads[f.plate].name} is {done}: {f.what}{how}" for f in faults)
    for fault in faults if mend else ():
        loads[fault.plate] = fault.mended
    points = np.stack([centre_of_pressure(load, LOADED)[:, 0] for load in loads], axis=1)
    seen = Evidence(
        recording.events,
        np.stack([load.force[:, 2] for load in loads], axis=1),
        points,
        prints,
        _carried(model, motion),
        {side: off_plate(foot, loads) for side, foot in prints.items()},
        {} if mend else {fault.plate: fault.what for fault in faults},
        recording.first_frame,
    )
    judged = tuple(judge(stance, seen) for stance in stances(recording.events))
    table = _compose(recording, judged, [load.force[:, [0, 2]] for load in loads], points, ahead)
    return GroundForces(table, judged, remarks, tuple(loads))


def plate_loads(recording: Recording) -> list[ForcePlate]:
    """Return the plates with their loads at the marker frames, unloaded level removed, filtered."""
    per_frame, frames = recording.samples_per_frame, recording.positions.shape[0]
    loads = []
    for plate in recording.plates:
        wrench = np.hstack([plate.force, plate.moment])
        idle = np.abs(plate.force[:, 2]) < LOADED
        if idle.any():
            wrench = wrench - np.median(wrench[idle], axis=0)
        smooth = low_pass(wrench, recording.rate * per_frame, FORCE_CUTOFF)[::per_frame][:frames]
        loads.append(replace(plate, force=smooth[:, :3], moment=smooth[:, 3:]))
    return loads


def _footprints(
    model: pin.Model, feet: Mapping[Side, np.ndarray], aside: Mapping[Side, np.ndarray] | None
) -> dict[Side, Footprint]:
    """Return where both feet are on the ground, toes included."""
    neutral = foot_points(model, np.zeros((1, model.nq)))
    prints = {}
    for side, ends in feet.items():
        heel, toe = neutral[side][0]
        length = float(np.linalg.norm(toe - heel))
        sideways = np.full(len(ends), np.nan) if aside is None else aside[side]
        prints[side] = Footprint(ends + np.array([0.0, _TOES * length]), sideways, length)
    return prints


def foot_extents(model: pin.Model, q: np.ndarray) -> dict[Side, np.ndarray]:
    """Return the forward positions of heel and toe [m] per side, each of shape (n, 2)."""
    return {side: points[..., 0] for side, points in foot_points(model, q).items()}


def foot_points(model: pin.Model, q: np.ndarray) -> dict[Side, np.ndarray]:
    """Return heel and toe (forward, up) [m] per side in poses (n, 10), each of shape (n, 2, 2)."""
    points = frame_positions(model, q, [point.name for point in POINTS])
    return dict(zip(SIDES, np.split(points, len(SIDES), axis=1), strict=True))


def plate_direction(
    loads: Sequence[ForcePlate], feet: Mapping[Side, np.ndarray], events: Sequence[Event]
) -> str:
    """Return the laboratory axis along which the loads lie under the standing feet, e.g. "-y".

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
    misses: list[tuple[float, str]] = []
    for name, heading in _HEADINGS.items():
        points = [centre_of_pressure(load, 5.0 * LOADED)[:, :2] @ heading for load in loads]
        gaps = np.array([[outside(point, standing[side]) for side in SIDES] for point in points])
        nearest = np.fmin(gaps[:, 0], gaps[:, 1])
        seen = nearest[np.isfinite(nearest)]
        if seen.size:
            misses.append((float(np.minimum(seen, _FAR).mean()), name))
    return min(misses, key=lambda item: item[0])[1] if misses else "+x"


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
    ahead: Mapping[Side, np.ndarray] | None,
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
            if ahead is not None:
                point = point - ahead[item.stance.side][rows]
            feet[item.stance.side][rows] = np.column_stack([force, point])
    return force_columns(recording.time, feet)
