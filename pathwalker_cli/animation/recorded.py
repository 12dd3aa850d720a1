"""A recorded gait cycle behind a predicted one: stick figure and markers, in step."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.errors import DataError
from pathwalker_cli.evaluation.recorded import recorded_gait
from pathwalker_cli.inverse.c3d_trials import c3d_trials, read_markers
from pathwalker_cli.inverse.study import Paths, RecordedConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.walk import walks
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.stride import body_points


@dataclass(frozen=True)
class RecordedFrames:
    """One recorded gait cycle at n instants i/n of the right cycle, as an eye sees it.

    Args:
        name: Name of the trial.
        duration: Time of the cycle [s].
        points: Points of the body, forward from an eye that moves on evenly, and up [m], (n, 2).
        markers: Markers that were seen all the time, likewise; none without C3D.
    """

    name: str
    duration: float
    points: Mapping[str, np.ndarray]
    markers: Mapping[str, np.ndarray]


def recorded_frames(walker: Walker, trial: str, count: int) -> RecordedFrames:
    """Return the first right gait cycle of a C3D file, or of a recording, at `count` instants.

    Raises:
        DataError: If there is no such trial, it cannot be used, or shows no such cycle.
    """
    found = _of_c3d(walker, Path(trial)) if trial.lower().endswith(".c3d") else (
        [(_named(walker, trial), {})])  # fmt: skip
    cycles = [(each, cycle, paths) for each, paths in found
              for cycle in each.cycles if cycle.side == "right"]  # fmt: skip
    if not cycles:
        raise DataError("shows no gait cycle of the right foot", where=f"--recorded {trial}",
                        allowed="a trial from one right foot strike to the next")  # fmt: skip
    one, cycle, markers = cycles[0]
    share = np.arange(count) / count
    rows = cycle.start + (cycle.end - cycle.start) * share
    points = body_points(walker.as_recorded, _at(one.motion.values, rows))
    forward = one.motion.values[:, COORDINATES.index("pelvis_tx")]
    walked = share * (forward[cycle.end] - forward[cycle.start])
    eye = walked + float((points["hip_r"][:, 0] - walked).mean())
    time = one.motion.time
    seen = {name: _at(path, rows) for name, path in markers.items()}
    return RecordedFrames(
        name=one.name,
        duration=float(time[cycle.end] - time[cycle.start]),
        points={name: _before(eye, path) for name, path in points.items()},
        markers={n: _before(eye, path) for n, path in seen.items() if np.isfinite(path).all()},
    )


def _named(walker: Walker, name: str) -> Trial:
    """Return a recording beside the patient."""
    gait = recorded_gait(walker)
    trial = None if gait is None else gait.trial(name)
    if trial is None:
        known = ", ".join(each.name for each in gait.trials) if gait else "a C3D file"
        raise DataError(f"there is no {walker.condition} recording of {walker.patient.id} by it",
                        where=f"--recorded {name}", allowed=known)  # fmt: skip
    return trial


def _of_c3d(walker: Walker, path: Path) -> list[tuple[Trial, dict[str, np.ndarray]]]:
    """Return the passes of a file, each with the paths of its markers (forward, up) [m]."""
    patient, condition = walker.patient, walker.condition
    config = RecordedConfig(
        patient=patient.id, conditions=(condition,), c3d=Paths(**{condition: (str(path),)})
    )
    file = read_markers(path, patient, condition, config)
    names = [point.marker for point in file.points]
    trials = [trial for trial, _ in c3d_trials([path], patient, condition, config)]
    passes = walks(file.recording, file.points)
    paths = [{n: walk.marker(n)[:, [0, 2]] for n in names} for walk in passes]
    return list(zip(trials, paths, strict=True))


def _at(columns: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return columns between their rows, shape (n, m) to (len(rows), m)."""
    known = np.arange(len(columns))
    return np.stack([np.interp(rows, known, column) for column in columns.T], axis=1)


def _before(eye: np.ndarray, path: np.ndarray) -> np.ndarray:
    """Return a path (n, 2) as an eye at these places sees it."""
    return path - np.stack([eye, np.zeros_like(eye)], axis=1)
