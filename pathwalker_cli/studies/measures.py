"""What neighbours are compared by: cost, measures of the gait and free numbers, SI units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.neighbourhood import Derivative
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in, numbers_of
from pathwalker_cli.stride.stride import stride_of

COMPARED: Final = (
    "cost",
    *(f"{stem}_{side}" for stem in ("min_stance_knee_flexion", "step_length")
      for side in ("left", "right")),
    "walking_speed",
)  # fmt: skip
"""The measures of table 5 of Sreenivasa et al. (2017)."""

Ranges = Mapping[str, tuple[float, float]]
"""Least and largest value of every spring and of every other number that is free, by name [SI]."""


def all_measures(optimum: Optimum) -> dict[str, float]:
    """Return the cost and every single number of the gait."""
    return {"cost": optimum.cost, **numbers_of(stride_of(optimum.series))}


def slopes(at: Derivative) -> dict[str, float]:
    """Return the derivatives of the cost and of every single number of the gait."""
    below, above = all_measures(at.below), all_measures(at.above)
    found = {key: (above[key] - below[key]) / (2.0 * at.step) for key in above if key in below}
    return {**found, "cost": at.cost}


def measures(optimum: Optimum) -> dict[str, float]:
    """Return the measures that every study shows, then free numbers that are no springs."""
    numbers, unknowns = all_measures(optimum), optimum.series.walker.unknowns
    known = {m.key: numbers[m.key] for m in measures_in("studies") if m.key in numbers}
    return known | {u.name: optimum.value(u) for u in unknowns if u.name not in STIFFNESSES}


def free_units(unknowns: Sequence[Unknown]) -> dict[str, str]:
    """Return the SI units of the unknowns beside the four springs, by name."""
    return {u.name: u.unit for u in unknowns if u.name not in STIFFNESSES}


def measures_with(units: Mapping[str, str]) -> tuple[Measure, ...]:
    """Return the measures that every study shows, then free numbers by name and SI unit."""
    words = {name: name.replace("_", " ") for name in units}
    free = (Measure(name, words[name], unit, "", None) for name, unit in units.items())
    return (*measures_in("studies"), *free)


def ranges_of(optimum: Optimum) -> dict[str, tuple[float, float]]:
    """Return the allowed range of every spring and unknown; none where it follows another one."""
    ranges = dict(optimum.solver.bounds.ranges)
    springs = optimum.solver.walker.springs
    if not all(name in ranges for name in springs):
        values = dict(zip(STIFFNESSES, optimum.stiffness.tolist(), strict=True))
        ranges = {name: (values[name], values[name]) for name in springs} | ranges
    return {name: ranges[name] for name in dict.fromkeys((*springs, *ranges))}


def range_content(ranges: Ranges) -> dict[str, dict[str, tuple[float, float]]]:
    """Return ranges as plain values, those of springs apart from others if there are any."""
    springs = {name: pair for name, pair in ranges.items() if name in STIFFNESSES}
    others = {name: pair for name, pair in ranges.items() if name not in STIFFNESSES}
    return {"stiffness_ranges": springs, **({"number_ranges": others} if others else {})}
