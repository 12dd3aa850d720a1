"""The front of effort and speed as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

__all__ = ["FrontPoint", "Tradeoff"]

_EQUAL = 1e-3
"""Relative difference up to which two points count as equally fast or equally costly."""


@dataclass(frozen=True)
class FrontPoint:
    """The best local optimum at one weight of speed.

    Args:
        name: Its name, e.g. "w0.5".
        weight: Weight of walking speed, lambda of equation (10).
        status: "converged" or the reason why not.
        mesh_status: "base" if the mesh of the base is accurate there, "refined" if a finer one
            was made and is, "inaccurate" if neither.
        measures: Numbers of `MEASURES`, SI units; none if every solve failed.
        errors: Largest re-integration errors [rad or m], [rad/s or m/s].
        intervals: Mesh intervals.
        cost_on_base: Cost on the mesh of the base.
        branches: Local optima that were found.
        iterations: Iterations of the solve on the mesh of the base.
    """

    name: str
    weight: float
    status: str
    mesh_status: str
    measures: Mapping[str, float]
    errors: tuple[float, float]
    intervals: int
    cost_on_base: float
    branches: int
    iterations: int

    @property
    def solved(self) -> bool:
        """Whether there is a solution."""
        return bool(self.measures)

    @property
    def speed(self) -> float:
        """Walking speed [m/s]."""
        return self.measures["walking_speed"]

    @property
    def effort(self) -> float:
        """Effort per distance [s/m]."""
        return self.measures["effort_per_distance"]

    def beats(self, other: FrontPoint) -> bool:
        """Return whether this one is no slower and no more costly, and clearly better in one."""
        faster = (self.speed - other.speed) / other.speed
        cheaper = (other.effort - self.effort) / other.effort
        return min(faster, cheaper) >= 0.0 and max(faster, cheaper) > _EQUAL


@dataclass(frozen=True)
class Tradeoff:
    """Effort against walking speed.

    Args:
        patient: Id of the patient.
        problem: The problem.
        condition: Condition that it is about.
        points: The points, by rising weight.
        base_weight: Weight of the run that the study began with.
        optimum: Cost and walking speed of that run, SI units.
        recorded: Least and largest recorded speed in that condition [m/s]; None without any.
        tolerances: Largest re-integration errors allowed [rad or m], [rad/s or m/s].
        solves: Solves on the mesh of the base.
        failed_solves: Those that did not converge.
        iterations: Iterations of each.
        seconds: Wall seconds of all of them.
        seconds_refined: Wall seconds of the solves on refined meshes.
        sweeps: Sweeps over the weights.
        complete: Whether the last sweep found nothing new.
    """

    patient: str
    problem: str
    condition: str
    points: tuple[FrontPoint, ...]
    base_weight: float
    optimum: Mapping[str, float]
    recorded: tuple[float, float] | None
    tolerances: tuple[float, float]
    solves: int
    failed_solves: int
    iterations: tuple[int, ...]
    seconds: float
    seconds_refined: float
    sweeps: int
    complete: bool

    @property
    def solved(self) -> tuple[FrontPoint, ...]:
        """Points with a solution."""
        return tuple(point for point in self.points if point.solved)

    def dominated(self, point: FrontPoint) -> bool:
        """Return whether another point is no slower and no more costly."""
        return any(other.beats(point) for other in self.solved)

    @property
    def front(self) -> tuple[FrontPoint, ...]:
        """Points that no other one beats, by rising speed."""
        best = [point for point in self.solved if not self.dominated(point)]
        return tuple(sorted(best, key=lambda point: (point.speed, point.effort)))

    @property
    def median_iterations(self) -> float:
        """Median of the iterations of all solves on the mesh of the base."""
        return float(np.median(self.iterations)) if self.iterations else 0.0
