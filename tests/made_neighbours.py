"""Neighbours without a solve: two basins over springs and speed, one start leads to each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from conftest import made_result
from helpers import stylised_series, walker_of
from pathwalker_cli.case import Case, load_case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.results.run_folder import Run

FREE = (91.9, 90.0, 6.0, 5.0)
"""Stiffnesses that least effort chooses where it may [N m/rad]."""
GAIN = 0.02
"""Cost by which the second basin is better than the first, which the base lies in."""
LIMIT = "the iteration limit was reached"

Fails = Callable[[StudyConfig], bool]


@dataclass(frozen=True)
class MadeOptimum:
    """What the studies ask of a neighbour; its basin is the first of its unknowns."""

    case: Case
    result: NlpResult
    errors: tuple[float, float] = (5e-4, 5e-3)

    @property
    def config(self) -> StudyConfig:
        return self.case.config

    @property
    def converged(self) -> bool:
        return self.result.converged

    @property
    def cost(self) -> float:
        return self.result.objective

    @property
    def stiffness(self) -> np.ndarray:
        given = self.config.bounds.stiffness
        return np.array([given.get(name, (free,))[0]
                         for name, free in zip(STIFFNESSES, FREE, strict=True)])  # fmt: skip

    @property
    def motion(self) -> Any:
        motion = stylised_series("orthosis").motion
        phases = tuple(replace(phase, duration=phase.duration / speed(self.config) * 0.6)
                       for phase in motion.phases)  # fmt: skip
        return replace(motion, phases=phases, parameters=self.stiffness)

    @property
    def solver(self) -> Any:
        walker = walker_of("orthosis")
        return SimpleNamespace(walker=walker, bounds=gait_bounds(walker, self.config.bounds))

    @property
    def reintegration(self) -> Any:
        return SimpleNamespace(worst_position=self.errors[0], worst_velocity=self.errors[1])


def speed(config: StudyConfig) -> float:
    """Return the speed that a weight leads to [m/s]."""
    return 0.636 + 0.2 * max(config.cost.walking_speed_weight - 0.5, 0.0)


def effort(case: Case, basin: float) -> float:
    """Return effort per distance [s/m] over the springs and the speed of a case."""
    springs = MadeOptimum(case, made_result()).stiffness
    away = np.abs(np.log(springs / FREE)).sum()
    return 0.26 * (1.0 + 0.05 * away) - GAIN * basin * 0.26 + (speed(case.config) - 0.636) ** 2


@dataclass
class MadeResolver:
    """Ends at once; a start decides the basin, and a leap leads from the first to the second."""

    case: Case
    fails: Fails = field(default=lambda config: False)
    leaps: bool = False
    errors: tuple[float, float] = (5e-4, 5e-3)
    solved: list[Case] = field(default_factory=list)

    @property
    def optimum(self) -> MadeOptimum:
        return self.restored(self.case, self.end(self.case, 0.0, "converged"))

    def resolve(
        self, case: Case, start: MadeOptimum | None = None, insist: bool = True
    ) -> MadeOptimum:
        self.solved.append(case)
        start = start or self.optimum
        far = np.linalg.norm(np.log(start.stiffness / MadeOptimum(case, start.result).stiffness))
        basin = 1.0 if self.leaps and far > 3.0 else start.result.unknowns[0]
        status = LIMIT if self.fails(case.config) else "converged"
        return self.restored(case, self.end(case, basin, status))

    def restored(self, case: Case, result: NlpResult) -> MadeOptimum:
        return MadeOptimum(case, result, self.errors)

    def end(self, case: Case, basin: float, status: str) -> NlpResult:
        weight = case.config.cost.walking_speed_weight
        cost = effort(case, basin) - weight * speed(case.config)
        unknowns = np.array([basin, *0.01 * np.log(MadeOptimum(case, made_result()).stiffness)])
        return replace(made_result(), unknowns=unknowns, objective=cost, status=status)


def made_measures(optimum: MadeOptimum) -> dict[str, float]:
    """Return measures that follow the config."""
    return {
        "cost": optimum.cost,
        "effort_per_distance": effort(optimum.case, optimum.result.unknowns[0]),
        "min_stance_knee_flexion_left": 0.42,
        "min_stance_knee_flexion_right": 0.40 + 1e-3 * float(optimum.stiffness[0]),
        "step_length_left": 0.36,
        "step_length_right": 0.35 + 1e-4 * float(optimum.stiffness[2]),
        "walking_speed": speed(optimum.config),
        "stride_time": 1.12,
        **dict(zip(STIFFNESSES, optimum.stiffness.tolist(), strict=True)),
    }


def made_run(folder: Path, case: Case | None = None) -> Run:
    """Return a run to stand on."""
    motion = stylised_series("orthosis").motion
    return Run(
        folder,
        {"motion_hash": "made", "input_hashes": {}},
        motion,
        case or load_case("mapd-orthosis"),
    )
