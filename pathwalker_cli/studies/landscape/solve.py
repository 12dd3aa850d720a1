"""The landscape: cost over the two spring stiffnesses of a side, everything else optimal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.conventions import SIDES, STIFFNESSES
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.nlp.ipopt import NlpResult
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.branches import explore
from pathwalker_cli.studies.graph import Exploration, Graph, Rules, Values
from pathwalker_cli.studies.landscape.result import ROOT, Landscape, Point
from pathwalker_cli.studies.landscape.study import LandscapeStudy, axis_values
from pathwalker_cli.studies.measures import measures
from pathwalker_cli.studies.neighbours import Neighbours, motion_distance, motion_signature
from pathwalker_cli.studies.springs import require_springs

__all__ = ["grid", "landscape_of", "with_springs"]

_KINDS: Final = ("dorsiflexion", "plantarflexion")

_BETTER: Final = 1e-3
"""Share of the cost by which the grid must beat the optimum for the two to be different ones."""


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


def landscape_of(
    study: LandscapeStudy, run: Run, folder: Path, tell: Callable[[str], None]
) -> Landscape:
    """Solve a landscape.

    Args:
        study: What was asked for.
        run: The converged run to stand on.
        folder: Where solved points are kept; what is there already is not solved again.
        tell: Is told of every point.

    Raises:
        ConfigError: If the base has no springs or an axis is wrong.
        NotConvergedError: If the user stopped it, or there is nothing to begin with.
    """
    require_springs(run.config, "base")
    near = Neighbours(run, folder, study.max_iterations, tell)
    table = near.optimum.solver.bounds.table.entries
    k_d, k_p = (
        axis_values(getattr(study, kind), table[(f"{kind}_stiffness_{study.sides[0]}",)], kind)
        for kind in _KINDS
    )
    springs = near.optimum.stiffness.reshape(2, 2)[:, [SIDES.index(s) for s in study.sides]]
    graph = grid(k_d, k_p, tuple(np.exp(np.log(springs).mean(axis=1)).tolist()))
    solve = near.solver(partial(with_springs, run.case, study.sides))
    root = near.optimum
    if study.side == "both":
        root = solve(ROOT, graph.points[ROOT], near.optimum)
        _require(root)
    leaps = {name: [("leap", near.optimum)] for name in _corners(k_d, k_p)}
    rules: Rules[Optimum] = Rules(motion_distance, motion_signature, sweeps=study.sweeps)
    found = explore(graph, root, solve, rules, leaps if study.leaps else None)
    return _result(study, near, (k_d, k_p), graph, found)


def _require(root: Optimum) -> None:
    """Refuse to go on without a solution to begin with."""
    if not root.converged:
        raise NotConvergedError(
            "no solution was found with the springs of the optimum tied to equal values on both "
            f"sides: {root.result.status}; a landscape of one side needs none"
        )


def _corners(k_d: np.ndarray, k_p: np.ndarray) -> list[str]:
    """Return the names of the corners of the grid."""
    return [point_name(i, j) for i in (0, k_d.size - 1) for j in (0, k_p.size - 1)]


def with_springs(case: Case, sides: tuple[str, ...], values: Values) -> Case:
    """Return a case in which the springs of some sides have given stiffnesses.

    Args:
        case: The base.
        sides: The sides.
        values: K_D and K_P [N m/rad].
    """
    fixed = {
        name: (value, value)
        for value, kind in zip(values, _KINDS, strict=True)
        for name in STIFFNESSES
        if name.startswith(kind) and name.rsplit("_", 1)[1] in sides
    }
    return case.with_values({"bounds.stiffness": {**case.config.bounds.stiffness, **fixed}})


def _result(
    study: LandscapeStudy,
    near: Neighbours,
    axes: tuple[np.ndarray, np.ndarray],
    graph: Graph,
    found: Exploration[Optimum],
) -> Landscape:
    """Return what an exploration found as plain numbers, with proofs of some of its points."""
    points, mesh = tuple(_points(graph, found)), near.run.config.mesh
    best = min((p for p in points if p.branch == 1), key=lambda p: p.cost)
    start = _point(ROOT, graph.points[ROOT], near.optimum.result, measures(near.optimum))
    differs = study.side != "both" and best.cost < start.cost - _BETTER * abs(start.cost)
    return Landscape(
        patient=near.optimum.solver.walker.patient.id,
        problem=near.run.config.problem,
        side=study.side,
        k_d=axes[0],
        k_p=axes[1],
        points=points,
        optimum=start,
        released=_released(near, study.side, best, found) if differs else None,
        checks=dict(_checks(found, [best.name, *_corners(*axes)])),
        allowed=(mesh.position_tolerance, mesh.velocity_tolerance),
        tolerance=study.tolerance,
        solves=len(found.attempts),
        failed_solves=sum(not a.found.converged for a in found.attempts),
        iterations=tuple(a.found.result.iterations for a in found.attempts),
        seconds=sum(a.found.result.seconds for a in found.attempts),
        sweeps=found.sweeps,
        complete=found.complete,
    )


def _checks(
    found: Exploration[Optimum], names: list[str]
) -> Iterator[tuple[str, tuple[float, float]]]:
    """Yield the largest re-integration errors of some points by name."""
    for name in dict.fromkeys(names):
        if (branch := found.best(name)) is not None:
            errors = branch.found.reintegration
            yield name, (errors.worst_position, errors.worst_velocity)


def _released(near: Neighbours, side: str, best: Point, found: Exploration[Optimum]) -> Point:
    """Return where the best point ends with free springs."""
    branch = found.best(best.name)
    start = None if branch is None else branch.found
    end = near.resolve("released", near.run.case, start)
    numbers = measures(end) if end.converged else {}
    springs = tuple(numbers.get(f"{kind}_stiffness_{side}", float("nan")) for kind in _KINDS)
    return _point("released", springs, end.result, numbers)


def _points(graph: Graph, found: Exploration[Optimum]) -> Iterator[Point]:
    """Yield every local optimum of every point, best first; one entry where all failed."""
    for name, values in graph.points.items():
        for rank, branch in enumerate(found.branches[name], start=1):
            end = branch.found
            yield _point(name, values, end.result, measures(end), rank, branch.times)
        if not found.branches[name]:
            last = [a.found.result for a in found.attempts if a.point == name][-1]
            yield _point(name, values, last, {}, branch=0)


def _point(
    name: str,
    values: Values,
    result: NlpResult,
    numbers: dict[str, float],
    branch: int = 1,
    times: int = 1,
) -> Point:
    """Return the end of a solve as plain numbers."""
    k_d, k_p = values
    return Point(name, k_d, k_p, branch, result.status, result.iterations, result.seconds, numbers,
                 times)  # fmt: skip
