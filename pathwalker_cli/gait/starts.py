"""Several starts of one study: all local optima that they lead to, and the best of them.

The problem is not convex; a start decides which optimum is found.  The first one is the study's
own; where that is a typical walk, the others come next.  Further starts differ in crouch, step
length, speed and stiffness, spread by a Latin hypercube.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import qmc

from pathwalker_cli.case import Case
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum, Shortfall, StageRecord
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.typical import typical_walks
from pathwalker_cli.io.processes import results_of_calls
from pathwalker_cli.nlp.result import NlpResult

Finished = Callable[[LocalOptimum], None]


@dataclass(frozen=True)
class _Outcome:
    """What comes back from the process of one start."""

    optimum: LocalOptimum
    nlp: NlpResult
    meshes: tuple[np.ndarray, ...]
    stages: tuple[StageRecord, ...]
    seconds: dict[str, float]
    shortfall: Shortfall | None


def spread_starts(solver: GaitSolver) -> list[Case]:
    """Return a case for every start of a solver's study; equal seeds give equal starts."""
    config = solver.config
    single = config.model_copy(update={"starts": 1})
    unknowns = solver.walker.unknowns
    lower, upper = solver.bounds.table.arrays(tuple(unknown.name for unknown in unknowns))
    spread = (choices.CROUCH_SPREAD, choices.STRIDE_SPREAD, choices.SPEED_SPREAD)
    low = [*(pair[0] for pair in spread), *lower]
    high = [*(pair[1] for pair in spread), *upper]
    walks = len(typical_walks(solver.walker)) if config.start.gait == "typical" else 0
    others = [walk for walk in range(walks) if walk != config.start.walk][: config.starts - 1]
    starts = [config.start.model_copy(update={"walk": walk}) for walk in others]
    studies = [single, *(single.model_copy(update={"start": start}) for start in starts)]
    cube = qmc.LatinHypercube(len(low), rng=np.random.default_rng(config.start.seed))
    # qmc.scale refuses to scale no points at all
    points = np.array(low) + cube.random(config.starts - len(studies)) * np.subtract(high, low)
    for knee_flexion, stride_ratio, faster, *free in points.tolist():
        start = config.start.model_copy(
            update={
                "gait": "synthetic",
                "trial": "",
                "knee_flexion": knee_flexion,
                "stride_ratio": stride_ratio,
                "walking_speed": faster * solver.start_speed,
                "stiffness": {},
                "free": {u.address: value for u, value in zip(unknowns, free, strict=True)},
            }
        )
        studies.append(single.model_copy(update={"start": start}))
    return [replace(solver.case, config=study) for study in studies]


def solve_from_starts(case: Case, finished: Finished | None = None) -> GaitSolution:
    """Return the best solution from all starts of a study, with all local optima by cost.

    They run on as many processes as there are cores; `finished` is called with every local optimum
    as soon as it is there.
    """
    solver = GaitSolver(case)
    outcomes = list(_outcomes(spread_starts(solver), finished))
    outcomes.sort(key=lambda o: (not o.optimum.converged, o.optimum.cost, o.optimum.start))
    best = outcomes[0]
    solver.stages, solver.seconds = list(best.stages), dict(best.seconds)
    solver.shortfall = best.shortfall
    solution = solver.restored(best.nlp, best.meshes)
    optima = tuple(outcome.optimum for outcome in outcomes)
    return replace(solution, optima=optima, start=best.optimum.description)


def _outcomes(cases: list[Case], finished: Finished | None) -> Iterator[_Outcome]:
    """Yield the outcomes of all starts as they come."""
    workers = min(len(cases), len(os.sched_getaffinity(0)))
    for outcome in results_of_calls(_solved, list(enumerate(cases)), workers):
        if finished is not None:
            finished(outcome.optimum)
        yield outcome


def _solved(number: int, case: Case) -> _Outcome:
    """Solve one start in a process of its own."""
    solver = GaitSolver(case)
    solution = solver.solve()
    last = solution.last_motion
    optimum = LocalOptimum(
        start=number,
        description=solution.start,
        status=solution.status,
        cost=solution.cost,
        walking_speed=walked_distance(last) / last.duration,
        stiffness=tuple(None if np.isnan(k) else float(k) for k in solution.walker.stiffness),
        iterations=solution.iterations,
        seconds=float(sum(solution.seconds.values())),
        numbers=solver.by_name(last.parameters),
    )
    meshes = last.meshes[: len(solver.gait.phases)]
    return _Outcome(
        optimum, solution.nlp, meshes, solution.stages, solution.seconds, solution.shortfall
    )
