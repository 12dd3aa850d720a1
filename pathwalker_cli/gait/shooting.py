"""Gait problems by direct multiple shooting, with the neural excitations as controls.

It begins with the solution by collocation.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import GENERATORS
from pathwalker_cli.errors import ConfigError, InputError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.cost_terms import prediction_terms
from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.gait.solution import GaitSolution, StageRecord
from pathwalker_cli.gait.solve import GaitSolver, StageObserver
from pathwalker_cli.gait.symmetry import full_stride
from pathwalker_cli.model.elements.muscle import (
    ACTIVATION_TIME,
    DEACTIVATION_TIME,
    excitation_from_rate,
)
from pathwalker_cli.nlp.ipopt import IpoptSettings, solve_program
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.problem import ProblemNumbers, Variables
from pathwalker_cli.ocp.shooting import ShootingProgram
from pathwalker_cli.ocp.shooting_blocks import ShootingBlocks, ShootingProblem
from pathwalker_cli.ocp.shooting_motion import Shooter, ShootingNodes
from pathwalker_cli.ocp.violations import Violation, active_bounds, largest_violations
from pathwalker_cli.stride.verify import reintegrate

EXCITATIONS: Final = tuple(f"{name}_excitation" for name in GENERATORS)


@dataclass(frozen=True)
class ShootingSettings:
    """Settings of a solve by multiple shooting.

    Args:
        integration_tolerance: Largest error estimate of a step in scaled states: radians, metres,
            activations, and speeds over 5 m/s or rad/s.
        roundings: Half widths, one per round, to which the kink of equation (2) at e = a is
            rounded off; the last one decides how exactly equation (2) is met.
        tolerance: Optimality tolerance of every round.
        constraint_tolerance: Largest scaled violation.
        max_iterations: Iteration limit of a round.
        repeats: How often the last round may be repeated with new steps.
    """

    integration_tolerance: float = 1e-4
    roundings: tuple[float, ...] = (0.1, 0.01, 1e-3, 1e-4)
    tolerance: float = 1e-5
    constraint_tolerance: float = 1e-9
    max_iterations: int = 300
    repeats: int = 3


@dataclass(frozen=True)
class ShootingSolution:
    """The end of a solve by multiple shooting, converged or not.

    Args:
        status: "converged" or the reason why not.
        running_costs: Integrals over the whole motion by name, without weights.
        nodes: Phase durations, parameters, and states, activations and excitations at the nodes.
        motion: The motion between the nodes, integrated anew with equation (2) itself.
        integration_error: Largest error estimate of a step, scaled as the tolerance.
        defect: Largest gap between the end of an interval, integrated anew with equation (2)
            itself, and its node, in scaled states.
        violations: Largest violations, largest first.
        rounds: The rounds, in each of which steps were chosen anew.
        seconds_build: Wall seconds for blocks and programs.
    """

    status: str
    cost: float
    running_costs: dict[str, float]
    nodes: ShootingNodes
    motion: PhasedMotion
    integration_error: float
    defect: float
    violations: tuple[Violation, ...]
    rounds: tuple[StageRecord, ...]
    seconds_build: float
    nlp: NlpResult = field(repr=False)
    program: ShootingProgram = field(repr=False)

    @property
    def converged(self) -> bool:
        """Whether all tolerances are met."""
        return self.status == "converged"

    @property
    def seconds(self) -> float:
        """Wall seconds of all solves."""
        return sum(each.seconds for each in self.rounds)


def rounded_rate(excitation: Any, activation: Any, rounding: Any) -> Any:
    """Return the activation rate [1/s] of equation (2) with its kink at e = a rounded off.

    Equation (2) is (e - a) / tau_D + (1 / tau_A - 1 / tau_D) e max(e - a, 0); in the maximum
    |e - a| becomes the square root of (e - a)^2 + rounding^2.

    Args:
        excitation: Neural excitation e in [0, 1], shape (m,).
        activation: Muscle activation a in [0, 1], shape (m,).
        rounding: Half width of the kink in e - a; 0 gives equation (2) itself.
    """
    difference = excitation - activation
    above = (difference + (difference**2 + rounding**2) ** 0.5) / 2
    faster = 1 / ACTIVATION_TIME - 1 / DEACTIVATION_TIME
    return difference / DEACTIVATION_TIME + faster * excitation * above


def gait_shooting(gait: GaitProblem) -> ShootingProblem:
    """Return a gait problem in which equation (2) turns excitations into activations.

    Raises:
        InputError: If the problem follows recorded instants: they need not stand at nodes.
    """
    problem = gait.build()
    if not problem.sample.is_zero():
        raise InputError(
            "a fit of recorded instants has no multiple-shooting form", mend="use collocation"
        )
    controls = Variables.make("e", EXCITATIONS, 1.0)
    return ShootingProblem(problem, controls, rounded_rate, excitation_from_rate)


def solve_shooting(
    gait: GaitProblem,
    numbers: ProblemNumbers,
    motion: PhasedMotion,
    settings: ShootingSettings | None = None,
    observer: StageObserver | None = None,
) -> ShootingSolution:
    """Solve a gait problem by direct multiple shooting on the mesh of a motion.

    In every round the integration steps are chosen along the last motion and kept during the
    solve; the kink of equation (2) is rounded off less from round to round.  Excitations are
    bounded to [0, 1] here.

    Raises:
        NotConvergedError: If a motion can not be integrated.
    """
    settings = settings or ShootingSettings()
    began = time.perf_counter()
    blocks = ShootingBlocks(gait_shooting(gait))
    excited = numbers.bounds.replace({(name,): (0.0, 1.0) for name in EXCITATIONS})
    bounded = ProblemNumbers(numbers.shared, excited, numbers.point_data)
    search = _Search(blocks, bounded, ShootingNodes.of(blocks.shooting, motion), settings, observer)
    while not search.done:
        search.advance()
    return search.solution(time.perf_counter() - began)


class _Search:
    """The rounds of a solve and what they have reached."""

    def __init__(
        self,
        blocks: ShootingBlocks,
        numbers: ProblemNumbers,
        nodes: ShootingNodes,
        settings: ShootingSettings,
        observer: StageObserver | None,
    ) -> None:
        self.blocks, self.numbers, self.nodes = blocks, numbers, nodes
        self.settings, self.observer = settings, observer
        self.rounds: list[StageRecord] = []
        self.error = np.inf
        self.program: ShootingProgram
        self.result: NlpResult

    @property
    def shooter(self) -> Shooter:
        return Shooter(self.blocks, self.numbers, self.nodes)

    @property
    def _accurate(self) -> bool:
        return self.error <= self.settings.integration_tolerance

    @property
    def done(self) -> bool:
        """Whether the last round is accurate, has failed, or was repeated often enough."""
        behind = len(self.rounds) - len(self.settings.roundings)
        failed = bool(self.rounds) and not self.result.converged
        return failed or (behind >= 0 and (self._accurate or behind >= self.settings.repeats))

    def advance(self) -> None:
        """Choose steps and solve."""
        settings, number = self.settings, len(self.rounds)
        rounding = settings.roundings[min(number, len(settings.roundings) - 1)]
        edges = self.shooter.choose(settings.integration_tolerance / choices.STEP_MARGIN)
        meshes = self.nodes.meshes
        self.program = ShootingProgram(self.blocks, self.numbers, meshes, edges, rounding)
        name = f"rounding {rounding:g}"
        watch = None if self.observer is None else partial(self.observer, name)
        start = self.program.from_nodes(self.nodes)
        self.result = solve_program(self.program, start, self._ipopt(), observer=watch)
        self.nodes = self.program.nodes(self.result.unknowns)
        self.error = self.shooter.error(edges)
        intervals = sum(len(mesh) - 1 for mesh in meshes)
        name = f"shooting, kink {rounding:g}"
        self.rounds.append(StageRecord.of(name, self.result, intervals, self.program.size))

    def _ipopt(self) -> IpoptSettings:
        """Return settings that start near a motion without multipliers.

        Those of the bounds begin at barrier over slack, as at the end of the round before; from
        them IPOPT estimates those of the rows by least squares.
        """
        settings, first = self.settings, not self.rounds
        push = choices.SHOOTING_PUSH if first else choices.NEXT_PUSH
        later = choices.ROUND_BARRIER_SHARE * settings.tolerance
        pushes = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
        return IpoptSettings(
            tolerance=settings.tolerance,
            constraint_tolerance=settings.constraint_tolerance,
            max_iterations=settings.max_iterations,
            initial_barrier=choices.SHOOTING_BARRIER if first else later,
            extra={
                "bound_mult_init_method": "mu-based",
                "constr_mult_init_max": 1e8,
                **dict.fromkeys(pushes, push),
            },
        )

    def solution(self, seconds: float) -> ShootingSolution:
        """Return what was reached after some wall seconds."""
        status, shooter, edges = self.result.status, self.shooter, self.program.edges
        if self.result.converged and not self._accurate:
            status = "the integration does not reach the accuracy asked for"
        layout, names = self.program.layout, self.blocks.problem.integrals
        costs = (self.result.unknowns * layout.scale)[layout.integrals[-1]]
        return ShootingSolution(
            status=status,
            cost=self.result.objective,
            running_costs=dict(zip(names, costs.tolist(), strict=True)),
            nodes=self.nodes,
            motion=shooter.motion(edges),
            integration_error=self.error,
            defect=shooter.defect(edges),
            violations=largest_violations(self.program, self.result),
            rounds=tuple(self.rounds),
            seconds_build=seconds - sum(each.seconds for each in self.rounds),
            nlp=self.result,
            program=self.program,
        )


def solve_by_shooting(solver: GaitSolver, warm_start: PhasedMotion | None = None) -> GaitSolution:
    """Solve by collocation, then by multiple shooting on the same mesh.

    Where shooting does not converge, the solution by collocation is returned.

    Raises:
        ConfigError: If the study fits a recording: shooting solves predictions only.
    """
    config = solver.config
    if config.fits:
        raise ConfigError(
            f"is multiple-shooting, but {config.problem} fits a recording",
            where="transcription",
            mend="set transcription to collocation",
        )
    collocation = solver.solve(warm_start)
    if not collocation.converged:
        return collocation
    first = collocation.last_motion
    first = replace(first, phases=first.phases[: len(solver.gait.phases)])
    settings = ShootingSettings(constraint_tolerance=config.solver.constraint_tolerance)
    shooting = solve_shooting(solver.gait, solver.prediction, first, settings, solver.observer)
    return _solution(collocation, solver, shooting)


def _solution(
    collocation: GaitSolution, solver: GaitSolver, shooting: ShootingSolution
) -> GaitSolution:
    """Return the solution by shooting in the form of every other one."""
    began = time.perf_counter()
    errors = reintegrate(solver.walker, shooting.motion)
    seconds = dict(collocation.seconds)
    seconds["verify"] += time.perf_counter() - began
    seconds["build"] += shooting.seconds_build
    seconds["solve"] += shooting.seconds
    motion, costs = shooting.motion, shooting.running_costs
    if solver.config.half_cycle:
        motion = full_stride(solver.walker.parts, motion)
        costs = {name: 2 * value for name, value in costs.items()}
    return replace(
        collocation,
        status=shooting.status,
        last_motion=motion,
        nlp=shooting.nlp,
        cost=shooting.cost,
        cost_terms=prediction_terms(motion, costs, solver.gait.costs, solver.config.cost.weights),
        violations=shooting.violations,
        active=active_bounds(shooting.program, shooting.nlp),
        reintegration=errors,
        start=f"collocation from {collocation.start}, cost {collocation.cost:.6g}",
        stages=collocation.stages + shooting.rounds,
        seconds=seconds,
    )
