"""Recordings of a made-up child: another child's recorded gait, played by its model.

Angles are kept, lengths grow with the legs, times with the square root of that, forces with the
weight: the two walks are alike dynamically, so that forces fit the motion (Alexander 1989,
Physiological Reviews 69, 1199-1227).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import islice
from pathlib import Path
from typing import Final

import numpy as np
import pinocchio as pin
from scipy.interpolate import CubicSpline

from pathwalker_cli.conventions import SIDES, Condition
from pathwalker_cli.inverse.cycles import Stance
from pathwalker_cli.inverse.dynamics import frame_rate
from pathwalker_cli.inverse.forces import foot_extents, foot_points
from pathwalker_cli.inverse.kinematics import marker_paths
from pathwalker_cli.inverse.markers import MarkerPoint, load_marker_set, marker_points
from pathwalker_cli.inverse.trials import recorded_stances
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.c3d_plates import ForcePlate
from pathwalker_cli.io.c3d_write import write_c3d
from pathwalker_cli.io.recordings import CompactRecording, read_recording, recording_names
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient, load_patient

SOURCE: Final = "sreenivasa2017-patient"
"""Whose recordings are played."""

TRIALS: Final = 7
"""Trials per condition: all barefoot ones in which a stance was measured."""

NOISE: Final = 1e-3
"""Standard deviation of the noise on every coordinate of a marker [m]."""

_SEED: Final = 2017
_PER_FRAME: Final = 8
_DESCRIPTION: Final = "Made by PathWalker from another child's angles and forces; not recorded"

_ASIDE: Final[Mapping[str, float]] = {"r": -0.09, "l": 0.09}
"""Distance of a leg from the walking plane [m]."""

_PLATE: Final = (0.5, 0.16)
"""Length and width of a force plate [m]; narrow, so that each carries one foot only."""


def write_example(folder: Path, patient: Patient, conditions: tuple[Condition, ...]) -> None:
    """Write C3D files of a made-up child into c3d/barefoot and c3d/orthosis of a folder."""
    for condition in conditions:
        place = folder / "c3d" / condition
        place.mkdir(parents=True)
        for recording in made_recordings(patient, condition):
            path = place / f"{recording.name}.c3d"
            write_c3d(path, recording, description=_DESCRIPTION)


def made_recordings(patient: Patient, condition: Condition) -> Iterator[Recording]:
    """Yield recordings of a patient who walks as another child was recorded."""
    source = load_patient(SOURCE)
    models = pinocchio_model(patient, condition), pinocchio_model(source, condition)
    size = _leg(patient) / _leg(source)
    points = marker_points(load_marker_set(), patient, condition)
    noise = np.random.default_rng(_SEED)
    names = recording_names(source, condition)
    trials = filter(_measured, (read_recording(source, condition, name) for name in names))
    for number, trial in enumerate(islice(trials, TRIALS), start=1):
        yield _recording(f"made-{condition}-{number}", _played(trial, size, *models), points, noise)


def _leg(patient: Patient) -> float:
    """Return the mean length of the legs, hip to ankle [m]."""
    return sum(patient.length(name, side) for name in ("thigh", "shank") for side in SIDES) / 2.0


def _measured(trial: CompactRecording) -> list[Stance]:
    """Return the stances of a trial of which the forces are known."""
    return [item.stance for item in recorded_stances(trial) if item.measured]


@dataclass(frozen=True)
class _Played:
    """A trial in the time and the poses of another body.

    Args:
        trial: The trial.
        rate: Frames per second [1/s].
        frames: Frame of the trial, with fractions, that each frame shows, shape (n,).
        q: Poses of the child [m, rad], shape (n, 10).
        events: Foot strikes and toe-offs in its frames.
        model: The child.
        other: The child who was recorded.
    """

    trial: CompactRecording
    rate: float
    frames: np.ndarray
    q: np.ndarray
    events: tuple[Event, ...]
    model: pin.Model
    other: pin.Model


def _played(trial: CompactRecording, size: float, model: pin.Model, other: pin.Model) -> _Played:
    """Return a trial as a child walks it whose legs are so many times as long."""
    slower = np.sqrt(size)
    values, rate = trial.motion.values.copy(), frame_rate(trial.motion)
    values[:, :2] *= size
    count = int((len(values) - 1) * slower) + 1
    frames = np.arange(count) / slower
    q = CubicSpline(np.arange(len(values)), values)(frames)
    soles = np.hstack([points[..., 1] for points in foot_points(model, q).values()])
    q[:, 1] -= soles.min(axis=1).mean()
    events = tuple(
        Event(event.side, event.kind, round(event.frame * slower))
        for event in trial.events
        if round(event.frame * slower) < count
    )
    return _Played(trial, rate, frames, q, events, model, other)


def _recording(
    name: str,
    played: _Played,
    points: tuple[MarkerPoint, ...],
    noise: np.random.Generator,
) -> Recording:
    paths = marker_paths(played.model, points, played.q)
    markers = {point.marker: i for i, point in enumerate(points)}
    positions = np.empty((len(played.q), len(markers), 3))
    for column, i in enumerate(markers.values()):
        positions[:, column, [0, 2]] = paths[:, i]
        positions[:, column, 1] = _ASIDE.get(points[i].link[-2:].removeprefix("_"), 0.0)
    positions += noise.normal(0.0, NOISE, positions.shape)
    plates = tuple(
        _plate(number, stance, played)
        for number, stance in enumerate(_measured(played.trial), start=1)
    )
    return Recording(
        name, played.rate, tuple(markers), positions, played.events, plates, _PER_FRAME
    )


def _plate(number: int, stance: Stance, played: _Played) -> ForcePlate:
    """Return a plate below a stance, with the load of that stance alone."""
    force, point = _load(stance, played)
    middle = float(np.median(point[force[:, 2] > 0.0]))
    along, across = _PLATE
    aside = _ASIDE[stance.side[0]]
    ends = [(1, 1), (-1, 1), (-1, -1), (1, -1)]
    corners = np.array([[middle + x * along / 2, aside + y * across / 2, 0.0] for x, y in ends])
    at = np.arange(len(force) * _PER_FRAME) / _PER_FRAME
    samples = np.column_stack([np.interp(at, np.arange(len(force)), c) for c in force.T])
    arm = np.interp(at, np.arange(len(force)), point - middle)
    moment = np.cross(np.outer(arm, [1.0, 0.0, 0.0]), samples)
    return ForcePlate(f"plate {number}", corners, samples, moment)


def _load(stance: Stance, played: _Played) -> tuple[np.ndarray, np.ndarray]:
    """Return force (n, 3) [N] and its forward position (n,) [m] of one stance, over all frames.

    The centre of pressure lies at the same share of the foot, from heel marker to toe marker, and
    as far before the toe marker as it did: toes are longer than the marker tells.
    """
    trial, side = played.trial, stance.side
    assert trial.forces is not None  # noqa: S101 - shipped recordings have forces
    rows = slice(stance.strike, stance.toe_off + 1)
    known = np.arange(stance.strike, stance.toe_off + 1)
    heel, toe = foot_extents(played.other, trial.motion.values[rows])[side].T
    centre = trial.forces[f"cop_{side[0]}_x"][rows]
    seen = np.isfinite(centre)
    centre = np.interp(known, known[seen], centre[seen])
    share = np.clip((centre - heel) / (toe - heel), 0.0, 1.0)
    beyond = centre - (heel + share * (toe - heel))
    inside = (played.frames >= stance.strike) & (played.frames <= stance.toe_off)
    force = np.zeros((len(played.q), 3))
    for axis, name in ((0, "x"), (2, "z")):
        values = np.nan_to_num(trial.forces[f"force_{side[0]}_{name}"][rows])
        force[inside, axis] = np.interp(played.frames[inside], known, values)
    force *= pin.computeTotalMass(played.model) / pin.computeTotalMass(played.other)
    heel, toe = foot_extents(played.model, played.q)[side].T
    share, beyond = (np.interp(played.frames, known, values) for values in (share, beyond))
    return force, heel + share * (toe - heel) + beyond
