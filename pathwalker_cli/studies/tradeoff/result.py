"""The front of effort and speed as plain numbers: its files and its table on the terminal."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Any, Final

import numpy as np
from pydantic import BeforeValidator, PlainSerializer, TypeAdapter

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.measures import measures_with

FILES: Final = ("tradeoff.csv", "tradeoff.json")

_EQUAL: Final = 1e-3
"""Relative difference up to which two points count as equally fast or equally costly."""

_MESHES: Final = {
    "base": "mesh of the base",
    "refined": "finer mesh",
    "inaccurate": "mesh too coarse",
}

Number = Annotated[
    float,
    BeforeValidator(lambda value: float("nan") if value is None else value),
    PlainSerializer(lambda value: value if np.isfinite(value) else None),
]
"""A number that may be none, which is null in JSON."""


@dataclass(frozen=True)
class FrontPoint:
    """The best local optimum at one weight of speed, as `tradeoff.json` has it.

    Args:
        walking_speed_weight: Weight of walking speed, lambda of equation (10) [s^2/m^2].
        status: "converged" or the reason why not.
        mesh: "base" if the mesh of the base is accurate there, "refined" if a finer one was made
            and is, "inaccurate" if neither; None without a solution.
        dominated: Whether another point is no slower and no more costly; None without a solution.
        measures: Measures and further unknowns, SI units; none if every solve failed.
        errors: Largest re-integration errors [rad or m], [rad/s or m/s].
        intervals: Mesh intervals.
        cost_on_base_mesh: Cost on the mesh of the base.
        local_optima: Local optima that were found.
        iterations: Iterations of the solve on the mesh of the base.
    """

    walking_speed_weight: float
    status: str
    mesh: str | None
    dominated: bool | None
    measures: Mapping[str, float]
    errors: tuple[Number, Number]
    intervals: int
    cost_on_base_mesh: Number
    local_optima: int
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
    """Effort against walking speed, as `tradeoff.json` has it; points by rising weight of speed.

    Args:
        base_weight: Weight of the run that the study began with, with the measures `optimum` [SI].
        front: Weights of the points that no other one beats, by rising speed.
        recorded_walking_speed: Least and largest one in that condition [m/s]; None without any.
        tolerances: Largest re-integration errors allowed [rad or m], [rad/s or m/s].
        seconds: Wall seconds of all solves on the mesh of the base.
        further: SI units of the unknowns beside the springs, by name.
    """

    problem: str
    patient: str
    condition: str
    points: tuple[FrontPoint, ...]
    base_weight: float
    optimum: Mapping[str, float]
    front: tuple[float, ...]
    recorded_walking_speed: tuple[float, float] | None
    tolerances: tuple[float, float]
    solves: int
    failed_solves: int
    median_iterations: float
    seconds: float
    seconds_refined: float
    sweeps: int
    sweeps_found_nothing_new: bool
    further: Mapping[str, str] = field(default_factory=dict)

    @property
    def solved(self) -> tuple[FrontPoint, ...]:
        """Points with a solution."""
        return tuple(point for point in self.points if point.solved)

    @property
    def coarse(self) -> tuple[FrontPoint, ...]:
        """Points whose mesh is too coarse."""
        return tuple(point for point in self.solved if point.mesh == "inaccurate")

    @property
    def front_points(self) -> tuple[FrontPoint, ...]:
        """Points that no other one beats, by rising speed."""
        of = {point.walking_speed_weight: point for point in self.points}
        return tuple(of[weight] for weight in self.front)

    @property
    def springs(self) -> tuple[str, ...]:
        """Springs that there are; none barefoot."""
        worn = STIFFNESSES if self.condition == "orthosis" else ()
        return tuple(name for name in worn if self.optimum.get(name) is not None)


def judged(points: Sequence[FrontPoint]) -> tuple[FrontPoint, ...]:
    """Return points that know whether another one dominates them."""
    solved = [point for point in points if point.solved]
    return tuple(
        replace(p, dominated=any(other.beats(p) for other in solved)) if p.solved else p
        for p in points
    )


def front_of(points: Sequence[FrontPoint]) -> tuple[float, ...]:
    """Return the weights of judged points that no other one beats, by rising speed."""
    best = [point for point in points if point.dominated is False]
    best.sort(key=lambda point: (point.speed, point.effort))
    return tuple(point.walking_speed_weight for point in best)


_PLAIN: Final = TypeAdapter(Tradeoff)


def tradeoff_content(tradeoff: Tradeoff) -> dict[str, Any]:
    """Return a trade-off as plain values; SI units."""
    plain: dict[str, Any] = _PLAIN.dump_python(tradeoff, mode="json")
    return plain if tradeoff.further else {k: v for k, v in plain.items() if k != "further"}


def write_tables(tradeoff: Tradeoff, folder: Path) -> None:
    """Write every point as a row, and the summary."""
    measures = measures_with(tradeoff.further)
    header = ("walking_speed_weight [s^2/m^2]", "status", "mesh", "dominated",
              *(measure.column for measure in measures), "reintegration_position_error [rad or m]",
              "reintegration_velocity_error [rad/s or m/s]", "intervals", "cost_on_base_mesh [1]",
              "local_optima", "iterations")  # fmt: skip
    rows: list[list[Any]] = []
    for point in tradeoff.points:
        numbers = [point.measures.get(measure.key) for measure in measures]
        row = [point.walking_speed_weight, point.status, point.mesh,
               "yes" if point.dominated else "no", *numbers, *point.errors, point.intervals,
               point.cost_on_base_mesh, point.local_optima, point.iterations]  # fmt: skip
        rows.append(row if point.solved else [*row[:2], *[None] * (len(header) - 2)])
    write_table(folder / FILES[0], header, rows)
    write_json(folder / FILES[1], tradeoff_content(tradeoff))


def tradeoff_lines(tradeoff: Tradeoff) -> list[str]:
    """Return the table and what it took, line by line."""
    springs = tradeoff.springs
    heading = ["weight", "speed", "effort", *(measure_of(name).short for name in springs)]
    units = ["s^2/m^2", "m/s", "s/m", *(["N m/rad"] * len(springs))]
    lines = ["".join(f"{cell:>9}" for cell in row) for row in (heading, units)]
    lines += [_line(tradeoff, point) for point in tradeoff.points]
    return [*lines, "", *(f"{label:<22}{text}" for label, text in _notes(tradeoff))]


def _line(tradeoff: Tradeoff, point: FrontPoint) -> str:
    weight = f"{point.walking_speed_weight:9.3g}"
    if not point.solved or point.mesh is None:
        return f"{weight}  {point.status}"
    cells = [weight, f"{point.speed:9.3f}", f"{point.effort:9.4f}"]
    cells += [f"{point.measures[name]:9.1f}" for name in tradeoff.springs]
    notes = [
        f"{_MESHES[point.mesh]}, {point.intervals} intervals",
        f"errors {point.errors[0]:.1e} rad or m, {point.errors[1]:.1e} rad/s or m/s",
        *(f"{n} {point.measures[n]:.4g} {unit}" for n, unit in tradeoff.further.items()),
    ]
    notes += [point.status] * (point.status != "converged")
    notes += ["dominated"] * bool(point.dominated)
    return f"{''.join(cells)}   {'; '.join(notes)}"


def _notes(tradeoff: Tradeoff) -> list[tuple[str, str]]:
    """Return label and text of what to know about the table."""
    coarse = ", ".join(f"{point.walking_speed_weight:g}" for point in tradeoff.coarse)
    allowed = "{:g} rad or m, {:g} rad/s or m/s".format(*tradeoff.tolerances)
    rows = [("front", f"{len(tradeoff.front)} of {len(tradeoff.points)} points; a dominated point "
             "is no faster and no cheaper than another one")]  # fmt: skip
    if tradeoff.recorded_walking_speed is not None:
        low, high = tradeoff.recorded_walking_speed
        rows.append(("recorded speed", f"{low:.2f} to {high:.2f} m/s, {tradeoff.condition}"))
    rows.append(("re-integration error", f"allowed {allowed}; " + (
        f"exceeded at weight {coarse}: take these numbers as rough" if coarse
        else "met by every point with a solution")))  # fmt: skip
    done = "nothing new" if tradeoff.sweeps_found_nothing_new else "still new optima"
    rows.append(("solves", f"{tradeoff.solves} on the mesh of the base, {tradeoff.failed_solves} "
                 f"without a solution; {tradeoff.median_iterations:.0f} iterations in the median; "
                 f"{tradeoff.sweeps} sweeps, the last found {done}"))  # fmt: skip
    rows.append(("seconds", f"{tradeoff.seconds:.0f} on the mesh of the base, "
                 f"{tradeoff.seconds_refined:.0f} on finer meshes"))  # fmt: skip
    return rows
