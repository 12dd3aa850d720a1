"""The landscape: cost over the two spring stiffnesses of a side, everything else optimal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final, Literal

import numpy as np
from pydantic import Field, model_validator

from pathwalker_cli.case import Case
from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import ConfigError, NotConvergedError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.patient.blocks import Stiffness
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import NeighbourStudy, Plan, StudyKind, Work
from pathwalker_cli.studies.branches import Exploration, Graph, Rules, Values, explore
from pathwalker_cli.studies.landscape.result import ROOT, Landscape, Point
from pathwalker_cli.studies.landscape.text import (
    FILES,
    landscape_content,
    landscape_lines,
    write_tables,
)
from pathwalker_cli.studies.measures import free_units, measures
from pathwalker_cli.studies.neighbours import Neighbours, motion_distance, motion_signature

_KINDS: Final = ("dorsiflexion", "plantarflexion")

_BETTER: Final = 1e-3
"""Share of the cost by which the grid must beat the optimum for the two to be different ones."""


class Axis(YamlModel):
    """Values of one stiffness."""

    from_: Stiffness | None = Field(default=None, alias="from")
    to: Stiffness | None = None
    points: Annotated[int, Field(ge=2, le=40)] = 8
    spacing: Literal["logarithmic", "linear"] = "logarithmic"
    values: Annotated[tuple[Stiffness, ...], AS_TUPLE] = ()

    @model_validator(mode="before")
    @classmethod
    def _list(cls, value: Any) -> Any:
        return {"values": value} if isinstance(value, list | tuple) else value

    @model_validator(mode="after")
    def _rising(self) -> Axis:
        ends = [end for end in (self.from_, self.to) if end is not None]
        given = self.values or tuple(ends)
        if any(a >= b for a, b in pairwise(given)):
            raise invalid("does not rise", allowed="values in rising order, each once")
        if self.values and ends:
            raise invalid("has values and ends", allowed="values, or from and to")
        if len(self.values) == 1:
            raise invalid("has one value", allowed="two or more: one is no axis")
        return self


class LandscapeStudy(NeighbourStudy):
    """A landscape around the optimum of a problem with orthoses."""

    side: Literal["right", "left", "both"] = "both"
    dorsiflexion: Axis = Axis()
    plantarflexion: Axis = Axis()
    tolerance: Annotated[float, Quantity("", 1e-4, 1.0, above="is it in percent?")] = 0.05
    leaps: bool = True
    sweeps: Annotated[int, Field(ge=0, le=20)] = 6
    max_iterations: Annotated[int, Field(ge=20, le=100000)] = 200

    @property
    def sides(self) -> tuple[str, ...]:
        """Sides whose springs are varied."""
        return SIDES if self.side == "both" else (self.side,)


def axis_values(
    axis: Axis, allowed: tuple[float, float], name: str, real: Sequence[float] = ()
) -> np.ndarray:
    """Return the values of an axis, rising [N m/rad], shape (n,).

    Args:
        axis: What was asked for.
        allowed: Lowest and highest stiffness that the base allows [N m/rad].
        name: Key of the axis, for the message.
        real: Springs that exist [N m/rad]: the value next to each gives way to it.

    Raises:
        ConfigError: If the ends are upside down.
    """
    if axis.values:
        return np.array(axis.values)
    low = allowed[0] if axis.from_ is None else axis.from_
    high = allowed[1] if axis.to is None else axis.to
    if low >= high:
        raise ConfigError(
            f"runs from {low:g} to {high:g} N m/rad", where=name, allowed="from below to",
            mend="give both ends: what is left out is the range of the base",
        )  # fmt: skip
    space = np.geomspace if axis.spacing == "logarithmic" else np.linspace
    values = np.asarray(space(low, high, axis.points))
    for spring in real:
        if low <= spring <= high:
            values[np.argmin(np.abs(values - spring))] = spring
    return values


Springs = tuple[tuple[Unknown, ...], ...]
"""The unknowns that are varied as K_D, and as K_P."""


def varied_springs(study: LandscapeStudy, unknowns: Sequence[Unknown]) -> Springs:
    """Return the unknowns that stand for K_D and for K_P of the sides of a study.

    Raises:
        ConfigError: If one of them sets the spring of the other side too.
    """
    springs = []
    for kind in _KINDS:
        names = {f"{kind}_stiffness_{side}" for side in study.sides}
        full = {u: {number.full_name for number in u.numbers} for u in unknowns}
        springs.append(tuple(u for u in unknowns if names & full[u]))
        if any(full[u] - names for u in springs[-1]):
            raise ConfigError(
                f"is {study.side}, but the problem chooses one {kind} stiffness for both sides",
                where="side",
                allowed="both",
                mend="or free each side for itself in the base",
            )
    return tuple(springs)


def _axes(study: LandscapeStudy, solver: GaitSolver) -> tuple[Springs, list[np.ndarray]]:
    """Return the unknowns that are varied, and the values of both axes [N m/rad]."""
    springs, ranges = varied_springs(study, solver.walker.unknowns), solver.bounds.ranges
    orthosis = solver.walker.patient.orthosis
    lists = None if orthosis is None else orthosis.springs
    real = {k: [s.stiffness for s in getattr(lists, k)] if lists else [] for k in _KINDS}
    values = [
        axis_values(getattr(study, kind), ranges[unknowns[0].name], kind, real[kind])
        for kind, unknowns in zip(_KINDS, springs, strict=True)
    ]
    return springs, values


def on_worn_side(study: LandscapeStudy, walker: Walker) -> LandscapeStudy:
    """Return a study of the only side that wears an orthosis; itself where both do.

    Raises:
        ConfigError: If it asks for the side that wears none.
    """
    worn = tuple(walker.device.elements)
    if len(worn) != 1:
        return study
    if study.side not in (*worn, "both"):
        raise ConfigError(
            f"is {study.side}, a side that wears no orthosis", where="side", allowed=worn[0]
        )
    return study.model_copy(update={"side": worn[0]})


def plan(study: LandscapeStudy, solver: GaitSolver) -> Plan:
    """Return the size of the grid."""
    study = on_worn_side(study, solver.walker)
    _, (k_d, k_p) = _axes(study, solver)
    does = (
        f"a grid of {k_d.size} x {k_p.size} stiffnesses, springs {study.side}, up to "
        f"{study.sweeps} sweeps: points with several neighbours are solved more than once"
    )
    return Plan(does, k_d.size * k_p.size + 4 * study.leaps, least=True)


def grid(k_d: np.ndarray, k_p: np.ndarray, optimum: Values) -> Graph:
    """Return the points of a landscape: a grid, and the optimum beside the corners of its cell.

    Args:
        k_d: Values of K_D, rising [N m/rad], shape (n,).
        k_p: Values of K_P, rising [N m/rad], shape (m,).
        optimum: K_D and K_P of the optimum [N m/rad].
    """
    names = [[point_name(i, j) for j in range(k_p.size)] for i in range(k_d.size)]
    points: dict[str, Values] = {ROOT: optimum}
    edges = []
    for i, d in enumerate(k_d.tolist()):
        for j, p in enumerate(k_p.tolist()):
            points[names[i][j]] = (d, p)
            edges += [(names[a][b], names[i][j]) for a, b in ((i - 1, j), (i, j - 1))
                      if min(a, b) >= 0]  # fmt: skip
    for i in _around(k_d, optimum[0]):
        edges += [(ROOT, names[i][j]) for j in _around(k_p, optimum[1])]
    return Graph(points, tuple(edges), ROOT)


def point_name(i: int, j: int) -> str:
    """Return the name of a grid point by its places on the two axes, counted from 0."""
    return f"d{i + 1}-p{j + 1}"


def _around(values: np.ndarray, value: float) -> tuple[int, ...]:
    """Return the places of the values on either side of a value; one if it is outside."""
    above = int(np.searchsorted(values, value))
    return tuple(sorted({max(above - 1, 0), min(above, values.size - 1)}))


def landscape_of(study: LandscapeStudy, run: Run, work: Work) -> Landscape:
    """Solve a landscape.

    Raises:
        ConfigError: If an axis is wrong, or the base ties the sides.
        NotConvergedError: If the user stopped it, or there is nothing to begin with.
    """
    near = Neighbours(run, work.folder / "points", study.max_iterations, work.report)
    study = on_worn_side(study, near.optimum.solver.walker)
    springs, (k_d, k_p) = _axes(study, near.optimum.solver)
    both = near.optimum.stiffness.reshape(2, 2)[:, [SIDES.index(side) for side in study.sides]]
    graph = grid(k_d, k_p, tuple(np.exp(np.log(both).mean(axis=1)).tolist()))
    solve = near.solver(lambda values: with_springs(run.case, springs, values))
    root = near.optimum
    if study.side == "both":
        root = solve(ROOT, graph.points[ROOT], near.optimum)
        if not root.converged:
            raise NotConvergedError(
                "no solution was found with the springs of the optimum tied to equal values on "
                f"both sides: {root.result.status}; a landscape of one side needs none"
            )
    corners = [point_name(i, j) for i in (0, k_d.size - 1) for j in (0, k_p.size - 1)]
    leaps = {name: [("leap", near.optimum)] for name in corners}
    rules: Rules[Optimum] = Rules(motion_distance, motion_signature, sweeps=study.sweeps)
    explored = explore(graph, root, solve, rules, leaps if study.leaps else None)
    return _result(study, near, (k_d, k_p), graph, explored, corners)


def with_springs(case: Case, springs: Springs, values: Values) -> Case:
    """Return a case in which springs have given stiffnesses.

    Args:
        case: The base.
        springs: The unknowns that take K_D, and those that take K_P.
        values: K_D and K_P [N m/rad].
    """
    pairs = zip(springs, values, strict=True)
    return case.with_values(held(case.config, {u: k for unknowns, k in pairs for u in unknowns}))


def _result(
    study: LandscapeStudy,
    near: Neighbours,
    axes: tuple[np.ndarray, np.ndarray],
    graph: Graph,
    explored: Exploration[Optimum],
    corners: list[str],
) -> Landscape:
    """Return an exploration as plain numbers, with proofs of some of its points."""
    points, mesh = tuple(_points(graph, explored)), near.run.config.mesh
    best = min((p for p in points if p.branch == 1), key=lambda p: p.cost)
    start = _point(ROOT, graph.points[ROOT], near.optimum)
    differs = study.side != "both" and best.cost < start.cost - _BETTER * abs(start.cost)
    attempts = [attempt.end.result for attempt in explored.attempts]
    return Landscape(
        patient=near.run.case.unvaried.id,
        problem=near.run.config.problem,
        side=study.side,
        k_d=axes[0],
        k_p=axes[1],
        points=points,
        optimum=start,
        released=_released(near, study.side, best, explored) if differs else None,
        checks=dict(_checks(explored, [best.name, *corners])),
        allowed=(mesh.position_tolerance, mesh.velocity_tolerance),
        tolerance=study.tolerance,
        solves=len(attempts),
        failed_solves=sum(not result.converged for result in attempts),
        iterations=tuple(result.iterations for result in attempts),
        seconds=sum(result.seconds for result in attempts),
        sweeps=explored.sweeps,
        complete=explored.complete,
        further=free_units(near.optimum.solver.walker.unknowns),
    )


def _checks(
    explored: Exploration[Optimum], names: list[str]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the largest re-integration errors of some points by name."""
    for name in dict.fromkeys(names):
        if (branch := explored.best(name)) is not None:
            errors = branch.end.reintegration
            yield name, (errors.worst_position, errors.worst_velocity)


