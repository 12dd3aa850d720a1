"""Neighbours without a solve: a stand-in for the resolver whose measures follow the config."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from conftest import made_result
from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.nlp.result import NlpResult

BEST = dict(zip(STIFFNESSES, (92.0, 40.0, 6.0, 5.0), strict=True))
"""K_D right at its upper limit, K_P left at its lower one, the others inside."""

SLOPE = dict(zip(STIFFNESSES, (-1e-3, 0.0, 0.0, 1e-3), strict=True))
"""Change of the cost per N m/rad: what pushes the first and the last to their limits."""

CURVATURE = 1e-4


@dataclass(frozen=True)
class StandInOptimum:
    """What a study asks of a neighbour."""

    case: Case
    result: NlpResult

    @property
    def config(self) -> StudyConfig:
        return self.case.config

    @property
    def converged(self) -> bool:
        return self.result.converged

    @property
    def solver(self) -> Any:
        walker = build_walker(self.case.patient, "orthosis", backend="direct")
        bounds = gait_bounds(walker, self.config.bounds)
        free = tuple(u for u in walker.unknowns if len(set(bounds.ranges[u.name])) > 1)
        return SimpleNamespace(walker=walker, bounds=bounds, free=free)

    @property
    def motion(self) -> Any:
        return SimpleNamespace(intervals=36)


@dataclass
class StandInResolver:
    """Ends every solve at once; those of which `fails` says so do not converge."""

    case: Case
    solved: list[Case] = field(default_factory=list)
    fails: Callable[[StudyConfig], bool] = field(default=lambda config: False)

    @property
    def optimum(self) -> StandInOptimum:
        return StandInOptimum(self.case, made_result())

    def resolve(
        self, case: Case, start: StandInOptimum | None = None, insist: bool = True
    ) -> StandInOptimum:
        self.solved.append(case)
        status = "the iteration limit was reached" if self.fails(case.config) else "converged"
        return StandInOptimum(case, replace(made_result(), status=status))

    def restored(self, case: Case, result: NlpResult) -> StandInOptimum:
        return StandInOptimum(case, result)


def stand_in_measures(optimum: StandInOptimum) -> dict[str, float]:
    """Return measures that follow springs and strengths."""
    springs = chosen(optimum.config)
    patient, usual = optimum.case.patient, optimum.case.unvaried
    strength = np.mean(np.array(patient.max_isometric_torque) / usual.max_isometric_torque)
    cost = 0.28 / strength
    for name, value in springs.items():
        away = value - BEST[name]
        cost += SLOPE[name] * away + (0.5 * CURVATURE * away**2 if SLOPE[name] == 0.0 else 0.0)
    numbers = {
        "cost": cost,
        "effort_per_distance": 0.95 * cost,
        "min_stance_knee_flexion_left": 0.42 * strength,
        "min_stance_knee_flexion_right": 0.43,
        "step_length_left": 0.36,
        "step_length_right": 0.35,
        "walking_speed": 0.636 * patient.body_mass / usual.body_mass,
        "stride_time": 1.12,
    }
    return {**{k: float(v) for k, v in numbers.items()}, **springs}


def chosen(config: StudyConfig) -> Mapping[str, float]:
    """Return the stiffnesses that a config leads to."""
    return {name: config.bounds.stiffness.get(name, (best,))[0] for name, best in BEST.items()}
