"""A recorded passage to follow, equation (8): one stride as it was, with its phase times."""

from __future__ import annotations

from typing import Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.io.recordings import CompactRecording
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.problem import Sample
from pathwalker_cli.trajectory import Trajectory

__all__ = ["passage_samples", "recorded_passage"]

_CLEAR: Final = 0.01
"""Height above its level in stance at which a heel or toe counts as lifted [m]."""

_SHORTEST: Final = 2
"""Fewest frames of a phase."""

_WANTED: Final = (
    ("left", "toe_off"),
    ("left", "foot_strike"),
    ("right", "toe_off"),
    ("right", "foot_strike"),
)

_HEEL_R, _TOE_R, _HEEL_L, _TOE_L = range(4)


def recorded_passage(walker: Walker, recording: CompactRecording) -> ReferenceStride:
    """Return the first stride of a recording from left toe-off to left toe-off, as recorded.

    Foot strikes and toe-offs are the events of the recording; a heel has left, and a toe has met,
    the ground where it passes 1 cm above its level in stance.  The last toe-off may come from the
    height of the toe too: recordings often end before it.

    Raises:
        DataError: If the recording holds no such stride.
    """
    frames = _event_frames(recording)
    heights = np.array([walker.contact_points(q)[:, 1] for q in recording.motion.values])
    cuts = _phase_frames(frames, heights, recording.name)
    motion = recording.motion
    part = slice(cuts[0], cuts[-1] + 1)
    values = motion.values[part].copy()
    values[:, 0] -= values[0, 0]
    # the plantar points of a standing foot are the ground, wherever the markers put it
    values[:, 1] -= float(np.median(heights[part].min(axis=1)))
    time = motion.time[part] - motion.time[cuts[0]]
    durations = np.diff(motion.time[cuts])
    name = f"recording {recording.name} from {motion.time[cuts[0]]:.4f} s"
    return ReferenceStride(name, Trajectory(time, motion.names, values, motion.units), durations)


def passage_samples(passage: ReferenceStride) -> tuple[Sample, ...]:
    """Return every recorded frame of a passage as an instant to compare with."""
    ends = np.cumsum(passage.durations)
    starts = np.concatenate([[0.0], ends[:-1]])
    samples = []
    for time, q in zip(passage.trajectory.time, passage.trajectory.values, strict=True):
        i = min(int(np.searchsorted(ends, time, "right")), len(ends) - 1)
        fraction = float(np.clip((time - starts[i]) / passage.durations[i], 0.0, 1.0))
        samples.append(Sample(i, fraction, np.array(q)))
    return tuple(samples)


def _event_frames(recording: CompactRecording) -> list[int]:
    """Return the frames of the five events from left toe-off to left toe-off, or the first four."""
    events = sorted(recording.events, key=lambda event: event.frame)
    kinds = [(event.side, event.kind) for event in events]
    for i in range(len(events) - 3):
        if tuple(kinds[i : i + 4]) == _WANTED:
            more = 5 if kinds[i + 4 : i + 5] == [_WANTED[0]] else 4
            return [event.frame for event in events[i : i + more]]
    raise DataError(
        f"recording {recording.name} holds no stride from left toe-off to right foot strike",
        mend="choose another start.trial",
    )


def _phase_frames(frames: list[int], heights: np.ndarray, name: str) -> list[int]:
    """Return the frames at which the eight phases begin, and the frame at which the last ends."""
    off_l, strike_l, off_r, strike_r = frames[:4]

    def level(point: int, begin: int, end: int) -> float:
        return float(heights[begin : end + 1, point].min()) + _CLEAR

    def first(mask: np.ndarray, begin: int, otherwise: int) -> int:
        hits = np.flatnonzero(mask[begin:])
        return begin + int(hits[0]) if hits.size else otherwise

    last = len(heights) - 1
    toe_l = level(_TOE_L, strike_l, strike_r)
    end = frames[4] if len(frames) > 4 else first(heights[:, _TOE_L] > toe_l, strike_r, last)
    toe_r = level(_TOE_R, off_l, strike_l)
    cuts = [
        off_l,
        first(heights[:, _HEEL_R] > level(_HEEL_R, off_l, strike_l), off_l, strike_l),
        strike_l,
        first(heights[:, _TOE_L] < toe_l, strike_l, off_r),
        off_r,
        first(heights[:, _HEEL_L] > level(_HEEL_L, off_r, strike_r), off_r, strike_r),
        strike_r,
        first(heights[:, _TOE_R] < toe_r, strike_r, end),
        end,
    ]
    room = [_SHORTEST * k for k in range(len(cuts))]
    spread = np.maximum.accumulate(np.array(cuts) - room) + room
    if spread[-1] > last:
        raise DataError(
            f"recording {name} ends before its stride does", mend="choose another start.trial"
        )
    return [int(k) for k in spread]
