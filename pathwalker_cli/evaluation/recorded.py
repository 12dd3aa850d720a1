"""The recordings of one condition as strides and stances, and the spread of what they say."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.evaluation.paper import PATIENT, REFERENCE_STRIDES
from pathwalker_cli.inverse.cycles import OTHER, GaitCycle, resampled, stances
from pathwalker_cli.inverse.dynamics import frame_rate
from pathwalker_cli.inverse.recorded import trial_steps
from pathwalker_cli.inverse.strengths import stance_curves
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.trials import recorded_trials
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.stride.stride import POINTS, Part, Stride

Position = Literal["below", "in", "above"]
"""Where a value lies in relation to a recorded range."""


@dataclass(frozen=True)
class Spread:
    """Mean and range over trials, strides or stances, their number and standard deviation."""

    mean: float
    low: float
    high: float
    count: int
    sd: float

    def position(self, value: float) -> Position:
        """Return where a value lies in relation to the range."""
        if value < self.low:
            return "below"
        return "above" if value > self.high else "in"


def spread(values: Iterable[float]) -> Spread | None:
    """Return mean and range of some values, None without any."""
    known = np.array(list(values), dtype=float)
    if known.size == 0:
        return None
    sd = float(known.std(ddof=1)) if known.size > 1 else 0.0
    return Spread(float(known.mean()), float(known.min()), float(known.max()), known.size, sd)


@dataclass(frozen=True)
class RecordedGait:
    """All recordings of a patient in the condition of its walker, which carries the weight.

    Trials have angles, events and, where measured, forces and torques.
    """

    walker: Walker
    trials: tuple[Trial, ...]

    def trial(self, name: str) -> Trial | None:
        """Return the trial of this name, or None."""
        return next((each for each in self.trials if each.name == name), None)

    @cached_property
    def strides(self) -> tuple[Stride, ...]:
        """Every recording, gait cycle, step and stance: each knows only what it shows.

        Forces and torques are those of measured stances, resampled; torques and their ankle
        angles are filtered alike.
        """
        return tuple(each for trial in self.trials for each in _strides(self.walker, trial))

    def of(self, part: Part, side: Side) -> tuple[Stride, ...]:
        """Return the strides of one kind and side."""
        return tuple(s for s in self.strides if (s.part, s.side) == (part, side))

    @property
    def cycles(self) -> tuple[Stride, ...]:
        """Every recorded gait cycle, right ones first."""
        return tuple(cycle for side in SIDES for cycle in self.of("stride", side))

    def stance_forces(self, side: Side) -> np.ndarray:
        """Return (forward, up) over every measured stance [N], shape (stances, POINTS, 2)."""
        found = [each.force[side] for each in self.of("stance", side) if each.force]
        return np.array(found).reshape(-1, POINTS, 2)

    def ankle_profiles(self, side: Side) -> np.ndarray:
        """Return the ankle profiles of all measured stances, shape (stances, POINTS, 2)."""
        measured = [each for each in self.of("stance", side) if each.net_torque is not None]
        return np.array([each.ankle_profile(side) for each in measured]).reshape(-1, POINTS, 2)


def recorded_gait(walker: Walker) -> RecordedGait | None:
    """Return the recordings of the patient in the walker's condition, None if there are none.

    Raises:
        DataError: If a recording cannot be used.
    """
    patient, condition = walker.patient, walker.condition
    if not recording_names(patient, condition):
        return None
    config = InverseDynamicsConfig(
        study="inverse-dynamics", patient=patient.id, conditions=(condition,)
    )
    trials = recorded_trials(config, patient, condition, lambda _: None)
    return RecordedGait(walker.as_recorded, tuple(trials))


def recorded_numbers(
    recorded: RecordedGait, measures: Iterable[Measure] | None = None
) -> dict[str, Spread]:
    """Return mean and range of what recordings say, by key, SI units.

    They are asked what `evaluate` compares if no measures are named.
    """
    spreads = {
        measure.key: spread(v for s in recorded.strides if (v := measure.of(s)) is not None)
        for measure in measures or measures_in("evaluate")
    }
    return {key: values for key, values in spreads.items() if values is not None}


def _excerpt(
    walker: Walker, trial: Trial, part: Part, first: int, last: int, **known: Any
) -> Stride:
    """Return some frames of a trial, the last one included."""
    motion, rows = trial.motion, slice(first, last + 1)
    values: dict[str, Any] = {"time": motion.time[rows] - motion.time[first], "stances": {}}
    return Stride(trial.name, walker, q=motion.values[rows], part=part, **(values | known))


def _strides(walker: Walker, trial: Trial) -> Iterator[Stride]:
    """Yield everything that a trial shows."""
    rate = frame_rate(trial.motion)
    yield _excerpt(walker, trial, "recording", 0, trial.motion.time.size - 1)
    for cycle in trial.cycles:
        yield _cycle(walker, trial, cycle, rate)
    for stance in stances(trial.events):
        ends = {stance.side: (0.0, (stance.toe_off - stance.strike) / rate)}
        time = np.arange(stance.toe_off - stance.strike + 1) / rate
        known = {"side": stance.side, "stances": ends, "time": time}
        yield _excerpt(walker, trial, "stance", stance.strike, stance.toe_off, **known)
    for side in SIDES:
        steps = trial_steps(walker.model, trial.motion, trial.events)[side]
        yield from (_curve(walker, trial, "step", side, steps={side: step}) for step in steps)
        yield from _measured(walker, trial, side)


def _cycle(walker: Walker, trial: Trial, cycle: GaitCycle, rate: float) -> Stride:
    """Return a gait cycle; the other side's stance where the cycle shows all of its swing."""
    side, start, frames = cycle.side, cycle.start, cycle.end - cycle.start
    spans = {side: (0.0, (cycle.toe_off - start) / rate)}
    other = {
        e.kind: e.frame - start
        for e in trial.events
        if e.side != side and start < e.frame < cycle.toe_off
    }
    if other.keys() == {"toe_off", "foot_strike"}:
        spans[OTHER[side]] = other["foot_strike"] / rate, (other["toe_off"] + frames) / rate
    known: dict[str, Any] = {"side": side, "stances": spans, "time": np.arange(frames + 1) / rate}
    if trial.forces is not None:
        known["force"] = {side: _in_the_air_at_last(_forces(trial, side), cycle)}
    if trial.tau is not None:
        known["net_torque"] = _in_the_air_at_last(trial.tau.values, cycle)
    return _excerpt(walker, trial, "stride", start, cycle.end, **known)


