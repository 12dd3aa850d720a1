"""How sure an identified number is: its limits, the cost around it, stops, and real springs."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import SIDES, STIFFNESSES
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum
from pathwalker_cli.io.refusals import dotted
from pathwalker_cli.model.elements.orthosis import AnkleOrthosis
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.patient.blocks import RealSpring
from pathwalker_cli.results.text import end_of
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.studies.edges import Edge, find_edge

__all__ = [
    "SHARE",
    "NumberVerdict",
    "SnappedSprings",
    "StopVerdict",
    "Verdict",
    "verdict_of",
    "verdict_of_metrics",
]

SHARE: Final = 0.05
"""Rise of the cost that still counts as good."""

_DETERMINED: Final = 0.25
"""Share of the range of springs up to which a region determines a spring."""

_ROUGHLY: Final = 0.75
"""Share of the range of springs up to which a region still says something."""

_CANDIDATES: Final = 2
"""Real springs next to an identified stiffness that are considered."""


@dataclass(frozen=True)
class NumberVerdict:
    """What is known of one identified number; the others follow when it moves.

    Args:
        name: Its name: of a spring as in `conventions.STIFFNESSES`, else of the unknown.
        label: Its name for people.
        unit: SI unit.
        value: Identified value [unit].
        range: Allowed values [unit].
        limit: "lower" or "upper" if it sits at a limit of its range, else "".
        gradient: Relative change of the cost per unit; 0 inside the range.
        curvature: Relative second derivative of the cost [1/unit^2].
        region: Values within which the cost stays within `SHARE` of the best [unit].
        open_ends: Whether the region reaches the lower and the upper limit of the range.
        certain: Whether solves enclose both ends of the region.
        again: Whether the cost is within `SHARE` again at the lower and the upper limit, beyond
            the region: another local optimum.
        tied: Whether both sides are one number.
    """

    name: str
    label: str
    unit: str
    value: float
    range: tuple[float, float]
    limit: str
    gradient: float
    curvature: float
    region: tuple[float, float]
    open_ends: tuple[bool, bool]
    certain: bool
    again: tuple[bool, bool] = (False, False)
    tied: bool = False

    @property
    def prescribed(self) -> bool:
        """Whether the config leaves no choice."""
        return self.range[0] == self.range[1]

    @property
    def width(self) -> float:
        """Share of the range that the region covers; 0 of a range without width."""
        if self.prescribed:
            return 0.0
        return (self.region[1] - self.region[0]) / (self.range[1] - self.range[0])

    @property
    def determined(self) -> str:
        """How well least effort determines the number, in words."""
        if self.prescribed:
            return "prescribed"
        if any(self.again) or self.width > _ROUGHLY:
            return "not determined"
        if self.limit:
            return "set by its limit"
        return "determined" if self.width <= _DETERMINED else "roughly determined"


@dataclass(frozen=True)
class StopVerdict:
    """Whether a hard stop is reached.

    Args:
        side: "right" or "left".
        stop: "dorsiflexion" or "plantarflexion".
        angle: Angle of the stop [rad].
        excess: How far the ankle goes beyond it at most [rad]; negative if it is not reached.
        share: Share of the stride beyond it.
    """

    side: str
    stop: str
    angle: float
    excess: float
    share: float


@dataclass(frozen=True)
class SnappedSprings:
    """The best choice among the springs that exist.

    Args:
        names: Name of the spring for each identified one.
        stiffness: Their stiffness [N m/rad].
        rise: What the cost rises by, as a share, all else solved again.
        walking_speed: Walking speed with them [m/s].
        status: "converged", or why not: then `rise` is an estimate.
    """

    names: dict[str, str]
    stiffness: dict[str, float]
    rise: float
    walking_speed: float
    status: str


@dataclass(frozen=True)
class Verdict:
    """All that is known about an identification.

    Args:
        springs: Every spring, in the order of `conventions.STIFFNESSES`.
        numbers: Every other number that was free to choose.
        stops: Every hard stop.
        snapped: The choice among real springs; None where the file lists none.
        optima: Other local optima within `SHARE` of the best.
        starts: Number of starts that converged.
        solves: Problems that were solved for this.
        seconds: Wall seconds it took.
    """

    springs: tuple[NumberVerdict, ...]
    numbers: tuple[NumberVerdict, ...]
    stops: tuple[StopVerdict, ...]
    snapped: SnappedSprings | None
    optima: tuple[LocalOptimum, ...]
    starts: int
    solves: int
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values; SI units, shares of 1."""
        plain = asdict(self)
        for key in ("springs", "numbers"):
            for entry, number in zip(plain[key], getattr(self, key), strict=True):
                entry["determined"], entry["width"] = number.determined, number.width
        for entry in plain["springs"]:
            entry["spring"], entry["stiffness"] = entry.pop("name"), entry.pop("value")
        return plain


