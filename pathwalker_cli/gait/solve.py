"""Solve a gait problem in stages: track a stride, predict on a coarse mesh, refine the mesh."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import (
    gait_bounds,
    helped_bounds,
    recorded_durations,
    tracking_bounds,
)
from pathwalker_cli.gait.cost_terms import cost_terms, with_goal_costs
from pathwalker_cli.gait.costs import Weights
from pathwalker_cli.gait.passage import passage_samples, recorded_passage
from pathwalker_cli.gait.problem import Form, GaitProblem
from pathwalker_cli.gait.shortfall import Shortfall, missing_torques
from pathwalker_cli.gait.solution import TOO_WEAK, GaitSolution, StageRecord
from pathwalker_cli.gait.start import ReferenceStride, reference_stride, start_recording
from pathwalker_cli.gait.structures import gait_blocks
from pathwalker_cli.gait.symmetry import full_stride, require_symmetry
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.nlp.ipopt import IpoptSettings, NlpResult, solve_program
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import BoundTable, ProblemNumbers, Sample
from pathwalker_cli.ocp.violations import active_bounds, largest_violations
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.verify import Reintegration, reintegrate

__all__ = ["GaitSolver", "solve_study"]

_TRACKING = {"tracking": 10.0, "reserve": 10.0, "smoothing": 0.1}
"""Weights of the first stage: follow the stride, carried by reserve forces where needed."""

_TRACKING_TOLERANCE, _TRACKING_BARRIER = 1e-2, 0.1
"""A start need not be exact; far from any solution a large barrier takes the fewest iterations."""

_HELPED = {"effort": 1e-2, "rate": 2e-4, "acceleration": 1e-5, "reserve": 10.0}
"""Weights by which reserves at the joints help a solve that failed: hardly any effort matters."""

_LEAST_HELP = {**_HELPED, "reserve": 1e3}
"""Weights of the least help: what is left of the reserves is what the muscles lack."""

_PATIENCE = 400
"""Iterations on the first mesh after which reserves have to help; most need 60 to 300."""

_FADED = 0.02
"""Share of the orthosis that acts in the first stage."""

_BARRIER_SHARE = 1e-2
"""Barrier, as a share of the tolerance of the stage before, that a warm start begins with."""

_EAGER_ROUND, _EAGER_SHARE = 4, 0.3
"""Round from which intervals are split at a share of the tolerance already: the solution moves
from round to round, and would take the error to another interval that just met it before."""

_MESHING = 1e-6
"""Relative tolerance of the integrator that a mesh is refined by; errors to find are 1e-3."""

StageObserver = Callable[[str, ProgressReport], None]


@dataclass
class GaitSolver:
    """One problem structure, built once; solves it on any mesh with any numbers.

    Args:
        case: What is solved, and for whom.
        observer: Called after every iteration with the stage's name.
    """

    case: Case
    observer: StageObserver | None = None
    stages: list[StageRecord] = field(default_factory=list)
    seconds: dict[str, float] = field(
        default_factory=lambda: {"build": 0.0, "solve": 0.0, "verify": 0.0}
    )
    shortfall: Shortfall | None = field(default=None, init=False)

    def __post_init__(self) -> None:
        """Build walker, bounds and the blocks of the problem."""
        began = time.perf_counter()
        self.walker = self.case.walker(self.config.model.backend)
        self.bounds = gait_bounds(self.walker, self.config.bounds, self.config.free)
        self.gait = GaitProblem(self.walker, self._form(), self.config.cost.wanted)
        if self.config.start.gait == "recorded":
            _ = self.stride  # a missing recording is refused before anything is built
        if self.config.fits:
            self.bounds = recorded_durations(self.bounds, self.stride.durations)
        self.blocks = gait_blocks(self.gait, self.config.mesh.degree)
        self.seconds["build"] += time.perf_counter() - began

    @property
    def config(self) -> StudyConfig:
        """What is solved."""
        return self.case.config

    def _form(self) -> Form:
        """Return what the phases are.

        Raises:
            ConfigError: If half a cycle is asked for, but left and right differ.
        """
        if self.config.fits:
            return "passage"
        if not self.config.half_cycle:
            return "stride"
        require_symmetry(self.walker)
        return "step"

    @property
    def weights(self) -> dict[str, float]:
        """Weights of the prediction by cost term."""
        cost = self.config.cost
        return {
            "effort": cost.effort_weight,
            "rate": cost.rate_weight,
            "acceleration": cost.acceleration_weight,
            "walking_speed": cost.walking_speed_weight,
            "fit": cost.fit_weight,
            "excitation": cost.excitation_weight,
            **cost.goals,
        }

    @property
    def free(self) -> tuple[Unknown, ...]:
        """The unknowns that may move within their ranges."""
        ranges = self.bounds.ranges
        return tuple(u for u in self.walker.unknowns if ranges[u.name][0] < ranges[u.name][1])

    @cached_property
    def stride(self) -> ReferenceStride:
        """The stride that a solve without warm start begins with; of a fit, what is followed."""
        start = self.config.start
        if self.config.fits:
            return recorded_passage(self.walker, start_recording(self.walker, start))
        return reference_stride(self.walker, start, self.start_speed)

    @property
    def start_speed(self) -> float:
        """Speed of a synthetic start [m/s]: the config's, or the least speed allowed."""
        least = self.bounds.table.entries[("walking_speed",)][0]
        return self.config.start.walking_speed or least

    @cached_property
    def samples(self) -> tuple[Sample, ...]:
        """The recorded instants that a fit follows."""
        return passage_samples(self.stride) if self.config.fits else ()

    def parameter_guess(self) -> np.ndarray:
        """Return where the search for the walker's unknowns begins, within their bounds, (k,)."""
        walker, start = self.walker, self.config.start
        given = {**start.stiffness, **start.free}
        values = [
            given.get(u.name, given.get(u.address, u.value(walker.values))) for u in walker.unknowns
        ]
        lower, upper = self.bounds.table.arrays(tuple(u.name for u in walker.unknowns))
        return np.clip(values, lower, upper)

    def numbers(
        self, weights: Weights, table: BoundTable, orthosis_share: float = 1.0
    ) -> ProblemNumbers:
        """Return the numbers of a stage."""
        friction = self.config.bounds.friction
        shared = self.gait.shared_values(weights, friction, orthosis_share)
        reference = self.stride.coordinates
        return ProblemNumbers(shared, table, lambda i, at: reference(i, at), self.samples)

    @cached_property
    def prediction(self) -> ProblemNumbers:
        """The numbers of the problem itself."""
        return self.numbers(self.weights, self.bounds.table)

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
            program.size,
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
        assert observer is not None  # noqa: S101 - asked for only where there is one
        return lambda report: observer(name, report)

    def settings(self, tolerance: float, barrier: float, warm: bool = False) -> IpoptSettings:
        """Return the settings of a stage: optimality tolerance, first barrier, warm multipliers."""
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
        config, solver = self.config, self.config.solver
        self.shortfall = None
        loose = max(solver.tolerance, solver.first_tolerance) if config.mesh.refinements else 0.0
        if warm_start is None:
            program, result = self._track()
            motion = program.to_motion(result.unknowns)
            motion = replace(motion, parameters=self.parameter_guess())
            settings = self.settings(loose or solver.tolerance, solver.first_barrier)
        else:
            warm_start = replace(warm_start, phases=warm_start.phases[: len(self.gait.phases)])
            if not config.fits:
                warm_start = with_goal_costs(warm_start, self.gait.costs, self.walker.weight)
            kept = config.mesh.refinements > 0
            motion = warm_start if kept else self._first_meshed(warm_start)
            settings = self.settings(loose or solver.tolerance, solver.warm_barrier)
        if not self._interrupted:
            program, result = self._on_first_mesh(motion, settings)
        program, result, errors = self._refine(program, result, settings.tolerance)
        return self._finish(program, result, errors, warm_start is not None)

    def restored(self, result: NlpResult, meshes: tuple[np.ndarray, ...]) -> GaitSolution:
        """Return the solution that another process found on these meshes."""
        program = CollocationProgram(self.blocks, self.prediction, meshes)
        errors = self._reintegrated(program.to_motion(result.unknowns))
        return self._finish(program, result, errors, False)

    def _on_first_mesh(
        self, motion: PhasedMotion, settings: IpoptSettings
    ) -> tuple[CollocationProgram, NlpResult]:
        """Predict on the first mesh; if that fails, by way of a motion that reserves help along."""
        helpless = self.config.fits
        limit = settings.max_iterations if helpless else min(_PATIENCE, settings.max_iterations)
        first = replace(settings, max_iterations=limit)
        program, result = self.stage("first mesh", motion, self.prediction, first)
        if result.converged or helpless or self._interrupted:
            return program, result
        return self._helped(motion, settings) or (program, result)

    def _helped(
        self, motion: PhasedMotion, settings: IpoptSettings
    ) -> tuple[CollocationProgram, NlpResult] | None:
        """Predict from a motion with reserves at the joints; if that fails, find what is lacking.

        Returns None if not even reserves lead to a motion within the bounds.
        """
        table = helped_bounds(self.bounds)
        program, result = self.stage("helped", motion, self.numbers(_HELPED, table), settings)
        if not result.converged:
            self.shortfall = None if self._interrupted else Shortfall(within_bounds=False)
            return None
        helped = program.to_motion(result.unknowns)
        last = self.stage("first mesh again", helped, self.prediction, settings)
        if last[1].converged or self._interrupted:
            return last
        numbers = self.numbers(_LEAST_HELP, table)
        program, result = self.stage("least help", helped, numbers, settings)
        if result.converged:
            motion = program.to_motion(result.unknowns)
            motion = full_stride(motion) if self.config.half_cycle else motion
            missing = missing_torques(gait_series(self.walker, motion))
            self.shortfall = Shortfall(within_bounds=True, missing=missing)
        return last

    def _first_meshed(self, motion: PhasedMotion) -> PhasedMotion:
        mesh = self.config.mesh
        return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)

    def _track(self) -> tuple[CollocationProgram, NlpResult]:
        """Follow the stride of the start with reserve forces and given durations.

        The orthosis is faded out: its steep stops would fight a stride that ignores it.
        """
        config, stride, unknowns = self.config, self.stride, self.walker.unknowns
        shares = np.array([_FADED if unknown.faded else 1.0 for unknown in unknowns])
        held = shares * self.parameter_guess()
        names = [unknown.name for unknown in unknowns]
        table = tracking_bounds(
            self.bounds, stride.durations, dict(zip(names, held.tolist(), strict=True))
        )
        meshes = meshing.first(stride.durations[: len(self.gait.phases)], config.mesh)
        costs = len(self.gait.costs.integrals)
        motion = stride.motion(self.walker, held, meshes, config.mesh.degree, costs)
        settings = self.settings(_TRACKING_TOLERANCE, _TRACKING_BARRIER)
        settings = replace(settings, extra={"barrier_tol_factor": 100.0, **settings.extra})
        numbers = self.numbers(_TRACKING, table, _FADED)
        return self.stage("tracking", motion, numbers, settings)

    @property
    def _interrupted(self) -> bool:
        return bool(self.stages) and self.stages[-1].status == "stopped by the user"

    def _refine(
        self, program: CollocationProgram, result: NlpResult, tolerance: float
    ) -> tuple[CollocationProgram, NlpResult, Reintegration]:
        """Refine the mesh until an independent integrator agrees."""
        mesh, solver = self.config.mesh, self.config.solver
        tolerances = (mesh.position_tolerance, mesh.velocity_tolerance)
        errors = self._reintegrated(program.to_motion(result.unknowns), _MESHING)
        for attempt in range(1, mesh.refinements + 1):
            done = _within(errors, tolerances) and tolerance <= solver.tolerance
            if not result.converged or done or self._interrupted:
                break
            share = _EAGER_SHARE if attempt >= _EAGER_ROUND else 1.0
            meshes = meshing.refined(program.meshes, errors, *tolerances, mesh.degree, share)
            start = program.to_motion(result.unknowns).resampled(meshes, mesh.degree)
            name, before = f"refined {attempt}", (program, result)
            program, result = self._refined(name, start, before, tolerance)
            tolerance = solver.tolerance
            errors = self._reintegrated(program.to_motion(result.unknowns), _MESHING)
        return program, result, self._reintegrated(program.to_motion(result.unknowns))

    def _refined(
        self,
        name: str,
        start: PhasedMotion,
        before: tuple[CollocationProgram, NlpResult],
        tolerance: float,
    ) -> tuple[CollocationProgram, NlpResult]:
        """Solve on a refined mesh from the last solution; without multipliers if that fails."""
        solver = self.config.solver
        barrier = max(_BARRIER_SHARE * tolerance, solver.refined_barrier)
        near = self.settings(solver.tolerance, barrier, warm=True)
        program, result = self.stage(name, start, self.prediction, near, before)
        if result.converged or self._interrupted:
            return program, result
        far = self.settings(solver.tolerance, solver.warm_barrier)
        return self.stage(f"{name} again", start, self.prediction, far)

    def _reintegrated(self, motion: PhasedMotion, tolerance: float = 1e-9) -> Reintegration:
        began = time.perf_counter()
        errors = reintegrate(self.walker, motion, tolerance)
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
        if result.converged and mesh.refinements and not _within(errors, tolerances):
            status = "the mesh does not reach the accuracy asked for"
        if self.shortfall is not None and self.shortfall.too_weak:
            status = TOO_WEAK
        motion = program.to_motion(result.unknowns)
        motion = full_stride(motion) if self.config.half_cycle else motion
        return GaitSolution(
            case=self.case,
            walker=self.walker.with_parameters(motion.parameters),
            status=status,
            last_motion=motion,
            nlp=result,
            bounds=self.bounds,
            cost=result.objective,
            cost_terms=cost_terms(motion, self.gait.costs, self.weights, self.samples),
            violations=largest_violations(program, result),
            active=active_bounds(program, result),
            reintegration=errors,
            start="earlier run" if warm else self.stride.name,
            stages=tuple(self.stages),
            seconds=dict(self.seconds),
            shortfall=self.shortfall,
        )


def _within(errors: Reintegration, tolerances: tuple[float, float]) -> bool:
    return errors.worst_position <= tolerances[0] and errors.worst_velocity <= tolerances[1]


def solve_study(
    study: StudyConfig | Case,
    warm_start: PhasedMotion | None = None,
    observer: StageObserver | None = None,
) -> GaitSolution:
    """Build and solve a study, whose patient is read if it is a config; see `GaitSolver`."""
    return GaitSolver(Case.of(study), observer).solve(warm_start)
