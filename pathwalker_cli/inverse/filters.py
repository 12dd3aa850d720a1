"""Zero-lag low-pass filter and smooth rates of measured signals."""

from __future__ import annotations

from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline
from scipy.signal import butter, sosfiltfilt

from pathwalker_cli.trajectory import Trajectory

__all__ = ["FORCE_CUTOFF", "MOTION_CUTOFF", "frame_rate", "low_pass", "smooth_rates"]

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

    Args:
        motion: Evenly sampled motion.
        cutoff: Cut-off frequency [Hz].
    """
    smooth = low_pass(motion.values, frame_rate(motion), cutoff)
    spline = CubicSpline(motion.time, smooth, axis=0)
    return smooth, np.asarray(spline(motion.time, 1)), np.asarray(spline(motion.time, 2))
