"""The first prediction of a problem: by way of a typical walk, a stride, or an earlier motion."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import helped_bounds, tracking_bounds
from pathwalker_cli.gait.cost_terms import with_goal_costs
from pathwalker_cli.gait.further import with_further_joints
from pathwalker_cli.gait.sinking import sunk
from pathwalker_cli.gait.solution import Shortfall, missing_torques
from pathwalker_cli.gait.typical import TypicalWalk, typical_walks
from pathwalker_cli.nlp.ipopt import IpoptSettings
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.stride.series import gait_series

if TYPE_CHECKING:
    from pathwalker_cli.gait.solve import GaitSolver

Stage = tuple[CollocationProgram, NlpResult]
"""A solved stage."""


def from_start(solver: GaitSolver, tolerance: float) -> tuple[str, Stage]:
    """Predict on the first mesh as the config's start says.

    With joints that recordings do not know, it is a walk without them that leads there.

    Raises:
        KeyboardInterrupt: If the user stops it: there is no iterate of this problem yet.
    """
    if solver.walker.as_recorded is solver.walker:
        return _from_typical_walk(solver, tolerance) or _from_stride(solver, tolerance)
    known = solver.walker.as_recorded.parts.numbers
    names = {name for number in known for name in (number.address, number.place)}
    free = {address: pair for address, pair in solver.config.free.items() if address in names}
    given = solver.config.bounds.joint_ranges.items()
    ranges = {name: pair for name, pair in given if name in COORDINATES}
    values = {
        "model.toes": False,
        "model.orthosis": "glued",
        "free": free,
        "bounds.joint_ranges": ranges,
    }
    case = solver.case.with_values(values)
    plain = solver.another(case)
    start, (program, result) = from_start(plain, tolerance)
    if solver.interrupted:
        raise KeyboardInterrupt
    found = program.to_motion(result.unknowns)
    motion = with_further_joints(solver.walker, found)
    motion = replace(motion, parameters=solver.parameter_guess())
    return start, _on_first_mesh(
        solver, motion, solver.settings(tolerance, choices.TYPICAL_BARRIER)
    )


def _from_typical_walk(solver: GaitSolver, tolerance: float) -> tuple[str, Stage] | None:
    """Predict on the first mesh from the typical walk of the most similar child.

    Returns None where none is wanted, there is none with these phases, or it leads nowhere.
    """
    wanted, which = solver.config.start.gait == "typical", solver.config.start.walk
    walks = typical_walks(solver.walker) if wanted else []
    if which >= len(walks):
        return None
    walk = walks[which]
    settings = solver.settings(tolerance, choices.TYPICAL_BARRIER)
    limit = min(choices.TYPICAL_PATIENCE, settings.max_iterations)
    settings = replace(settings, max_iterations=limit)
    motion = _typical_motion(solver, walk)
    stage = solver.stage("first mesh", motion, solver.prediction, settings)
    if not stage[1].converged and not solver.interrupted:
        return None
    return f"typical walk {walk.name}", stage


def _typical_motion(solver: GaitSolver, walk: TypicalWalk) -> PhasedMotion:
    """Return a typical walk on the first mesh, scaled to the walker."""
    motion, mesh = walk.scaled(solver.walker, solver.parameter_guess()), solver.config.mesh
    if solver.walker.parts.compliant:
        motion = sunk(solver.walker, motion)
    motion = replace(motion, phases=motion.phases[: len(solver.gait.phases)])
    motion = with_goal_costs(motion, solver.gait.costs, solver.walker)
    return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)


def _from_stride(solver: GaitSolver, tolerance: float) -> tuple[str, Stage]:
    """Predict on the first mesh from the config's stride, which is tracked first."""
    settings = solver.settings(tolerance, solver.config.solver.first_barrier)
    if solver.walker.parts.compliant:
        return solver.stride.name, _on_first_mesh(solver, _tracked_on_soles(solver), settings)
    program, result = tracked(solver)
    if not solver.interrupted:
        motion = program.to_motion(result.unknowns)
        motion = replace(motion, parameters=solver.parameter_guess())
        program, result = _on_first_mesh(solver, motion, settings)
    return solver.stride.name, (program, result)


def from_motion(solver: GaitSolver, motion: PhasedMotion, tolerance: float) -> Stage:
    """Predict on the first mesh from an earlier motion.

    Raises:
        DataError: If it is one of other joints, as of shells on other sides.
    """
    settings = solver.settings(tolerance, solver.config.solver.warm_barrier)
    return _on_first_mesh(solver, _warm_motion(solver, motion), settings)


