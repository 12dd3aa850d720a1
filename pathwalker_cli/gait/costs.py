"""The cost of walking: every term of the objective as one object (docs/theory.md, 2.3 and 2.4).

A term is a few running costs and one expression in their integrals, written so that they take
numbers, arrays and CasADi expressions alike.  A further goal is an entry of `GOALS` and nothing
else: config, nonlinear program and results follow.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from pathwalker_cli.conventions import ANGLES, CONTACT_POINTS, COORDINATES, LEG_JOINTS, SUFFIX
from pathwalker_cli.gait import choices
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.model.contact import ContactPhase
from pathwalker_cli.model.skeleton import EVERY_JOINT, SIDES

if TYPE_CHECKING:
    from pathwalker_cli.model.walker import Walker

Weights = Mapping[str, float]
"""Weight of every term by its name; what is missing counts nothing."""


_BESIDE: Final = frozenset(joint.coordinate for joint in EVERY_JOINT.joints if joint.beside)


@dataclass(frozen=True)
class Instant:
    """What running costs see at one instant, or at many if every entry is an array.

    Args:
        phase: The contact phase.
        q: Generalised coordinates, 10 entries [m, rad].
        v: Generalised velocities, 10 entries [m/s, rad/s].
        activation: Activations, 14 entries.
        force: Contact forces of the phase in the order of `phase.forces` [N].
        force_rate: Their rates of change [N/s]; only collocation knows them.
        rate: Activation rates, 14 entries [1/s].
        excitation: Excitations, 14 entries.
        vdot: Generalised accelerations, 10 entries [m/s^2, rad/s^2].
        reserve: Reserve forces, 10 entries [N, N m].
        reference: Coordinates that are followed, 10 entries [m, rad].
        heights: Heights of the places in the air, in the order of the walker's pattern [m].
        speeds: Their forward velocities [m/s].
        cuffs: Forces of the orthoses' cuffs on the legs: right across, right along the shank, left
            across, left along [N]; 0 where none is worn.
        coordinates: Names of the coordinates.
        power: Power of the activations in the effort.
        data: Numbers of the term, see `CostTerm.size`.
    """

    phase: ContactPhase
    q: Sequence[Any]
    v: Sequence[Any]
    activation: Sequence[Any]
    force: Sequence[Any]
    force_rate: Sequence[Any] = field(default=(), kw_only=True)
    rate: Sequence[Any] = ()
    excitation: Sequence[Any] = ()
    vdot: Sequence[Any] = ()
    reserve: Sequence[Any] = ()
    reference: Sequence[Any] = ()
    heights: Sequence[Any] = ()
    speeds: Sequence[Any] = ()
    cuffs: Sequence[Any] = ()
    coordinates: Sequence[str] = field(default=COORDINATES, kw_only=True)
    power: int = field(default=2, kw_only=True)
    data: Sequence[Any] = ()

    @property
    def standing(self) -> dict[str, Any]:
        """How far each foot stands by its suffix: 1 on the ground, 0 in the air.

        What gives way passes from one to the other around the force from which a foot is loaded.
        """
        if not self.phase.compliant:
            return {SUFFIX[side]: float(side in self.phase.feet) for side in SIDES}
        loads = self.by_foot(self.force)
        return {side: load**2 / (load**2 + LOADED**2) for side, load in loads.items()}

    @property
    def vertical_force(self) -> dict[str, Any]:
        """Vertical force by contact point, 0 for points in the air [N]."""
        loads = {f.point.name: self.force[i] for i, f in enumerate(self.phase.forces) if f.bears}
        return {point: loads.get(point, 0.0) for point in CONTACT_POINTS}

    @property
    def own_vdot(self) -> tuple[Any, ...]:
        """Accelerations but for those of what turns beside a joint of the body."""
        pairs = zip(self.coordinates, self.vdot, strict=False)
        return tuple(value for name, value in pairs if name not in _BESIDE)

    def by_foot(self, values: Sequence[Any]) -> dict[str, Any]:
        """Return the sums of vertical components of each foot on the ground by its suffix."""
        sums: dict[str, Any] = {}
        for f, value in zip(self.phase.forces, values, strict=True):
            if f.bears:
                sums[SUFFIX[f.point.side]] = sums.get(SUFFIX[f.point.side], 0.0) + value
        return sums

    def angle(self, name: str) -> Any:
        """Return a coordinate by its name."""
        return self.q[self.coordinates.index(name)]


@dataclass(frozen=True)
class Totals:
    """What the value of a term is made of; expressions or numbers of a whole stride.

    Args:
        integrals: Integrals of the running costs by name.
        distance: Distance of the stride [m].
        time: Time of the stride [s].
        durations: Durations of the phases, of half a cycle those of one step [s].
        phases: The phases.
    """

    integrals: Mapping[str, Any]
    distance: Any
    time: Any
    durations: Sequence[Any]
    phases: Sequence[ContactPhase]


@dataclass(frozen=True)
class CostTerm:
    """A term of the objective.

    Args:
        summary: What it asks for, in words.
        integrals: Names of its running costs.
        integrands: The running costs at an instant, in that order.
        value: The term without its weight.
        unit: Unit of the value.
        size: How many numbers it takes, see `Instant.data`.
        whole_stride: Whether it makes no sense for half a cycle of a symmetric gait.
        collocation: Whether it needs what collocation alone knows, the rates of forces.
        per_distance: Whether the value is still to be divided by the distance.
        result: Its name among the cost terms of a result; "" for what only helps a start.
    """

    summary: str
    integrals: tuple[str, ...]
    integrands: Callable[[Instant], tuple[Any, ...]]
    value: Callable[[Totals], Any]
    unit: str
    size: int = 0
    whole_stride: bool = False
    collocation: bool = False
    per_distance: bool = False
    result: str = ""

    def worth(self, total: Totals) -> Any:
        """Return the term without its weight [unit]; a number or an expression."""
        value = self.value(total)
        return value / total.distance if self.per_distance else value


def _squares(name: str, size: float = 1.0) -> Callable[[Instant], tuple[Any, ...]]:
    """Return the sum of squares of what an instant holds under a name as a running cost."""
    return lambda point: (sum((value / size) ** 2 for value in getattr(point, name)),)


def _of(name: str) -> Callable[[Totals], Any]:
    """Return the integral of one running cost as a value."""
    return lambda total: total.integrals[name]


def _none(point: Instant) -> tuple[Any, ...]:
    return ()


def _effort(point: Instant) -> tuple[Any, ...]:
    return (sum(a**point.power for a in point.activation),)


def _distance_from_reference(point: Instant) -> tuple[Any, ...]:
    return (sum((a - b) ** 2 for a, b in zip(point.q, point.reference, strict=True)),)


BASE: Final[dict[str, CostTerm]] = {
    "effort": CostTerm(
        "little effort: activations to a power per distance, equation (9)",
        ("effort",), _effort, _of("effort"), "s/m", per_distance=True, result="effort_per_distance",
    ),
    "rate": CostTerm(
        "calm controls: squared activation rates per distance (regularisation)",
        ("rate",), _squares("rate", choices.RATE_SIZE), _of("rate"), "s/m", per_distance=True,
        result="rate_regularisation",
    ),
    "acceleration": CostTerm(
        "calm limbs: squared accelerations per distance (regularisation)",
        ("acceleration",), _squares("own_vdot", choices.ACCELERATION_SIZE), _of("acceleration"),
        "s/m", per_distance=True, result="acceleration_regularisation",
    ),
    "tracking": CostTerm(
        "follow a stride: integral of (q - q_ref)^2",
        ("tracking",), _distance_from_reference, _of("tracking"), "rad^2 s",
    ),
    "reserve": CostTerm(
        "no help from outside: integral of the squared reserve forces",
        ("reserve",), _squares("reserve", choices.FORCE_SIZE), _of("reserve"), "s",
    ),
    "smoothing": CostTerm(
        "calm muscles: integrals of squared activations and rates, not per distance",
        (), _none, lambda total: total.integrals["effort"] + total.integrals["rate"], "s",
    ),
    "walking_speed": CostTerm(
        "speed, equation (10)",
        (), _none, lambda total: -(total.distance / total.time), "m/s", result="walking_speed",
    ),
}  # fmt: skip
"""The terms of every gait by the names of their weights."""

EXCITATION: Final = CostTerm(
    "little excitation: integral of the squared excitations, equation (8)",
    ("excitation",), _squares("excitation"), _of("excitation"), "s",
    result="excitation_regularisation",
)  # fmt: skip
"""A further term of a passage that follows a recording; the other one, "fit", is the weight of the
sum over recorded instants of (q - q_recorded)^2."""


def _crouch(point: Instant) -> tuple[Any, ...]:
    knees = (on * point.angle(f"knee_{side}") ** 2 for side, on in point.standing.items())
    return (sum(knees),)


def _asymmetry(point: Instant) -> tuple[Any, ...]:
    speed = point.v[COORDINATES.index("pelvis_tx")]
    advance = speed if point.phase.step == SIDES[0] else 0.0 * speed
    return advance, *(point.angle(f"{j}_r") - point.angle(f"{j}_l") for j in LEG_JOINTS)


def _asymmetry_value(total: Totals) -> Any:
    advance, *differences = (total.integrals[name] for name in GOALS["asymmetry"].integrals)
    squares = [(2.0 * advance - total.distance) / total.distance]
    squares += [(first - second) / total.time for first, second in _pairs(total)]
    squares += [difference / total.time for difference in differences]
    return sum(square**2 for square in squares)


def _pairs(total: Totals) -> list[tuple[Any, Any]]:
    """Return the times of phases right and left; of unlike steps those of their supports."""
    timed = list(zip(total.phases, total.durations, strict=True))
    right, left = ([each for each in timed if each[0].step == side] for side in SIDES)
    if len(right) == len(left):
        return [(a, b) for (_, a), (_, b) in zip(right, left, strict=True)]

    def supported(step: list[tuple[ContactPhase, Any]], feet: int) -> Any:
        return sum(time for phase, time in step if len(phase.feet) == feet)

    return [(supported(right, feet), supported(left, feet)) for feet in (1, 2)]


def _pressure(point: Instant) -> tuple[Any, ...]:
    force, weight = point.vertical_force, point.data[0]
    return (sum(((force[f"toe_{s}"] - force[f"heel_{s}"]) / weight) ** 2 for s in "rl"),)


def _peak(point: Instant) -> tuple[Any, ...]:
    return (sum(a**choices.PEAK_POWER for a in point.activation),)


def _peak_value(total: Totals) -> Any:
    mean = total.integrals["peak_activation"] / total.time
    return (mean + choices.PEAK_FLOOR) ** (1.0 / choices.PEAK_POWER)


def _discomfort(point: Instant) -> tuple[Any, ...]:
    count, cost = len(ANGLES), 0.0
    for i, name in enumerate(ANGLES):
        angle, lower, upper = point.angle(name), point.data[i], point.data[count + i]
        cost = cost + _beyond(angle - upper) ** 2 + _beyond(lower - angle) ** 2
    return (cost,)


def _beyond(x: Any) -> Any:
    """Return x where it is positive and 0 elsewhere, rounded off."""
    return 0.5 * (x + (x * x + choices.COMFORT_ROUNDING**2) ** 0.5)


def _trunk_speed(point: Instant) -> tuple[Any, ...]:
    speeds = (point.v[COORDINATES.index(name)] for name in _TRUNK)
    return (sum(speeds) ** 2,)


def _trunk_lean(point: Instant) -> tuple[Any, ...]:
    return ((sum(map(point.angle, _TRUNK)) - point.data[0]) ** 2,)


def _foot_pitch(point: Instant) -> tuple[Any, ...]:
    cost = 0.0 * point.q[0]
    for side, on in point.standing.items():
        chain = ("pelvis_tilt", *(f"{joint}_{side}" for joint in LEG_JOINTS))
        cost = cost + (1.0 - on) * sum(map(point.angle, chain)) ** 2
    return (cost,)


def _stumbling(point: Instant) -> tuple[Any, ...]:
    count = len(point.heights)
    swings = (
        [1.0 - on for on in point.standing.values()] if point.phase.compliant else [1.0] * count
    )
    places = zip(point.heights, point.speeds, swings, strict=True)
    near = (s * v**2 / (1.0 + (h / choices.NEAR_GROUND) ** 2) ** 2 for h, v, s in places)
    return (sum(near, 0.0 * point.q[0]),)


def _loading_rate(point: Instant) -> tuple[Any, ...]:
    rates = point.by_foot(point.force_rate).values()
    return (sum((rate / point.data[0]) ** 2 for rate in rates),)


def _cuff_load(point: Instant) -> tuple[Any, ...]:
    (weight,) = point.data
    return (sum(((force / weight) ** 2 for force in point.cuffs), 0.0 * point.q[0]),)


def _mean(name: str) -> Callable[[Totals], Any]:
    """Return the mean over the stride of one running cost as a value."""
    return lambda total: total.integrals[name] / total.time


_TRUNK: Final = ("pelvis_tilt", "lumbar")
"""Coordinates whose sum is the forward lean of the trunk."""

GOALS: Final[dict[str, CostTerm]] = {
    "time": CostTerm(
        "get there: time per distance; its weight is what a second costs",
        (), _none, lambda total: total.time, "s/m", per_distance=True,
    ),
    "steady_trunk": CostTerm(
        "a steady trunk: squared angular velocity of the trunk, per distance",
        ("trunk_speed",), _trunk_speed, _of("trunk_speed"), "rad^2/(s m)", per_distance=True,
    ),
    "upright_trunk": CostTerm(
        "a trunk that leans as wanted: squared difference of its lean, per distance",
        ("trunk_lean",), _trunk_lean, _of("trunk_lean"), "rad^2 s/m", size=1, per_distance=True,
    ),
    "level_foot": CostTerm(
        "carry the foot level: squared pitch of feet in the air, per distance",
        ("foot_pitch",), _foot_pitch, _of("foot_pitch"), "rad^2 s/m", per_distance=True,
    ),
    "clear_ground": CostTerm(
        "swing the feet clear of the ground: squared forward speed of places in the air, a quarter "
        "of it at 1.5 cm of height and hardly any above 4, per distance",
        ("stumbling",), _stumbling, _of("stumbling"), "m/s", per_distance=True,
    ),
    "loading_rate": CostTerm(
        "load and unload the feet gently: squared rates of the vertical force on each foot in body "
        "weights per second, per distance",
        ("loading_rate",), _loading_rate, _of("loading_rate"), "1/(s m)", size=1,
        per_distance=True, collocation=True,
    ),
    "cuff_load": CostTerm(
        "spare the leg under the cuff: squared forces of the orthoses' cuffs in body weights, per "
        "distance",
        ("cuff_load",), _cuff_load, _of("cuff_load"), "s/m", size=1, per_distance=True,
    ),
    "crouch": CostTerm(
        "stand straighter: mean square of the knee flexion of stance",
        ("crouch",), _crouch, _mean("crouch"), "rad^2",
    ),
    "asymmetry": CostTerm(
        "equal left and right: steps, times of phases, mean hip, knee and ankle angles",
        ("first_advance", "hip_difference", "knee_difference", "ankle_difference"),
        _asymmetry, _asymmetry_value, "1", whole_stride=True,
    ),
    "centre_of_pressure": CostTerm(
        "less movement of the centre of pressure: mean square of its distance from the middle of "
        "the foot in half foot lengths, times the load of the foot in body weights",
        ("centre_of_pressure",), _pressure, _mean("centre_of_pressure"), "1", size=1,
    ),
    "peak_activation": CostTerm(
        "spare the muscle that works hardest: 8th root of the mean 8th power of all activations",
        ("peak_activation",), _peak, _peak_value, "1",
    ),
    "discomfort": CostTerm(
        "stay in comfortable joint ranges: mean square of how far angles are outside them",
        ("discomfort",), _discomfort, _mean("discomfort"), "rad^2", size=2 * len(ANGLES),
    ),
}  # fmt: skip
"""All goals by the name that configs and results use."""

SHIPPED: Final = frozenset(GOALS)
"""Those that come with this package: derivatives of others are not kept on disk."""

ELSEWHERE: Final[set[str]] = set()
"""Goals of runs that were read, which nothing here has registered: their configs can be read."""


@dataclass(frozen=True)
class Costs:
    """The terms of a problem: those of every gait, and the clinical goals that count.

    Args:
        names: Names of the goals that count, in the order of `GOALS`.
        activation_power: Power of the activations in the effort.
        comfort_ranges: Comfortable range by coordinate [rad].
        trunk_lean: Forward lean of the trunk that "upright_trunk" wants [rad].
        passage: Whether a recorded passage is followed, equation (8).
    """

    names: tuple[str, ...] = ()
    activation_power: int = 2
    comfort_ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    trunk_lean: float = 0.0
    passage: bool = False

    @property
    def structure(self) -> tuple[tuple[str, ...], int]:
        """What expressions depend on."""
        return self.names, self.activation_power

    @property
    def goals(self) -> dict[str, CostTerm]:
        """The clinical goals that count."""
        return {name: GOALS[name] for name in self.names}

    @property
    def terms(self) -> dict[str, CostTerm]:
        """All terms by the names of their weights, but that of the recorded instants."""
        last = {"excitation": EXCITATION} if self.passage else {}
        return {**BASE, **self.goals, **last}

    @property
    def weighed(self) -> tuple[str, ...]:
        """Names of all weights."""
        return (*self.terms, "fit")

    @property
    def integrals(self) -> tuple[str, ...]:
        """Names of all running costs."""
        return tuple(integral for term in self.terms.values() for integral in term.integrals)

    @property
    def size(self) -> int:
        """How many numbers the terms take."""
        return sum(term.size for term in self.terms.values())

    def numbers(self, walker: Walker) -> np.ndarray:
        """Return the numbers of all terms for a walker, shape (size,)."""
        wide = (-choices.NO_EDGE, choices.NO_EDGE)
        ranges = [self.comfort_ranges.get(name, wide) for name in ANGLES]
        known = {
            "upright_trunk": [self.trunk_lean],
            "centre_of_pressure": [walker.weight],
            "loading_rate": [walker.weight],
            "cuff_load": [walker.weight],
            "discomfort": np.array(ranges).T.ravel(),
        }
        return np.concatenate([np.zeros(0), *(known[n] for n in self.names if n in known)])

    def integrands(
        self, point: Instant, numbers: Sequence[Any], terms: Mapping[str, CostTerm] | None = None
    ) -> list[Any]:
        """Return the running costs at an instant, whose power and data are filled in here.

        Numbers are what `numbers` returns, or symbols for it.
        """
        values: list[Any] = []
        at = 0
        for term in (self.terms if terms is None else terms).values():
            data = numbers[at : at + term.size]
            values += term.integrands(replace(point, power=self.activation_power, data=data))
            at += term.size
        return values

    def objective(self, weights: Mapping[str, Any], total: Totals) -> Any:
        """Return what is minimised, but for the recorded instants; numbers or expressions."""
        terms = self.terms.items()
        shared = sum(weights[name] * term.value(total) for name, term in terms if term.per_distance)
        rest = [weights[name] * term.value(total) for name, term in terms if not term.per_distance]
        return sum(rest, shared / total.distance)

    def values(self, weights: Weights, total: Totals) -> dict[str, float]:
        """Return the weighed terms by the names that results give them."""
        return {
            term.result or name: float(weights.get(name, 0.0) * term.worth(total))
            for name, term in self.terms.items()
            if name in GOALS or term.result
        }

    def goal_values(self, total: Totals) -> dict[str, Any]:
        """Return the goals without weights by name."""
        return {name: term.worth(total) for name, term in self.goals.items()}
