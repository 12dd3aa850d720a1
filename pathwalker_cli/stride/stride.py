"""One stride, predicted or recorded: what is known of it, and the gait cycle of each side."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Final, Literal

import numpy as np
from scipy.integrate import trapezoid

from pathwalker_cli.conventions import COORDINATES, GENERATORS, SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.model.contact import ContactPattern, phase_named
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.stride.series import GaitSeries, Sampled

POINTS: Final = 101
"""Points of a normalised curve: one per cent each."""

LOADED_SHARE: Final = 0.05
"""Share of body weight above which a foot counts as loaded: below it, centre of pressure and
friction ratio are quotients of two small numbers; force plates are evaluated with a similar one."""

Part = Literal["recording", "stride", "stance", "step"]
"""What of a walk one value of a measure belongs to."""


class NotKnownError(LookupError):
    """A recording does not know what a measure asks for."""


@dataclass(frozen=True)
class Stride(Sampled):
    """One stride, or the part of one that a recording shows, n instants.

    SI units and radians, orders as in `conventions`.  A predicted stride begins when the left toe
    leaves the ground and knows everything; of a recorded one, what is not known is None, an empty
    mapping, or NaN within an array.

    Args:
        name: What to call it: the folder of a run, or the recorded trial.
        walker: Who walks: mass and weight with what is worn, and leg length.
        time: Instants from 0 on [s], never decreasing, shape (n,).
        q: Generalised coordinates [m, rad], shape (n, 10).
        stances: Per side, its foot strike and the toe-off that ends this stance [s]; later than
            the end where the stance goes on at the beginning of the stride.
        problem: The problem that it solves, e.g. "mapd-orthosis"; "" for a recorded one.
        part: What of a walk it is; None for a prediction, which is all of it.
        side: The side whose gait cycle, stance or step it is; None for both.
        phase: Name of the phase at each instant, n of them; empty where no phases are known.
        v: Generalised velocities [m/s, rad/s], shape (n, 10).
        force: Per side, ground reaction force on the foot (forward, up) [N], shape (n, 2).
        point_force: Forces in the order of `walker.pattern.forces` [N], shape (n, 8).
        net_torque: Sum of muscle and orthosis torques per joint of the body [N m], shape (n, 10).
        muscle_torque: Torque of each generator [N m], shape (n, 14).
        orthosis_torque: Torques of the orthoses right, left [N m], shape (n, 2).
        cuff_force: Forces of the cuffs on the legs [N], right across and along the shank, then
            left, shape (n, 4).
        element_power: Powers in the order of `walker.elements` [W], shape (n, k).
        activation: Activation of each generator, shape (n, 14).
        quadrature: Weights of an integral over time [s], shape (n,); trapezoids if left out.
        stiffness: K_D right, left, K_P right, left [N m/rad], shape (4,).
        phase_durations: Durations of the phases by name [s].
        steps: Per side, length of a recorded step [m].
        notes: What to know about it, one sentence each.

    Raises:
        ValueError: If shapes do not fit, time decreases or a phase is none of the pattern's.
    """

    name: str
    walker: Walker
    time: np.ndarray
    q: np.ndarray
    stances: Mapping[Side, tuple[float, float]]
    problem: str = ""
    part: Part | None = None
    side: Side | None = None
    phase: tuple[str, ...] = ()
    v: np.ndarray | None = None
    force: Mapping[Side, np.ndarray] = field(default_factory=dict)
    point_force: np.ndarray | None = None
    net_torque: np.ndarray | None = None
    muscle_torque: np.ndarray | None = None
    orthosis_torque: np.ndarray | None = None
    cuff_force: np.ndarray | None = None
    element_power: np.ndarray | None = None
    activation: np.ndarray | None = None
    quadrature: np.ndarray | None = None
    stiffness: np.ndarray | None = None
    phase_durations: Mapping[str, float] = field(default_factory=dict)
    steps: Mapping[Side, float] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the shapes."""
        n, columns = self.time.size, {"muscle_torque": len(GENERATORS), "orthosis_torque": 2}
        columns |= {"cuff_force": 4}
        columns |= dict.fromkeys(("q", "v", "net_torque"), self.walker.skeleton.size)
        pattern = self.walker.pattern
        columns |= {"activation": len(GENERATORS), "point_force": len(pattern.forces)}
        checked = [(name, getattr(self, name), width) for name, width in columns.items()]
        checked += [(f"force {side}", values, 2) for side, values in self.force.items()]
        for name, values, width in checked:
            if values is not None and values.shape != (n, width):
                raise ValueError(f"{name} has shape {values.shape}; allowed: {(n, width)}")
        if self.phase and (len(self.phase) != n or not set(self.phase) <= set(pattern.names)):
            raise ValueError(f"phase names {n} instants with: {', '.join(pattern.names)}")
        if np.any(np.diff(self.time) < 0.0):
            raise ValueError("time must not decrease from row to row")

    @property
    def walking_speed(self) -> float:
        """Distance over time [m/s]."""
        return self.distance / self.duration

    @property
    def velocity(self) -> np.ndarray:
        """Generalised velocities, of a recording from its posture [m/s, rad/s], shape (n, 10)."""
        return np.gradient(self.q, self.time, axis=0) if self.v is None else self.v

    def known(self, name: str) -> np.ndarray:
        """Return an array by its name.

        Raises:
            NotKnownError: If it is not known.
        """
        values = getattr(self, name)
        if values is None or not len(values):
            raise NotKnownError(name)
        return np.asarray(values)

    def foot_force(self, side: Side) -> np.ndarray:
        """Return the ground reaction force on a foot (forward, up) [N], shape (n, 2).

        Raises:
            NotKnownError: If it is not known.
        """
        if side not in self.force:
            raise NotKnownError(f"force {side}")
        return self.force[side]

    def stance(self, side: Side) -> tuple[float, float]:
        """Return the foot strike of a side and the toe-off that ends its stance [s].

        Raises:
            NotKnownError: If they are not known.
        """
        if side not in self.stances:
            raise NotKnownError(f"stance {side}")
        return self.stances[side]

    def strike(self, side: Side) -> float:
        """Return when the foot strikes the ground [s]."""
        return self.stance(side)[0]

    def toe_off(self, side: Side) -> float:
        """Return when the stance that begins with `strike` ends [s]; later than the strike."""
        return self.stance(side)[1]

    def stands(self, side: Side) -> np.ndarray:
        """Return whether anything of a foot is on the ground, shape (n,)."""
        if self.phase:
            rows = self.walker.pattern.rows(side)
            return np.asarray(self.contacts[:, rows].any(axis=1))
        strike, toe_off = self.stance(side)
        return np.asarray((strike <= self.time) & (self.time <= toe_off))

    @property
    def contacts(self) -> np.ndarray:
        """Whether each place of the walker's pattern is on the ground, shape (n, k).

        Raises:
            NotKnownError: If phases are not known.
        """
        return contacts(self.walker, tuple(self.known("phase")), self.point_force)

    @cached_property
    def weights(self) -> np.ndarray:
        """Weights w [s] with sum(w * f) = integral of f over the stride, shape (n,)."""
        if self.quadrature is not None:
            return self.quadrature
        steps = np.diff(self.time) / 2.0
        return np.append(steps, 0.0) + np.append(0.0, steps)

    def mean(self, values: np.ndarray) -> np.ndarray:
        """Return the mean of columns over time, shape (n, ...) to (...)."""
        return np.asarray(trapezoid(values, self.time, axis=0) / self.duration)

    def over_cycle(self, values: np.ndarray, side: Side, points: int = POINTS) -> np.ndarray:
        """Return columns over the side's gait cycle, shape (n, m) to (points, m).

        The cycle runs from the side's foot strike through the end of the stride to the next one.
        """
        strike = self.strike(side)
        return self._between(values, strike, strike + self.duration, points)

    def over_stance(self, values: np.ndarray, side: Side, points: int = POINTS) -> np.ndarray:
        """Return columns from foot strike to toe-off of a side, shape (n, m) to (points, m)."""
        return self._between(values, *self.stance(side), points)

    def ankle_profile(self, side: Side, points: int = POINTS) -> np.ndarray:
        """Return dorsiflexion [rad] and net plantarflexing torque [N m] over stance, (points, 2).

        The torque is that of muscles and orthosis together, as inverse dynamics cannot tell them
        apart.

        Raises:
            NotKnownError: If the torques are not known.
        """
        ankle = COORDINATES.index(f"ankle_{SUFFIX[side]}")
        columns = np.stack([-self.q[:, ankle], self.known("net_torque")[:, ankle]], axis=1)
        return self.over_stance(columns, side, points)

    def step_length(self, side: Side) -> float:
        """Return the distance from the other foot's heel to this foot's, each flat [m].

        The right foot stands flat at the beginning and the end of a predicted stride, the left
        foot when the right toe leaves the ground.

        Raises:
            NotKnownError: If no step of this side is known.
        """
        if self.part is not None and side not in self.steps:
            raise NotKnownError(f"step {side}")
        if side in self.steps:
            return self.steps[side]
        middle = self._heel("left", self.toe_off("right") % self.duration)
        if side == "right":
            return self._heel("right", self.time[-1]) - middle
        return middle - self._heel("right", self.time[0])

    def pose(self, time: float) -> np.ndarray:
        """Return the generalised coordinates at an instant [s], shape (10,)."""
        return self._at(self.q, np.array([time]))[0]

    def _heel(self, side: Side, time: float) -> float:
        """Return the forward position of a heel [m] at an instant [s]."""
        return float(self.walker.foot_points(self.pose(time))[2 * SIDES.index(side), 0])

    def _between(self, values: np.ndarray, first: float, last: float, points: int) -> np.ndarray:
        """Return columns at some instants, those after the end taken from the beginning."""
        time = np.linspace(first, last, points)
        return self._at(values, np.where(time > self.time[-1], time - self.duration, time))

    def _at(self, values: np.ndarray, time: np.ndarray) -> np.ndarray:
        """Return columns at some instants, shape (len(time), m)."""
        return np.stack([np.interp(time, self.time, column) for column in values.T], axis=1)


