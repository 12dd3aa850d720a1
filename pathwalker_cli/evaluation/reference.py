"""The recorded stride with which a gait is compared at equal time."""

from __future__ import annotations

from dataclasses import dataclass

from pathwalker_cli.errors import DataError
from pathwalker_cli.evaluation.paper import PATIENT, REFERENCE_STRIDES
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.inverse.trials import Trial
from pathwalker_cli.trajectory import Trajectory

__all__ = ["ReferenceStride", "article_stride", "left_toe_off_stride", "reference_stride"]


@dataclass(frozen=True)
class ReferenceStride:
    """A recorded stride from the instant in which the left toe leaves the ground.

    Args:
        trial: Name of its trial.
        motion: Coordinates over time from 0 on.
    """

    trial: str
    motion: Trajectory


def article_stride(recorded: RecordedGait, from_toe_off: bool = False) -> ReferenceStride | None:
    """Return the stride with which the article's programs compared, None for other recordings.

    Args:
        recorded: The recordings.
        from_toe_off: Whether to begin at the left toe-off before it, if the recording gives one;
            barefoot this is one frame earlier.
    """
    walker = recorded.walker
    rows = REFERENCE_STRIDES[walker.condition]
    trial = recorded.trial(rows.trial) if walker.patient.id == PATIENT else None
    if trial is None:
        return None
    offs = [off for off in _left_toe_offs(trial) if off <= rows.first]
    first = max(offs) if from_toe_off and offs else rows.first
    return ReferenceStride(trial.name, _rows(trial.motion, first, rows.last))


def reference_stride(recorded: RecordedGait, name: str | None = None) -> ReferenceStride | None:
    """Return the recorded stride to compare with at equal time.

    For the patient of the article it is that of the article, from the left toe-off on.

    Args:
        recorded: The recordings.
        name: Name of the trial; the article's, or the first with such a stride, if left out.

    Returns:
        The stride, or None if no trial was named and none shows such a stride.

    Raises:
        DataError: If there is no such trial, or it shows no such stride.
    """
    walker = recorded.walker
    if name is not None and recorded.trial(name) is None:
        raise DataError(
            f"patient {walker.patient.id} has no {walker.condition} recording '{name}'",
            allowed=", ".join(each.name for each in recorded.trials),
        )
    article = article_stride(recorded, from_toe_off=True)
    if article is not None and name in (None, article.trial):
        return article
    strides = [each for each in map(left_toe_off_stride, recorded.trials) if each is not None]
    if name is None:
        return strides[0] if strides else None
    found = next((each for each in strides if each.trial == name), None)
    if found is None:
        raise DataError(
            "shows no stride from a left toe-off to the next one",
            where=f"recording {name}",
            allowed=", ".join(each.trial for each in strides) or "no recording shows one",
        )
    return found


def left_toe_off_stride(trial: Trial) -> ReferenceStride | None:
    """Return the first stride of a trial from one left toe-off to the next, or None."""
    offs = _left_toe_offs(trial)
    if len(offs) < 2:
        return None
    return ReferenceStride(trial.name, _rows(trial.motion, offs[0], offs[1]))


def _left_toe_offs(trial: Trial) -> list[int]:
    """Return the frames in which the left toe leaves the ground."""
    return [e.frame for e in trial.events if (e.side, e.kind) == ("left", "toe_off")]


def _rows(motion: Trajectory, first: int, last: int) -> Trajectory:
    """Return some rows of a motion, the last one included, with time from 0 on."""
    rows = slice(first, last + 1)
    time = motion.time[rows] - motion.time[first]
    return Trajectory(time, motion.names, motion.values[rows], motion.units)
