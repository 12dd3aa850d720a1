"""A stride at evenly spaced instants of the right gait cycle: all that an animation shows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.animation.recorded import RecordedFrames, recorded_frames
from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.evaluation.run import run_names, run_notes, stride_of_run
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import body_points, centre_of_pressure, stride_of, switching_times

_CLOSED: Final = 1e-3
"""Difference between beginning and end of a stride [m, rad] below which it repeats itself."""


@dataclass(frozen=True)
class GaitFrames:
    """One stride at n instants i/n of the right gait cycle; SI units, orders as in `conventions`.

    The next stride is the same, `distance` further on.  Positions are (forward, up) in the plane of
    walking, from where the right heel strikes the ground at instant 0.

    Args:
        name: What to call it, e.g. the folder of the run.
        patient: Who walks.
        braced: Sides that wear an orthosis.
        problem: The problem that the stride solves.
        duration: Time of the stride [s].
        distance: Distance of the stride [m].
        weight: Body weight with what is worn [N].
        phase: Name of the phase at each instant, n of them.
        points: Positions of joints, heels, toes, neck and head [m], shape (n, 2) each.
        force: Ground reaction force on each foot [N], shape (n, 2); NaN where it is not loaded.
        pressure: Forward position of each centre of pressure [m], shape (n,); NaN likewise.
        activation: Activation of each muscle torque generator, shape (n, 14).
        notes: What to know about it, one sentence each.
        recorded: A recorded cycle to draw behind it, at the same instants.
    """

    name: str
    patient: str
    braced: tuple[Side, ...]
    problem: str
    duration: float
    distance: float
    weight: float
    phase: tuple[str, ...]
    points: Mapping[str, np.ndarray]
    force: Mapping[Side, np.ndarray]
    pressure: Mapping[Side, np.ndarray]
    activation: np.ndarray
    notes: tuple[str, ...] = ()
    recorded: RecordedFrames | None = None

    @property
    def count(self) -> int:
        """Number of instants n."""
        return len(self.phase)

    @property
    def cycle(self) -> np.ndarray:
        """Instants as shares of the right gait cycle, from 0 to below 1, shape (n,)."""
        return np.arange(self.count) / self.count

    @property
    def walking_speed(self) -> float:
        """Distance over time [m/s]."""
        return self.distance / self.duration

    @cached_property
    def pelvis_height(self) -> float:
        """Mean height of the hips above the ground [m]."""
        return float(self.points["hip_r"][:, 1].mean())

    @property
    def eye(self) -> np.ndarray:
        """Where an eye is that moves on evenly before the hips [m], shape (n,)."""
        return self.middle + self.cycle * self.distance

    @cached_property
    def middle(self) -> float:
        """Where an eye that moves on evenly begins, so that the hips stay before it [m]."""
        return float((self.points["hip_r"][:, 0] - self.cycle * self.distance).mean())


def run_frames(
    folders: Sequence[Path], rate: float, recorded: str | None = None
) -> tuple[GaitFrames, ...]:
    """Return the strides of converged runs at the same shares of their gait cycles.

    The first has so many instants per second [1/s], and the trial `recorded` behind it.

    Raises:
        DataError: If one is no run folder, did not converge, holds no full stride or comes twice.
        PatientError: If a patient that a run keeps is damaged.
    """
    names = run_names(folders)
    strides = [stride_of_run(folder) for folder in folders]
    count = max(1, round(rate * strides[0][1].duration))
    frames = [
        gait_frames(series, name, run.config.problem, count, run_notes(run))
        for name, (run, series) in zip(names, strides, strict=True)
    ]
    if recorded is not None:
        behind = recorded_frames(strides[0][1].walker, recorded, count)
        frames[0] = replace(frames[0], recorded=behind)
    return tuple(frames)


def gait_frames(
    series: GaitSeries, name: str, problem: str, count: int, notes: tuple[str, ...] = ()
) -> GaitFrames:
    """Return a stride at `count` evenly spaced instants from right foot strike on."""
    strike = stride_of(series).strike("right")
    later = strike + series.duration * np.arange(count) / count
    again = later >= series.duration
    time = np.where(again, later - series.duration, later)
    points = body_points(series.walker, _at(series.time, series.q, time))
    phase = _phases(series, time)
    ahead = np.where(again, series.distance, 0.0) - points["heel_r"][0, 0]
    feet = dict(
        zip(SIDES, _in_phase(series, _feet(series), time, phase).swapaxes(0, 1), strict=True)
    )
    return GaitFrames(
        name=name,
        patient=series.walker.patient.id,
        braced=tuple(series.walker.device.elements),
        problem=problem,
        duration=series.duration,
        distance=series.distance,
        weight=series.walker.weight,
        phase=phase,
        points={key: xz + np.stack([ahead, 0.0 * ahead], 1) for key, xz in points.items()},
        force={side: foot[:, :2] for side, foot in feet.items()},
        pressure={side: foot[:, 2] + ahead for side, foot in feet.items()},
        activation=_at(series.time, series.activation, time),
        notes=(*notes, *_open_stride(series)),
    )


def _at(known: np.ndarray, values: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return columns known at some instants at others, shape (n, ...) to (len(time), ...)."""
    columns = values.reshape(known.size, -1).T
    sampled = [np.interp(time, known, column) for column in columns]
    return np.stack(sampled, axis=1).reshape(time.size, *values.shape[1:])


def _feet(series: GaitSeries) -> np.ndarray:
    """Return ground force (forward, up) [N] and centre of pressure [m] of each foot, (n, 2, 3).

    All are NaN where the foot is not loaded.
    """
    feet = []
    for side in SIDES:
        centre = centre_of_pressure(series, side)
        force = np.stack([series.forward_force(side), series.vertical_force(side)], axis=1)
        force[np.isnan(centre)] = np.nan
        feet.append(np.column_stack([force, centre]))
    return np.stack(feet, axis=1)


def _in_phase(
    series: GaitSeries, values: np.ndarray, time: np.ndarray, phase: tuple[str, ...]
) -> np.ndarray:
    """Return columns as `_at`, each from its own phase only: forces jump where one begins."""
    sampled = np.empty((time.size, *values.shape[1:]))
    for name in set(phase):
        wanted, known = np.array(phase) == name, np.array(series.phase) == name
        sampled[wanted] = _at(series.time[known], values[known], time[wanted])
    return sampled


def _phases(series: GaitSeries, time: np.ndarray) -> tuple[str, ...]:
    """Return the phase at some instants; a phase begins with its first one."""
    pattern = series.walker.pattern
    rows = np.searchsorted(switching_times(pattern, series.motion), time, side="right") - 1
    return tuple(pattern.names[min(row, len(pattern.names) - 1)] for row in rows)


def _open_stride(series: GaitSeries) -> tuple[str, ...]:
    """Return a note if the stride does not end as it began."""
    defect = float(np.abs(series.q[-1, 1:] - series.q[0, 1:]).max())
    if defect < _CLOSED:
        return ()
    return (
        f"the stride does not repeat itself: coordinates differ by up to {defect:.2g} m or rad "
        "between its beginning and its end, where the figure jumps",
    )
