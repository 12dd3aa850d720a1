"""CPU seconds until a solver can begin: walker, blocks, derivatives, functions."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TypeVar

T = TypeVar("T")

STEPS = (
    "imports",
    "walker",
    "bounds and blocks",
    "program and derivatives",
    "again on another mesh",
    "solver",
)


def timed(action: Callable[[], T]) -> tuple[float, T]:
    """Return CPU seconds of an action, and its result."""
    began = time.process_time()
    result = action()
    return time.process_time() - began, result


def steps(problem: str, intervals: int) -> dict[str, float]:
    """Return the CPU seconds of every step.

    Args:
        problem: Name of a shipped problem.
        intervals: Intervals of the mesh.
    """
    began = time.process_time()
    from pathwalker_cli.case import load_case
    from pathwalker_cli.gait import mesh as meshing
    from pathwalker_cli.gait.solve import GaitSolver
    from pathwalker_cli.model.walker import build_walker
    from pathwalker_cli.nlp.ipopt import NlpSolver
    from pathwalker_cli.ocp.collocation import CollocationProgram

    imports = time.process_time() - began
    case = load_case(problem)
    config = case.config
    model, condition = config.model, config.condition
    walker, _ = timed(lambda: build_walker(case.patient, condition, model.published, model.backend))
    blocks, solver = timed(lambda: GaitSolver(case))
    durations = solver.stride.durations[: len(solver.gait.phases)]

    def functions(count: int) -> CollocationProgram:
        meshes = meshing.by_duration(durations, count, 2)
        program = CollocationProgram(solver.blocks, solver.prediction, meshes)
        _ = program.functions
        return program

    first, program = timed(lambda: functions(intervals))
    again, _ = timed(lambda: functions(intervals + 5))
    settings = solver.settings(config.solver.tolerance, config.solver.first_barrier)
    ready, _ = timed(lambda: NlpSolver(program, settings))
    return dict(zip(STEPS, (imports, walker, blocks, first, again, ready), strict=True))
