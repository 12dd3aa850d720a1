"""The recordings of one condition, cut into strides and stances."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

import numpy as np

from pathwalker_cli.conventions import SUFFIX, Side
from pathwalker_cli.inverse.cycles import POINTS, GaitCycle, Stance, resampled, stances
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.trials import Trial, recorded_trials
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.model.walker import Walker

__all__ = ["RecordedGait", "recorded_gait"]


@dataclass(frozen=True)
class RecordedGait:
    """All recordings of a patient in one condition.

    Args:
        walker: The patient's walker in that condition; it carries the weight.
        trials: The trials with angles, events and, where measured, forces and torques.
    """

    walker: Walker
    trials: tuple[Trial, ...]

    def trial(self, name: str) -> Trial | None:
        """Return the trial of this name, or None."""
        return next((each for each in self.trials if each.name == name), None)

    def cycles(self, side: Side) -> Iterator[tuple[Trial, GaitCycle]]:
        """Yield every complete gait cycle of a side with its trial."""
        for trial in self.trials:
            yield from ((trial, cycle) for cycle in trial.cycles if cycle.side == side)

    def stances(self, side: Side) -> Iterator[tuple[Trial, Stance]]:
        """Yield every complete stance of a side with its trial, measured or not."""
        for trial in self.trials:
            yield from ((trial, each) for each in stances(trial.events) if each.side == side)

    def stance_forces(self, side: Side) -> np.ndarray:
        """Return (forward, up) over every measured stance [N], shape (stances, POINTS, 2)."""
        found = [
            resampled(_forces(trial, side)[item.stance.strike : item.stance.toe_off + 1])
            for trial in self.trials
            for item in trial.stances
            if item.measured and item.stance.side == side and trial.forces is not None
        ]
        return _stacked(found)

    def cycle_forces(self, side: Side) -> np.ndarray:
        """Return (forward, up) over every cycle with a measured stance [N], (cycles, POINTS, 2)."""
        return _stacked(
            _over_cycle(_forces(trial, side), cycle)
            for trial, cycle in self.cycles(side)
            if trial.forces is not None
        )

    def cycle_moments(self, side: Side, coordinate: str) -> np.ndarray:
        """Return a net joint moment over every cycle with a measured stance [N m].

        Args:
            side: Side of the cycles.
            coordinate: Coordinate that the moment drives, e.g. "hip_r".

        Returns:
            Shape (cycles, POINTS).
        """
        found = _stacked(
            _over_cycle(trial.tau[coordinate][:, None], cycle)
            for trial, cycle in self.cycles(side)
            if trial.tau is not None
        )
        return found.reshape(-1, POINTS)

    def cycle_angles(self, side: Side, coordinate: str) -> np.ndarray:
        """Return a coordinate over every complete cycle [rad], shape (cycles, POINTS)."""
        found = [
            resampled(trial.motion[coordinate][cycle.start : cycle.end + 1, None])
            for trial, cycle in self.cycles(side)
        ]
        return np.array(found).reshape(-1, POINTS)


def recorded_gait(walker: Walker) -> RecordedGait | None:
    """Return the recordings of the patient in the walker's condition.

    Args:
        walker: The walker; its patient says where the recordings are.

    Returns:
        The recordings, or None if there are none.

    Raises:
        DataError: If a recording cannot be used.
    """
    patient, condition = walker.patient, walker.condition
    if not recording_names(patient, condition):
        return None
    config = InverseDynamicsConfig(
        study="inverse-dynamics", patient=patient.id, conditions=(condition,)
    )
    trials = recorded_trials(config, patient, condition, lambda _: None)
    return RecordedGait(walker, tuple(trials))


def _forces(trial: Trial, side: Side) -> np.ndarray:
    """Return (forward, up) on a foot in every frame [N], NaN where not measured, shape (n, 2)."""
    if trial.forces is None:
        raise ValueError(f"trial {trial.name} has no forces")
    return np.stack([trial.forces[f"force_{SUFFIX[side]}_{axis}"] for axis in "xz"], axis=1)


def _over_cycle(values: np.ndarray, cycle: GaitCycle) -> np.ndarray:
    """Return columns that only measured stances have over a cycle, shape (POINTS, m)."""
    curve = values[cycle.start : cycle.end + 1]
    # At the next strike the foot is still in the air; what follows may not be measured.
    return resampled(np.vstack([curve[:-1], curve[-2:-1]]))


def _stacked(curves: Iterable[np.ndarray]) -> np.ndarray:
    """Return those curves that are known throughout, shape (curves, POINTS, m)."""
    known = [curve for curve in curves if np.isfinite(curve).all()]
    return np.array(known) if known else np.empty((0, 0, 2))
