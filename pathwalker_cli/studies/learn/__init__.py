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
from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from pydantic import Field
from scipy.optimize import least_squares

from pathwalker_cli.case import Case
from pathwalker_cli.config.learnt import COST, Learnt, LearntNumber, Prior, config_values
from pathwalker_cli.config.schema import TrialName
from pathwalker_cli.errors import ConfigError, DataError, NotConvergedError, did_you_mean
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.fields import Quantity, YamlModel
from pathwalker_cli.nlp.kkt import Answer
from pathwalker_cli.ocp.violations import active_bounds
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.stride.stride import Stride, stride_of
from pathwalker_cli.studies.base import NeighbourStudy, Plan, StudyKind, Work, resolver_of
from pathwalker_cli.studies.learn.result import (
    FILES,
    LearnResult,
    learn_content,
    learn_lines,
    left_out_errors,
    write_learnt,
)
from pathwalker_cli.studies.learn.targets import Target, carried_weight, residuals, targets_of
from pathwalker_cli.studies.neighbours import STOPPED, Journal

STEPS: Final = "steps"
"""Folder of the predictions that were solved on the way."""

_STEP: Final = 1e-4
"""Forward difference by which derivatives of the problem are taken [prior standard deviations]."""
_AT_END: Final = 0.01
"""Distance from an end of its range at which a number sits there [prior deviations]."""
_WEIGHT_OFF: Final = 0.2
"""Share of the weight by which the load of both feet may be off: strides are not quite periodic."""
_DIGITS: Final = 9
"""Significant digits of the numbers that are tried: a restart asks for the very same."""


class Weights(YamlModel):
    """How much the groups of observations count."""

    angles: Annotated[float, Quantity("", 0.0, 100.0)] = 1.0
    forces: Annotated[float, Quantity("", 0.0, 100.0)] = 0.3
    moments: Annotated[float, Quantity("", 0.0, 100.0)] = 0.3
    walk: Annotated[float, Quantity("", 0.0, 100.0)] = 1.0


Barrier = Annotated[float, Quantity("", 0.0, 1.0)]


class LearnStudy(NeighbourStudy):
    """What is learnt, from which recordings."""

    numbers: Annotated[dict[str, Prior], Field(min_length=1)]
    weights: Weights = Weights()
    without: tuple[TrialName, ...] = ()
    steps: Annotated[int, Field(ge=1, le=200)] = 12
    precision: Annotated[float, Quantity("", 1e-8, 1e-1)] = 1e-3
    smoothing: Annotated[tuple[Barrier, ...], Field(min_length=1)] = (1e-3, 0.0)
    starts: Annotated[int, Field(ge=1, le=50)] = 1
    seed: Annotated[int, Field(ge=0)] = 0

    def based_on(self, case: Case) -> Case:
        """Return a case with all numbers at their priors."""
        return case.with_values(config_values({k: p.prior for k, p in self.numbers.items()}))

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


@dataclass
class _Learner:
    """Predictions for numbers, counted in prior standard deviations from their priors.

    Args:
        study: What is learnt.
        case: The problem.
        targets: What its strides are held against.
        resolver: Solves neighbours of the first prediction.
        journal: Keeps what was solved.
        report: Hears of every step.
        name: Beginning of the names in the journal.
        begin: The prediction to begin with; the first one if left out.
    """

    study: LearnStudy
    case: Case
    targets: tuple[Target, ...]
    resolver: Resolver
    journal: Journal
    report: Callable[[str], object]
    name: str = "start-00"
    begin: Optimum | None = None
    solves: int = 0
    iterations: int = 0
    _known: dict[bytes, Optimum] = field(default_factory=dict)
    _at: tuple[np.ndarray, Optimum, list[Answer]] | None = None

    def values(self, deviations: np.ndarray) -> dict[str, float]:
        """Return the numbers by place [their units]."""
        pairs = zip(self.study.numbers.items(), deviations, strict=True)
        return {k: float(f"{p.value(float(d)):.{_DIGITS}g}") for (k, p), d in pairs}

    def case_at(self, deviations: np.ndarray) -> Case:
        """Return the problem with these numbers."""
        return self.case.with_values(config_values(self.values(deviations)))

    def optimum(self, deviations: np.ndarray) -> Optimum:
        """Return the prediction, solved from the last one that was accepted."""
        key = deviations.tobytes()
        if key not in self._known:
            name = f"{self.name}-{len(self._known):03d}"
            begin = self._extrapolated(deviations)
            optimum = self.journal.resolve(name, self.case_at(deviations), begin, insist=False)
            self.solves += 1
            self.iterations += optimum.result.iterations
            self._known[key] = optimum
        return self._known[key]

    def _extrapolated(self, deviations: np.ndarray) -> Optimum | None:
        """Return where the derivatives at the last step say that the optimum is."""
        if self._at is None:
            return self.begin
        last, optimum, answers = self._at
        steps = zip(answers, deviations - last, strict=True)
        unknowns = optimum.result.unknowns + sum(a.unknowns * step for a, step in steps)
        return replace(optimum, result=replace(optimum.result, unknowns=unknowns))

    def misfit(self, deviations: np.ndarray) -> np.ndarray:
        """Return all deviations, of the walk and of the numbers; NaN where nothing was found."""
        optimum = self.optimum(deviations)
        if not optimum.converged:
            size = sum(target.mean.size for target in self.targets)
            return np.full(size + deviations.size, np.nan)
        return np.concatenate([residuals(self.targets, stride_at(optimum)), deviations])

    def slopes(self, deviations: np.ndarray) -> np.ndarray:
        """Return the derivatives of `misfit` by all numbers."""
        optimum = self.optimum(deviations)
        answers, columns = [], []
        here = residuals(self.targets, stride_at(optimum))
        for step in _STEP * np.eye(deviations.size):
            end = self.resolver.restored(self.case_at(deviations + step), optimum.result)
            answer = optimum.kkt.answer(optimum.program, end.program, _STEP / 2.0)
            there = residuals(self.targets, stride_at(_moved(end, _STEP * answer.unknowns)))
            answers.append(answer)
            columns.append((there - here) / _STEP)
        self._at = deviations.copy(), optimum, answers
        self._tell(deviations, optimum)
        return np.vstack([np.array(columns).T, np.eye(deviations.size)])

    def _tell(self, deviations: np.ndarray, optimum: Optimum) -> None:
        stride = stride_at(optimum)
        parts = [(t.group, float(np.sum(t.residual(stride) ** 2))) for t in self.targets]
        groups = {group: sum(v for g, v in parts if g == group) for group, _ in parts}
        shown = ", ".join(f"{group} {value:.2f}" for group, value in groups.items())
        self.report(
            f"step {self.solves:3d}  misfit {sum(groups.values()):7.3f} ({shown}), "
            f"priors {float(deviations @ deviations):.2f}, {stride.walking_speed:.3f} m/s, "
            f"{self.iterations} iterations"
        )