def stride_of(
    series: GaitSeries, name: str = "", problem: str = "", notes: tuple[str, ...] = ()
) -> Stride:
    """Return the stride that the solver found.

    Raises:
        DataError: If the motion is not one stride in the phases of the walker's pattern.
    """
    pattern = series.walker.pattern
    durations = np.diff(switching_times(pattern, series.motion))
    return Stride(
        name=name,
        walker=series.walker,
        time=series.time,
        q=series.q,
        stances=stances_of(series),
        problem=problem,
        phase=series.phase,
        v=series.v,
        force={
            side: np.stack([series.forward_force(side), series.vertical_force(side)], axis=1)
            for side in SIDES
        },
        point_force=series.force,
        net_torque=series.joint_torque,
        muscle_torque=series.muscle_torque,
        orthosis_torque=series.orthosis_torque,
        cuff_force=series.cuff_force,
        element_power=series.element_power,
        activation=series.activation,
        quadrature=series.quadrature,
        stiffness=series.stiffness if series.stiffness.size else None,
        phase_durations=dict(zip(pattern.names, durations.tolist(), strict=True)),
        notes=notes,
    )


def switching_times(pattern: ContactPattern, motion: PhasedMotion) -> np.ndarray:
    """Return the beginnings of all phases and the end of the last one [s], shape (k + 1,).

    Raises:
        DataError: If the motion is not one stride in the phases of the pattern.
    """
    names = tuple(phase.name for phase in motion.phases)
    if names != pattern.names:
        raise DataError(
            f"a motion of the phases {', '.join(names)} is no full stride",
            allowed=", ".join(pattern.names),
        )
    return np.concatenate([[0.0], np.cumsum(motion.durations)])


