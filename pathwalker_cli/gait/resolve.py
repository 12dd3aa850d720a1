"""Solve neighbours of a solved problem: same structure and mesh, other numbers, warm start."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.nlp.ipopt import NlpSolver, last_barrier, warm_pushes
from pathwalker_cli.nlp.kkt import Answer, KktSystem
from pathwalker_cli.nlp.result import Multipliers, NlpResult
from pathwalker_cli.nlp.watch import Observer
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.verify import Reintegration, reintegrate


@dataclass(frozen=True)
class WarmStart:
    """How to begin with the multipliers of a neighbour.

    Args:
        barrier: First barrier parameter; None for the last one, with which solves end.
        push: How far the start is moved off its bounds [solver units]; None for IPOPT's settings.
    """

    barrier: float | None = None
    push: float | None = None


_NEAR: Final = WarmStart()
_FURTHER, _FAR = WarmStart(*choices.FURTHER_START), WarmStart(*choices.FAR_START)


@dataclass(frozen=True)
class Optimum:
    """A solved neighbour.

    Args:
        solver: The solver of its case; it brings in walker, bounds and numbers.
    """

    solver: GaitSolver
    program: CollocationProgram
    result: NlpResult

    @property
    def case(self) -> Case:
        """What was asked for, and for whom."""
        return self.solver.case

    @property
    def config(self) -> StudyConfig:
        """What was asked for."""
        return self.solver.config

    @property
    def converged(self) -> bool:
        """Whether the tolerances were met."""
        return self.result.converged

    @property
    def cost(self) -> float:
        """Value of the objective."""
        return self.result.objective

    @cached_property
    def motion(self) -> PhasedMotion:
        """The motion of a whole stride."""
        return self.solver.whole_stride(self.program, self.result)

    @property
    def walker(self) -> Walker:
        """Who walks, with the numbers of the optimum."""
        return self.solver.walker.with_parameters(self.motion.parameters)

    @property
    def stiffness(self) -> np.ndarray:
        """K_D right, left, K_P right, left [N m/rad], shape (4,); empty when barefoot."""
        return self.walker.stiffness

    @property
    def free(self) -> tuple[Unknown, ...]:
        """The unknowns that may move within their ranges."""
        return self.solver.free

    def value(self, unknown: Unknown) -> float:
        """Return the value of an unknown [its unit]."""
        return float(self.motion.parameters[self.solver.walker.unknowns.index(unknown)])

    def range(self, unknown: Unknown) -> tuple[float, float]:
        """Return the allowed range of an unknown [its unit]."""
        return self.solver.bounds.ranges[unknown.name]

    @cached_property
    def series(self) -> GaitSeries:
        """Time series of the stride."""
        return gait_series(self.solver.walker, self.motion)

    @cached_property
    def reintegration(self) -> Reintegration:
        """Errors of an independent integrator: the mesh was made for another problem."""
        return reintegrate(self.solver.walker, self.motion)

    @cached_property
    def kkt(self) -> KktSystem:
        """The KKT system at this optimum."""
        return KktSystem(self.program, self.result)

    @cached_property
    def missed(self) -> float:
        """Root mean square violation of the rows [solver units]."""
        program, unknowns = self.program, self.result.unknowns
        (_, rows) = program.functions["nlp"](unknowns, program.parameters)
        missed = _outside(np.asarray(rows).ravel(), *program.row_bounds)
        return float(np.sqrt(np.mean(missed**2)))

    def towards(self, there: Optimum) -> Optimum:
        """Return this optimum to first order in the program of a neighbour; nothing is solved."""
        return self.moved(self.kkt.towards(there.program, choices.WAY_SHARE), 1.0, there)

    def moved(self, answer: Answer, amount: float, there: Optimum) -> Optimum:
        """Return where so much of an answer leads to, in the program of `there`."""
        result, multipliers = self.result, self.result.multipliers
        result = replace(
            result,
            unknowns=result.unknowns + amount * answer.unknowns,
            objective=result.objective + amount * answer.cost,
            multipliers=replace(multipliers, rows=multipliers.rows + amount * answer.rows),
        )
        return replace(there, result=result)

    @property
    def solution(self) -> GaitSolution:
        """The same as the end of a solve, e.g. for a run folder."""
        return self.solver.restored(self.result, self.program.meshes)


class Resolver:
    """Solves problems near an optimum on its mesh; derivatives and solver are built once.

    Args:
        multipliers: Its multipliers; without them the optimum is solved anew from its motion.
        tolerance: Optimality tolerance of all solves; that of the config if left out.
        observer: Hears every iteration, and may end a solve.
    """

    def __init__(
        self,
        case: Case,
        motion: PhasedMotion,
        multipliers: Multipliers | None = None,
        tolerance: float | None = None,
        observer: Observer | None = None,
    ) -> None:
        self._observer = observer
        self._solver = GaitSolver(case)
        self._tolerance = tolerance or case.config.solver.tolerance
        steps = motion.phases[: len(self._solver.gait.phases)]
        self._motion = replace(motion, phases=steps)
        self._program = CollocationProgram(
            self._solver.blocks, self._solver.prediction, self._motion.meshes
        )
        self._warm_solvers: dict[WarmStart, NlpSolver] = {}
        self._multipliers = multipliers
        if multipliers is not None and multipliers.rows.size != self._program.rows:
            self._multipliers = None

    @classmethod
    def at(cls, optimum: Optimum, tolerance: float | None = None) -> Resolver:
        """Return a solver of the neighbours of an optimum."""
        return cls(optimum.case, optimum.motion, optimum.result.multipliers, tolerance)

    @property
    def begins_there(self) -> bool:
        """Whether multipliers of this problem are known, so that its solve begins at the end."""
        return self._multipliers is not None

    @cached_property
    def optimum(self) -> Optimum:
        """The optimum itself, solved to the tolerance."""
        start = self._program.to_unknowns(self._motion)
        result = (
            self._warm(_NEAR).solve(self._program, start, self._multipliers)
            if self._multipliers is not None
            else self._cold.solve(self._program, start)
        )
        return Optimum(self._solver, self._program, result)

    def resolve(self, case: Case, start: Optimum | None = None, insist: bool = True) -> Optimum:
        """Solve a neighbour, converged or not.

        Args:
            case: What differs; problem, model and degree must be those of the optimum.
            start: Neighbour to begin with; the optimum if left out.
            insist: Whether to try without multipliers, which may take long, where these do not
                lead to a solution.
        """
        start = start or self.optimum
        guess = self.restored(case, start.result)
        if guess.missed > choices.FURTHER_ROWS:
            guess = min(guess, start.towards(guess), key=lambda each: each.missed)
        return self.solved(guess, insist)

    def solved(self, guess: Optimum, insist: bool = True) -> Optimum:
        """Solve the problem of a neighbour from the unknowns and multipliers that it has."""
        program, start = guess.program, guess.result.unknowns
        warm = self._warm(warm_start_for(guess))
        result = warm.solve(program, start, guess.result.multipliers)
        if insist and not result.converged and result.status != "stopped by the user":
            result = self._cold.solve(program, start)
        return replace(guess, result=result)

    def restored(self, case: Case, result: NlpResult) -> Optimum:
        """Return a neighbour with unknowns and multipliers that are known, its own or others'."""
        solver = GaitSolver(case)
        return Optimum(solver, self._program_of(solver), result)

    def _program_of(self, solver: GaitSolver) -> CollocationProgram:
        return self._program.with_numbers(solver.prediction)

    def _warm(self, start: WarmStart) -> NlpSolver:
        """Return the solver that begins with multipliers in this way."""
        if start not in self._warm_solvers:
            solver = self._solver.config.solver
            lowest = min(solver.refined_barrier, last_barrier(self._tolerance))
            settings = self._solver.settings(self._tolerance, start.barrier or lowest, warm=True)
            pushes = {} if start.push is None else warm_pushes(start.push)
            extra = {**choices.WATCHDOG, **pushes, **settings.extra}
            settings = replace(settings, max_iterations=choices.WARM_ITERATIONS, extra=extra)
            self._warm_solvers[start] = NlpSolver(self._program, settings, self._observer)
        return self._warm_solvers[start]

    @cached_property
    def _cold(self) -> NlpSolver:
        """Where the neighbour is too far for the multipliers to help."""
        barrier = self._solver.config.solver.warm_barrier
        settings = self._solver.settings(self._tolerance, barrier)
        return NlpSolver(self._program, settings, self._observer)


def warm_start_for(guess: Optimum) -> WarmStart:
    """Return how to begin with this guess: by how much it misses rows and bounds."""
    beyond = float(_outside(guess.result.unknowns, *guess.program.bounds).max())
    if guess.missed > choices.FURTHER_ROWS:
        return _FAR
    near = guess.missed < choices.NEAR_ROWS and beyond < choices.NEAR_BOUNDS
    return _NEAR if near else _FURTHER


def _outside(values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return by how much values are outside their bounds."""
    return np.asarray(np.maximum(np.maximum(lower - values, values - upper), 0.0))
