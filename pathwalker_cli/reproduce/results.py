"""What the page of results is made from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import CONDITIONS, Condition
from pathwalker_cli.evaluation.evaluate import Change, Evaluation, evaluate_gait, gait_changes
from pathwalker_cli.evaluation.paper import PATIENT
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.patient import load_patient
from pathwalker_cli.reproduce.inverse_study import InverseResult
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import stride_of

__all__ = ["ProblemResult", "Results", "evaluated", "recordings"]


@dataclass(frozen=True)
class ProblemResult:
    """How a problem ended.

    Args:
        problem: Its name.
        metrics: Content of `metrics.json`.
        bounds: Bounds that hold the solution back.
        config: The config that was solved.
        kept: Whether it was solved before and not again.
        series: The stride, None if it did not converge.
        evaluation: The stride beside the recordings, None if it did not converge.
    """

    problem: str
    metrics: Mapping[str, Any]
    bounds: tuple[ActiveBound, ...]
    config: StudyConfig
    kept: bool
    series: GaitSeries | None = None
    evaluation: Evaluation | None = None

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""
        return self.evaluation is not None


@dataclass(frozen=True)
class Results:
    """Everything that was computed.

    Args:
        problems: The problems by name, in order.
        inverse: By method of inverse dynamics, its result, or why there is none.
        recorded: The recordings by condition.
        quick: Whether the solves were quick checks on coarse meshes.
    """

    problems: Mapping[str, ProblemResult]
    inverse: Mapping[str, InverseResult | str]
    recorded: Mapping[Condition, RecordedGait]
    quick: bool

    @property
    def changes(self) -> tuple[Change, ...]:
        """Changes from mapd-barefoot to mapd-orthosis; none unless both converged."""
        pair = [self.problems[name].evaluation for name in ("mapd-barefoot", "mapd-orthosis")]
        if pair[0] is None or pair[1] is None:
            return ()
        return gait_changes(pair[0], pair[1])

    @property
    def failed(self) -> tuple[str, ...]:
        """Problems that did not converge."""
        return tuple(name for name, each in self.problems.items() if not each.converged)


def recordings() -> dict[Condition, RecordedGait]:
    """Return the recordings of the article's patient by condition."""
    patient = load_patient(PATIENT)
    found: dict[Condition, RecordedGait] = {}
    for condition in CONDITIONS:
        gait = recorded_gait(build_walker(patient, condition))
        if gait is not None:
            found[condition] = gait
    return found


def evaluated(
    folder: Path, kept: bool, recorded: Mapping[Condition, RecordedGait]
) -> ProblemResult:
    """Return the result that a run folder holds.

    Args:
        folder: The run folder, converged or not.
        kept: Whether it was solved before and not again.
        recorded: The recordings of the article's patient.
    """
    run = load_run(folder, allow_unconverged=True)
    config, metrics = run.config, run.metrics
    result = ProblemResult(config.problem, metrics, run.result.bounds, config, kept)
    if metrics["status"] != "converged":
        return result
    series = gait_series(run.case.walker(), run.motion)
    gait = stride_of(series, config.problem, config.problem)
    theirs = recorded.get(config.condition) if run.case.patient.id == PATIENT else None
    evaluation = evaluate_gait(gait, recorded=theirs)
    return replace(result, series=series, evaluation=evaluation)