def phase_stances(
    pattern: ContactPattern, durations: np.ndarray
) -> dict[Side, tuple[float, float]]:
    """Return foot strike and toe-off of each side [s] from the durations of the phases."""
    switching = np.concatenate([[0.0], np.cumsum(durations)])
    found: dict[Side, tuple[float, float]] = {}
    for side in SIDES:
        strike, off = switching[pattern.strike(side)], switching[pattern.toe_off(side)]
        found[side] = float(strike), float(off if off > strike else off + switching[-1])
    return found


def stances_of(series: GaitSeries) -> dict[Side, tuple[float, float]]:
    """Return foot strike and toe-off of each side [s]; of what gives way, from its load.

    Toe-off of compliant soles is the end of the side's own step, and the strike where the load that
    lasts until toe-off passes `LOADED`.  Toes that a joint carries push on when the ball has left
    the ground: they are off where they bear less than that.
    """
    pattern = series.walker.pattern
    switching = switching_times(pattern, series.motion)
    if not series.walker.parts.compliant:
        spans = phase_stances(pattern, np.diff(switching))
        if not series.walker.parts.toes:
            return spans
        return {side: (on, _unloaded(series, side, off)) for side, (on, off) in spans.items()}
    duration, found = series.duration, {}
    for side, toe_off in zip(SIDES, switching[1:].tolist(), strict=True):
        since = (series.time - toe_off) % duration
        order = np.argsort(since, kind="stable")
        load = series.vertical_force(side)[order]
        rising = np.flatnonzero((load[:-1] <= LOADED) & (load[1:] > LOADED))
        strike = toe_off % duration  # a foot that never lifts, as in an iterate that is no solution
        if rising.size:
            last = int(rising[-1])
            share = (LOADED - load[last]) / (load[last + 1] - load[last])
            begin, end = since[order][last : last + 2]
            strike = (toe_off + begin + share * (end - begin)) % duration
        found[side] = strike, toe_off if toe_off > strike else toe_off + duration
    return found


