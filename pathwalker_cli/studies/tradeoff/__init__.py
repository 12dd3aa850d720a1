"""The trade-off of effort and walking speed: the problem solved for many weights of speed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field, field_validator

from pathwalker_cli.config.schema import Weight
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import AS_TUPLE, invalid
from pathwalker_cli.results.run_folder import Run, load_run, write_run
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.base import NeighbourStudy, Plan, StudyKind, Work
from pathwalker_cli.studies.branches import Branch, Exploration, Graph, Rules, Values, explore
from pathwalker_cli.studies.measures import free_units, measures
from pathwalker_cli.studies.neighbours import Neighbours, motion_signature
from pathwalker_cli.studies.run import done_run
from pathwalker_cli.studies.tradeoff.result import (
    FILES,
    FrontPoint,
    Tradeoff,
    front_of,
    judged,
    tradeoff_content,
    tradeoff_lines,
    write_tables,
)

ROOT: Final = "base"
"""Name of the run that everything begins with."""


class TradeoffStudy(NeighbourStudy):
    """The front of effort per distance and walking speed."""

    walking_speed_weights: Annotated[tuple[Weight, ...], AS_TUPLE, Field(min_length=2)] = (
        0.0, 0.55, 0.7, 0.8, 0.9, 1.0, 1.2, 1.5, 2.0, 2.5,
    )  # fmt: skip
    refine: bool = True
    sweeps: Annotated[int, Field(ge=0, le=20)] = 6
    max_iterations: Annotated[int, Field(ge=20, le=100000)] = 300

    @field_validator("walking_speed_weights")
    @classmethod
    def _rising(cls, value: tuple[float, ...]) -> tuple[float, ...]:
        if any(a >= b for a, b in pairwise(value)):
            raise invalid("does not rise", allowed="weights in rising order, each once")
        return value


def plan(study: TradeoffStudy, solver: GaitSolver) -> Plan:
    """Return how many weights there are."""
    count = len(study.walking_speed_weights)
    does = f"{count} weights of walking speed, up to {study.sweeps} sweeps to and fro"
    return Plan(does, count, least=True)


def chain(weights: tuple[float, ...], base: float) -> Graph:
    """Return the points of a trade-off: one behind the other by weight, the base among them."""
    named: dict[str, Values] = {ROOT: (base,), **{f"w{w:g}": (w,) for w in weights}}
    order = sorted(named, key=lambda name: named[name])
    return Graph(named, tuple(pairwise(order)), ROOT)


def tradeoff_of(study: TradeoffStudy, run: Run, work: Work) -> Tradeoff:
    """Solve a trade-off.

    Raises:
        NotConvergedError: If the user stopped it.
    """
    near = Neighbours(run, work.folder / "points", study.max_iterations, work.report)
    base = run.config.cost.walking_speed_weight
    solve = near.solver(lambda w: run.case.with_values({"cost.walking_speed_weight": w[0]}))
    rules: Rules[Optimum] = Rules(
        lambda one, other: 1.0, motion_signature, without_reward, jump=0.0, sweeps=study.sweeps
    )
    weights = study.walking_speed_weights
    explored = explore(chain(weights, base), near.optimum, solve, rules)
    points, seconds_refined = [], 0.0
    for weight in weights:
        branches = explored.branches[f"w{weight:g}"]
        point = _point(weight, branches)
        if study.refine and point.mesh == "inaccurate":
            point, seconds = _refined(point, branches[0].end, work)
            seconds_refined += seconds
        points.append(point)
    return _result(near, explored, judged(points), seconds_refined)


def without_reward(optimum: Optimum) -> float:
    """Return the cost without the reward for speed, which may cancel it."""
    weight = optimum.config.cost.walking_speed_weight
    return optimum.cost + weight * float(motion_signature(optimum)[0])


def _point(weight: float, branches: Sequence[Branch[Optimum]]) -> FrontPoint:
    """Return the best local optimum at a weight as plain numbers, with its errors."""
    if not branches:
        none = float("nan")
        return FrontPoint(weight, "no solve converged", None, None, {}, (none, none), 0, none, 0, 0)
    best = branches[0].end
    mesh, errors = best.config.mesh, best.reintegration
    position, velocity = errors.worst_position, errors.worst_velocity
    rough = position > mesh.position_tolerance or velocity > mesh.velocity_tolerance
    return FrontPoint(
        walking_speed_weight=weight,
        status=best.result.status,
        mesh="inaccurate" if rough else "base",
        dominated=None,
        measures=measures(best),
        errors=(position, velocity),
        intervals=best.motion.intervals,
        cost_on_base_mesh=best.cost,
        local_optima=len(branches),
        iterations=best.result.iterations,
    )


def _refined(point: FrontPoint, optimum: Optimum, work: Work) -> tuple[FrontPoint, float]:
    """Return a point with the numbers of a refined mesh, if that converges, and its seconds.

    It is solved into a run folder; what is there already stays.
    """
    weight, case = point.walking_speed_weight, optimum.case
    folder = work.folder / "runs" / f"w{weight:g}"
    if done_run(folder, case) is None:
        write_run(folder, GaitSolver(case, work.log).solve(optimum.motion), work.log.lines)
    run = load_run(folder, allow_unconverged=True)
    metrics = run.metrics
    seconds = metrics["seconds_solve"]
    errors = metrics["reintegration_position_error"], metrics["reintegration_velocity_error"]
    work.report(
        f"      w{weight:<23g} {metrics['status']} on {metrics['intervals']} "
        f"intervals, errors {errors[0]:.1e}, {errors[1]:.1e}"
    )
    if metrics["status"] != "converged":
        return replace(point, status=f"on a finer mesh: {metrics['status']}"), seconds
    numbers = {
        m.key: metrics[m.key] for m in measures_in("studies") if metrics.get(m.key) is not None
    }
    unknowns = optimum.solver.walker.unknowns
    for name in free_units(unknowns):
        which = [unknown.name for unknown in unknowns].index(name)
        numbers[name] = float(run.motion.parameters[which])
    better = replace(
        point, mesh="refined", measures=numbers, errors=errors, intervals=metrics["intervals"]
    )
    return better, seconds


def _result(
    near: Neighbours,
    explored: Exploration[Optimum],
    points: tuple[FrontPoint, ...],
    seconds_refined: float,
) -> Tradeoff:
    config, solver = near.run.config, near.optimum.solver
    recorded = solver.walker.patient.recorded.get(config.condition)
    ends = [attempt.end.result for attempt in explored.attempts]
    return Tradeoff(
        problem=config.problem,
        patient=solver.walker.patient.id,
        condition=config.condition,
        points=points,
        base_weight=config.cost.walking_speed_weight,
        optimum=measures(near.optimum),
        front=front_of(points),
        recorded_walking_speed=None
        if recorded is None
        else (recorded.walking_speed.min, recorded.walking_speed.max),
        tolerances=(config.mesh.position_tolerance, config.mesh.velocity_tolerance),
        solves=len(ends),
        failed_solves=sum(not end.converged for end in ends),
        median_iterations=float(np.median([end.iterations for end in ends] or [0])),
        seconds=sum(end.seconds for end in ends),
        seconds_refined=seconds_refined,
        sweeps=explored.sweeps,
        sweeps_found_nothing_new=explored.complete,
        further=free_units(solver.walker.unknowns),
    )


def _write(tradeoff: Tradeoff, folder: Path) -> None:
    from pathwalker_cli.studies.tradeoff.figures import save_tradeoff_figure

    write_tables(tradeoff, folder)
    if tradeoff.solved:
        save_tradeoff_figure(tradeoff, folder / "figures")


STUDY: Final = StudyKind(
    model=TradeoffStudy,
    files=frozenset({"points", "runs", "figures", *FILES}),
    varies="",
    plan=plan,
    run=tradeoff_of,
    write=_write,
    content=tradeoff_content,
    lines=tradeoff_lines,
    predicts=True,
    whole_cycle=False,
)
"""The study of what walking faster costs."""
