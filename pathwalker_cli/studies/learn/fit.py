"""Predictions for numbers, and the descent to those whose gait is nearest to recordings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any, Final

import numpy as np
from scipy.optimize import least_squares

from pathwalker_cli.case import Case
from pathwalker_cli.config.learnt import Prior, config_values
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.ocp.violations import active_bounds
from pathwalker_cli.stride.stride import Stride, stride_of
from pathwalker_cli.studies.learn.targets import Target, residuals
from pathwalker_cli.studies.neighbours import STOPPED, Journal

_STEP: Final = 1e-4
"""Forward difference by which derivatives of the problem are taken [prior standard deviations]."""
_AT_END: Final = 0.01
"""Distance from an end of its range at which a number sits there [prior deviations]."""
_DIGITS: Final = 9
"""Significant digits of the numbers that are tried: a restart asks for the very same."""


@dataclass
class Learner:
    """Predictions for numbers, counted in prior standard deviations from their priors.

    The resolver solves neighbours of the first prediction, the journal keeps them under names that
    begin with `name`.  The next prediction begins at `begin`: the last one whose slopes were asked
    for, or the optimum of the resolver.
    """

    numbers: Mapping[str, Prior]
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

    def values(self, deviations: np.ndarray) -> dict[str, float]:
        """Return the numbers by place [their units]."""
        pairs = zip(self.numbers.items(), deviations, strict=True)
        return {k: float(f"{p.value(float(d)):.{_DIGITS}g}") for (k, p), d in pairs}

    def case_at(self, deviations: np.ndarray) -> Case:
        """Return the problem with these numbers."""
        return self.case.with_values(config_values(self.values(deviations)))

    def optimum(self, deviations: np.ndarray) -> Optimum:
        """Return the prediction, solved from the last one that was accepted."""
        key = deviations.tobytes()
        if key not in self._known:
            name = f"{self.name}-{len(self._known):03d}"
            optimum = self.journal.resolve(name, self.case_at(deviations), self.begin, insist=False)
            self.solves += 1
            self.iterations += optimum.result.iterations
            self._known[key] = optimum
        return self._known[key]

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
        columns = []
        here = residuals(self.targets, stride_at(optimum))
        for step in _STEP * np.eye(deviations.size):
            end = self.resolver.restored(self.case_at(deviations + step), optimum.result)
            answer = optimum.kkt.answer(optimum.program, end.program, _STEP / 2.0)
            there = residuals(self.targets, stride_at(_moved(end, _STEP * answer.unknowns)))
            columns.append((there - here) / _STEP)
        self.begin = optimum
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


def smoothed(case: Case, barrier: float) -> Case:
    """Return a problem that is solved with what this barrier leaves of its inequalities.

    A bound that becomes active bends the way of the optimum; with a barrier the way is smooth.
    """
    if not barrier:
        return case
    return case.with_values({"solver.ipopt": {**case.config.solver.ipopt, "mu_target": barrier}})


def descend(learner: Learner, start: np.ndarray, steps: int, precision: float) -> Any:
    """Return where the trust-region method ends.

    Args:
        learner: What predicts, and is held against targets.
        start: Where to begin [prior standard deviations], shape (n,).
        steps: Predictions that are tried, at most.
        precision: Relative change of misfit or numbers at which it is enough.

    Raises:
        NotConvergedError: If there is no prediction at the start, or the user stopped it.
    """
    numbers = learner.numbers.values()
    limits = np.array([[p.deviations(end) for end in p.range] for p in numbers]).T
    inside = np.clip(start, *(limits + np.array([[1e-6], [-1e-6]])))
    if not np.isfinite(learner.misfit(inside)).all():
        status = learner.optimum(inside).result.status
        raise NotConvergedError(f"there is no prediction to begin with: {status}")
    try:
        return least_squares(
            learner.misfit, inside, learner.slopes, bounds=limits, max_nfev=steps,
            ftol=precision, xtol=precision,
        )  # fmt: skip
    except KeyboardInterrupt:
        raise NotConvergedError(STOPPED) from None


def ranges_that_act(learner: Learner, deviations: np.ndarray) -> tuple[str, ...]:
    """Return the ranges of the problem and of the learnt numbers that hold the result."""
    optimum = learner.optimum(deviations)
    bounds = active_bounds(optimum.program, optimum.result)
    asked = {*optimum.solver.bounds.sources, "duration"}
    ours = [str(bound) for bound in bounds if bound.name in asked]
    for (place, prior), at in zip(learner.numbers.items(), deviations, strict=True):
        low, high = (prior.deviations(end) for end in prior.range)
        if min(at - low, high - at) < _AT_END:
            ours.append(f"{place} at {prior.value(float(at)):.4g}")
    return tuple(ours)
