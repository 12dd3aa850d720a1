"""The numbers that a study's base may choose, springs first: values, ranges, ends, columns."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final, Literal

from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.studies.measures import MEASURES, Measure, measures

__all__ = [
    "Ranges",
    "end_of",
    "ends",
    "further_units",
    "measures_with",
    "numbers_of",
    "range_content",
    "ranges_of",
]

Ranges = Mapping[str, tuple[float, float]]
"""Least and largest value of every spring and of every other number that is free, by name [SI]."""

NEAR_END: Final = 1e-3
"""Share of its range within which a number sits at a limit: interior-point solvers stay a little
away from every bound, by far less than this."""


def further_units(unknowns: Sequence[Unknown]) -> dict[str, str]:
    """Return the SI units of the unknowns beside the four springs, by name."""
    return {u.name: u.unit for u in unknowns if u.name not in STIFFNESSES}


def measures_with(further: Mapping[str, str]) -> tuple[Measure, ...]:
    """Return what every study tells, then further numbers by name and SI unit."""
    words = {name: name.replace("_", " ") for name in further}
    more = (Measure(name, words[name], unit, words[name]) for name, unit in further.items())
    return (*MEASURES, *more)


def numbers_of(optimum: Optimum) -> dict[str, float]:
    """Return measures and unknowns of a neighbour by name; SI units."""
    unknowns = optimum.solver.walker.unknowns
    more = {u.name: optimum.value(u) for u in unknowns if u.name not in STIFFNESSES}
    return {**measures(optimum), **more}


def ranges_of(optimum: Optimum) -> dict[str, tuple[float, float]]:
    """Return the allowed range of every spring and unknown; none where it follows another one."""
    ranges = dict(optimum.solver.bounds.ranges)
    springs = STIFFNESSES if optimum.config.condition == "orthosis" else ()
    if not all(name in ranges for name in springs):
        values = zip(springs, optimum.stiffness.tolist(), strict=True)
        ranges = {name: (value, value) for name, value in values} | ranges
    return {name: ranges[name] for name in dict.fromkeys((*springs, *ranges))}


def end_of(value: float, limits: tuple[float, float]) -> Literal["", "lower", "upper"]:
    """Return the end of its range at which a number sits; "" inside, or where it has no choice."""
    low, high = limits
    margin = NEAR_END * (high - low)
    if low == high:
        return ""
    if value >= high - margin:
        return "upper"
    return "lower" if value <= low + margin else ""


def ends(values: Mapping[str, float], ranges: Ranges) -> dict[str, Literal["", "lower", "upper"]]:
    """Return the free numbers that sit at an end of their range, and at which.

    Args:
        values: Value by name [SI]; other keys do no harm.
        ranges: Range by name.
    """
    sides = {name: end_of(values[name], ranges[name]) for name in ranges if name in values}
    return {name: end for name, end in sides.items() if end}


def range_content(ranges: Ranges) -> dict[str, dict[str, tuple[float, float]]]:
    """Return ranges as plain values, those of springs apart from others if there are any."""
    springs = {name: pair for name, pair in ranges.items() if name in STIFFNESSES}
    others = {name: pair for name, pair in ranges.items() if name not in STIFFNESSES}
    return {"stiffness_ranges": springs, **({"number_ranges": others} if others else {})}