def _in_the_air_at_last(values: np.ndarray, cycle: GaitCycle) -> np.ndarray:
    """Return columns that only measured stances have over a cycle.

    At the next strike the foot is still in the air; what follows may not be measured.
    """
    return np.vstack([values[cycle.start : cycle.end], values[cycle.end - 1 : cycle.end]])


def _measured(walker: Walker, trial: Trial, side: Side) -> Iterator[Stride]:
    """Yield forces, then ankle angles and torques, of a side's measured stances."""
    for item in trial.stances if trial.forces is not None else ():
        rows = slice(item.stance.strike, item.stance.toe_off + 1)
        if item.measured and item.stance.side == side:
            force = resampled(_forces(trial, side)[rows])
            if np.isfinite(force).all():
                yield _curve(walker, trial, "stance", side, force={side: force})
    ankle = f"ankle_{SUFFIX[side]}"
    for torque, angle, _ in (c.T for c in stance_curves([trial]).get(ankle, ())):
        columns = (np.full((POINTS, len(COORDINATES)), np.nan) for _ in range(2))
        q, net = columns
        q[:, COORDINATES.index(ankle)], net[:, COORDINATES.index(ankle)] = angle, torque
        yield _curve(walker, trial, "stance", side, q=q, net_torque=net)


def _curve(walker: Walker, trial: Trial, part: Part, side: Side, **known: Any) -> Stride:
    """Return a piece over 0 to 100 % of its own length, whose posture may not be known."""
    q = np.full((POINTS, len(COORDINATES)), np.nan)
    values: dict[str, Any] = {"q": q, "stances": {side: (0.0, 1.0)}, "part": part, "side": side}
    return Stride(trial.name, walker, np.linspace(0.0, 1.0, POINTS), **(values | known))


def _forces(trial: Trial, side: Side) -> np.ndarray:
    """Return (forward, up) on a foot in every frame [N], NaN where not measured, shape (n, 2)."""
    if trial.forces is None:
        raise ValueError(f"trial {trial.name} has no forces")
    return np.stack([trial.forces[f"force_{SUFFIX[side]}_{axis}"] for axis in "xz"], axis=1)


def article_stride(recorded: RecordedGait, from_toe_off: bool = False) -> Stride | None:
    """Return the stride with which the article's programs compared, None for other recordings.

    With `from_toe_off` it begins at the left toe-off before, if there is one; barefoot this is one
    frame earlier.
    """
    walker = recorded.walker
    rows = REFERENCE_STRIDES[walker.condition]
    trial = recorded.trial(rows.trial) if walker.patient.id == PATIENT else None
    if trial is None:
        return None
    offs = [off for off in _left_toe_offs(trial) if off <= rows.first]
    first = max(offs) if from_toe_off and offs else rows.first
    return _excerpt(walker, trial, "stride", first, rows.last)


def reference_stride(recorded: RecordedGait, name: str | None = None) -> Stride | None:
    """Return the recorded stride to compare with at equal time, from a left toe-off on.

    For the patient of the article it is that of the article, else that of the trial named, or the
    first; None if no trial was named and none shows such a stride.

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
    if article is not None and name in (None, article.name):
        return article
    strides = [s for s in (left_toe_off_stride(walker, t) for t in recorded.trials) if s]
    chosen = next((each for each in strides if name in (None, each.name)), None)
    if chosen is None and name is not None:
        raise DataError(
            "shows no stride from a left toe-off to the next one",
            where=f"recording {name}",
            allowed=", ".join(each.name for each in strides) or "no recording shows one",
        )
    return chosen


def left_toe_off_stride(walker: Walker, trial: Trial) -> Stride | None:
    """Return the first stride of a trial from one left toe-off to the next, or None."""
    offs = _left_toe_offs(trial)
    return _excerpt(walker, trial, "stride", offs[0], offs[1]) if len(offs) > 1 else None


def _left_toe_offs(trial: Trial) -> list[int]:
    """Return the frames in which the left toe leaves the ground."""
    return [e.frame for e in trial.events if (e.side, e.kind) == ("left", "toe_off")]
