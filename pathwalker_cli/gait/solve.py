"""Solve a gait problem in stages: predict on a coarse mesh, refine the mesh, prove the result."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Final

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.gait import choices
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import (
    fallback_speed,
    gait_bounds,
    recorded_durations,
    require_worn,
)
from pathwalker_cli.gait.cost_terms import cost_terms
from pathwalker_cli.gait.costs import Weights
from pathwalker_cli.gait.first_mesh import Stage, from_motion, from_start
from pathwalker_cli.gait.problem import Form, GaitProblem, gait_blocks
from pathwalker_cli.gait.recorded import (
    passage_samples,
    recorded_passage,
    recorded_stride,
    start_recording,
)
from pathwalker_cli.gait.solution import (
    TOO_WEAK,
    GaitSolution,
    Shortfall,
    StageRecord,
)
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.gait.stylised import stylised_stride
from pathwalker_cli.gait.symmetry import full_stride, require_symmetry
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import BoundTable, ProblemNumbers, Sample
from pathwalker_cli.ocp.violations import active_bounds, largest_violations
from pathwalker_cli.stride.verify import Reintegration

StageObserver = Callable[[str, ProgressReport], None]
EARLIER: Final = "earlier run"
"""Start of a solve that begins with a motion of another one."""


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
        require_worn(self.walker, self.config)
        self.bounds = gait_bounds(self.walker, self.config.bounds, self.config.free)
        self.gait = GaitProblem(self.walker, self._form(), self.config.cost.wanted)
        if self.config.start.gait == "recorded":
            _ = self.stride  # a missing recording is refused before anything is built
        if self.config.fits:
            self.bounds = recorded_durations(self.bounds, self.durations)
        self.blocks = gait_blocks(self.gait, self.config.mesh.degree)
        self._judge = meshing.MeshJudge(self.walker, self.config.mesh, self.seconds)
        self.seconds["build"] += time.perf_counter() - began

    def another(self, case: Case) -> GaitSolver:
        """Return the solver of a problem that leads to this one; its stages count as this one's."""
        return GaitSolver(case, self.observer, self.stages, self.seconds)

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
    def free(self) -> tuple[Unknown, ...]:
        """The unknowns that may move within their ranges."""
        ranges = self.bounds.ranges
        return tuple(u for u in self.walker.unknowns if ranges[u.name][0] < ranges[u.name][1])

    @cached_property
    def stride(self) -> ReferenceStride:
        """The stride that a solve without warm start begins with; of a fit, what is followed."""
        start = self.config.start
        if start.gait == "recorded":
            follow = recorded_passage if self.config.fits else recorded_stride
            return follow(self.walker, start_recording(self.walker, start))
        crouch, ratio = start.knee_flexion, start.stride_ratio
        return stylised_stride(self.walker, self.start_speed, crouch, ratio)

    @property
    def durations(self) -> dict[str, float]:
        """Durations of the phases of that stride by name [s]."""
        durations = self.stride.durations.tolist()
        return dict(zip(self.walker.pattern.names, durations, strict=True))

    @property
    def start_speed(self) -> float:
        """Speed of a synthetic start [m/s]: the config's, or a slow walk of these legs."""
        least = self.bounds.table.entries[("walking_speed",)][0]
        slow = fallback_speed(self.walker.patient, self.config.bounds)
        return self.config.start.walking_speed or max(least, slow)

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

    def by_name(self, parameters: np.ndarray) -> dict[str, float]:
        """Return values of the walker's unknowns (k,) by name."""
        pairs = zip(self.walker.unknowns, parameters, strict=True)
        return {unknown.name: float(value) for unknown, value in pairs}

    def numbers(
        self, weights: Weights, table: BoundTable, orthosis_share: float = 1.0
    ) -> ProblemNumbers:
        """Return the numbers of a stage."""
        friction = self.config.bounds.friction
        shared = self.gait.shared_values(weights, friction, orthosis_share)
        return ProblemNumbers(shared, table, self.stride.coordinates, self.samples)

    @cached_property
    def prediction(self) -> ProblemNumbers:
        """The numbers of the problem itself."""
        return self.numbers(self.config.cost.weights, self.bounds.table)

    def stage(
        self,
        name: str,
        motion: PhasedMotion,
        numbers: ProblemNumbers,
        settings: IpoptSettings,
        before: Stage | None = None,
    ) -> Stage:
        """Solve one stage from a motion, and from the multipliers of a stage before; record it."""
        began = time.perf_counter()
        program = CollocationProgram(self.blocks, numbers, motion.meshes)
        multipliers = transferred(before[0], before[1].multipliers, program) if before else None
        observer = None if self.observer is None else partial(self.observer, name)
        start = program.to_unknowns(motion)
        result = solve_program(program, start, settings, multipliers, observer)
        self.stages.append(StageRecord.of(name, result, motion.intervals, program.size))
        self.seconds["solve"] += result.seconds
        self.seconds["build"] += time.perf_counter() - began - result.seconds
        return program, result

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
        """Solve the problem from a motion of this condition, or by way of the config's stride."""
        solver, tolerance = self.config.solver, self.config.solver.tolerance
        self.shortfall = None
        if self.config.mesh.refinements:
            tolerance = max(tolerance, solver.first_tolerance)
        if warm_start is not None:
            start, stage = EARLIER, from_motion(self, warm_start, tolerance)
        else:
            start, stage = from_start(self, tolerance)
        program, result, errors = self._refine(*stage, tolerance)
        return self._finish(program, result, errors, start)

    def restored(self, result: NlpResult, meshes: tuple[np.ndarray, ...]) -> GaitSolution:
        """Return the solution that another process found on these meshes."""
        program = CollocationProgram(self.blocks, self.prediction, meshes)
        return self._finish(program, result, self._judge.errors(program, result), EARLIER)

    def whole_stride(self, program: CollocationProgram, result: NlpResult) -> PhasedMotion:
        """Return the motion of a whole stride, of half a cycle with its mirror image."""
        return self._whole(program.to_motion(result.unknowns))

    def _whole(self, motion: PhasedMotion) -> PhasedMotion:
        return full_stride(self.walker.parts, motion) if self.config.half_cycle else motion

    @property
    def interrupted(self) -> bool:
        """Whether the user has stopped it."""
        return bool(self.stages) and self.stages[-1].status == "stopped by the user"

    def _refine(
        self, program: CollocationProgram, result: NlpResult, tolerance: float
    ) -> tuple[CollocationProgram, NlpResult, Reintegration]:
        """Refine the mesh until an independent integrator agrees and the cost stays."""
        mesh, solver, judge = self.config.mesh, self.config.solver, self._judge
        for attempt in range(1, mesh.refinements + 1):
            if not result.converged or self.interrupted:
                break
            errors = judge.errors(program, result, choices.MESHING_TOLERANCE)
            costly = judge.costly(program, result)
            settled = tolerance <= solver.tolerance and not any(part.any() for part in costly)
            if settled and judge.accepts(errors):
                errors = judge.errors(program, result)
                if judge.accepts(errors):
                    return program, result, errors
            share = choices.EAGER_SHARE if attempt >= choices.EAGER_ROUND else 1.0
            meshes = meshing.refined(program.meshes, errors, costly, mesh, share)
            start = program.to_motion(result.unknowns).resampled(meshes, mesh.degree)
            name, before = f"refined {attempt}", (program, result)
            program, result = self._refined(name, start, before, tolerance)
            tolerance = solver.tolerance
        return program, result, judge.errors(program, result)

    def _refined(self, name: str, start: PhasedMotion, before: Stage, tolerance: float) -> Stage:
        """Solve on a refined mesh from the last solution; without multipliers if that fails."""
        solver = self.config.solver
        barrier = max(choices.BARRIER_SHARE * tolerance, solver.refined_barrier)
        near = self.settings(solver.tolerance, barrier, warm=True)
        program, result = self.stage(name, start, self.prediction, near, before)
        if result.converged or self.interrupted:
            return program, result
        far = self.settings(solver.tolerance, solver.warm_barrier)
        return self.stage(f"{name} again", start, self.prediction, far)

    def _finish(
        self, program: CollocationProgram, result: NlpResult, errors: Reintegration, start: str
    ) -> GaitSolution:
        judge, status = self._judge, result.status
        if result.converged and self.config.mesh.refinements and not judge.accepts(errors):
            status = "the mesh does not reach the accuracy asked for"
        if self.shortfall is not None and self.shortfall.too_weak:
            status = TOO_WEAK
        motion = self.whole_stride(program, result)
        error = judge.cost_error(program, result) if result.converged else None
        finer = None if error is None else error.motion
        return GaitSolution(
            case=self.case,
            walker=self.walker.with_parameters(motion.parameters),
            status=status,
            last_motion=motion,
            nlp=result,
            bounds=self.bounds,
            cost=result.objective,
            cost_terms=cost_terms(motion, self.gait.costs, self.config.cost.weights, self.samples),
            violations=largest_violations(program, result),
            active=active_bounds(program, result),
            reintegration=errors,
            cost_error=None if error is None else error.total,
            finer_motion=finer and self._whole(finer),
            start=start,
            stages=tuple(self.stages),
            seconds=dict(self.seconds),
            shortfall=self.shortfall,
        )


def solve_study(
    study: StudyConfig | Case,
    warm_start: PhasedMotion | None = None,
    observer: StageObserver | None = None,
) -> GaitSolution:
    """Build and solve a study, whose patient is read if it is a config; see `GaitSolver`."""
    return GaitSolver(Case.of(study), observer).solve(warm_start)
