"""Generalised forces that explain a motion under measured ground forces."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Side, force_unit
from pathwalker_cli.inverse.filters import MOTION_CUTOFF, smooth_rates
from pathwalker_cli.inverse.forces import GroundForces
from pathwalker_cli.trajectory import Trajectory

__all__ = ["gait_torques", "inverse_dynamics"]


def inverse_dynamics(
    model: pin.Model,
    q: np.ndarray,
    v: np.ndarray,
    vdot: np.ndarray,
    force: Mapping[Side, np.ndarray],
    centre: Mapping[Side, np.ndarray],
) -> np.ndarray:
    """Return generalised forces by recursive Newton-Euler, frame by frame.

    The first three are the residuals on the pelvis, which a perfect model would not need.  A
    force that is NaN (not measured) makes the torques of that leg and the residuals NaN and leaves
    the other leg and the lumbar joint as they are.

    Args:
        model: The walker.
        q: Coordinates [m, rad], shape (n, 10).
        v: Velocities [m/s, rad/s], shape (n, 10).
        vdot: Accelerations [m/s^2, rad/s^2], shape (n, 10).
        force: Per side, ground reaction force on the foot (forward, up) [N], shape (n, 2).
        centre: Per side, forward position of the centre of pressure on the ground [m], shape (n,);
            may be NaN where the force is zero.

    Returns:
        Generalised forces [N, N m] in the order of `COORDINATES`, shape (n, 10).
    """
    data: Any = model.createData()
    tau = np.empty_like(v)
    feet = {side: model.getJointId(f"ankle_{SUFFIX[side]}") for side in SIDES}
    wrenches = {side: _wrench(force[side], centre[side]) for side in force}
    external = pin.StdVec_Force()
    for _ in range(model.njoints):
        external.append(pin.Force.Zero())
    for frame in range(q.shape[0]):
        pin.forwardKinematics(model, data, q[frame])
        for side, wrench in wrenches.items():
            foot = feet[side]
            external[foot] = data.oMi[foot].actInv(pin.Force(wrench[frame]))
        tau[frame] = pin.rnea(model, data, q[frame], v[frame], vdot[frame], external)
    return tau


def gait_torques(
    model: pin.Model, motion: Trajectory, forces: GroundForces, cutoff: float = MOTION_CUTOFF
) -> Trajectory:
    """Return residuals and joint torques of a recorded motion, NaN where a force is not measured.

    Args:
        model: The walker.
        motion: Its coordinates in every frame, from `inverse_kinematics`.
        forces: The forces on both feet in the same frames.
        cutoff: Cut-off frequency of the motion [Hz].

    Returns:
        Generalised forces in the order of `COORDINATES`.
    """
    q, v, vdot = smooth_rates(motion, cutoff)
    tau = inverse_dynamics(model, q, v, vdot, forces.force, forces.centre)
    units = tuple(force_unit(name) for name in COORDINATES)
    return Trajectory(motion.time, COORDINATES, tau, units)


def _wrench(force: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return force and moment about the world's origin, shape (n, 6), of forces on the ground."""
    wrench = np.zeros((force.shape[0], 6))
    wrench[:, 0] = force[:, 0]
    wrench[:, 2] = force[:, 1]
    lever = np.where(force[:, 1] == 0.0, 0.0, centre)
    wrench[:, 4] = -lever * force[:, 1]
    return wrench