def stride_at(optimum: Optimum) -> Stride:
    """Return the predicted stride of an optimum."""
    return stride_of(optimum.series)


def _moved(optimum: Optimum, unknowns: np.ndarray) -> Optimum:
    result = replace(optimum.result, unknowns=optimum.result.unknowns + unknowns)
    return replace(optimum, result=result)


def plan(study: LearnStudy, solver: GaitSolver) -> Plan:
    """Return what would be learnt, and from what.

    Raises:
        ConfigError: If a number or a trial does not exist.
        DataError: If there is nothing to learn from.
    """
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
        f"learns {len(study.numbers)} numbers from {trials} {solver.walker.condition} trials, "
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
    learners: list[_Learner] = []
    ends = []
    for start, at in enumerate(_starts(study)):
        begin: Optimum | None = None
        for stage, barrier in enumerate(study.smoothing):
            smooth = replace(run, case=_smoothed(case, barrier))
            resolver = resolver_of(smooth)
            journal = Journal(work.folder / STEPS, run, resolver)
            name = f"start-{start:02d}-{stage}"
            learner = _Learner(
                study, smooth.case, targets, resolver, journal, work.report, name, begin
            )
            learners.append(learner)
            end = _descended(learner, at)
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
        active=_bounds_that_act(learner, best.x),
        left_out=left_out_errors(
            study.targets, recorded, targets, slopes, best.x, stride_at(optimum), study.without
        ),
        solves=sum(each.solves for each in learners),
        iterations=sum(each.iterations for each in learners),
        seconds=time.perf_counter() - began,
        cpu_seconds=time.process_time() - used,
    )


def _smoothed(case: Case, barrier: float) -> Case:
    """Return a problem that is solved with what this barrier leaves of its inequalities.

    A bound that becomes active bends the way of the optimum; with a barrier the way is smooth.
    """
    if not barrier:
        return case
    return case.with_values({"solver.ipopt": {**case.config.solver.ipopt, "mu_target": barrier}})


def _starts(study: LearnStudy) -> list[np.ndarray]:
    """Return where to begin: at the priors, then at draws from half of them."""
    size, rng = len(study.numbers), np.random.default_rng(study.seed)
    return [np.zeros(size), *(0.5 * rng.standard_normal((study.starts - 1, size)))]


def _descended(learner: _Learner, start: np.ndarray) -> Any:
    """Return where the trust-region method ends."""
    numbers = learner.study.numbers.values()
    limits = np.array([[p.deviations(end) for end in p.range] for p in numbers]).T
    inside = np.clip(start, *(limits + np.array([[1e-6], [-1e-6]])))
    if not np.isfinite(learner.misfit(inside)).all():
        status = learner.optimum(inside).result.status
        raise NotConvergedError(f"there is no prediction to begin with: {status}")
    study = learner.study
    try:
        return least_squares(
            learner.misfit, inside, learner.slopes, bounds=limits, max_nfev=study.steps,
            ftol=study.precision, xtol=study.precision,
        )  # fmt: skip
    except KeyboardInterrupt:
        raise NotConvergedError(STOPPED) from None


def _bounds_that_act(learner: _Learner, deviations: np.ndarray) -> tuple[str, ...]:
    """Return the ranges of the problem and of the learnt numbers that hold the result."""
    optimum = learner.optimum(deviations)
    bounds = active_bounds(optimum.program, optimum.result)
    asked = {*optimum.solver.bounds.sources, "duration"}
    ours = [str(bound) for bound in bounds if bound.name in asked]
    for (place, prior), at in zip(learner.study.numbers.items(), deviations, strict=True):
        low, high = (prior.deviations(end) for end in prior.range)
        if min(at - low, high - at) < _AT_END:
            ours.append(f"{place} at {prior.value(float(at)):.4g}")
    return tuple(ours)


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
    content=learn_content,
    lines=learn_lines,
    predicts=True,
    whole_cycle=True,
)
"""The study that learns numbers from recordings."""
