"""What a solve returns: the last motion, how far it can be trusted, and how it came about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any, Final

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.errors import InputError, NotConvergedError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.bounds import GaitBounds
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.ocp.violations import ActiveBound, Violation
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.verify import Reintegration, second_engine_residual

if TYPE_CHECKING:
    from matplotlib.figure import Figure

TOO_WEAK: Final = "the muscles are too weak for a walk within the bounds"
"""Status of a solve that ended in which torques are lacking."""


@dataclass(frozen=True)
class MissingTorque:
    """What a muscle torque generator lacks.

    Args:
        generator: Its name in `conventions.GENERATORS`.
        torque: The largest missing torque [N m].
        strength: Its maximum isometric torque [N m].
        percent: When, in percent of the stride.
    """

    generator: str
    torque: float
    strength: float
    percent: float


@dataclass(frozen=True)
class Shortfall:
    """Why no motion was found.

    A solve that fails is tried again by way of reserve actuators at the joints.  If the walk is not
    found without them, what is left of them says whether the muscles are too weak.

    Args:
        within_bounds: Whether muscles of any strength can walk within the bounds, as far as known.
        missing: What the muscles lack for it, the largest share of a strength first.
    """

    within_bounds: bool
    missing: tuple[MissingTorque, ...] = ()

    @property
    def too_weak(self) -> bool:
        """Whether the muscles are too weak for a motion that the bounds allow."""
        return self.within_bounds and bool(self.missing)

    def as_dict(self) -> dict[str, Any]:
        """Return it as plain values."""
        missing = [dict(vars(torque)) for torque in self.missing]
        return {"within_bounds": self.within_bounds, "missing_torques": missing}


@dataclass(frozen=True)
class StageRecord:
    """One stage as it went.

    Args:
        name: "tracking", "first mesh", "refined 1", "helped", ...
        status: "converged" or the reason why not.
        unknowns: Size of the nonlinear program.
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

    @classmethod
    def of(cls, name: str, result: NlpResult, intervals: int, unknowns: int) -> StageRecord:
        """Return the record of a stage from how its solve ended."""
        iterations, seconds = result.iterations, (result.seconds, result.seconds_functions)
        return cls(name, result.status, intervals, unknowns, iterations, *seconds)


@dataclass(frozen=True)
class LocalOptimum:
    """Where one of several starts ended.

    Args:
        start: Number of the start; 0 is the study's own.
        description: The start in words.
        status: "converged" or the reason why not.
        walking_speed: Walking speed [m/s].
        stiffness: K_D right, left, K_P right, left [N m/rad], None where no orthosis is worn; empty
            when barefoot.
        numbers: Value of every number that was free to choose, by name [SI].
        seconds: Wall seconds.
    """

    start: int
    description: str
    status: str
    cost: float
    walking_speed: float
    stiffness: tuple[float | None, ...]
    iterations: int
    seconds: float
    numbers: dict[str, float] = field(default_factory=dict)

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""
        return self.status == "converged"


@dataclass(frozen=True)
class GaitSolution:
    """The end of a solve, converged or not.

    A solution that did not converge is sealed: `series` raises; `last_iterate` says what it is.

    Args:
        case: What was asked for, and for whom.
        status: "converged" or the reason why not.
        last_motion: The last iterate.
        nlp: What the nonlinear solver returned last.
        bounds: Bounds that were used and where they come from.
        cost_terms: Its terms by name; they add up to the cost.
        violations: Largest violations, largest first.
        reintegration: Errors of an independent integrator.
        cost_error: Estimated change of the cost if all mesh intervals were halved; None where it
            is not known.
        finer_motion: The motion on that mesh to first order, for what else would change.
        start: Where the search began.
        seconds: Wall seconds by part: build, solve, verify.
        optima: Where all starts ended, best first; empty for a single start.
        shortfall: Why no motion was found, where that was looked for.
    """

    case: Case
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
    cost_error: float | None
    start: str
    stages: tuple[StageRecord, ...]
    seconds: dict[str, float]
    optima: tuple[LocalOptimum, ...] = ()
    shortfall: Shortfall | None = None
    finer_motion: PhasedMotion | None = None

    def __repr__(self) -> str:
        """Return what was solved, and how it ended."""
        return f"GaitSolution({self.case!r}, {self.status!r}, cost {self.cost:.5g})"

    def plot(self, figure: str = "joint_angles") -> Figure:
        """Return a figure of the solution, which need not be saved anywhere.

        Args:
            figure: "joint_angles", "joint_moments", "ground_forces", "activations",
                "stick_figures", "ankle_torque", "orthosis_curves", "toe_joints" or "cuffs".

        Raises:
            NotConvergedError: If it did not converge.
            InputError: If there is no such figure.
        """
        from pathwalker_cli.stride.figures.save import figure_names, make_figure

        series = self.series
        names = figure_names(series)
        if figure not in names:
            raise InputError(f"there is no figure {figure!r} of it", allowed=", ".join(names))
        return make_figure(figure, series)

    @property
    def config(self) -> StudyConfig:
        """What was asked for."""
        return self.case.config

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


def missing_torques(series: GaitSeries) -> tuple[MissingTorque, ...]:
    """Return what the muscles lack in a stride that reserve actuators help along."""
    largest = sorted(_largest_help(series), key=lambda each: -each.torque / each.strength)
    return tuple(each for each in largest if each.torque > choices.LEAST_LACK * each.strength)


def _largest_help(series: GaitSeries) -> Iterator[MissingTorque]:
    """Yield the largest help for each generator; help against it is help for its antagonist."""
    walker = series.walker
    for muscle, strength in zip(walker.muscles, walker.max_isometric_torque, strict=True):
        row = walker.skeleton.index(muscle.coordinate)
        help_ = muscle.torque_sign * series.reserve[:, row]
        k = int(help_.argmax())
        percent = 100.0 * float(series.time[k] / series.time[-1])
        yield MissingTorque(muscle.name, float(help_[k]), float(strength), percent)
