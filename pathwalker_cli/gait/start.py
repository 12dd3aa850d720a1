"""Where the search begins: a stylised or a recorded stride as a motion in phases."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import CubicSpline

from pathwalker_cli.config import StartConfig
from pathwalker_cli.conventions import COORDINATES, GENERATORS, GRAVITY
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.stylised import StylisedGait, stylised_trajectory
from pathwalker_cli.io.recordings import CompactRecording, read_recording, start_names
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion, collocation_times
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "ReferenceStride",
    "recorded_stride",
    "reference_stride",
    "start_recording",
    "stylised_stride",
]

_EVENTS = (
    ("left", "toe_off"),
    ("left", "foot_strike"),
    ("right", "toe_off"),
    ("right", "foot_strike"),
)
"""Events in the order of the phases; each begins the next pair of phases."""

_SPLITS = (0.33, 0.5, 0.33, 0.5)
"""Share of the first phase of each pair: recordings do not tell when heels lift or toes land."""


@dataclass(frozen=True)
class ReferenceStride:
    """One stride to track in the first stage of a solve.

    Args:
        name: Where it comes from, for records.
        trajectory: `conventions.COORDINATES` over one stride from the start of right_flat on.
        durations: Phase durations [s], shape (8,).
    """

    name: str
    trajectory: Trajectory
    durations: np.ndarray

    @cached_property
    def _spline(self) -> CubicSpline:
        return CubicSpline(self.trajectory.time, self.trajectory.values)

    @cached_property
    def _starts(self) -> np.ndarray:
        return np.concatenate([[0.0], np.cumsum(self.durations)])

    def coordinates(self, phase: int, fraction: np.ndarray | float, order: int = 0) -> np.ndarray:
        """Return q, or its time derivative of that order, at a fraction of a phase."""
        time = self._starts[phase] + np.asarray(fraction) * self.durations[phase]
        return np.asarray(self._spline(time, order))

    def motion(
        self,
        walker: Walker,
        parameters: np.ndarray,
        meshes: tuple[np.ndarray, ...],
        degree: int,
        integrals: int,
    ) -> PhasedMotion:
        """Return a start on a mesh: this stride, level activations, weight on the feet.

        Args:
            walker: Who walks.
            parameters: Start of the walker's unknowns, shape (k,).
            meshes: Node positions of every phase.
            degree: Number of collocation points in an interval.
            integrals: Number of running costs.
        """
        phases = tuple(
            self._phase(walker, i, mesh, degree, integrals) for i, mesh in enumerate(meshes)
        )
        return PhasedMotion(phases, np.asarray(parameters, float))

    def _phase(
        self, walker: Walker, i: int, mesh: np.ndarray, degree: int, integrals: int
    ) -> PhaseMotion:
        contact, count = PHASES[i], len(mesh)
        points = mesh[:-1, None] + np.diff(mesh)[:, None] * collocation_times(degree)
        loads = [force.bears for force in contact.forces]
        force = np.where(loads, walker.weight / sum(loads), 0.0)
        n = len(COORDINATES)
        algebraic = np.zeros((count - 1, degree, 2 * n + len(force)))
        algebraic[:, :, n : n + len(force)] = force

        def states(at: np.ndarray) -> np.ndarray:
            return np.concatenate([self.coordinates(i, at), self.coordinates(i, at, 1)], axis=-1)

        return PhaseMotion(
            name=contact.name,
            duration=float(self.durations[i]),
            mesh=mesh,
            states=states(mesh),
            smooth=np.full((count, len(GENERATORS)), 0.2),
            controls=np.zeros((count, len(GENERATORS))),
            integrals=np.zeros((count, integrals)),
            inner_states=states(points),
            algebraic=algebraic,
        )


def reference_stride(walker: Walker, config: StartConfig, walking_speed: float) -> ReferenceStride:
    """Return the stride that a config asks for.

    Args:
        walker: Who walks.
        config: Start of the study.
        walking_speed: Speed of a stylised gait [m/s].

    Raises:
        DataError: If a recorded start was asked for and there is none.
    """
    if config.gait == "recorded":
        return recorded_stride(walker, start_recording(walker, config))
    return stylised_stride(walker, walking_speed, config.knee_flexion, config.stride_ratio)


def start_recording(walker: Walker, config: StartConfig) -> CompactRecording:
    """Return the recording that a config names, or the first one that holds a whole stride.

    Raises:
        DataError: If there is none.
    """
    names = start_names(walker.patient, config.condition)
    trial = config.trial or _first_with_stride(walker, config, names)
    return read_recording(walker.patient, config.condition, trial)


def stylised_stride(
    walker: Walker, walking_speed: float, knee_flexion: float, stride_ratio: float
) -> ReferenceStride:
    """Return a stylised stride; at least 0.1 sqrt(g leg length) fast."""
    slowest = 0.1 * float(np.sqrt(GRAVITY * walker.leg_length))
    gait = StylisedGait(max(walking_speed, slowest), stride_ratio * walker.leg_length, knee_flexion)
    return ReferenceStride("synthetic", stylised_trajectory(walker, gait), gait.durations)


def _first_with_stride(walker: Walker, config: StartConfig, names: tuple[str, ...]) -> str:
    for name in names:
        recording = read_recording(walker.patient, config.condition, name)
        if _stride_frames(recording) is not None:
            return name
    raise DataError(
        f"patient {walker.patient.id} has no {config.condition} recording of a whole stride",
        mend="import C3D files first, or set start.gait to synthetic",
    )


def _stride_frames(recording: CompactRecording) -> tuple[int, list[int]] | None:
    """Return which event begins the first whole stride, and the frames of its five events."""
    events = sorted(recording.events, key=lambda event: event.frame)
    kinds = [(event.side, event.kind) for event in events]
    for i in range(len(events) - 4):
        if kinds[i] not in _EVENTS:
            continue
        first = _EVENTS.index(kinds[i])
        wanted = [_EVENTS[(first + k) % 4] for k in range(5)]
        if kinds[i : i + 5] == wanted:
            return first, [event.frame for event in events[i : i + 5]]
    return None


def recorded_stride(walker: Walker, recording: CompactRecording) -> ReferenceStride:
    """Return the first whole stride of a recording, closed to be periodic.

    The mismatch between both ends is spread over the stride, time is turned so that left toe-off
    comes first, and the pelvis is set so high that the soles touch the ground.

    Raises:
        DataError: If no whole stride was recorded.
    """
    found = _stride_frames(recording)
    if found is None:
        raise DataError(
            f"recording {recording.name} holds no whole stride (toe-offs and strikes of both feet)",
            mend="choose another start.trial",
        )
    first, frames = found
    time = recording.motion.time[frames[0] : frames[-1] + 1]
    values = recording.motion.values[frames[0] : frames[-1] + 1]
    period, share = time[-1] - time[0], (time - time[0]) / (time[-1] - time[0])
    drift = values[-1] - values[0]
    distance, drift[0] = drift[0], 0.0
    values = values - share[:, None] * drift
    gaps = np.roll(np.diff(recording.motion.time[frames]), first)
    toe_off = float(gaps[first:].sum()) if first else 0.0
    closed = _turned(time - time[0], values, distance, period, toe_off)
    durations = np.array(
        [k for g, s in zip(gaps, _SPLITS, strict=True) for k in (g * s, g - g * s)]
    )
    closed[:, 0] -= closed[0, 0]
    lowest = [walker.contact_points(q)[:, 1].min() for q in closed]
    closed[:, 1] -= np.mean(lowest)
    grid = np.linspace(0.0, period, len(closed))
    trajectory = Trajectory(grid, COORDINATES, closed, recording.motion.units)
    return ReferenceStride(f"recording {recording.name}", trajectory, durations)


def _turned(
    time: np.ndarray, values: np.ndarray, distance: float, period: float, begin: float
) -> np.ndarray:
    """Return a periodic stride sampled from another instant of it on."""
    at = begin + np.linspace(0.0, period, len(time))
    laps = np.floor_divide(at, period)
    result = np.array(CubicSpline(time, values)(at - laps * period))
    result[:, 0] += laps * distance
    return result
