"""The rates of a filtered motion, and the generalised forces that explain it."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, force_unit
from pathwalker_cli.io.recordings import foot_columns
from pathwalker_cli.trajectory import Trajectory

MOTION_CUTOFF: Final = 6.0
"""Cut-off of joint angles [Hz]; usual for walking (Winter 2009, section 3.4)."""

FORCE_CUTOFF: Final = 20.0
"""Cut-off of plate channels [Hz]: keeps the load's rise, removes the plates' ringing."""

_ORDER: Final = 2
"""Order of the filter in each direction; there and back makes four."""


def low_pass(values: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """Return columns after a zero-lag Butterworth filter of fourth order.

    Args:
        values: Samples, shape (n, ...).
        rate: Samples per second [1/s].
        cutoff: Frequency at which half of the power passes each way [Hz], below half of `rate`.
    """
    sections = butter(_ORDER, cutoff, fs=rate, output="sos")
    return np.asarray(sosfiltfilt(sections, values, axis=0))


def frame_rate(motion: Trajectory) -> float:
    """Return the frames per second of an evenly sampled motion [1/s]."""
    return (motion.time.size - 1) / motion.duration


def smooth_rates(
    motion: Trajectory, cutoff: float = MOTION_CUTOFF
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return filtered values with their first and second derivatives, each of shape (n, m).

    The motion is evenly sampled; the cut-off frequency is in Hz.
    """
    smooth = low_pass(motion.values, frame_rate(motion), cutoff)
    spline = CubicSpline(motion.time, smooth, axis=0)
    return smooth, np.asarray(spline(motion.time, 1)), np.asarray(spline(motion.time, 2))


def inverse_dynamics(
    model: pin.Model, q: np.ndarray, v: np.ndarray, vdot: np.ndarray, forces: Trajectory
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
        forces: Columns of `FORCE_COLUMNS` in n frames; the centre of pressure may be NaN where the
            force is zero.

    Returns:
        Generalised forces [N, N m] in the order of `COORDINATES`, shape (n, 10).
    """
    data: Any = model.createData()
    tau = np.empty_like(v)
    wrenches = {
        model.getJointId(f"ankle_{SUFFIX[side]}"): _wrench(
            *forces.select(foot_columns(side)).values.T
        )
        for side in SIDES
    }
    external = pin.StdVec_Force()
    for _ in range(model.njoints):
        external.append(pin.Force.Zero())
    for frame in range(q.shape[0]):
        pin.forwardKinematics(model, data, q[frame])
        for foot, wrench in wrenches.items():
            external[foot] = data.oMi[foot].actInv(pin.Force(wrench[frame]))
        tau[frame] = pin.rnea(model, data, q[frame], v[frame], vdot[frame], external)
    return tau


def generalised_forces(time: np.ndarray, tau: np.ndarray) -> Trajectory:
    """Return generalised forces [N, N m], shape (n, 10), over the time of the frames [s]."""
    return Trajectory(time, COORDINATES, tau, tuple(force_unit(name) for name in COORDINATES))


def _wrench(forward: np.ndarray, up: np.ndarray, centre: np.ndarray) -> np.ndarray:
    """Return force and moment about the world's origin, shape (n, 6), of forces on the ground."""
    moment = -np.where(up == 0.0, 0.0, centre) * up
    none = np.zeros_like(up)
    return np.stack([forward, none, up, none, moment, none], axis=1)
