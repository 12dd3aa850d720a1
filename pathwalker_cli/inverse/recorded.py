"""What recorded gait tells of a patient, and its blocks in the patient's file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import SIDES, Condition, Side
from pathwalker_cli.errors import DataError, PatientError
from pathwalker_cli.inverse.cycles import gait_cycles, joint_ranges, step_lengths, walking_speed
from pathwalker_cli.inverse.dynamics import frame_rate
from pathwalker_cli.inverse.forces import foot_extents
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.recordings import CompactRecording
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient, shipped_patients
from pathwalker_cli.patient.blocks import Recorded, Strengths
from pathwalker_cli.trajectory import Trajectory


def recorded(
    patient: Patient, condition: Condition, trials: Sequence[CompactRecording]
) -> Recorded:
    """Return the ranges of walking speed, step length and joint angles over trials.

    Speed is the mean over each recording; a step reaches from flat heel to flat heel; angles are
    those of complete gait cycles, unfiltered.

    Raises:
        DataError: If the trials show no complete gait cycle or no step of a side.
    """
    speeds = [walking_speed(trial.motion) for trial in trials]
    model = pinocchio_model(patient, condition)
    each = [trial_steps(model, trial.motion, trial.events) for trial in trials]
    steps = {side: [length for own in each for length in own[side]] for side in SIDES}
    ranges = joint_ranges(tuple((trial.motion, gait_cycles(trial.events)) for trial in trials))
    if not ranges or not all(steps.values()):
        raise DataError(f"{condition} trials of {patient.id} show no complete cycle and step")
    speed = {"mean": float(np.mean(speeds)), "min": min(speeds), "max": max(speeds)}
    return Recorded.model_validate(
        {
            "walking_speed": {key: _rounded(value) for key, value in speed.items()},
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


def _rounded(value: float) -> float:
    """Return a value to the millimetre or milliradian."""
    return round(value, 3)


def require_own_patient(patient: Patient) -> Path:
    """Return the file of a patient that may be changed.

    Raises:
        PatientError: If the patient comes with PathWalker.
    """
    if patient.source is None or patient.id in shipped_patients():
        raise PatientError(
            f"patient {patient.id} comes with PathWalker and is not changed",
            where="--update-patient",
            mend="copy the file and give the copy another id",
        )
    return patient.source


def recorded_blocks(
    patient: Patient, trials: Sequence[Trial]
) -> dict[Condition, tuple[Recorded, int]]:
    """Return the ranges of recorded gait and the number of trials, per condition.

    Raises:
        DataError: If the trials of a condition show no complete gait cycle.
    """
    blocks = {}
    for condition in dict.fromkeys(trial.condition for trial in trials):
        own = [trial for trial in trials if trial.condition == condition]
        blocks[condition] = (recorded(patient, condition, own), len(own))
    return blocks


def update_patient(
    path: Path,
    strengths: Strengths | None,
    source: str,
    blocks: Mapping[Condition, tuple[Recorded, int]],
) -> None:
    """Put strengths [N m] with their source, and `recorded_blocks`, into a patient's file.

    Strengths that are None, and blocks of no condition, leave what is there.
    """
    text = path.read_text(encoding="utf-8")
    if strengths is not None:
        lines = ["strengths:", f"  # [N m], {source}", *strength_lines(strengths)]
        text = with_block(text, "strengths", lines)
    if blocks:
        text = with_block(text, "recorded", list(_recorded_lines(blocks)))
    with atomic_open(path) as file:
        file.write(text)


def strength_lines(strengths: Strengths) -> list[str]:
    """Return what stands below `strengths:` in a patient's file [N m]."""
    lines = []
    for name, value in strengths.model_dump().items():
        if isinstance(value, dict):
            shown = f"{{right: {value['right']:.4f}, left: {value['left']:.4f}}}"
        else:
            shown = f"{value:.4f}"
        lines.append(f"  {name}: {shown}")
    return lines


def _recorded_lines(blocks: Mapping[Condition, tuple[Recorded, int]]) -> list[str]:
    """Return the block `recorded` of a patient's file."""
    counts = ", ".join(f"{count} {condition}" for condition, (_, count) in blocks.items())
    lines = ["recorded:", f"  # computed by pathwalker id, trials: {counts}"]
    for condition, (block, _) in blocks.items():
        speed, step = block.walking_speed, block.step_length
        lines += [
            f"  {condition}:",
            f"    walking_speed: {{mean: {speed.mean:g}, min: {speed.min:g}, max: {speed.max:g}}}"
            "   # [m/s]",
            "    step_length:   # [m]",
            *(f"      {side}: {{min: {step[side].min:g}, max: {step[side].max:g}}}"
              for side in SIDES),
            "    joint_ranges:   # [rad]",
            *(f"      {name}: [{low:g}, {high:g}]"
              for name, (low, high) in block.joint_ranges.items()),
        ]  # fmt: skip
    return lines


def with_block(text: str, key: str, lines: Sequence[str]) -> str:
    """Return the text of a YAML file with a block in place of the one under a key.

    Comments above the key stay; those within the block go.  A block that is not there yet is
    added at the end.  The key is an outermost one; its line is the first of `lines`.
    """
    old = text.splitlines()
    begin = next((i for i, line in enumerate(old) if re.match(rf"{key}\s*:", line)), None)
    if begin is None:
        return "\n".join([*old, "", *lines]) + "\n"
    end = begin + 1
    while end < len(old) and (not old[end].strip() or old[end][0] in " \t"):
        end += 1
    while not old[end - 1].strip():
        end -= 1
    return "\n".join([*old[:begin], *lines, *old[end:]]) + "\n"
