"""What recorded gait tells of a patient, put into the patient's file."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

from pathwalker_cli.conventions import Condition
from pathwalker_cli.errors import PatientError
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.recorded import recorded
from pathwalker_cli.inverse.recorded_files import strength_lines
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.io.recordings import CompactRecording
from pathwalker_cli.patient import Patient, shipped_patients
from pathwalker_cli.patient.blocks import Recorded, Strengths

__all__ = ["recorded_blocks", "require_own_patient", "update_patient", "with_block"]


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
    patient: Patient, trials: Sequence[StudyTrial]
) -> dict[Condition, tuple[Recorded, int]]:
    """Return the ranges of recorded gait and the number of trials, per condition.

    Raises:
        DataError: If the trials of a condition show no complete gait cycle.
    """
    found: dict[Condition, tuple[Recorded, int]] = {}
    for condition in dict.fromkeys(trial.condition for trial in trials):
        own = [
            CompactRecording(trial.name, trial.motion, trial.events, trial.forces)
            for trial in trials
            if trial.condition == condition
        ]
        found[condition] = (recorded(patient, condition, own), len(own))
    return found


def update_patient(
    path: Path,
    strengths: Strengths | None,
    source: str,
    blocks: Mapping[Condition, tuple[Recorded, int]],
) -> None:
    """Put strengths and ranges of recorded gait into a patient's file.

    Args:
        path: The file.
        strengths: Strengths [N m]; None to keep those that are there.
        source: Where they come from, one line.
        blocks: Ranges and number of trials by condition, from `recorded_blocks`.
    """
    text = path.read_text(encoding="utf-8")
    if strengths is not None:
        lines = ["strengths:", f"  # [N m], {source}", *strength_lines(strengths)]
        text = with_block(text, "strengths", lines)
    if blocks:
        text = with_block(text, "recorded", list(_recorded_lines(blocks)))
    with atomic_open(path) as file:
        file.write(text)


def _recorded_lines(blocks: Mapping[Condition, tuple[Recorded, int]]) -> list[str]:
    """Return the block `recorded` of a patient's file."""
    counts = ", ".join(f"{count} {condition}" for condition, (_, count) in blocks.items())
    lines = ["recorded:", f"  # computed by pathwalker id, trials: {counts}"]
    for condition, (found, _) in blocks.items():
        speed, step = found.walking_speed, found.step_length
        lines += [
            f"  {condition}:",
            f"    walking_speed: {{mean: {speed.mean:g}, min: {speed.min:g}, max: {speed.max:g}}}"
            "   # [m/s]",
            "    step_length:   # [m]",
            *(f"      {side}: {{min: {step[side].min:g}, max: {step[side].max:g}}}"
              for side in ("right", "left")),
            "    joint_ranges:   # [rad]",
            *(f"      {name}: [{low:g}, {high:g}]"
              for name, (low, high) in found.joint_ranges.items()),
        ]  # fmt: skip
    return lines


def with_block(text: str, key: str, lines: Sequence[str]) -> str:
    """Return the text of a YAML file with a block in place of the one under a key.

    Comments above the key stay; those within the block go.  A block that is not there yet is
    added at the end.

    Args:
        text: The text of the file.
        key: The outermost key.
        lines: The block, the key's line among them.
    """
    found = text.splitlines()
    begin = next((i for i, line in enumerate(found) if re.match(rf"{key}\s*:", line)), None)
    if begin is None:
        return "\n".join([*found, "", *lines]) + "\n"
    end = begin + 1
    while end < len(found) and (not found[end].strip() or found[end][0] in " \t"):
        end += 1
    while not found[end - 1].strip():
        end -= 1
    return "\n".join([*found[:begin], *lines, *found[end:]]) + "\n"
