"""Events of a C3D file, in every layout that recording programs write.

C3D counts times from frame 1 at time zero, in pairs of minutes and seconds; sides stand in CONTEXTS
or in the labels themselves ("Left", "Foot Strike"; "LHS").  Some programs write one number per
event, or pairs in one row, or count from the first frame that was kept.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from pathwalker_cli.conventions import Side

EventKind = Literal["foot_strike", "toe_off"]

_SIDES: Final[tuple[tuple[str, Side], ...]] = (
    (r"^l(eft)?\b|^l(?=hs|fs|ic|to|fo|fc|hc)|\bleft\b", "left"),
    (r"^r(ight)?\b|^r(?=hs|fs|ic|to|fo|fc|hc)|\bright\b", "right"),
)
_KINDS: Final[tuple[tuple[str, EventKind], ...]] = (
    (r"strike|contact|touch ?down|foot ?on|heel ?on|\b[lr]? ?(hs|fs|ic|fc|hc|fd)\b", "foot_strike"),
    (r"off|toe ?lift|\b[lr]? ?(to|fo)\b", "toe_off"),
)


@dataclass(frozen=True)
class Event:
    """A foot strike or toe-off.

    Args:
        side: "right" or "left".
        kind: "foot_strike" or "toe_off".
        frame: Frame of the recording, from 0.
    """

    side: Side
    kind: EventKind
    frame: int


def frames_of(
    events: Sequence[Event], side: Side, *kinds: EventKind
) -> tuple[tuple[int, ...], ...]:
    """Return the frames of a side's events wherever they follow one another in these kinds."""
    own = [event for event in events if event.side == side]
    runs = zip(*(own[first:] for first in range(len(kinds))), strict=False)
    return tuple(
        tuple(event.frame for event in run)
        for run in runs
        if tuple(event.kind for event in run) == kinds
    )


def continued(group: Mapping[str, Any], name: str) -> list[Any]:
    """Return the values of a parameter and of those that continue it: NAME, NAME2, NAME3..."""
    values: list[Any] = []
    for key in (name, *(f"{name}{number}" for number in range(2, len(group) + 2))):
        if key not in group:
            break
        values += list(group[key]["value"])
    return values


def read_events(
    group: Mapping[str, Any], rate: float, first_frame: int, frames: int
) -> tuple[Event, ...]:
    """Return strikes and toe-offs inside the recording, in order of time.

    An event between two frames counts for the later one: in the shipped recordings the plates'
    forces rise and fall within one frame of the events read this way.
    The rate is in 1/s; `first_frame`, from 1, is the first one that was kept.
    """
    labels = [str(label) for label in continued(group, "LABELS")]
    contexts = [str(side) for side in continued(group, "CONTEXTS")]
    contexts += [""] * (len(labels) - len(contexts))
    times = _times(group, len(labels))
    named = [
        (side, kind, time)
        for label, context, time in zip(labels, contexts, times, strict=False)
        if (side := _first(_SIDES, (context, label)))
        and (kind := _first(_KINDS, (label,)))
        and np.isfinite(time)
    ]
    for shift in (first_frame - 1, 0):  # 0: counted from the first frame that was kept
        events = [
            Event(side, kind, math.ceil(round(time * rate, 3)) - shift)
            for side, kind, time in named
        ]
        inside = [event for event in events if 0 <= event.frame < frames]
        if inside:
            return tuple(sorted(inside, key=lambda event: event.frame))
    return ()


def _times(group: Mapping[str, Any], count: int) -> np.ndarray:
    """Return the times of so many events [s]: pairs in columns, pairs in a row, or seconds."""
    if "TIMES" not in group:
        return np.zeros(0)
    parts = [
        np.asarray(group[key]["value"], dtype=float).ravel(order="F")
        for key in group
        if re.fullmatch(r"TIMES\d*", key)
    ]
    values = np.concatenate(parts)
    if values.size < 2 * count:
        return values
    pairs = values[: 2 * count].reshape(-1, 2)
    return np.asarray(60.0 * pairs[:, 0] + pairs[:, 1])


def _first(patterns: Iterable[tuple[str, Any]], texts: Iterable[str]) -> Any:
    """Return what the first pattern found in the texts stands for, None without any."""
    words = (text.strip().lower().replace("_", " ") for text in texts)
    return next((meaning for w in words for p, meaning in patterns if re.search(p, w)), None)
