"""Ground forces and rates exactly as in the published evaluation, with its shortcuts.

For comparison only: no filter, no gating, sensor depth ignored, each foot carries one plate's force
over the whole trial, rates are forward differences, events two frames early, and only three of the
trials in which the patient walks along the laboratory's +y are turned round.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, and the evaluation published with it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.direction import WalkingPlane
from pathwalker_cli.inverse.dynamics import inverse_dynamics
from pathwalker_cli.inverse.plates import plate_load, wrench_axis_at_ground
from pathwalker_cli.io.c3d import Event, Recording

__all__ = [
    "EVENT_SHIFT",
    "TURNED",
    "PublishedForces",
    "forward_difference",
    "published_forces",
    "published_torques",
]

EVENT_SHIFT: Final = -2
"""Frames by which the published evaluation reads every event too early."""

TURNED: Final = frozenset({"3053176", "3053178", "3053183"})
"""Trials that the published evaluation knows as walked along the laboratory's +y."""


@dataclass(frozen=True)
class PublishedForces:
    """Forces as the published evaluation applies them.

    Args:
        force: Per side, ground reaction force (forward, up) [N], shape (n, 2).
        centre: Per side, forward position of the centre of pressure [m], shape (n,).
        plate: Per side, index of the plate that was picked.
    """

    force: dict[Side, np.ndarray]
    centre: dict[Side, np.ndarray]
    plate: dict[Side, int]


def published_forces(recording: Recording) -> PublishedForces:
    """Return the forces on both feet as the published evaluation has them."""
    plane = WalkingPlane(axis=1, sign=1 if recording.name in TURNED else -1)
    loads = [
        plate_load(plate, _frame_means(plate.channels, recording.samples_per_frame))
        for plate in recording.plates
    ]
    picked = {side: _pick(recording, [load.force for load in loads], side) for side in SIDES}
    force, centre = {}, {}
    for side, index in picked.items():
        force[side] = plane.project(loads[index].force)
        centre[side] = plane.project(wrench_axis_at_ground(loads[index]))[:, 0]
    return PublishedForces(force, centre, picked)


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


def _pick(recording: Recording, forces: list[np.ndarray], side: str) -> int:
    """Return the plate with the largest squared force in the first stance of a side."""
    first, last = _first_stance(recording, side)
    return int(np.argmax([(force[first : last + 1] ** 2).sum() for force in forces]))


def _first_stance(recording: Recording, side: str) -> tuple[int, int]:
    """Return the published frames of the first strike of a side and of its next toe-off."""
    events: list[Event] = [event for event in recording.events if event.side == side]
    strikes = [event.frame + EVENT_SHIFT for event in events if event.kind == "foot_strike"]
    for event in events:
        off = event.frame + EVENT_SHIFT
        if event.kind == "toe_off" and strikes and off > strikes[0]:
            return strikes[0], off
    raise DataError(f"has no stance of the {side} foot", where=recording.name)


def forward_difference(values: np.ndarray, rate: float) -> np.ndarray:
    """Return forward differences per second; the last value is repeated."""
    differences = np.diff(values, axis=0) * rate
    return np.concatenate([differences, differences[-1:]])


def published_torques(
    model: pin.Model, recording: Recording, q: np.ndarray
) -> tuple[np.ndarray, PublishedForces]:
    """Return generalised forces [N, N m], shape (n, 10), and the forces that they explain.

    Args:
        model: The published walker (`pinocchio_model(..., published=True)`).
        recording: The recording.
        q: Coordinates in every frame; the published torques follow from the published angles with
            their six printed digits, which forward differences magnify to a few newtons.
    """
    forces = published_forces(recording)
    v = forward_difference(q, recording.rate)
    vdot = forward_difference(v, recording.rate)
    return inverse_dynamics(model, q, v, vdot, forces.force, forces.centre), forces
