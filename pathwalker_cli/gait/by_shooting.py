"""Solve a study by direct multiple shooting, beginning with its solution by collocation."""

from __future__ import annotations

import time
from dataclasses import replace

from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.cost_terms import prediction_terms
from pathwalker_cli.gait.shooting import ShootingSettings, ShootingSolution, solve_shooting
from pathwalker_cli.gait.solution import GaitSolution, StageRecord
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.symmetry import full_stride
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.violations import active_bounds
from pathwalker_cli.stride.verify import reintegrate

__all__ = ["solve_by_shooting"]


def solve_by_shooting(solver: GaitSolver, warm_start: PhasedMotion | None = None) -> GaitSolution:
    """Solve by collocation, then by multiple shooting on the same mesh.

    Args:
        solver: The solver of the study.
        warm_start: An earlier motion to begin with.

    Returns:
        The solution by multiple shooting; that by collocation if it did not converge.

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
        motion = full_stride(motion)
        costs = {name: 2 * value for name, value in costs.items()}
    stages = tuple(
        StageRecord(
            f"shooting, kink {one.rounding:g}",
            one.status,
            collocation.last_motion.intervals,
            one.unknowns,
            one.iterations,
            one.seconds,
            one.seconds_functions,
        )
        for one in shooting.rounds
    )
    return replace(
        collocation,
        status=shooting.status,
        last_motion=motion,
        nlp=shooting.nlp,
        cost=shooting.cost,
        cost_terms=prediction_terms(motion, costs, solver.gait.costs, solver.weights),
        violations=shooting.violations,
        active=active_bounds(shooting.program, shooting.nlp),
        reintegration=errors,
        start=f"collocation from {collocation.start}, cost {collocation.cost:.6g}",
        stages=collocation.stages + stages,
        seconds=seconds,
    )
