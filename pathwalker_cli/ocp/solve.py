"""Solve a gait problem in stages: track a stride, predict on a coarse mesh, then on a fine one."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.ocp import mesh as meshing
from pathwalker_cli.ocp.collocation import CollocationBlocks, CollocationProgram
from pathwalker_cli.ocp.gait import STIFFNESSES, GaitProblem, GaitWeights
from pathwalker_cli.ocp.gait_bounds import GaitBounds, gait_bounds, tracking_bounds
from pathwalker_cli.ocp.ipopt import IpoptSettings, NlpResult, ProgressReport, solve_program
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import BoundTable, ProblemNumbers
from pathwalker_cli.ocp.series import GaitSeries, gait_series
from pathwalker_cli.ocp.start import ReferenceStride, reference_stride
from pathwalker_cli.ocp.verify import (
    ActiveBound,
    Reintegration,
    Violation,
    active_bounds,
    largest_violations,
    reintegrate,
    second_engine_residual,
)
from pathwalker_cli.patient import load_patient

__all__ = ["GaitSolution", "GaitSolver", "StageRecord", "solve_study"]

_TRACKING = GaitWeights(effort=0.0, rate=0.0, tracking=10.0, reserve=10.0, smoothing=0.1)
"""Weights of the first stage: follow the stride, carried by reserve forces where needed."""

_FADED = 0.02
"""Share of the orthosis that acts in the first stage."""

_NEAR_ITERATIONS = 40
"""A refined solve that takes longer has lost the last solution."""

StageObserver = Callable[[str, ProgressReport], None]


@dataclass(frozen=True)
class StageRecord:
    """One stage as it went.

    Args:
        name: "tracking", "coarse", "fine" or "refined 1", ...
        status: "converged" or the reason why not.
        intervals: Mesh intervals.
        unknowns: Size of the nonlinear program.
        iterations: Iterations.
        seconds: Wall seconds of the solve.
        seconds_functions: Part of them in function evaluations.
    """

    name: str
    status: str
    intervals: int
    unknowns: int
    iterations: int
    seconds: float
    seconds_functions: float


@dataclass(frozen=True)
class GaitSolution:
    """The end of a solve, converged or not.

    A solution that did not converge is sealed: `series` raises; `last_iterate` says what it is.

    Args:
        config: What was asked for.
        walker: Who walks.
        status: "converged" or the reason why not.
        last_motion: The last iterate.
        nlp: What the nonlinear solver returned last.
        bounds: Bounds that were used and where they come from.
        cost: Value of the objective.
        cost_terms: Its terms by name; they add up to the cost.
        violations: Largest violations, largest first.
        active: Active bounds.
        reintegration: Errors of an independent integrator.
        start: Where the search began.
        stages: The stages.
        seconds: Wall seconds by part: build, solve, verify.
    """

    config: StudyConfig
    walker: Walker
    status: str
    last_motion: PhasedMotion
    nlp: NlpResult
    bounds: GaitBounds
    cost: float
    cost_terms: dict[str, float]
    violations: tuple[Violation, ...]
    active: tuple[ActiveBound, ...]
    reintegration: Reintegration
    start: str
    stages: tuple[StageRecord, ...]
    seconds: dict[str, float]

    @property
    def converged(self) -> bool:
        """Whether the solution meets all tolerances."""
        return self.status == "converged"

    @property
    def series(self) -> GaitSeries:
        """Time series of the solution.

        Raises:
            NotConvergedError: If it did not converge.
        """
        if not self.converged:
            raise NotConvergedError(
                f"{self.config.problem} did not converge ({self.status}); "
                "its last iterate is no solution"
            )
        return self.last_iterate

    @cached_property
    def last_iterate(self) -> GaitSeries:
        """Time series of the last iterate, converged or not."""
        return gait_series(self.walker, self.last_motion)

    @cached_property
    def second_engine(self) -> float:
        """Largest violation of the equations of motion in numeric Pinocchio [N, N m]."""
        return second_engine_residual(self.last_iterate)

    @property
    def iterations(self) -> int:
        """Iterations over all stages."""
        return sum(stage.iterations for stage in self.stages)


@dataclass
class GaitSolver:
    """One problem structure, built once; solves it on any mesh with any numbers.

    Args:
        config: The study.
        observer: Called after every iteration with the stage's name.
    """

    config: StudyConfig
    observer: StageObserver | None = None
    stages: list[StageRecord] = field(default_factory=list)
    seconds: dict[str, float] = field(
        default_factory=lambda: {"build": 0.0, "solve": 0.0, "verify": 0.0}
    )

    def __post_init__(self) -> None:
        """Build walker, bounds and the blocks of the problem."""
        began = time.perf_counter()
        patient = load_patient(self.config.patient)
        model = self.config.model
        self.walker = build_walker(patient, self.config.condition, model.published, model.backend)
        self.bounds = gait_bounds(self.walker, self.config.bounds)
        self.gait = GaitProblem(self.walker)
        if self.config.start.gait == "recorded":
            _ = self.stride  # a missing recording is refused before anything is built
        self.blocks = CollocationBlocks(self.gait.build(), self.config.mesh.degree)
        self.seconds["build"] += time.perf_counter() - began

    @property
    def weights(self) -> GaitWeights:
        """Cost weights of the prediction."""
        cost = self.config.cost
        return GaitWeights(
            effort=cost.effort_weight,
            rate=cost.rate_weight,
            acceleration=cost.acceleration_weight,
            walking_speed=cost.walking_speed_weight,
        )

    @cached_property
    def stride(self) -> ReferenceStride:
        """The stride that a solve without warm start begins with."""
        speed = self.bounds.table.entries[("walking_speed",)][0]
        return reference_stride(self.walker, self.config.start, speed)

    def stiffness_guess(self) -> np.ndarray:
        """Return the guess of the free stiffnesses [N m/rad] within their bounds, (4,) or (0,)."""
        if self.walker.orthosis is None:
            return np.zeros(0)
        guess = self.walker.patient.require_orthosis().stiffness_guess
        values = [getattr(guess, name.split("_")[0]) for name in STIFFNESSES]
        lower, upper = self.bounds.table.arrays(STIFFNESSES)
        return np.clip(values, lower, upper)

    def numbers(
        self, weights: GaitWeights, table: BoundTable, orthosis_share: float = 1.0
    ) -> ProblemNumbers:
        """Return the numbers of a stage."""
        friction = self.config.bounds.friction
        shared = self.gait.shared_values(weights, friction, orthosis_share)
        return ProblemNumbers(shared, table, lambda i, at: self.stride.coordinates(i, at))

    def stage(
        self,
        name: str,
        motion: PhasedMotion,
        numbers: ProblemNumbers,
        settings: IpoptSettings,
        before: tuple[CollocationProgram, NlpResult] | None = None,
    ) -> tuple[CollocationProgram, NlpResult]:
        """Solve one stage from a motion, and from the multipliers of a stage before; record it."""
        began = time.perf_counter()
        program = CollocationProgram(self.blocks, numbers, motion.meshes)
        multipliers = transferred(before[0], before[1].multipliers, program) if before else None
        observer = None if self.observer is None else self._named(name)
        start = program.to_unknowns(motion)
        result = solve_program(program, start, settings, multipliers, observer)
        record = StageRecord(
            name,
            result.status,
            motion.intervals,
            program.program.size,
            result.iterations,
            result.seconds,
            result.seconds_functions,
        )
        self.stages.append(record)
        self.seconds["solve"] += result.seconds
        self.seconds["build"] += time.perf_counter() - began - result.seconds
        return program, result

    def _named(self, name: str) -> Callable[[ProgressReport], None]:
        observer = self.observer
        assert observer is not None
        return lambda report: observer(name, report)

    def _settings(
        self, tolerance: float, barrier: float = 0.1, warm: bool = False
    ) -> IpoptSettings:
        solver = self.config.solver
        return IpoptSettings(
            tolerance=tolerance,
            constraint_tolerance=solver.constraint_tolerance,
            max_iterations=solver.max_iterations,
            initial_barrier=barrier,
            warm_start=warm,
            extra=dict(solver.ipopt),
        )

    def solve(self, warm_start: PhasedMotion | None = None) -> GaitSolution:
        """Solve the problem.

        Args:
            warm_start: An earlier motion of the same condition to begin with; otherwise the stride
                of the config is tracked first.
        """
        config, mesh = self.config, self.config.mesh
        numbers = self.numbers(self.weights, self.bounds.table)
        coarse = meshing.uniform([mesh.start_intervals_per_phase] * len(PHASES))
        settings = self._settings(config.solver.coarse_tolerance)
        if warm_start is None:
            program, result = self._track(coarse)
            motion = program.to_motion(result.unknowns)
            motion = replace(motion, parameters=self.stiffness_guess())
        else:
            motion = warm_start.resampled(coarse, mesh.degree)
        if not self._interrupted and (warm_start is None or not mesh.intervals):
            program, result = self.stage("coarse", motion, numbers, settings)
            motion = program.to_motion(result.unknowns)
        if mesh.intervals and not self._interrupted:
            motion = motion if warm_start is None else warm_start
            program, result, errors = self._fine(motion, numbers)
        else:
            errors = self._reintegrated(program.to_motion(result.unknowns))
        return self._finish(program, result, errors, warm_start is not None)

    def _track(self, coarse: tuple[np.ndarray, ...]) -> tuple[CollocationProgram, NlpResult]:
        """Follow the stride of the start with reserve forces and given durations.

        The orthosis is faded out: its steep stops would fight a stride that ignores it.
        """
        stiffness = _FADED * self.stiffness_guess()
        table = tracking_bounds(self.bounds, self.stride.durations, stiffness)
        motion = self.stride.motion(self.walker, stiffness, coarse, self.config.mesh.degree)
        settings = self._settings(max(1e-2, self.config.solver.coarse_tolerance))
        numbers = self.numbers(_TRACKING, table, _FADED)
        return self.stage("tracking", motion, numbers, settings)

    @property
    def _interrupted(self) -> bool:
        return bool(self.stages) and self.stages[-1].status == "stopped by the user"

    def _fine(
        self,
        motion: PhasedMotion,
        numbers: ProblemNumbers,
    ) -> tuple[CollocationProgram, NlpResult, Reintegration]:
        """Solve on the fine mesh and refine it until an independent integrator agrees."""
        mesh, solver = self.config.mesh, self.config.solver
        tolerances = (mesh.position_tolerance, mesh.velocity_tolerance)
        meshes = meshing.by_duration(
            motion.durations, mesh.intervals, mesh.least_intervals_per_phase
        )
        loose = max(solver.tolerance, 1e-5) if mesh.refinements else solver.tolerance
        settings = self._settings(loose, solver.fine_initial_barrier)
        start = motion.resampled(meshes, mesh.degree)
        program, result = self.stage("fine", start, numbers, settings)
        errors = self._reintegrated(program.to_motion(result.unknowns))
        for attempt in range(1, mesh.refinements + 1):
            done = _within(errors, tolerances) and (attempt > 1 or loose == solver.tolerance)
            if not result.converged or done or self._interrupted:
                break
            meshes = meshing.refined(meshes, errors, *tolerances, order=mesh.degree)
            start = program.to_motion(result.unknowns).resampled(meshes, mesh.degree)
            program, result = self._refined(f"refined {attempt}", start, numbers, (program, result))
            errors = self._reintegrated(program.to_motion(result.unknowns))
        return program, result, errors

    def _refined(
        self,
        name: str,
        start: PhasedMotion,
        numbers: ProblemNumbers,
        before: tuple[CollocationProgram, NlpResult],
    ) -> tuple[CollocationProgram, NlpResult]:
        """Solve on a refined mesh from the last solution; without multipliers if that fails."""
        solver = self.config.solver
        near = self._settings(solver.tolerance, solver.refined_initial_barrier, warm=True)
        near = replace(near, max_iterations=min(_NEAR_ITERATIONS, solver.max_iterations))
        program, result = self.stage(name, start, numbers, near, before)
        if result.converged or self._interrupted:
            return program, result
        far = self._settings(solver.tolerance, solver.fine_initial_barrier)
        return self.stage(f"{name} again", start, numbers, far)

    def _reintegrated(self, motion: PhasedMotion) -> Reintegration:
        began = time.perf_counter()
        errors = reintegrate(self.walker, motion)
        self.seconds["verify"] += time.perf_counter() - began
        return errors

    def _finish(
        self,
        program: CollocationProgram,
        result: NlpResult,
        errors: Reintegration,
        warm: bool,
    ) -> GaitSolution:
        mesh = self.config.mesh
        status = result.status
        tolerances = (mesh.position_tolerance, mesh.velocity_tolerance)
        if result.converged and mesh.intervals and not _within(errors, tolerances):
            status = "the mesh does not reach the accuracy asked for"
        motion = program.to_motion(result.unknowns)
        return GaitSolution(
            config=self.config,
            walker=self.walker,
            status=status,
            last_motion=motion,
            nlp=result,
            bounds=self.bounds,
            cost=result.objective,
            cost_terms=self._cost_terms(motion),
            violations=largest_violations(program, result),
            active=active_bounds(program, result),
            reintegration=errors,
            start="earlier run" if warm else self.stride.name,
            stages=tuple(self.stages),
            seconds=dict(self.seconds),
        )

    def _cost_terms(self, motion: PhasedMotion) -> dict[str, float]:
        """Return the terms of the objective, equations (9) and (10)."""
        effort, rate, acceleration = motion.phases[-1].integrals[-1][:3]
        distance = motion.phases[-1].states[-1, 0] - motion.phases[0].states[0, 0]
        weights = self.weights
        return {
            "effort_per_distance": float(weights.effort * effort / distance),
            "rate_regularisation": float(weights.rate * rate / distance),
            "acceleration_regularisation": float(weights.acceleration * acceleration / distance),
            "walking_speed": float(-weights.walking_speed * distance / motion.duration),
        }


def _within(errors: Reintegration, tolerances: tuple[float, float]) -> bool:
    return errors.worst_position <= tolerances[0] and errors.worst_velocity <= tolerances[1]


def solve_study(
    config: StudyConfig,
    warm_start: PhasedMotion | None = None,
    observer: StageObserver | None = None,
) -> GaitSolution:
    """Build and solve a study; see `GaitSolver`."""
    return GaitSolver(config, observer).solve(warm_start)
