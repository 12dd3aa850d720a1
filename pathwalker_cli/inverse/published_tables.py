"""Tables 1 and 3 of the article, recomputed with the published evaluation's own method.

References:
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023, tables 1 and 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np
from scipy.signal import butter, filtfilt

from pathwalker_cli.conventions import COORDINATES, LEG_JOINTS, SUFFIX, Side
from pathwalker_cli.inverse.bands import resampled
from pathwalker_cli.inverse.cycles import GaitCycle, gait_cycles
from pathwalker_cli.inverse.published import EVENT_SHIFT, forward_difference
from pathwalker_cli.inverse.residuals import ResidualRange, Residuals, residual_range
from pathwalker_cli.inverse.strengths import Peak, extension_peaks
from pathwalker_cli.io.c3d import Recording

__all__ = [
    "AVERAGED_TRIALS",
    "PublishedTrial",
    "flagged_cycles",
    "published_residuals",
    "published_strengths",
]

AVERAGED_TRIALS: Final = {
    "barefoot": ("3053176", "3053178", "3053179", "3053183", "3053184"),
    "orthosis": ("3053141", "3053142", "3053144", "3053146"),
}
"""Trials whose inverse dynamics the published evaluation averages."""


@dataclass(frozen=True)
class PublishedTrial:
    """A trial with the generalised forces of `published_torques`.

    Args:
        recording: The recording.
        q: Coordinates [m, rad], shape (n, 10).
        tau: Generalised forces [N, N m], shape (n, 10).
    """

    recording: Recording
    q: np.ndarray
    tau: np.ndarray


def flagged_cycles(recording: Recording) -> tuple[GaitCycle, ...]:
    """Return the first gait cycle of each side for which the file holds a ground reaction force.

    Frames are those of the published evaluation.
    """
    found: dict[Side, GaitCycle] = {}
    for cycle in gait_cycles(recording.events):
        label = f"{cycle.side[0].upper()}GroundReactionForce"
        if label in recording.markers and cycle.side not in found:
            start, off, end = (f + EVENT_SHIFT for f in (cycle.start, cycle.toe_off, cycle.end))
            found[cycle.side] = GaitCycle(cycle.side, start, off, end)
    return tuple(found.values())


def published_residuals(trials: tuple[PublishedTrial, ...], body_mass: float) -> ResidualRange:
    """Return table 3: residuals per body mass [N/kg, N m/kg], which the article prints as N, N m.

    Args:
        trials: The averaged trials of one condition.
        body_mass: Mass of the patient [kg].
    """
    found = []
    for trial in trials:
        means = [
            trial.tau[cycle.start : cycle.end + 1, :3].mean(axis=0)
            for cycle in flagged_cycles(trial.recording)
        ]
        mean = np.mean(means, axis=0)
        found.append(Residuals(trial.recording.name, mean, np.abs(mean), len(trial.tau)))
    return residual_range(tuple(found), per=body_mass)


def published_strengths(trials: tuple[PublishedTrial, ...]) -> tuple[Peak, ...]:
    """Return the extension strengths behind table 1, as far as the article tells how.

    Torque, angle and speed of the flagged cycles are averaged over the cycle and then filtered
    (Butterworth, third order, 0.2 of the Nyquist frequency, there and back).

    Args:
        trials: The averaged barefoot trials.
    """
    curves: dict[str, list[np.ndarray]] = {}
    for trial in trials:
        speed = forward_difference(trial.q, trial.recording.rate)
        for cycle in flagged_cycles(trial.recording):
            for joint in LEG_JOINTS:
                name = f"{joint}_{SUFFIX[cycle.side]}"
                column = COORDINATES.index(name)
                parts = [values[cycle.start : cycle.end + 1, column]
                         for values in (trial.tau, trial.q, speed)]  # fmt: skip
                curves.setdefault(name, []).append(resampled(np.stack(parts, axis=1)))
    b, a = butter(3, 0.2)
    means = {name: filtfilt(b, a, np.mean(found, axis=0), axis=0) for name, found in curves.items()}
    return extension_peaks(means, _counts(curves))


def _counts(curves: Mapping[str, list[np.ndarray]]) -> dict[str, int]:
    """Return the number of curves per coordinate."""
    return {name: len(found) for name, found in curves.items()}
