"""Clinical goals: terms of the objective that a config names and weighs (docs/theory.md, 2.4).

A goal is a few running costs and one expression in their integrals, written so that they take
numbers, arrays and CasADi expressions alike.  A further one is an entry of `GOALS` and nothing
else: config, nonlinear program and results follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import ANGLES, CONTACT_POINTS, COORDINATES, SUFFIX
from pathwalker_cli.model.contact import PHASES, ContactPhase

__all__ = ["COMFORT_COORDINATES", "GOALS", "Goal", "GoalPoint", "GoalTotals", "Goals"]

COMFORT_COORDINATES: Final = ANGLES
"""Coordinates that may have a comfortable range: all but the position of the pelvis."""

_PEAK_POWER: Final = 8
"""Power of the mean that stands for the largest activation."""
_PEAK_FLOOR: Final = 1e-6
"""Keeps the derivative of the root finite where no muscle is active: a peak of 0.18."""
_COMFORT_ROUNDING: Final = 0.01
"""Half width to which the edge of a comfortable range is rounded off [rad]."""
_UNBOUNDED: Final = 10.0
"""Edge of a comfortable range that is not given [rad]."""


@dataclass(frozen=True)
class GoalPoint:
    """What running costs see at one instant, or at many if every entry is an array.

    Args:
        q: Generalised coordinates, 10 entries [m, rad].
        v: Generalised velocities, 10 entries [m/s, rad/s].
        activation: Activations, 14 entries.
        vertical_force: Vertical force by contact point, 0 for points in the air [N].
        stance: Suffixes of the feet on the ground.
        first_step: Whether the phase belongs to the first half of the stride.
        data: Numbers of the goal, see `Goal.numbers`.
    """

    q: Sequence[Any]
    v: Sequence[Any]
    activation: Sequence[Any]
    vertical_force: Mapping[str, Any]
    stance: tuple[str, ...]
    first_step: bool
    data: Sequence[Any]

    @staticmethod
    def of(
        phase: ContactPhase,
        q: Sequence[Any],
        v: Sequence[Any],
        activation: Sequence[Any],
        force: Sequence[Any],
        data: Sequence[Any],
    ) -> GoalPoint:
        """Return an instant of a phase.

        Args:
            phase: The phase.
            q: Generalised coordinates.
            v: Generalised velocities.
            activation: Activations.
            force: Contact forces of the phase in the order of `phase.forces`.
            data: Numbers of the goal.
        """
        vertical = {f.point.name: force[i] for i, f in enumerate(phase.forces) if f.bears}
        everywhere = {point: vertical.get(point, 0.0) for point in CONTACT_POINTS}
        stance = tuple(sorted(SUFFIX[side] for side in phase.feet))
        first = PHASES.index(phase) < len(PHASES) // 2
        return GoalPoint(q, v, activation, everywhere, stance, first, data)

    def angle(self, name: str) -> Any:
        """Return a coordinate by its name."""
        return self.q[COORDINATES.index(name)]


@dataclass(frozen=True)
class GoalTotals:
    """What the value of a goal is made of; expressions or numbers of a whole stride.

    Args:
        integrals: Integrals of its running costs in their order.
        distance: Distance of the stride [m].
        time: Time of the stride [s].
        durations: Durations of the eight phases, or of four of half a cycle [s].
    """

    integrals: Sequence[Any]
    distance: Any
    time: Any
    durations: Sequence[Any]


@dataclass(frozen=True)
class Goal:
    """A term of the objective.

    Args:
        summary: What it asks for, in words.
        integrals: Names of its running costs.
        integrands: The running costs at an instant.
        value: The term without its weight.
        unit: Unit of the value.
        size: How many numbers it takes, see `GoalPoint.data`.
        whole_stride: Whether it makes no sense for half a cycle of a symmetric gait.
    """

    summary: str
    integrals: tuple[str, ...]
    integrands: Callable[[GoalPoint], tuple[Any, ...]]
    value: Callable[[GoalTotals], Any]
    unit: str
    size: int = 0
    whole_stride: bool = False


def _crouch(point: GoalPoint) -> tuple[Any, ...]:
    return (sum(point.angle(f"knee_{side}") ** 2 for side in point.stance),)


def _asymmetry(point: GoalPoint) -> tuple[Any, ...]:
    advance = point.v[0] if point.first_step else 0.0 * point.v[0]
    joints = ("hip", "knee", "ankle")
    return advance, *(point.angle(f"{j}_r") - point.angle(f"{j}_l") for j in joints)


def _asymmetry_value(total: GoalTotals) -> Any:
    advance, *differences = total.integrals
    half = len(PHASES) // 2
    pairs = [(total.durations[i], total.durations[i + half]) for i in range(half)]
    squares = [(2.0 * advance - total.distance) / total.distance]
    squares += [(first - second) / total.time for first, second in pairs]
    squares += [difference / total.time for difference in differences]
    return sum(square**2 for square in squares)


def _pressure(point: GoalPoint) -> tuple[Any, ...]:
    force, weight = point.vertical_force, point.data[0]
    return (sum(((force[f"toe_{s}"] - force[f"heel_{s}"]) / weight) ** 2 for s in "rl"),)


def _peak(point: GoalPoint) -> tuple[Any, ...]:
    return (sum(a**_PEAK_POWER for a in point.activation),)


def _peak_value(total: GoalTotals) -> Any:
    return (total.integrals[0] / total.time + _PEAK_FLOOR) ** (1.0 / _PEAK_POWER)


def _discomfort(point: GoalPoint) -> tuple[Any, ...]:
    count, cost = len(COMFORT_COORDINATES), 0.0
    for i, name in enumerate(COMFORT_COORDINATES):
        angle, lower, upper = point.angle(name), point.data[i], point.data[count + i]
        cost = cost + _beyond(angle - upper) ** 2 + _beyond(lower - angle) ** 2
    return (cost,)


def _beyond(x: Any) -> Any:
    """Return x where it is positive and 0 elsewhere, rounded off."""
    return 0.5 * (x + (x * x + _COMFORT_ROUNDING**2) ** 0.5)


def _mean(total: GoalTotals) -> Any:
    return total.integrals[0] / total.time


GOALS: Final[dict[str, Goal]] = {
    "crouch": Goal(
        "stand straighter: mean square of the knee flexion of stance",
        ("crouch",),
        _crouch,
        _mean,
        "rad^2",
    ),
    "asymmetry": Goal(
        "equal left and right: steps, times of phases, mean hip, knee and ankle angles",
        ("first_advance", "hip_difference", "knee_difference", "ankle_difference"),
        _asymmetry,
        _asymmetry_value,
        "1",
        whole_stride=True,
    ),
    "centre_of_pressure": Goal(
        "less movement of the centre of pressure: mean square of its distance from the middle of "
        "the foot in half foot lengths, times the load of the foot in body weights",
        ("centre_of_pressure",),
        _pressure,
        _mean,
        "1",
        size=1,
    ),
    "peak_activation": Goal(
        "spare the muscle that works hardest: 8th root of the mean 8th power of all activations",
        ("peak_activation",),
        _peak,
        _peak_value,
        "1",
    ),
    "discomfort": Goal(
        "stay in comfortable joint ranges: mean square of how far angles are outside them",
        ("discomfort",),
        _discomfort,
        _mean,
        "rad^2",
        size=2 * len(COMFORT_COORDINATES),
    ),
}
"""All goals by the name that configs and results use."""


@dataclass(frozen=True)
class Goals:
    """The goals of a problem.

    Args:
        names: Names of the goals that count, in the order of `GOALS`.
        activation_power: Power of the activations in the effort.
        comfort_ranges: Comfortable range by coordinate [rad].
    """

    names: tuple[str, ...] = ()
    activation_power: int = 2
    comfort_ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def structure(self) -> tuple[tuple[str, ...], int]:
        """What expressions depend on."""
        return self.names, self.activation_power

    @property
    def integrals(self) -> tuple[str, ...]:
        """Names of the running costs of all goals."""
        return tuple(integral for name in self.names for integral in GOALS[name].integrals)

    @property
    def size(self) -> int:
        """How many numbers the goals take."""
        return sum(GOALS[name].size for name in self.names)

    def numbers(self, weight: float) -> np.ndarray:
        """Return the numbers of all goals, shape (size,).

        Args:
            weight: Body weight with what is worn [N].
        """
        ranges = [
            self.comfort_ranges.get(name, (-_UNBOUNDED, _UNBOUNDED)) for name in COMFORT_COORDINATES
        ]
        known = {
            "centre_of_pressure": np.array([weight]),
            "discomfort": np.array(ranges).T.ravel(),
        }
        return np.concatenate([np.zeros(0), *(known[n] for n in self.names if n in known)])

    def integrands(
        self,
        phase: ContactPhase,
        q: Sequence[Any],
        v: Sequence[Any],
        activation: Sequence[Any],
        force: Sequence[Any],
        numbers: Sequence[Any],
    ) -> list[Any]:
        """Return the running costs of all goals at an instant of a phase.

        Args:
            phase: The phase.
            q: Generalised coordinates.
            v: Generalised velocities.
            activation: Activations.
            force: Contact forces in the order of `phase.forces`.
            numbers: What `numbers` returns, or symbols for it.
        """
        found: list[Any] = []
        at = 0
        for name in self.names:
            goal = GOALS[name]
            data = numbers[at : at + goal.size]
            found += goal.integrands(GoalPoint.of(phase, q, v, activation, force, data))
            at += goal.size
        return found

    def values(
        self, integrals: Mapping[str, Any], distance: Any, time: Any, durations: Sequence[Any]
    ) -> dict[str, Any]:
        """Return the terms without weights by name.

        Args:
            integrals: Integrals of running costs over a stride by name.
            distance: Distance of the stride [m].
            time: Time of the stride [s].
            durations: Durations of its phases [s].
        """
        return {
            name: GOALS[name].value(
                GoalTotals([integrals[i] for i in GOALS[name].integrals], distance, time, durations)
            )
            for name in self.names
        }
