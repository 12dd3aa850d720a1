"""Learn how a child walks: numbers of body and cost whose predicted gait is nearest to recordings.

Inverse optimal control on two levels.  Inside, the problem is solved for given numbers from the
solution before; outside, a trust-region Gauss-Newton method moves the numbers.  The squares of

    (predicted - mean recorded) / own spread    of every curve and number of the walk, and
    (number - prior) / its prior deviation      of every learnt number

add up to what is minimised.  Derivatives come from the KKT system at each optimum, not from further
solves.

References:
    Mombaur, Truong, Laumond (2010) Autonomous Robots 28, 369-383: inverse optimal control of walks.
    Branch, Coleman, Li (1999) SIAM J. Sci. Comput. 21, 1-23: the trust-region method, as in SciPy.
"""

from __future__ import annotations

import time
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import Field

from pathwalker_cli.case import Case
from pathwalker_cli.config.learnt import COST, Learnt, LearntNumber, Prior, config_values
from pathwalker_cli.config.schema import TrialName
from pathwalker_cli.conventions import Condition
from pathwalker_cli.errors import ConfigError, DataError, did_you_mean
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import Quantity, YamlModel
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import NeighbourStudy, Plan, StudyKind, Work, resolver_of
from pathwalker_cli.studies.learn.fit import (
    Learner,
    descend,
    ranges_that_act,
    smoothed,
    stride_at,
)
from pathwalker_cli.studies.learn.result import (
    FILES,
    LearnResult,
    learn_lines,
    left_out_errors,
    write_learnt,
)
from pathwalker_cli.studies.learn.targets import Target, carried_weight, targets_of
from pathwalker_cli.studies.neighbours import Journal

STEPS: Final = "steps"
"""Folder of the predictions that were solved on the way."""

_WEIGHT_OFF: Final = 0.2
"""Share of the weight by which the load of both feet may be off: strides are not quite periodic."""


class Weights(YamlModel):
    """How much the groups of observations count."""

    angles: Annotated[float, Quantity("", 0.0, 100.0)] = 1.0
    forces: Annotated[float, Quantity("", 0.0, 100.0)] = 0.3
    moments: Annotated[float, Quantity("", 0.0, 100.0)] = 0.3
    walk: Annotated[float, Quantity("", 0.0, 100.0)] = 1.0


Barrier = Annotated[float, Quantity("", 0.0, 1.0)]


class LearnStudy(NeighbourStudy):
    """What is learnt, from which recordings."""

    condition: Condition | None = None
    numbers: Annotated[dict[str, Prior], Field(min_length=1)]
    weights: Weights = Weights()
    without: tuple[TrialName, ...] = ()
    steps: Annotated[int, Field(ge=1, le=200)] = 12
    precision: Annotated[float, Quantity("", 1e-8, 1e-1)] = 1e-3
    smoothing: Annotated[tuple[Barrier, ...], Field(min_length=1)] = (1e-3, 0.0)
    starts: Annotated[int, Field(ge=1, le=50)] = 1
    seed: Annotated[int, Field(ge=0)] = 0

    def based_on(self, case: Case) -> Case:
        """Return a case of the condition that is learnt from, with all numbers at their priors."""
        values = config_values({k: p.prior for k, p in self.numbers.items()})
        if self.condition not in (None, case.config.condition):
            values["problem"] = f"mapd-{self.condition}"
        return case.with_values(values)

    def recorded(self, solver: GaitSolver) -> RecordedGait:
        """Return the recordings that are learnt from.

        Raises:
            DataError: If there are none, or not enough of them.
        """
        walker = solver.walker
        recorded = recorded_gait(walker)
        who = f"patient {walker.patient.id}, {walker.condition}"
        if recorded is None:
            raise DataError(
                "there are no recordings to learn from", where=who,
                mend="add them beside the patient's file: pathwalker import",
            )  # fmt: skip
        names = {trial.name for trial in recorded.trials}
        for name in self.without:
            if name not in names:
                raise ConfigError(
                    f"names the trial '{name}', which does not exist", where="without",
                    allowed=", ".join(sorted(names)), mend=did_you_mean(name, names),
                )  # fmt: skip
        rest = [s for side in ("right", "left") for s in recorded.of("stride", side)
                if s.name not in self.without]  # fmt: skip
        if {stride.side for stride in rest} != {"right", "left"}:
            raise DataError(
                "the recordings do not show a whole gait cycle of both sides", where=who,
                allowed="at least one from foot strike to foot strike on each side",
            )  # fmt: skip
        share = carried_weight(recorded, self.without)
        if share is not None and abs(share - 1.0) > _WEIGHT_OFF:
            raise DataError(
                f"both feet together carry {share:.2f} times the weight of this walker on average",
                where=who, allowed=f"1 within {_WEIGHT_OFF:g}: the recordings' own body",
                mend="correct body_mass, or take the recordings of this child",
            )  # fmt: skip
        return recorded

    def targets(self, recorded: RecordedGait, without: Collection[str] = ()) -> tuple[Target, ...]:
        """Return what a stride is held against."""
        return targets_of(recorded, dict(self.weights), {*self.without, *without})