def _unloaded(series: GaitSeries, side: Side, since: float) -> float:
    """Return the first instant from another one on at which a foot bears less than `LOADED` [s]."""
    later = (series.time - since) % series.duration
    order = np.argsort(later, kind="stable")
    light = series.vertical_force(side)[order] < LOADED
    return since + float(later[order][int(np.argmax(light))])


@dataclass(frozen=True)
class OwnCycle:
    """The gait cycle of one side, from its foot strike to its next one.

    The stride is periodic, so its instants before the strike follow those after it.

    Args:
        side: "right" or "left".
        index: Rows of the series in the order of this cycle, shape (n + 1,).
        percent: Their positions in the cycle [%], from 0 to 100, shape (n + 1,).
        toe_off: Position of the side's toe-off [%].
    """

    side: Side
    index: np.ndarray
    percent: np.ndarray
    toe_off: float


def own_cycle(series: GaitSeries, side: Side) -> OwnCycle:
    """Return the gait cycle of a side."""
    duration, time = series.duration, series.time
    strike, toe_off = stances_of(series)[side]
    first = int(np.argmin(np.abs(time - strike)))
    index = np.concatenate([np.arange(first, time.size), np.arange(first + 1)])
    later = np.repeat([0.0, duration], [time.size - first, first + 1])
    percent = 100.0 * (time[index] + later - time[first]) / duration
    return OwnCycle(side, index, percent, 100.0 * ((toe_off - strike) % duration) / duration)


