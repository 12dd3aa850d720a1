"""Which rows and bounds a solution misses, and which hold it back, by name and place."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from pathwalker_cli.nlp.program import Program, limits
from pathwalker_cli.nlp.result import NlpResult
from pathwalker_cli.ocp.transcription import Transcription

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
    def parsed(cls, text: str) -> ActiveBound | None:
        """Return the bound of such a text as older runs have it, None if it is none."""
        match = _ACTIVE_BOUND.fullmatch(text)
        if match is None:
            return None
        places = match["places"]
        return cls(match["name"], match["side"], float(match["value"]),
                   tuple(places.split(", ")) if places else ())  # fmt: skip


def largest_violations(
    program: Program, result: NlpResult, count: int = 5
) -> tuple[Violation, ...]:
    """Return the largest violations in physical units, largest first; zero ones count too."""
    values, lower, upper, scale = _all(program, result)
    missed = np.maximum(lower - values, values - upper) * scale
    # rows before unknowns where they are missed by as much
    missed = np.roll(np.nan_to_num(missed, nan=np.inf, neginf=0.0).clip(0.0), -program.size)
    found = []
    for i in np.argsort(-missed, kind="stable")[:count].tolist():
        kind = "" if i < program.rows else "bound of "
        name = " in ".join(_place(program, (i + program.size) % len(missed)))
        found.append(Violation(kind + name, float(missed[i])))
    return tuple(found)


def active_bounds(program: Transcription[Any], result: NlpResult) -> tuple[ActiveBound, ...]:
    """Return the inequality bounds that are active with a multiplier, grouped by name.

    Running costs that stay zero are left out: they hold nothing back.
    """
    groups: dict[tuple[str, str, float], list[str]] = {}
    values, lower, upper, scale = _all(program, result)
    for side, limit, gap, sign in (
        ("lower", lower, values - lower, -1.0),
        ("upper", upper, upper - values, 1.0),
    ):
        pull = sign * result.multipliers.stacked
        # along the barrier gap times multiplier is constant: active is where the multiplier wins
        hit = (gap < np.minimum(_NEAR, pull)) & (pull > _PULL) & (upper > lower)
        for i in np.flatnonzero(hit).tolist():
            name, where = _place(program, i)
            if name in program.problem.integrals:
                continue
            phases = groups.setdefault((name, side, round(float(limit[i] * scale[i]), 9)), [])
            phase = "" if where in ("all phases", "the whole motion") else where.split(" ")[0]
            if phase and phase not in phases:
                phases.append(phase)
    return tuple(ActiveBound(*key, tuple(places)) for key, places in sorted(groups.items()))


def _all(program: Program, result: NlpResult) -> tuple[np.ndarray, ...]:
    """Return values, lower and upper bounds and scale of all unknowns and then all rows."""
    scale = np.concatenate([program.scale, program.row_scale])
    return np.concatenate([result.unknowns, result.rows]), *limits(program), scale


def _place(program: Program, i: int) -> tuple[str, str]:
    """Return name and place of one of all unknowns and then all rows."""
    return program.unknown_place(i) if i < program.size else program.row_place(i - program.size)
