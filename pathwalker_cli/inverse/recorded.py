"""The `recorded` block of a patient's file: what gait was like over all trials of a condition."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import SIDES, Condition, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import gait_cycles, joint_ranges, step_lengths, walking_speed
from pathwalker_cli.inverse.filters import frame_rate
from pathwalker_cli.inverse.forces import foot_extents
from pathwalker_cli.io.c3d import Event
from pathwalker_cli.io.recordings import CompactRecording
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Recorded
from pathwalker_cli.trajectory import Trajectory

__all__ = ["recorded", "trial_steps"]


def recorded(
    patient: Patient, condition: Condition, trials: Sequence[CompactRecording]
) -> Recorded:
    """Return the ranges of walking speed, step length and joint angles over trials.

    Speed is the mean over each recording; a step reaches from flat heel to flat heel; angles are
    those of complete gait cycles, unfiltered.

    Args:
        patient: The patient.
        condition: What was worn.
        trials: The trials.

    Raises:
        DataError: If the trials show no complete gait cycle or no step of a side.
    """
    speeds = [walking_speed(trial.motion) for trial in trials]
    model = pinocchio_model(patient, condition)
    each = [trial_steps(model, trial.motion, trial.events) for trial in trials]
    steps = {side: [length for found in each for length in found[side]] for side in SIDES}
    ranges = joint_ranges(tuple((trial.motion, gait_cycles(trial.events)) for trial in trials))
    if not ranges or not all(steps.values()):
        raise DataError(f"{condition} trials of {patient.id} show no complete cycle and step")
    return Recorded.model_validate(
        {
            "walking_speed": {
                "mean": _rounded(np.mean(speeds)),
                "min": _rounded(min(speeds)),
                "max": _rounded(max(speeds)),
            },
            "step_length": {
                side: {"min": _rounded(min(lengths)), "max": _rounded(max(lengths))}
                for side, lengths in steps.items()
            },
            "joint_ranges": {
                name: (_rounded(low), _rounded(high)) for name, (low, high) in ranges.items()
            },
        }
    )


def trial_steps(
    model: pin.Model, motion: Trajectory, events: tuple[Event, ...]
) -> dict[Side, tuple[float, ...]]:
    """Return the step lengths of a trial per side [m]."""
    heels = {side: ends[:, 0] for side, ends in foot_extents(model, motion.values).items()}
    return step_lengths(events, heels, frame_rate(motion))


def _rounded(value: float | np.floating) -> float:
    """Return a value to the millimetre or milliradian."""
    return round(float(value), 3)