def _released(near: Neighbours, side: str, best: Point, explored: Exploration[Optimum]) -> Point:
    """Return where the best point ends with free springs."""
    branch = explored.best(best.name)
    end = near.resolve("released", near.run.case, None if branch is None else branch.end)
    numbers = measures(end) if end.converged else {}
    springs = tuple(numbers.get(f"{kind}_stiffness_{side}", float("nan")) for kind in _KINDS)
    return _point("released", springs, end)


def _points(graph: Graph, explored: Exploration[Optimum]) -> Iterator[Point]:
    """Yield every local optimum of every point, best first; one entry where all failed."""
    for name, values in graph.points.items():
        for rank, branch in enumerate(explored.branches[name], start=1):
            yield _point(name, values, branch.end, rank, branch.times)
        if not explored.branches[name]:
            last = [attempt.end for attempt in explored.attempts if attempt.point == name][-1]
            yield _point(name, values, last, branch=0)


def _point(name: str, values: Values, end: Optimum, branch: int = 1, times: int = 1) -> Point:
    """Return the end of a solve as plain numbers."""
    (k_d, k_p), result = values, end.result
    numbers = measures(end) if end.converged else {}
    return Point(name, k_d, k_p, branch, result.status, result.iterations, result.seconds, numbers,
                 times)  # fmt: skip


def _write(landscape: Landscape, folder: Path) -> None:
    from pathwalker_cli.studies.landscape.figures import save_landscape_figure

    write_tables(landscape, folder)
    save_landscape_figure(landscape, folder / "figures")


STUDY: Final = StudyKind(
    model=LandscapeStudy,
    files=frozenset({"points", "figures", *FILES}),
    varies="springs",
    plan=plan,
    run=landscape_of,
    write=_write,
    content=landscape_content,
    lines=landscape_lines,
)
"""The study of the cost over the springs."""
