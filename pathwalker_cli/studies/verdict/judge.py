"""The judge of an identification: solves its neighbourhood, and how far each number may move."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Final

import numpy as np

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.errors import InputError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.model.elements.orthosis import stops_of
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.patient.blocks import RealSpring
from pathwalker_cli.results.text import end_of
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.studies.measures import COMPARED, all_measures, slopes
from pathwalker_cli.studies.verdict import (
    LOADED,
    SHARE,
    STIFFER,
    NumberVerdict,
    SnappedSprings,
    StifferStops,
    StopVerdict,
    Verdict,
)
from pathwalker_cli.studies.verdict.edges import Edge, find_edge

_CANDIDATES: Final = 2
"""Real springs next to an identified stiffness that are considered."""


def verdict_of(solution: GaitSolution) -> Verdict | None:
    """Return the verdict on an identification, solving its neighbourhood.

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
    stops = tuple(map(judge.stop, _stops(judge.optimum.series)))
    stiffer = judge.stiffer_stops(stops)
    near = [o for o in solution.optima if o.converged]
    best = min((o.cost for o in near), default=0.0)
    return Verdict(
        springs=springs,
        numbers=tuple(v for u, v in verdicts.items() if not names.intersection(_full_names(u))),
        stops=stops,
        snapped=snapped,
        optima=tuple(o for o in near if o.cost <= best + SHARE * abs(best)),
        starts=len(near),
        solves=judge.solves,
        seconds=time.perf_counter() - began,
        stiffer_stops=stiffer,
    )


_STIFF: Final = 2.0
"""How many times as stiff stops are made that carry much."""


class _Judge:
    """Solves around an optimum."""

    def __init__(self, resolver: Resolver) -> None:
        self.resolver = resolver
        self.around = Neighbourhood(resolver)
        self.optimum = self.around.optimum
        self.solves = 0

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
        case = self.optimum.case.with_values(held(self.optimum.config, values))
        return self.resolver.resolve(case, start, insist)

    def stop(self, stop: StopVerdict) -> StopVerdict:
        """Return a stop with what more stiffness of it would change, if it carries much."""
        if stop.carried < LOADED:
            return stop
        by = self.around.by_factor(_stiffness_of(stop))
        changes = {key: STIFFER * slope for key, slope in slopes(by).items()}
        for unknown in self.around.free:
            ends = by.above.value(unknown) - by.below.value(unknown)
            changes[unknown.name] = STIFFER * ends / (2.0 * by.step)
        return replace(stop, stiffer=self._told(changes))

    def stiffer_stops(self, stops: Sequence[StopVerdict]) -> StifferStops | None:
        """Return the walk with all stops that carry much made stiffer, solved again."""
        places = [_stiffness_of(stop) for stop in stops if stop.carried >= LOADED]
        scale = dict(self.optimum.config.variation.scale)
        scale |= {place: scale.get(place, 1.0) * _STIFF for place in places}
        try:
            case = self.optimum.case.with_values({"variation.scale": scale})
            end = self.resolver.resolve(case) if places else None
        except InputError:  # no such stop can be computed exactly, or is allowed
            return None
        if end is None:
            return None
        self.solves += 1
        if not end.converged:
            return StifferStops(_STIFF, end.result.status, {})
        before, after = all_measures(self.optimum), all_measures(end)
        changes = {name: after[name] - value for name, value in before.items() if name in after}
        for unknown in self.around.free:
            changes[unknown.name] = end.value(unknown) - self.optimum.value(unknown)
        return StifferStops(_STIFF, end.result.status, self._told(changes))

    def _told(self, changes: dict[str, float]) -> dict[str, float]:
        """Return the changes that a verdict tells, that of the cost as a share."""
        names = (*(unknown.name for unknown in self.around.free), *COMPARED[1:])
        share = changes["cost"] / abs(self.optimum.cost)
        return {"cost": share, **{name: changes[name] for name in names}}

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
        end = self._solved({u: spring.stiffness for u, spring in best.items()})
        self.solves += 1
        rise = self._estimate(best)
        if end.converged:
            rise = end.cost - self.optimum.cost
        series = end.series
        each = {name: spring for u, spring in best.items() for name in _full_names(u)}
        return SnappedSprings(
            {name: spring.name for name, spring in each.items()},
            {name: spring.stiffness for name, spring in each.items()},
            rise / abs(self.optimum.cost),
            series.distance / series.duration,
            end.result.status,
        )

    def _estimate(self, choice: Mapping[Unknown, RealSpring]) -> float:
        """Return the rise of the cost to second order."""
        return self.around.rise(
            {u: spring.stiffness - self.optimum.value(u) for u, spring in choice.items()}
        )


def _stiffness_of(stop: StopVerdict) -> str:
    """Return the place of a stop's stiffness in the patient's file."""
    return f"orthosis.stop_stiffness.{stop.stop}.{stop.side}"


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
        torque = series.element_force[:, walker.columns([element])[0]]
        for stop in stops_of(fixed, *element.springs(walker.values)):
            beyond, resisting = stop.beyond(angle), np.maximum(-stop.sign * torque, 0.0)
            on_stop = np.where(beyond > 0.0, np.maximum(resisting - stop.spring, 0.0), 0.0)
            whole = float(weights @ resisting)
            yield StopVerdict(
                side,
                stop.name,
                float(stop.angle),
                float(beyond.max()),
                float(weights @ (beyond > 0.0) / weights.sum()),
                float(on_stop.max()),
                float(weights @ on_stop) / whole if whole else 0.0,
                float(stop.stiffness),
            )