def _warm_motion(solver: GaitSolver, motion: PhasedMotion) -> PhasedMotion:
    """Return an earlier motion as a start of this problem; see `from_motion`."""
    mesh, size = solver.config.mesh, solver.walker.skeleton.size
    if (found := motion.phases[0].states.shape[-1] // 2) != size:
        raise DataError(
            f"moves {found} coordinates",
            where="--warm-start",
            allowed=f"a walk of the same {size} joints",
        )
    motion = replace(motion, phases=motion.phases[: len(solver.gait.phases)])
    if not solver.config.fits:
        motion = with_goal_costs(motion, solver.gait.costs, solver.walker)
    if mesh.refinements > 0:
        return motion
    return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)


def _on_first_mesh(solver: GaitSolver, motion: PhasedMotion, settings: IpoptSettings) -> Stage:
    """Predict on the first mesh; if that fails, by way of a motion that reserves help along."""
    helpless = solver.config.fits
    limit = min(choices.PATIENCE, settings.max_iterations)
    short = settings if helpless else replace(settings, max_iterations=limit)
    first = solver.stage("first mesh", motion, solver.prediction, short)
    if first[1].converged or helpless or solver.interrupted:
        return first
    return _helped(solver, motion, settings) or first


def _helped(solver: GaitSolver, motion: PhasedMotion, settings: IpoptSettings) -> Stage | None:
    """Predict from a motion with reserves at the joints; if that fails, find what is lacking.

    Returns None if not even reserves lead to a motion within the bounds.
    """
    table = helped_bounds(solver.walker.skeleton, solver.bounds)
    numbers = solver.numbers(choices.HELPED, table)
    program, result = solver.stage("helped", motion, numbers, settings)
    if not result.converged:
        solver.shortfall = None if solver.interrupted else Shortfall(within_bounds=False)
        return None
    helped = program.to_motion(result.unknowns)
    last = solver.stage("first mesh again", helped, solver.prediction, settings)
    if last[1].converged or solver.interrupted:
        return last
    numbers = solver.numbers(choices.LEAST_HELP, table)
    program, result = solver.stage("least help", helped, numbers, settings)
    if result.converged:
        motion = solver.whole_stride(program, result)
        missing = missing_torques(gait_series(solver.walker, motion))
        solver.shortfall = Shortfall(within_bounds=True, missing=missing)
    return last


def _tracked_on_soles(solver: GaitSolver) -> PhasedMotion:
    """Follow the stride of the start on soles that roll; return it sunk into the ground.

    Raises:
        KeyboardInterrupt: If the user stops it: there is no iterate of this problem yet.
    """
    config, mesh = solver.config, solver.config.mesh
    law = {n.place for point in solver.walker.pattern.points for n in point.law}
    intervals = mesh.intervals if isinstance(mesh.intervals, int) else sum(mesh.intervals)
    values = {
        "model.feet": "sole",
        "mesh.intervals": intervals,
        "bounds.phase_durations": {},
        "free": {a: pair for a, pair in config.free.items() if a.partition(".")[0] not in law},
    }
    case = solver.case.with_values(values)
    rolling = solver.another(case)
    program, result = tracked(rolling)
    if solver.interrupted:
        raise KeyboardInterrupt
    motion = sunk(solver.walker, program.to_motion(result.unknowns))
    motion = replace(motion, parameters=solver.parameter_guess())
    return motion.resampled(meshing.first(motion.durations, mesh), mesh.degree)


def tracked(solver: GaitSolver) -> Stage:
    """Follow the stride of the start with reserve forces and given durations.

    The orthosis is faded out: its steep stops would fight a stride that ignores it.
    """
    mesh, stride, unknowns = solver.config.mesh, solver.stride, solver.walker.unknowns
    held = solver.parameter_guess() * [choices.FADED if u.faded else 1.0 for u in unknowns]
    skeleton, values = solver.walker.skeleton, solver.by_name(held)
    table = tracking_bounds(skeleton, solver.bounds, solver.durations, values)
    meshes = meshing.first(stride.durations[: len(solver.gait.phases)], mesh)
    costs = len(solver.gait.costs.integrals)
    motion = stride.motion(solver.walker, held, meshes, mesh.degree, costs)
    settings = solver.settings(choices.TRACKING_TOLERANCE, choices.TRACKING_BARRIER)
    early = {"barrier_tol_factor": choices.TRACKING_BARRIER_FACTOR, **settings.extra}
    settings = replace(settings, extra=early)
    numbers = solver.numbers(choices.TRACKING, table, choices.FADED)
    return solver.stage("tracking", motion, numbers, settings)
