"""The article's own evaluation of recorded gait, with its shortcuts.

For comparison only: no filter, no gating, sensor depth ignored, each foot carries one plate's force
over the whole trial, rates are forward differences, events two frames early, and only three of the
trials in which the patient walks along the laboratory's +y are turned round.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, and the evaluation published with it.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.signal import butter, filtfilt

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import GaitCycle, gait_cycles
from pathwalker_cli.inverse.dynamics import inverse_dynamics
from pathwalker_cli.inverse.forces import force_columns
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_plates import ForcePlate
from pathwalker_cli.trajectory import Trajectory

AVERAGED_TRIALS: Final = {
    "barefoot": ("3053176", "3053178", "3053179", "3053183", "3053184"),
    "orthosis": ("3053141", "3053142", "3053144", "3053146"),
}
"""Trials whose inverse dynamics the published evaluation averages."""

EVENT_SHIFT: Final = -2
"""Frames by which the published evaluation reads every event too early."""

TURNED: Final = frozenset({"3053176", "3053178", "3053183"})
"""Trials that the published evaluation knows as walked along the laboratory's +y."""


def published_torques(
    model: pin.Model, recording: Recording, q: np.ndarray
) -> tuple[np.ndarray, Trajectory]:
    """Return generalised forces [N, N m], shape (n, 10), and the forces that they explain.

    Args:
        model: The published walker (`pinocchio_model(..., published=True)`).
        recording: The recording.
        q: Coordinates in every frame; the published torques follow from the published angles with
            their six printed digits, which forward differences magnify to a few newtons.
    """
    forces = _forces(recording)
    v = forward_difference(q, recording.rate)
    vdot = forward_difference(v, recording.rate)
    return inverse_dynamics(model, q, v, vdot, forces), forces


def forward_difference(values: np.ndarray, rate: float) -> np.ndarray:
    """Return forward differences per second; the last value is repeated."""
    differences = np.diff(values, axis=0) * rate
    return np.concatenate([differences, differences[-1:]])


def published_filter(curve: np.ndarray) -> np.ndarray:
    """Return a mean curve over the gait cycle as the published evaluation smooths it.

    Butterworth, third order, 0.2 of the Nyquist frequency, there and back.
    """
    b, a = butter(3, 0.2)
    return np.asarray(filtfilt(b, a, curve, axis=0))


def flagged_cycles(recording: Recording) -> tuple[GaitCycle, ...]:
    """Return the first gait cycle of each side for which the file holds a ground reaction force.

    Frames are those of the published evaluation.
    """
    first: dict[Side, GaitCycle] = {}
    for cycle in gait_cycles(recording.events):
        label = f"{cycle.side[0].upper()}GroundReactionForce"
        if label in recording.stored and cycle.side not in first:
            start, off, end = (f + EVENT_SHIFT for f in (cycle.start, cycle.toe_off, cycle.end))
            first[cycle.side] = GaitCycle(cycle.side, start, off, end)
    return tuple(first.values())


def _forces(recording: Recording) -> Trajectory:
    """Return the forces on both feet as the published evaluation has them."""
    ahead = 1.0 if recording.name in TURNED else -1.0  # along the laboratory's y
    means = [
        _frame_means(np.hstack([plate.force, plate.moment]), recording.samples_per_frame)
        for plate in recording.plates
    ]
    loads = [
        replace(plate, force=mean[:, :3], moment=mean[:, 3:])
        for plate, mean in zip(recording.plates, means, strict=True)
    ]
    feet = {}
    for side in SIDES:
        rows = _first_stance(recording, side)
        load = max(loads, key=lambda load: (load.force[rows] ** 2).sum())
        centre = wrench_axis_at_ground(load)
        feet[side] = np.column_stack(
            [ahead * load.force[:, 1], load.force[:, 2], ahead * centre[:, 1]]
        )
    return force_columns(recording.time, feet)


def _frame_means(channels: np.ndarray, per_frame: int) -> np.ndarray:
    """Return means of the samples around each frame; first and last frame with their slips."""
    half = per_frame // 2
    frames = channels.shape[0] // per_frame
    means = np.empty((frames, channels.shape[1]))
    for frame in range(1, frames - 1):
        middle = frame * per_frame
        means[frame] = channels[middle - half : middle + half + 1].mean(axis=0)
    means[0] = channels[:half].mean(axis=0)
    means[-1] = channels[frames - half : frames].mean(axis=0)
    return means


def _first_stance(recording: Recording, side: Side) -> slice:
    """Return the published frames of the first strike of a side to its next toe-off."""
    events = [event for event in recording.events if event.side == side]
    strikes = [event.frame for event in events if event.kind == "foot_strike"]
    for event in events:
        if event.kind == "toe_off" and strikes and event.frame > strikes[0]:
            return slice(strikes[0] + EVENT_SHIFT, event.frame + EVENT_SHIFT + 1)
    raise DataError(f"has no stance of the {side} foot", where=recording.name)


def wrench_axis_at_ground(load: ForcePlate) -> np.ndarray:
    """Return the published evaluation's centre of pressure [m], shape (samples, 3).

    It is the point of the wrench's axis that is nearest to the plate's centre, F x M / |F|^2, set
    down to z = 0; the depth of the sensors is not considered.
    """
    square = (load.force**2).sum(axis=1, keepdims=True)
    with np.errstate(divide="ignore", invalid="ignore"):
        moment = load.moment - np.cross(load.force, load.origin)  # about the sensors' level
        point = np.cross(load.force, moment) / square + load.centre
    point[:, 2] = 0.0
    return point
