"""Which rows and bounds a solution misses, and which hold it back, by name and place."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pathwalker_cli.nlp.ipopt import NlpResult
from pathwalker_cli.nlp.program import Program
from pathwalker_cli.ocp.transcription import Transcription

__all__ = ["ActiveBound", "Violation", "active_bounds", "largest_violations"]

_NEAR: Final = 1e-2
"""Distance in solver units beyond which a bound is never called active."""

_PULL: Final = 1e-5
"""Least multiplier of an active bound: without it the bound does not matter."""

_ACTIVE_BOUND: Final = re.compile(
    r"(?P<name>.+) (?P<side>lower|upper) (?P<value>[-+.\w]+)(?: in (?P<places>.+))?"
)


@dataclass(frozen=True)
class Violation:
    """One constraint or bound that is not met.

    Args:
        name: What and where.
        amount: By how much, in its own unit.
    """

    name: str
    amount: float


@dataclass(frozen=True)
class ActiveBound:
    """A bound that holds the solution back.

    Args:
        name: Quantity, e.g. "position" or "mean speed".
        side: "lower" or "upper".
        value: The bound, in the unit of the quantity.
        places: Phases in which it is active; empty for the whole motion.
    """

    name: str
    side: str
    value: float
    places: tuple[str, ...]

    def __str__(self) -> str:
        """Return e.g. "position lower 0.42 in ascent, descent"."""
        where = f" in {', '.join(self.places)}" if self.places else ""
        return f"{self.name} {self.side} {self.value:.4g}{where}"

    @classmethod
    def parse(cls, text: str) -> ActiveBound:
        """Return the bound of such a text.

        Raises:
            ValueError: If it is none.
        """
        match = _ACTIVE_BOUND.fullmatch(text)
        if match is None:
            raise ValueError(f"'{text}' is no active bound")
        places = match["places"]
        return cls(match["name"], match["side"], float(match["value"]),
                   tuple(places.split(", ")) if places else ())  # fmt: skip


@dataclass(frozen=True)
class _Limited:
    """All rows and then all unknowns of a solution, in solver units."""

    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    multipliers: np.ndarray
    scale: np.ndarray

    @classmethod
    def of(cls, program: Program, result: NlpResult) -> _Limited:
        """Return what a solution of a program reaches, and its limits."""
        multipliers = result.multipliers
        pairs = (
            (result.rows, result.unknowns),
            *zip(program.row_bounds, program.bounds, strict=True),
            (multipliers.rows, multipliers.unknowns),
            (program.row_scale, program.scale),
        )
        return cls(*map(np.concatenate, pairs))


def largest_violations(
    program: Program, result: NlpResult, count: int = 5
) -> tuple[Violation, ...]:
    """Return the largest violations in physical units, largest first; zero ones count too."""
    limited = _Limited.of(program, result)
    missed = (
        np.maximum(limited.lower - limited.values, limited.values - limited.upper) * limited.scale
    )
    missed = np.nan_to_num(missed, nan=np.inf, neginf=0.0).clip(0.0)
    found = []
    for i in np.argsort(-missed, kind="stable")[:count].tolist():
        kind = "" if i < program.rows else "bound of "
        found.append(Violation(kind + " in ".join(_place(program, i)), float(missed[i])))
    return tuple(found)


def active_bounds(program: Transcription[Any], result: NlpResult) -> tuple[ActiveBound, ...]:
    """Return the inequality bounds that are active with a multiplier, grouped by name.

    Running costs that stay zero are left out: they hold nothing back.
    """
    groups: dict[tuple[str, str, float], list[str]] = {}
    limited = _Limited.of(program, result)
    for side, limit, gap, pull in (
        ("lower", limited.lower, limited.values - limited.lower, -limited.multipliers),
        ("upper", limited.upper, limited.upper - limited.values, limited.multipliers),
    ):
        # along the barrier gap times multiplier is constant: active is where the multiplier wins
        hit = (gap < np.minimum(_NEAR, pull)) & (pull > _PULL) & (limited.upper > limited.lower)
        for i in np.flatnonzero(hit).tolist():
            name, where = _place(program, i)
            if name in program.problem.integrals:
                continue
            value = round(float(limit[i] * limited.scale[i]), 9)
            phases = groups.setdefault((name, side, value), [])
            phase = "" if where in ("all phases", "the whole motion") else where.split(" ")[0]
            if phase and phase not in phases:
                phases.append(phase)
    return tuple(ActiveBound(*key, tuple(places)) for key, places in sorted(groups.items()))


def _place(program: Program, i: int) -> tuple[str, str]:
    """Return name and place of one of all rows and then all unknowns."""
    return program.row_place(i) if i < program.rows else program.unknown_place(i - program.rows)