def plan(study: LearnStudy, solver: GaitSolver) -> Plan:
    """Return what would be learnt, and from what.

    Raises:
        ConfigError: If a number or a trial does not exist, or the run is of the other condition.
        DataError: If there is nothing to learn from.
    """
    walked = solver.walker.condition
    if study.condition not in (None, walked):
        raise ConfigError(
            f"is {study.condition}, but the run is {walked}", where="condition", allowed=walked,
            mend="leave --run out, or give a run of that condition",
        )  # fmt: skip
    known = {a for n in solver.walker.numbers for a in (n.address, n.place)}
    for place in study.numbers:
        if not place.startswith(COST) and place not in known:
            raise ConfigError(
                "is no number of this walker", where=f"numbers.{place}",
                allowed=", ".join(sorted({n.place for n in solver.walker.numbers})),
                mend=did_you_mean(place, known),
            )  # fmt: skip
    for place in study.numbers:
        goal = place.removeprefix("cost.goals.")
        if goal != place and not solver.config.cost.goals.get(goal):
            raise ConfigError(
                f"is learnt, but the problem of the run does not weigh '{goal}'",
                where=f"numbers.{place}",
                mend="leave --run out, or solve it with a weight for it",
            )  # fmt: skip
    recorded = study.recorded(solver)
    trials = len({t.name for t in recorded.trials} - set(study.without))
    does = (
        f"learns {len(study.numbers)} numbers from {trials} {walked} trials, "
        f"{len(study.targets(recorded))} curves and numbers of the walk"
    )
    return Plan(does, study.steps * study.starts * len(study.smoothing))


def learn(study: LearnStudy, run: Run, work: Work) -> LearnResult:
    """Learn numbers from the recordings of one condition.

    Args:
        study: What to learn.
        run: The converged prediction to start from.
        work: Where; predictions solved there already are not solved again.

    Raises:
        ConfigError: If a number or a trial does not exist.
        DataError: If there is nothing to learn from.
        NotConvergedError: If the prediction at the priors cannot be solved.
    """
    began, used = time.perf_counter(), time.process_time()
    case = run.case
    recorded = study.recorded(GaitSolver(case))
    targets = study.targets(recorded)
    learners: list[Learner] = []
    ends = []
    for start, at in enumerate(_starts(study)):
        begin: Optimum | None = None
        for stage, barrier in enumerate(study.smoothing):
            smooth = replace(run, case=smoothed(case, barrier))
            resolver = resolver_of(smooth)
            journal = Journal(work.folder / STEPS, run, resolver)
            name = f"start-{start:02d}-{stage}"
            learner = Learner(
                study.numbers, smooth.case, targets, resolver, journal, work.report, name, begin
            )
            learners.append(learner)
            end = descend(learner, at, study.steps, study.precision)
            at, begin = end.x, learner.optimum(end.x)
        ends.append((learner, end))
    learner, best = min(ends, key=lambda end: end[1].cost)
    slopes = best.jac
    covariance = np.linalg.inv(slopes.T @ slopes)
    optimum = learner.optimum(best.x)
    values = learner.values(best.x)
    learnt = Learnt(
        patient=case.unvaried.id,
        condition=case.config.condition,
        origin=f"pathwalker learn, {len(recorded.trials) - len(study.without)} trials",
        numbers={
            place: LearntNumber(**prior.model_dump(exclude_none=True), learnt=values[place])
            for place, prior in study.numbers.items()
        },
        covariance=tuple(tuple(float(f"{x:.6g}") for x in row) for row in covariance),
    )
    return LearnResult(
        problem=case.config.problem,
        learnt=learnt,
        stride=stride_at(optimum),
        recorded=recorded,
        targets=targets,
        misfits=tuple(2.0 * end.cost for _, end in ends),
        prior_misfit=float(best.x @ best.x),
        active=ranges_that_act(learner, best.x),
        left_out=left_out_errors(
            study.targets, recorded, targets, slopes, best.x, stride_at(optimum), study.without
        ),
        solves=sum(each.solves for each in learners),
        iterations=sum(each.iterations for each in learners),
        seconds=time.perf_counter() - began,
        cpu_seconds=time.process_time() - used,
    )


def _starts(study: LearnStudy) -> list[np.ndarray]:
    """Return where to begin: at the priors, then at draws from half of them."""
    size, rng = len(study.numbers), np.random.default_rng(study.seed)
    return [np.zeros(size), *(0.5 * rng.standard_normal((study.starts - 1, size)))]


def _write(result: LearnResult, folder: Path) -> None:
    from pathwalker_cli.evaluation.curves import Trace
    from pathwalker_cli.evaluation.figures import save_evaluation_figures

    write_learnt(result, folder)
    trace = Trace(result.stride, "learnt", result.recorded)
    save_evaluation_figures(trace, folder / "figures")


STUDY: Final = StudyKind(
    model=LearnStudy,
    files=frozenset({STEPS, "figures", *FILES}),
    varies="",
    plan=plan,
    run=learn,
    write=_write,
    content=lambda result: result.content,
    lines=learn_lines,
    predicts=True,
    whole_cycle=True,
)
"""The study that learns numbers from recordings."""