def verdict_of(solution: GaitSolution) -> Verdict | None:
    """Return the verdict on an identification, solving its neighbourhood.

    Args:
        solution: A converged solution by collocation.

    Returns:
        None where there is no number to judge: nothing free to choose, half a cycle (where both
        sides are one), or a solution that is not one.
    """
    config = solution.config
    if not solution.converged or not solution.walker.unknowns:
        return None
    if config.half_cycle or config.transcription != "collocation":
        return None
    began = time.perf_counter()
    resolver = Resolver(solution.case, solution.last_motion, solution.nlp.multipliers)
    judge = _Judge(resolver)
    if not judge.around.free or not judge.optimum.converged:
        return None
    verdicts = {unknown: judge.number(unknown) for unknown in judge.optimum.solver.walker.unknowns}
    springs = tuple(_springs(verdicts))
    names = {spring.name for spring in springs}
    snapped = judge.snapped()
    near = [o for o in solution.optima if o.converged]
    best = min((o.cost for o in near), default=0.0)
    return Verdict(
        springs=springs,
        numbers=tuple(v for u, v in verdicts.items() if not names.intersection(_full_names(u))),
        stops=tuple(_stops(judge.optimum.series)),
        snapped=snapped,
        optima=tuple(o for o in near if o.cost <= best + SHARE * abs(best)),
        starts=len(near),
        solves=judge.solves,
        seconds=time.perf_counter() - began,
    )


def verdict_of_metrics(metrics: Mapping[str, Any]) -> Verdict | None:
    """Return the verdict that the metrics of a run hold, None without one.

    Raises:
        DataError: If it is not one that `Verdict.as_dict` wrote.
    """
    plain = metrics.get("verdict")
    if plain is None:
        return None
    where, mend = "verdict in metrics.json", "solve again"
    try:
        verdict = TypeAdapter(Verdict).validate_python(_renamed(plain))
    except ValidationError as problem:
        first = problem.errors()[0]
        what = f"{dotted(first['loc'])}: {first['msg'].lower()}"
        raise DataError(what, where=where, mend=mend) from None
    what = _contradiction(verdict)
    if what:
        raise DataError(what, where=where, mend=mend)
    return verdict


def _renamed(plain: Any) -> Any:
    """Return plain values under the names of the fields; what is malformed stays."""
    if not isinstance(plain, dict) or not isinstance(plain.get("springs"), list):
        return plain
    springs = []
    for entry in plain["springs"]:
        if isinstance(entry, dict):
            entry = {"unit": "N m/rad", "label": "", **entry}
            for old, new in (("spring", "name"), ("stiffness", "value")):
                if old in entry:
                    entry[new] = entry.pop(old)
            entry["label"] = entry["label"] or _spring_label(str(entry.get("name")))
        springs.append(entry)
    return {"numbers": [], **plain, "springs": springs}


def _spring_label(name: str) -> str:
    known = {n.full_name: n for side in SIDES for n in AnkleOrthosis(side).numbers[:2]}
    return Unknown.of(known[name]).label if name in known else name


def _contradiction(verdict: Verdict) -> str:
    """Return what cannot be in a verdict that was read, "" if it is in order."""
    names = {spring.name for spring in verdict.springs}
    snapped = verdict.snapped
    if not names <= set(STIFFNESSES):
        return f"names the spring {min(names - set(STIFFNESSES))}"
    if snapped is not None and not snapped.names.keys() == snapped.stiffness.keys() <= names:
        return "chooses real springs for others than were identified"
    if any(len(optimum.stiffness) < len(names) for optimum in verdict.optima):
        return "holds an optimum that lacks a stiffness"
    for number in (*verdict.springs, *verdict.numbers):
        if number.range[0] > number.range[1] or number.limit not in ("", "lower", "upper"):
            return f"holds a range or a limit of {number.name} that is none"
    return ""