def contacts(walker: Walker, phase: tuple[str, ...], force: np.ndarray | None) -> np.ndarray:
    """Return whether each place of the pattern is on the ground at n instants, (n, k).

    The phase of each tells it; what gives way is on the ground where it is loaded.

    Args:
        walker: Who walks.
        phase: Name of the phase at each instant.
        force: Forces in the order of the pattern [N], shape (n, 2 k); needed of what gives way.
    """
    pattern, points = walker.pattern, {name: phase_named(name).points for name in set(phase)}
    on = np.array([[point in points[name] for point in pattern.points] for name in phase])
    if force is not None and pattern.yielding:
        soft = [pattern.points.index(point) for point in pattern.yielding]
        on[:, soft] = force[:, pattern.upward(pattern.yielding)] > LOADED
    return on


def toe_bearing(stride: Stride, side: Side) -> np.ndarray:
    """Return whether a foot stands on more than its heel, shape (n,)."""
    pattern = stride.walker.pattern
    rows = [i for i in pattern.rows(side) if pattern.points[i].place != "heel"]
    return np.asarray(stride.contacts[:, rows].any(axis=1))


def loaded(series: GaitSeries, side: Side) -> np.ndarray:
    """Return whether a foot bears more than `LOADED_SHARE` of body weight, shape (n,)."""
    return np.asarray(series.vertical_force(side) > LOADED_SHARE * series.walker.weight)


def centre_of_pressure(series: GaitSeries, side: Side) -> np.ndarray:
    """Return the forward position of the centre of pressure [m], shape (n,).

    NaN where the foot is not loaded.
    """
    rows, bearing = series.walker.pattern.rows(side), loaded(series, side)
    force = series.force[:, [2 * row + 1 for row in rows]]
    moment = (force * series.contact_position[:, rows, 0]).sum(axis=1)
    centre = np.full(series.time.size, np.nan)
    centre[bearing] = moment[bearing] / force.sum(axis=1)[bearing]
    return centre


def body_points(walker: Walker, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return positions of joints, heels, toes, neck and head (x, z) [m], of toes also their tips.

    Of an orthosis that is a body of its own, its hinge and where its shell would have knee and
    ankle ("shell_knee_r").

    Args:
        walker: Who walks.
        q: Generalised coordinates, shape (10,), or (n, 10) for positions of shape (n, 2).
    """
    ends = ("hip", "knee", "ankle", "heel", "toe", *(["tip"] if walker.parts.toes else []))
    legs = [f"{name}_{s}" for name in ends for s in "rl"]
    hinges = [f"hinge_{SUFFIX[side]}" for side in walker.shelled]
    points = walker.frames(q, (*legs, "lumbar", "head", *hinges))
    points["neck"] = points.pop("head")
    points["head"] = points["neck"] + 0.25 * (points["neck"] - points["lumbar"])
    for side in walker.shelled:
        points |= _shell_points(walker, q, points, side)
    return points


def _shell_points(
    walker: Walker, q: np.ndarray, points: Mapping[str, np.ndarray], side: Side
) -> dict[str, np.ndarray]:
    """Return knee and ankle of the shank as if they were on the shell [m]."""
    s, values, cuff = SUFFIX[side], walker.values, walker.device.cuffs[side]
    shank = points[f"knee_{s}"] - points[f"ankle_{s}"]
    length = float(np.linalg.norm(shank, axis=-1).max())
    along = shank / length
    across = np.stack([along[..., 1], -along[..., 0]], axis=-1)
    columns = np.moveaxis(np.asarray(q, float), -1, 0)
    state = walker.state(columns, np.zeros_like(columns), [None] * len(walker.muscles))
    shell = {}
    for name, height in (("knee", length), ("ankle", 0.0)):
        x, z = cuff.shift(state, {**values, f"orthosis.cuff_height.{side}": height})
        shell[f"shell_{name}_{s}"] = (
            points[f"{name}_{s}"] + np.expand_dims(x, -1) * across + np.expand_dims(z, -1) * along
        )
    return shell
