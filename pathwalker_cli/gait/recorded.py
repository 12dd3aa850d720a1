"""Strides of a recording: one closed to be periodic, to start from, or one as it was, to follow.

Recordings know foot strikes and toe-offs; when heels lift and toes land follows from their heights
in a passage to follow, equation (8), and is a share of the time between in a start.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np
from scipy.interpolate import CubicSpline

from pathwalker_cli.config import StartConfig
from pathwalker_cli.conventions import CONTACT_POINTS, COORDINATES, coordinate_unit
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.io.recordings import CompactRecording, read_recording, start_names
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.problem import Sample
from pathwalker_cli.trajectory import Trajectory

_EVENTS: Final = (
    ("left", "toe_off"),
    ("left", "foot_strike"),
    ("right", "toe_off"),
    ("right", "foot_strike"),
)
"""Events in the order of the phases; each begins the next pair of phases."""

_TX, _TZ = COORDINATES.index("pelvis_tx"), COORDINATES.index("pelvis_tz")


def start_recording(walker: Walker, config: StartConfig) -> CompactRecording:
    """Return the recording that a config names, or the first one that holds a whole stride.

    Raises:
        DataError: If there is none.
    """
    patient, condition = walker.patient, config.condition
    names = (config.trial,) if config.trial else start_names(patient, condition)
    for name in names:
        recording = read_recording(patient, condition, name)
        if config.trial or _whole_stride(recording) is not None:
            return recording
    raise DataError(
        f"patient {patient.id} has no {condition} recording of a whole stride",
        mend="import C3D files first, or set start.gait to synthetic",
    )


def recorded_stride(walker: Walker, recording: CompactRecording) -> ReferenceStride:
    """Return the first whole stride of a recording, closed to be periodic.

    The mismatch between both ends is spread over the stride, time is turned so that left toe-off
    comes first, and the pelvis is set so high that the soles touch the ground.

    Raises:
        DataError: If no whole stride was recorded.
    """
    stride = _whole_stride(recording)
    if stride is None:
        raise DataError(
            f"recording {recording.name} holds no whole stride (toe-offs and strikes of both feet)",
            mend="choose another start.trial",
        )
    first, frames = stride
    time = recording.motion.time[frames[0] : frames[-1] + 1]
    values = recording.motion.values[frames[0] : frames[-1] + 1]
    period, share = time[-1] - time[0], (time - time[0]) / (time[-1] - time[0])
    drift = values[-1] - values[0]
    distance, drift[_TX] = drift[_TX], 0.0
    values = values - share[:, None] * drift
    gaps = np.roll(np.diff(recording.motion.time[frames]), first)
    toe_off = float(gaps[first:].sum()) if first else 0.0
    closed = _turned(time - time[0], values, distance, period, toe_off)
    pairs = zip(gaps, choices.PHASE_SPLITS, strict=True)
    durations = np.array([part for gap, s in pairs for part in (gap * s, gap - gap * s)])
    closed[:, _TX] -= closed[0, _TX]
    closed[:, _TZ] -= walker.as_recorded.foot_points(closed)[..., 1].min(axis=-1).mean()
    grid = np.linspace(0.0, period, len(closed))
    phases, name = walker.pattern.durations(durations), f"recording {recording.name}"
    return ReferenceStride(name, _of_all_joints(walker, grid, closed), phases)


def recorded_passage(walker: Walker, recording: CompactRecording) -> ReferenceStride:
    """Return the first stride of a recording from left toe-off to left toe-off, as recorded.

    Foot strikes and toe-offs are the events of the recording; a heel has left, and a toe has met,
    the ground where it passes 1 cm above its level in stance.  The last toe-off may come from the
    height of the toe too: recordings often end before it.

    Raises:
        DataError: If the recording holds no such stride.
    """
    motion = recording.motion
    heights = walker.as_recorded.foot_points(motion.values)[..., 1]
    cuts = _phase_frames(_passage_frames(recording), heights, recording.name)
    part = slice(cuts[0], cuts[-1] + 1)
    values = motion.values[part].copy()
    values[:, _TX] -= values[0, _TX]
    # the plantar points of a standing foot are the ground, wherever the markers put it
    values[:, _TZ] -= float(np.median(heights[part].min(axis=1)))
    time = motion.time[part] - motion.time[cuts[0]]
    durations = walker.pattern.durations(np.diff(motion.time[cuts]))
    name = f"recording {recording.name} from {motion.time[cuts[0]]:.4f} s"
    return ReferenceStride(name, _of_all_joints(walker, time, values), durations)


def _of_all_joints(walker: Walker, time: np.ndarray, values: np.ndarray) -> Trajectory:
    """Return recorded coordinates (n, 10) with those of further joints at 0."""
    names = walker.skeleton.coordinates
    units = tuple(map(coordinate_unit, names))
    return Trajectory(time, names, walker.skeleton.completed(values), units)


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


def _event_runs(recording: CompactRecording) -> Iterator[tuple[int, list[int]]]:
    """Yield for every event which of `_EVENTS` it is, and the frames of up to five in that order.

    Other events break a run off.
    """
    events = sorted(recording.events, key=lambda event: event.frame)
    kinds = [(event.side, event.kind) for event in events]
    for i, kind in enumerate(kinds):
        first, count = _EVENTS.index(kind), 1
        while count < 5 and kinds[i + count : i + count + 1] == [_EVENTS[(first + count) % 4]]:
            count += 1
        yield first, [event.frame for event in events[i : i + count]]


def _whole_stride(recording: CompactRecording) -> tuple[int, list[int]] | None:
    """Return which event begins the first whole stride, and the frames of its five events."""
    return next((run for run in _event_runs(recording) if len(run[1]) == 5), None)


def _passage_frames(recording: CompactRecording) -> list[int]:
    """Return the frames of the five events from left toe-off to left toe-off, or the first four."""
    for first, frames in _event_runs(recording):
        if first == 0 and len(frames) >= 4:
            return frames
    raise DataError(
        f"recording {recording.name} holds no stride from left toe-off to right foot strike",
        mend="choose another start.trial",
    )


def _turned(
    time: np.ndarray, values: np.ndarray, distance: float, period: float, begin: float
) -> np.ndarray:
    """Return a periodic stride sampled from another instant of it on."""
    at = begin + np.linspace(0.0, period, len(time))
    laps = np.floor_divide(at, period)
    result = np.array(CubicSpline(time, values)(at - laps * period))
    result[:, _TX] += laps * distance
    return result


def _phase_frames(frames: list[int], heights: np.ndarray, name: str) -> list[int]:
    """Return the frames at which the eight phases begin, and the frame at which the last ends."""
    off_l, strike_l, off_r, strike_r = frames[:4]
    height = dict(zip(CONTACT_POINTS, heights.T, strict=True))

    def level(point: str, begin: int, end: int) -> float:
        return float(height[point][begin : end + 1].min()) + choices.LIFTED

    def first(mask: np.ndarray, begin: int, otherwise: int) -> int:
        hits = np.flatnonzero(mask[begin:])
        return begin + int(hits[0]) if hits.size else otherwise

    def lifted(heel: str, begin: int, end: int) -> int:
        return first(height[heel] > level(heel, begin, end), begin, end)

    last = len(heights) - 1
    toe_l, toe_r = level("toe_l", strike_l, strike_r), level("toe_r", off_l, strike_l)
    end = frames[4] if len(frames) > 4 else first(height["toe_l"] > toe_l, strike_r, last)
    cuts = [
        off_l,
        lifted("heel_r", off_l, strike_l),
        strike_l,
        first(height["toe_l"] < toe_l, strike_l, off_r),
        off_r,
        lifted("heel_l", off_r, strike_r),
        strike_r,
        first(height["toe_r"] < toe_r, strike_r, end),
        end,
    ]
    room = [choices.FEWEST_FRAMES * k for k in range(len(cuts))]
    spread = np.maximum.accumulate(np.array(cuts) - room) + room
    if spread[-1] > last:
        raise DataError(
            f"recording {name} ends before its stride does", mend="choose another start.trial"
        )
    return [int(k) for k in spread]
