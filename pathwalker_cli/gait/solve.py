"""Solve a gait problem in stages: track a stride, predict on a coarse mesh, refine the mesh."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property, partial
from typing import Final

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import (
    fallback_speed,
    gait_bounds,
    helped_bounds,
    recorded_durations,
    require_worn,
    tracking_bounds,
)
from pathwalker_cli.gait.cost_terms import cost_terms, with_goal_costs
from pathwalker_cli.gait.costs import Weights
from pathwalker_cli.gait.further import with_further_joints
from pathwalker_cli.gait.problem import Form, GaitProblem, gait_blocks
from pathwalker_cli.gait.recorded import (
    passage_samples,
    recorded_passage,
    recorded_stride,
    start_recording,
)
from pathwalker_cli.gait.sinking import sunk
from pathwalker_cli.gait.solution import (
    TOO_WEAK,
    GaitSolution,
    Shortfall,
    StageRecord,
    missing_torques,
)
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.gait.stylised import stylised_stride
from pathwalker_cli.gait.symmetry import full_stride, require_symmetry
from pathwalker_cli.gait.typical import TypicalWalk, typical_walks
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.multipliers import transferred
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import BoundTable, ProblemNumbers, Sample
from pathwalker_cli.ocp.violations import active_bounds, largest_violations
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.verify import Reintegration

StageObserver = Callable[[str, ProgressReport], None]
EARLIER: Final = "earlier run"
"""Start of a solve that begins with a motion of another one."""
Stage = tuple[CollocationProgram, NlpResult]
"""A solved stage."""


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
            self.bounds = recorded_durations(self.bounds, self._durations)
        self.blocks = gait_blocks(self.gait, self.config.mesh.degree)
        self._judge = meshing.MeshJudge(self.walker, self.config.mesh, self.seconds)
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
    def _durations(self) -> dict[str, float]:
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
            start = EARLIER
            settings = self.settings(tolerance, solver.warm_barrier)
            stage = self._on_first_mesh(self._warm_motion(warm_start), settings)
        else:
            start, stage = self._from_the_start(tolerance)
        program, result, errors = self._refine(*stage, tolerance)
        return self._finish(program, result, errors, start)

    def _from_the_start(self, tolerance: float) -> tuple[str, Stage]:
        """Predict on the first mesh as the config's start says.

        With joints that recordings do not know, it is a walk without them that leads there.

        Raises:
            KeyboardInterrupt: If the user stops it: there is no iterate of this problem yet.
        """
        if self.walker.as_recorded is self.walker:
            return self._from_typical_walk(tolerance) or self._from_stride(tolerance)
        known = self.walker.as_recorded.parts.numbers
        names = {name for number in known for name in (number.address, number.place)}
        free = {address: pair for address, pair in self.config.free.items() if address in names}
        given = self.config.bounds.joint_ranges.items()
        ranges = {name: pair for name, pair in given if name in COORDINATES}
        values = {
            "model.toes": False,
            "model.orthosis": "glued",
            "free": free,
            "bounds.joint_ranges": ranges,
        }
        case = self.case.with_values(values)
        plain = GaitSolver(case, self.observer, self.stages, self.seconds)
        start, (program, result) = plain._from_the_start(tolerance)
        if self._interrupted:
            raise KeyboardInterrupt
        found = program.to_motion(result.unknowns)
        motion = with_further_joints(self.walker, found)
        motion = replace(motion, parameters=self.parameter_guess())
        return start, self._on_first_mesh(motion, self.settings(tolerance, choices.TYPICAL_BARRIER))

    def _from_typical_walk(self, tolerance: float) -> tuple[str, Stage] | None:
        """Predict on the first mesh from the typical walk of the most similar child.

        Returns None where none is wanted, there is none with these phases, or it leads nowhere.
        """
        wanted, which = self.config.start.gait == "typical", self.config.start.walk
        walks = typical_walks(self.walker) if wanted else []
        if which >= len(walks):
            return None
        walk = walks[which]
        settings = self.settings(tolerance, choices.TYPICAL_BARRIER)
        limit = min(choices.TYPICAL_PATIENCE, settings.max_iterations)
        settings = replace(settings, max_iterations=limit)
        motion = self._typical_motion(walk)
        stage = self.stage("first mesh", motion, self.prediction, settings)
        if not stage[1].converged and not self._interrupted:
            return None
        return f"typical walk {walk.name}", stage

    def _typical_motion(self, walk: TypicalWalk) -> PhasedMotion:
        """Return a typical walk on the first mesh, scaled to the walker."""
        motion, mesh = walk.scaled(self.walker, self.parameter_guess()), self.config.mesh
        if self.walker.parts.compliant:
            motion = sunk(self.walker, motion)
        motion = replace(motion, phases=motion.phases[: len(self.gait.phases)])
        motion = with_goal_costs(motion, self.gait.costs, self.walker)
        return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)

    def _from_stride(self, tolerance: float) -> tuple[str, Stage]:
        """Predict on the first mesh from the config's stride, which is tracked first."""
        settings = self.settings(tolerance, self.config.solver.first_barrier)
        if self.walker.parts.compliant:
            return self.stride.name, self._on_first_mesh(self._tracked_on_soles(), settings)
        program, result = self._track()
        if not self._interrupted:
            motion = program.to_motion(result.unknowns)
            motion = replace(motion, parameters=self.parameter_guess())
            program, result = self._on_first_mesh(motion, settings)
        return self.stride.name, (program, result)

    def _warm_motion(self, motion: PhasedMotion) -> PhasedMotion:
        """Return an earlier motion as a start of this problem.

        Raises:
            DataError: If it is one of other joints, as of shells on other sides.
        """
        mesh, size = self.config.mesh, self.walker.skeleton.size
        if (found := motion.phases[0].states.shape[-1] // 2) != size:
            raise DataError(
                f"moves {found} coordinates",
                where="--warm-start",
                allowed=f"a walk of the same {size} joints",
            )
        motion = replace(motion, phases=motion.phases[: len(self.gait.phases)])
        if not self.config.fits:
            motion = with_goal_costs(motion, self.gait.costs, self.walker)
        if mesh.refinements > 0:
            return motion
        return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)

    def restored(self, result: NlpResult, meshes: tuple[np.ndarray, ...]) -> GaitSolution:
        """Return the solution that another process found on these meshes."""
        program = CollocationProgram(self.blocks, self.prediction, meshes)
        return self._finish(program, result, self._judge.errors(program, result), EARLIER)

    def _on_first_mesh(self, motion: PhasedMotion, settings: IpoptSettings) -> Stage:
        """Predict on the first mesh; if that fails, by way of a motion that reserves help along."""
        helpless = self.config.fits
        limit = min(choices.PATIENCE, settings.max_iterations)
        short = settings if helpless else replace(settings, max_iterations=limit)
        first = self.stage("first mesh", motion, self.prediction, short)
        if first[1].converged or helpless or self._interrupted:
            return first
        return self._helped(motion, settings) or first

    def _helped(self, motion: PhasedMotion, settings: IpoptSettings) -> Stage | None:
        """Predict from a motion with reserves at the joints; if that fails, find what is lacking.

        Returns None if not even reserves lead to a motion within the bounds.
        """
        table = helped_bounds(self.walker.skeleton, self.bounds)
        numbers = self.numbers(choices.HELPED, table)
        program, result = self.stage("helped", motion, numbers, settings)
        if not result.converged:
            self.shortfall = None if self._interrupted else Shortfall(within_bounds=False)
            return None
        helped = program.to_motion(result.unknowns)
        last = self.stage("first mesh again", helped, self.prediction, settings)
        if last[1].converged or self._interrupted:
            return last
        numbers = self.numbers(choices.LEAST_HELP, table)
        program, result = self.stage("least help", helped, numbers, settings)
        if result.converged:
            motion = self.whole_stride(program, result)
            missing = missing_torques(gait_series(self.walker, motion))
            self.shortfall = Shortfall(within_bounds=True, missing=missing)
        return last

    def whole_stride(self, program: CollocationProgram, result: NlpResult) -> PhasedMotion:
        """Return the motion of a whole stride, of half a cycle with its mirror image."""
        return self._whole(program.to_motion(result.unknowns))

    def _whole(self, motion: PhasedMotion) -> PhasedMotion:
        return full_stride(self.walker.parts, motion) if self.config.half_cycle else motion

    def _tracked_on_soles(self) -> PhasedMotion:
        """Follow the stride of the start on soles that roll; return it sunk into the ground.

        Raises:
            KeyboardInterrupt: If the user stops it: there is no iterate of this problem yet.
        """
        config, mesh = self.config, self.config.mesh
        law = {n.place for point in self.walker.pattern.points for n in point.law}
        intervals = mesh.intervals if isinstance(mesh.intervals, int) else sum(mesh.intervals)
        values = {
            "model.feet": "sole",
            "mesh.intervals": intervals,
            "bounds.phase_durations": {},
            "free": {a: pair for a, pair in config.free.items() if a.partition(".")[0] not in law},
        }
        case = self.case.with_values(values)
        rolling = GaitSolver(case, self.observer, self.stages, self.seconds)
        program, result = rolling._track()
        if self._interrupted:
            raise KeyboardInterrupt
        motion = sunk(self.walker, program.to_motion(result.unknowns))
        motion = replace(motion, parameters=self.parameter_guess())
        return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)

    def _track(self) -> Stage:
        """Follow the stride of the start with reserve forces and given durations.

        The orthosis is faded out: its steep stops would fight a stride that ignores it.
        """
        mesh, stride, unknowns = self.config.mesh, self.stride, self.walker.unknowns
        held = self.parameter_guess() * [choices.FADED if u.faded else 1.0 for u in unknowns]
        skeleton, values = self.walker.skeleton, self.by_name(held)
        table = tracking_bounds(skeleton, self.bounds, self._durations, values)
        meshes = meshing.first(stride.durations[: len(self.gait.phases)], mesh)
        costs = len(self.gait.costs.integrals)
        motion = stride.motion(self.walker, held, meshes, mesh.degree, costs)
        settings = self.settings(choices.TRACKING_TOLERANCE, choices.TRACKING_BARRIER)
        early = {"barrier_tol_factor": choices.TRACKING_BARRIER_FACTOR, **settings.extra}
        settings = replace(settings, extra=early)
        numbers = self.numbers(choices.TRACKING, table, choices.FADED)
        return self.stage("tracking", motion, numbers, settings)

    @property
    def _interrupted(self) -> bool:
        return bool(self.stages) and self.stages[-1].status == "stopped by the user"

    def _refine(
        self, program: CollocationProgram, result: NlpResult, tolerance: float
    ) -> tuple[CollocationProgram, NlpResult, Reintegration]:
        """Refine the mesh until an independent integrator agrees and the cost stays."""
        mesh, solver, judge = self.config.mesh, self.config.solver, self._judge
        for attempt in range(1, mesh.refinements + 1):
            if not result.converged or self._interrupted:
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
        if result.converged or self._interrupted:
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
