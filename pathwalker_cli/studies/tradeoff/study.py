"""The trade-off of effort and walking speed: the problem solved for many weights of speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import Field, field_validator

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.schema import Weight
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import AS_TUPLE, invalid
from pathwalker_cli.results.run_folder import Run, load_run, write_run
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.base import NeighbourStudy
from pathwalker_cli.studies.branches import explore
from pathwalker_cli.studies.graph import Exploration, Graph, Rules, Values
from pathwalker_cli.studies.measures import measures
from pathwalker_cli.studies.neighbours import Neighbours, motion_signature
from pathwalker_cli.studies.run import RunLog, done_run
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff

__all__ = ["TradeoffStudy", "chain", "require_prediction", "tradeoff_of"]

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


def chain(weights: tuple[float, ...], base: float) -> Graph:
    """Return the points of a trade-off: one behind the other by weight, the base among them.

    Args:
        weights: Weights of walking speed.
        base: That of the base.
    """
    named: dict[str, Values] = {ROOT: (base,), **{f"w{w:g}": (w,) for w in weights}}
    order = sorted(named, key=lambda name: named[name])
    return Graph(named, tuple(pairwise(order)), ROOT)


def tradeoff_of(
    study: TradeoffStudy, run: Run, folder: Path, tell: Callable[[str], None], log: RunLog
) -> Tradeoff:
    """Solve a trade-off.

    Args:
        study: What was asked for.
        run: The converged run to stand on.
        folder: Folder of the study: solved points in `points`, refined ones in `runs`.
        tell: Is told of every point.
        log: Is told of every iteration on refined meshes.

    Raises:
        ConfigError: If the base is no prediction.
        NotConvergedError: If the user stopped it.
    """
    require_prediction(run.config)
    near = Neighbours(run, folder / "points", study.max_iterations, tell)
    base = run.config.cost.walking_speed_weight
    solve = near.solver(lambda values: with_weight(run.case, values))
    rules: Rules[Optimum] = Rules(
        lambda one, other: 1.0, motion_signature, without_reward, jump=0.0, sweeps=study.sweeps
    )
    found = explore(chain(study.walking_speed_weights, base), near.optimum, solve, rules)
    best = {w: found.branches[f"w{w:g}"] for w in study.walking_speed_weights}
    checked = [_Checked.of(weight, branches[0].found if branches else None, len(branches))
               for weight, branches in best.items()]  # fmt: skip
    refined = _Refined(folder / "runs", tell, log)
    points = [refined.point(each) if study.refine and each.inaccurate else each.point()
              for each in checked]  # fmt: skip
    return _result(near, found, tuple(points), refined.seconds)


def require_prediction(config: StudyConfig) -> None:
    """Refuse a problem that follows a recording.

    Raises:
        ConfigError: If it does.
    """
    if config.fits:
        raise ConfigError(f"is {config.problem}, which follows a recording", where="base",
                          allowed="a prediction, e.g. mapd-orthosis")  # fmt: skip


def with_weight(case: Case, values: Values) -> Case:
    """Return a case with another weight of walking speed, the only one of the values."""
    return case.with_values({"cost.walking_speed_weight": values[0]})


def without_reward(optimum: Optimum) -> float:
    """Return the cost without the reward for speed, which may cancel it."""
    weight = optimum.config.cost.walking_speed_weight
    return optimum.cost + weight * float(motion_signature(optimum)[0])


@dataclass(frozen=True)
class _Checked:
    """The best local optimum at a weight, None if every solve failed."""

    weight: float
    optimum: Optimum | None
    branches: int
    errors: tuple[float, float] = (float("nan"), float("nan"))

    @classmethod
    def of(cls, weight: float, optimum: Optimum | None, branches: int) -> _Checked:
        """Return it with its re-integration errors."""
        if optimum is None:
            return cls(weight, None, 0)
        errors = optimum.reintegration
        return cls(weight, optimum, branches, (errors.worst_position, errors.worst_velocity))

    @property
    def inaccurate(self) -> bool:
        """Whether the mesh of the base does not do for it."""
        if self.optimum is None:
            return False
        mesh = self.optimum.config.mesh
        return self.errors[0] > mesh.position_tolerance or self.errors[1] > mesh.velocity_tolerance

    def point(self, **changes: Any) -> FrontPoint:
        """Return it as plain numbers, with some of them replaced."""
        found = self.optimum
        values: dict[str, Any] = {
            "name": f"w{self.weight:g}",
            "weight": self.weight,
            "status": "no solve converged" if found is None else found.result.status,
            "mesh_status": "inaccurate" if found is None or self.inaccurate else "base",
            "measures": {} if found is None else measures(found),
            "errors": self.errors,
            "intervals": 0 if found is None else found.motion.intervals,
            "cost_on_base": float("nan") if found is None else found.cost,
            "branches": self.branches,
            "iterations": 0 if found is None else found.result.iterations,
        }
        return FrontPoint(**{**values, **changes})


class _Refined:
    """Solves points on meshes of their own, each into a run folder; those that are there stay."""

    def __init__(self, folder: Path, tell: Callable[[str], None], log: RunLog) -> None:
        self._folder, self._tell, self._log = folder, tell, log
        self.seconds = 0.0

    def point(self, checked: _Checked) -> FrontPoint:
        """Return a point with the numbers of a refined mesh, if that converges."""
        assert checked.optimum is not None  # noqa: S101 - called for points with an optimum
        folder, case = self._folder / f"w{checked.weight:g}", checked.optimum.case
        if done_run(folder, case) is None:
            solution = GaitSolver(case, self._log).solve(checked.optimum.motion)
            write_run(folder, solution, self._log.lines)
        metrics = load_run(folder, allow_unconverged=True).metrics
        self.seconds += metrics["seconds_solve"]
        done = metrics["status"] == "converged"
        errors = metrics["reintegration_position_error"], metrics["reintegration_velocity_error"]
        self._tell(f"      w{checked.weight:<23g} {metrics['status']} on {metrics['intervals']} "
                   f"intervals, errors {errors[0]:.1e}, {errors[1]:.1e}")  # fmt: skip
        if not done:
            return checked.point(status=f"on a finer mesh: {metrics['status']}")
        numbers = {
            m.key: metrics[m.key] for m in measures_in("studies") if metrics.get(m.key) is not None
        }
        return checked.point(
            mesh_status="refined", measures=numbers, errors=errors, intervals=metrics["intervals"]
        )


def _result(
    near: Neighbours,
    found: Exploration[Optimum],
    points: tuple[FrontPoint, ...],
    seconds_refined: float,
) -> Tradeoff:
    """Return everything as plain numbers."""
    config, patient = near.run.config, near.optimum.solver.walker.patient
    recorded = patient.recorded.get(config.condition)
    ends = [attempt.found.result for attempt in found.attempts]
    return Tradeoff(
        patient=patient.id,
        problem=config.problem,
        condition=config.condition,
        points=points,
        base_weight=config.cost.walking_speed_weight,
        optimum=measures(near.optimum),
        recorded=None
        if recorded is None
        else (recorded.walking_speed.min, recorded.walking_speed.max),
        tolerances=(config.mesh.position_tolerance, config.mesh.velocity_tolerance),
        solves=len(ends),
        failed_solves=sum(not end.converged for end in ends),
        iterations=tuple(end.iterations for end in ends),
        seconds=sum(end.seconds for end in ends),
        seconds_refined=seconds_refined,
        sweeps=found.sweeps,
        complete=found.complete,
    )