class _Judge:
    """Solves around an optimum."""

    def __init__(self, resolver: Resolver) -> None:
        self.resolver = resolver
        self.around = Neighbourhood(resolver)
        self.optimum = self.around.optimum
        self.solves = 0

    @property
    def config(self) -> StudyConfig:
        """The config of the optimum."""
        return self.optimum.config

    def number(self, unknown: Unknown) -> NumberVerdict:
        """Return the verdict on one number."""
        value, limits = self.optimum.value(unknown), self.optimum.range(unknown)
        about = (unknown.name, unknown.label, unknown.unit, value)
        tied = len(unknown.numbers) > 1
        if unknown not in self.around.free:
            only = (value, value)
            return NumberVerdict(
                *about, only, "", 0.0, 0.0, only, (True, True), certain=True, tied=tied
            )
        which = self.around.free.index(unknown)
        size = abs(self.optimum.cost)
        gradient = float(self.around.cost_gradient[which]) / size
        curvature = self.around.curvature(unknown) / size
        limit = end_of(value, limits)
        edges = []
        for end, sign in zip(limits, (-1.0, 1.0), strict=True):
            if limit == {-1.0: "lower", 1.0: "upper"}[sign]:
                edges.append(Edge(end, True, 0.0, True, 0, 0))
                continue
            step = _quadratic_edge(sign * gradient if limit else 0.0, curvature)
            edges.append(self._edge(unknown, value, end, step, not limit))
        return NumberVerdict(
            *about,
            limits,
            limit,
            gradient if limit else 0.0,
            curvature,
            (edges[0].value, edges[1].value),
            (edges[0].limit, edges[1].limit),
            all(edge.certain for edge in edges),
            (edges[0].again, edges[1].again),
            tied,
        )

    def _edge(self, unknown: Unknown, start: float, end: float, step: float, look: bool) -> Edge:
        """Return an edge; a cost that slopes from a limit is not searched for another basin."""

        def solve(value: float, near: Optimum, insist: bool) -> Optimum:
            return self._solved({unknown: value}, near, insist)

        edge = find_edge(solve, self.optimum, start, end, SHARE, step, look)
        self.solves += edge.solves
        return edge

    def _solved(
        self, values: Mapping[Unknown, float], start: Optimum | None = None, insist: bool = True
    ) -> Optimum:
        """Return the neighbour with some numbers prescribed."""
        case = self.optimum.case.with_values(held(self.config, values))
        return self.resolver.resolve(case, start, insist)

    def snapped(self) -> SnappedSprings | None:
        """Return the best choice among the springs that exist, solved again."""
        orthosis = self.optimum.solver.walker.patient.orthosis
        if orthosis is None or orthosis.springs is None:
            return None
        kinds = {u: u.numbers[0].name.removesuffix("_stiffness") for u in self.around.free}
        springs = [u for u, kind in kinds.items() if hasattr(orthosis.springs, kind)]
        if not springs:
            return None
        lists = [
            _nearest(
                getattr(orthosis.springs, kinds[u]), self.optimum.value(u), self.optimum.range(u)
            )
            for u in springs
        ]
        choices = [dict(zip(springs, choice, strict=True)) for choice in itertools.product(*lists)]
        best = min(choices, key=self._estimate)
        found = self._solved({u: spring.stiffness for u, spring in best.items()})
        self.solves += 1
        rise = self._estimate(best)
        if found.converged:
            rise = found.cost - self.optimum.cost
        series = found.series
        each = {name: spring for u, spring in best.items() for name in _full_names(u)}
        return SnappedSprings(
            {name: spring.name for name, spring in each.items()},
            {name: spring.stiffness for name, spring in each.items()},
            rise / abs(self.optimum.cost),
            series.distance / series.duration,
            found.result.status,
        )

    def _estimate(self, choice: Mapping[Unknown, RealSpring]) -> float:
        """Return the rise of the cost to second order."""
        return self.around.rise(
            {u: spring.stiffness - self.optimum.value(u) for u, spring in choice.items()}
        )


def _full_names(unknown: Unknown) -> tuple[str, ...]:
    return tuple(number.full_name for number in unknown.numbers)


def _springs(verdicts: Mapping[Unknown, NumberVerdict]) -> Iterator[NumberVerdict]:
    """Yield the verdict on every spring, in order; tied ones share theirs."""
    of = {name: (u, v) for u, v in verdicts.items() for name in _full_names(u)}
    for name in STIFFNESSES:
        if name in of:
            unknown, verdict = of[name]
            number = next(n for n in unknown.numbers if n.full_name == name)
            yield replace(verdict, name=name, label=Unknown.of(number).label)


def _quadratic_edge(slope: float, curvature: float) -> float:
    """Return the distance at which slope d + curvature d^2 / 2 reaches `SHARE` [N m/rad]."""
    slope, curvature = max(slope, 0.0), max(curvature, 1e-9)
    return float((np.sqrt(slope**2 + 2.0 * curvature * SHARE) - slope) / curvature)


def _nearest(
    springs: Sequence[RealSpring], stiffness: float, allowed: tuple[float, float]
) -> list[RealSpring]:
    """Return the real springs next to a stiffness, if possible those that are allowed."""
    within = [spring for spring in springs if allowed[0] <= spring.stiffness <= allowed[1]]
    by_distance = sorted(within or springs, key=lambda spring: abs(spring.stiffness - stiffness))
    return by_distance[:_CANDIDATES]


def _stops(series: GaitSeries) -> Iterator[StopVerdict]:
    """Yield how far the ankles go into every hard stop."""
    weights, walker = series.quadrature, series.walker
    for side, element in walker.device.elements.items():
        fixed, angle = element.fixed(walker.values), series.column(*element.coordinates)
        for stop, limit, sign in (
            ("dorsiflexion", fixed.dorsiflexion_stop, -1.0),
            ("plantarflexion", fixed.plantarflexion_stop, 1.0),
        ):
            beyond = sign * (angle - limit)
            share = float(weights @ (beyond > 0.0) / weights.sum())
            yield StopVerdict(side, stop, float(limit), float(beyond.max()), share)
