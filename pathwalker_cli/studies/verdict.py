"""How sure an identified stiffness is: its limits, the cost around it, stops, and real springs."""

from __future__ import annotations

import itertools
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import Any, Final

import numpy as np
from pydantic import TypeAdapter, ValidationError

from pathwalker_cli.config import StudyConfig, with_values
from pathwalker_cli.conventions import SIDES, STIFFNESSES
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum
from pathwalker_cli.io.refusals import dotted
from pathwalker_cli.model.walker import ANKLES
from pathwalker_cli.patient.blocks import RealSpring
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.studies.edges import Edge, find_edge
from pathwalker_cli.studies.springs import spring_ranges

__all__ = [
    "SHARE",
    "SnappedSprings",
    "SpringVerdict",
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
class SpringVerdict:
    """What is known of one spring; the other springs follow when it moves.

    Args:
        spring: Its name, as in `conventions.STIFFNESSES`.
        stiffness: Identified stiffness [N m/rad].
        range: Allowed stiffness [N m/rad].
        limit: "lower" or "upper" if it sits at a limit of its range, else "".
        gradient: Relative change of the cost per N m/rad; 0 inside the range.
        curvature: Relative second derivative of the cost [1/(N m/rad)^2].
        region: Stiffness within which the cost stays within `SHARE` of the best [N m/rad].
        open_ends: Whether the region reaches the lower and the upper limit of the range.
        certain: Whether solves enclose both ends of the region.
        again: Whether the cost is within `SHARE` again at the lower and the upper limit, beyond
            the region: another local optimum.
    """

    spring: str
    stiffness: float
    range: tuple[float, float]
    limit: str
    gradient: float
    curvature: float
    region: tuple[float, float]
    open_ends: tuple[bool, bool]
    certain: bool
    again: tuple[bool, bool] = (False, False)

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
        """How well least effort determines the spring, in words."""
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
        stops: Every hard stop.
        snapped: The choice among real springs; None where the file lists none.
        optima: Other local optima within `SHARE` of the best.
        starts: Number of starts that converged.
        solves: Problems that were solved for this.
        seconds: Wall seconds it took.
    """

    springs: tuple[SpringVerdict, ...]
    stops: tuple[StopVerdict, ...]
    snapped: SnappedSprings | None
    optima: tuple[LocalOptimum, ...]
    starts: int
    solves: int
    seconds: float

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values; SI units, shares of 1."""
        plain = asdict(self)
        for entry, spring in zip(plain["springs"], self.springs, strict=True):
            entry["determined"], entry["width"] = spring.determined, spring.width
        return plain


def verdict_of(solution: GaitSolution) -> Verdict | None:
    """Return the verdict on an identification, solving its neighbourhood.

    Args:
        solution: A converged solution by collocation.

    Returns:
        None where there is no spring to judge: barefoot, all springs prescribed, half a cycle
        (where both sides are one), or a solution that is not one.
    """
    config = solution.config
    if not solution.converged or config.condition != "orthosis":
        return None
    if config.half_cycle or config.transcription != "collocation":
        return None
    began = time.perf_counter()
    resolver = Resolver(config, solution.last_motion, solution.nlp.multipliers)
    judge = _Judge(resolver)
    if not judge.around.springs or not judge.optimum.converged:
        return None
    springs = tuple(map(judge.spring, STIFFNESSES))
    snapped = judge.snapped()
    near = [o for o in solution.optima if o.converged]
    best = min((o.cost for o in near), default=0.0)
    return Verdict(
        springs=springs,
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
        verdict = TypeAdapter(Verdict).validate_python(plain)
    except ValidationError as problem:
        first = problem.errors()[0]
        what = f"{dotted(first['loc'])}: {first['msg'].lower()}"
        raise DataError(what, where=where, mend=mend) from None
    what = _contradiction(verdict)
    if what:
        raise DataError(what, where=where, mend=mend)
    return verdict


def _contradiction(verdict: Verdict) -> str:
    """Return what cannot be in a verdict that was read, "" if it is in order."""
    names = {spring.spring for spring in verdict.springs}
    snapped = verdict.snapped
    if not names <= set(STIFFNESSES):
        return f"names the spring {min(names - set(STIFFNESSES))}"
    if snapped is not None and not snapped.names.keys() == snapped.stiffness.keys() == names:
        return "chooses real springs for others than were identified"
    if any(len(optimum.stiffness) < len(names) for optimum in verdict.optima):
        return "holds an optimum that lacks a stiffness"
    for spring in verdict.springs:
        if spring.range[0] > spring.range[1] or spring.limit not in ("", "lower", "upper"):
            return f"holds a range or a limit of {spring.spring} that is none"
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

    def spring(self, name: str) -> SpringVerdict:
        """Return the verdict on one spring."""
        ranges = spring_ranges(self.optimum)
        stiffness = dict(zip(STIFFNESSES, self.optimum.stiffness.tolist(), strict=True))
        if name not in self.around.springs:
            only = (stiffness[name], stiffness[name])
            return SpringVerdict(name, only[0], only, "", 0.0, 0.0, only, (True, True), True)
        which = self.around.springs.index(name)
        size = abs(self.optimum.cost)
        gradient = float(self.around.cost_gradient[which]) / size
        curvature = self.around.curvature(name) / size
        limit = spring_ends(stiffness, ranges).get(name, "")
        edges = []
        for end, sign in zip(ranges[name], (-1.0, 1.0), strict=True):
            if limit == {-1.0: "lower", 1.0: "upper"}[sign]:
                edges.append(Edge(end, True, 0.0, True, 0, 0))
                continue
            step = _quadratic_edge(sign * gradient if limit else 0.0, curvature)
            edges.append(self._edge(name, stiffness[name], end, step, not limit))
        return SpringVerdict(
            name,
            stiffness[name],
            ranges[name],
            limit,
            gradient if limit else 0.0,
            curvature,
            (edges[0].stiffness, edges[1].stiffness),
            (edges[0].limit, edges[1].limit),
            all(edge.certain for edge in edges),
            (edges[0].again, edges[1].again),
        )

    def _edge(self, name: str, start: float, end: float, step: float, look: bool) -> Edge:
        """Return an edge; a cost that slopes from a limit is not searched for another basin."""
        held = partial(self._held, name)
        edge = find_edge(held, self.optimum, start, end, SHARE, step, look)
        self.solves += edge.solves
        return edge

    def _held(self, name: str, stiffness: float, start: Optimum, insist: bool) -> Optimum:
        return self._solved({name: stiffness}, start, insist)

    def _solved(
        self, springs: dict[str, float], start: Optimum | None = None, insist: bool = True
    ) -> Optimum:
        """Return the neighbour with some springs prescribed."""
        held = {name: [value, value] for name, value in springs.items()}
        values = {**self.config.bounds.model_dump(mode="json")["stiffness"], **held}
        config = with_values(self.config, {"bounds.stiffness": values})
        return self.resolver.resolve(config, start, insist)

    def snapped(self) -> SnappedSprings | None:
        """Return the best choice among the springs that exist, solved again."""
        real = self.optimum.solver.walker.patient.require_orthosis().springs
        if real is None:
            return None
        names = self.around.springs
        stiffness = np.array([self.optimum.stiffness[STIFFNESSES.index(n)] for n in names])
        ranges = spring_ranges(self.optimum)
        lists = [
            _nearest(getattr(real, name.split("_")[0]), value, ranges[name])
            for name, value in zip(names, stiffness, strict=True)
        ]
        best = min(itertools.product(*lists), key=lambda choice: self._estimate(choice, stiffness))
        springs = {name: spring.stiffness for name, spring in zip(names, best, strict=True)}
        found = self._solved(springs)
        self.solves += 1
        rise = self._estimate(best, stiffness)
        if found.converged:
            rise = found.cost - self.optimum.cost
        series = found.series
        return SnappedSprings(
            {name: spring.name for name, spring in zip(names, best, strict=True)},
            springs,
            rise / abs(self.optimum.cost),
            series.distance / series.duration,
            found.result.status,
        )

    def _estimate(self, choice: Sequence[RealSpring], stiffness: np.ndarray) -> float:
        """Return the rise of the cost to second order."""
        moved = np.array([spring.stiffness for spring in choice]) - stiffness
        around = self.around
        return float(around.cost_gradient @ moved + moved @ around.cost_hessian @ moved / 2.0)


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
    assert series.walker.orthosis is not None  # noqa: S101 - verdicts are for orthoses
    weights = series.quadrature
    rows = dict(zip(SIDES, ANKLES, strict=True))
    for side, fixed in zip(SIDES, series.walker.orthosis, strict=True):
        angle = series.q[:, rows[side]]
        for stop, limit, sign in (
            ("dorsiflexion", fixed.dorsiflexion_stop, -1.0),
            ("plantarflexion", fixed.plantarflexion_stop, 1.0),
        ):
            beyond = sign * (angle - limit)
            share = float(weights @ (beyond > 0.0) / weights.sum())
            yield StopVerdict(side, stop, float(limit), float(beyond.max()), share)
