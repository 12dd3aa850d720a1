"""A gait as plain numbers: one stride, wherever it comes from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import trapezoid

from pathwalker_cli.conventions import COORDINATES, GENERATORS, Side
from pathwalker_cli.inverse.cycles import POINTS
from pathwalker_cli.model.contact import PHASE_NAMES, phase_named
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.cycle import STRIKE_PHASE, TOE_OFF_PHASE
from pathwalker_cli.stride.feet import point_rows

__all__ = ["Gait"]


@dataclass(frozen=True)
class Gait:
    """One stride in the eight contact phases, n instants; SI units, orders as in `conventions`.

    It begins when the left toe leaves the ground.  What is not known of a motion is None.

    Args:
        name: What to call it, e.g. the folder of a run.
        problem: The problem that it solves, e.g. "mapd-orthosis".
        walker: Who walks.
        time: Instants from 0 on [s], never decreasing, shape (n,).
        phase: Name of the phase at each instant, n of them.
        phase_durations: Durations of the eight phases [s], shape (8,).
        q: Generalised coordinates [m, rad], shape (n, 10).
        force: Per side, ground reaction force on the foot (forward, up) [N], shape (n, 2).
        net_torque: Sum of muscle and orthosis torques per coordinate [N m], shape (n, 10).
        muscle_torque: Torque of each generator [N m], shape (n, 14).
        activation: Activation of each generator, shape (n, 14).
        effort: Integral of the sum of squared activations [s].
        stiffness: K_D right, left, K_P right, left [N m/rad], shape (4,).
        notes: What to know about it, one sentence each.

    Raises:
        ValueError: If shapes do not fit, time decreases or a phase is none of the eight.
    """

    name: str
    problem: str
    walker: Walker
    time: np.ndarray
    phase: tuple[str, ...]
    phase_durations: np.ndarray
    q: np.ndarray
    force: Mapping[Side, np.ndarray] | None = None
    net_torque: np.ndarray | None = None
    muscle_torque: np.ndarray | None = None
    activation: np.ndarray | None = None
    effort: float | None = None
    stiffness: np.ndarray | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the shapes."""
        n = self.time.size
        wanted = {
            "q": (self.q, (n, len(COORDINATES))),
            "phase_durations": (self.phase_durations, (len(PHASE_NAMES),)),
            "net_torque": (self.net_torque, (n, len(COORDINATES))),
            "muscle_torque": (self.muscle_torque, (n, len(GENERATORS))),
            "activation": (self.activation, (n, len(GENERATORS))),
        } | {f"force {side}": (values, (n, 2)) for side, values in (self.force or {}).items()}
        for name, (values, shape) in wanted.items():
            if values is not None and values.shape != shape:
                raise ValueError(f"{name} has shape {values.shape}; allowed: {shape}")
        if len(self.phase) != n or not set(self.phase) <= set(PHASE_NAMES):
            raise ValueError(f"phase names {n} instants with: {', '.join(PHASE_NAMES)}")
        if np.any(np.diff(self.time) < 0.0):
            raise ValueError("time must not decrease from row to row")

    @property
    def duration(self) -> float:
        """Time of the stride [s]."""
        return float(self.time[-1] - self.time[0])

    @property
    def walking_speed(self) -> float:
        """Distance over time [m/s]."""
        return float(self.q[-1, 0] - self.q[0, 0]) / self.duration

    @cached_property
    def switching_times(self) -> np.ndarray:
        """Beginnings of the eight phases and the end of the last one [s], shape (9,)."""
        return np.concatenate([[0.0], np.cumsum(self.phase_durations)])

    def strike(self, side: Side) -> float:
        """Return when the foot strikes the ground [s]."""
        return float(self.switching_times[PHASE_NAMES.index(STRIKE_PHASE[side])])

    def toe_off(self, side: Side) -> float:
        """Return when the stance that begins with `strike` ends [s]; later than the strike."""
        off = float(self.switching_times[PHASE_NAMES.index(TOE_OFF_PHASE[side])])
        return off if off > self.strike(side) else off + self.duration

    def column(self, coordinate: str) -> np.ndarray:
        """Return one generalised coordinate over time, shape (n,)."""
        return np.asarray(self.q[:, COORDINATES.index(coordinate)])

    def stance_rows(self, side: Side) -> np.ndarray:
        """Return the rows in which heel or toe of a side is on the ground."""
        standing = {name for name in PHASE_NAMES if _stands(name, side)}
        return np.flatnonzero([name in standing for name in self.phase])

    def over_cycle(self, values: np.ndarray, side: Side, points: int = POINTS) -> np.ndarray:
        """Return columns over the side's gait cycle, shape (n, m) to (points, m).

        The cycle runs from the side's foot strike through the end of the stride to the next one.
        """
        return self._between(values, self.strike(side), self.strike(side) + self.duration, points)

    def over_stance(self, values: np.ndarray, side: Side, points: int = POINTS) -> np.ndarray:
        """Return columns from foot strike to toe-off of a side, shape (n, m) to (points, m)."""
        return self._between(values, self.strike(side), self.toe_off(side), points)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the mean of columns over time, shape (n, ...) to (...)."""
        return np.asarray(trapezoid(values, self.time, axis=0) / self.duration)

    def heel(self, side: Side, time: float) -> float:
        """Return the forward position of a heel [m] at an instant [s]."""
        pose = self._at(self.q, np.array([time]))[0]
        return float(self.walker.contact_points(pose)[point_rows(side)[0], 0])

    def step_length(self, side: Side) -> float:
        """Return the distance from the other foot's heel to this foot's, each flat [m].

        The right foot stands flat at the beginning and the end of the stride, the left foot when
        the right toe leaves the ground.
        """
        middle = self.switching_times[PHASE_NAMES.index(TOE_OFF_PHASE["right"])]
        if side == "right":
            return self.heel("right", self.time[-1]) - self.heel("left", middle)
        return self.heel("left", middle) - self.heel("right", 0.0)

    def _between(self, values: np.ndarray, first: float, last: float, points: int) -> np.ndarray:
        """Return columns at some instants, those after the end taken from the beginning."""
        time = np.linspace(first, last, points)
        return self._at(values, np.where(time > self.time[-1], time - self.duration, time))

    def _at(self, values: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return columns at some instants, shape (len(time), m)."""
        columns = [np.interp(time, self.time, column) for column in values.T]
        return np.stack(columns, axis=1)


def _stands(phase: str, side: Side) -> bool:
    """Return whether a point of a foot is on the ground in a phase."""
    return side in phase_named(phase).feet
