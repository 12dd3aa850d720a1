"""Foot strikes and toe-offs of recordings that name none.

References:
    Zeni, Richards, Higginson (2008), Two simple methods for determining gait events during
    treadmill and overground walking using kinematic data, Gait & Posture 27, 710-714: a foot
    strikes when its heel is farthest before the pelvis, and leaves when its toe is farthest behind.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np
from scipy.signal import find_peaks

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.inverse.dynamics import MOTION_CUTOFF, low_pass
from pathwalker_cli.io.c3d_events import Event, EventKind

_SWING: Final = 0.2
"""Share of a foot's way before and behind the pelvis that a peak must stand out by."""

_STRIDE: Final = 0.4
"""Shortest time between two strikes of a foot [s]."""

_NEAR: Final = 0.15
"""Time within which the edge of a plate's load counts as the same event [s]."""


def events_of_motion(
    pelvis: np.ndarray, feet: Mapping[Side, np.ndarray], rate: float
) -> tuple[Event, ...]:
    """Return the events that the motion shows, in order of time.

    Args:
        pelvis: Forward position of the pelvis [m], shape (n,).
        feet: Per side, forward positions of heel and toe [m], shape (n, 2).
        rate: Frames per second [1/s].
    """
    events = []
    for side in SIDES:
        heel, toe = low_pass(feet[side] - pelvis[:, None], rate, MOTION_CUTOFF).T
        kinds: tuple[tuple[EventKind, np.ndarray], ...] = (("foot_strike", heel), ("toe_off", -toe))
        for kind, curve in kinds:
            prominence = _SWING * np.ptp(curve)
            peaks, _ = find_peaks(curve, distance=_STRIDE * rate, prominence=prominence)
            events += [Event(side, kind, int(frame)) for frame in peaks]
    return tuple(sorted(events, key=lambda event: event.frame))


def set_by_plates(
    events: Sequence[Event], loads: Sequence[np.ndarray], least: float, rate: float
) -> tuple[tuple[Event, ...], int]:
    """Return events moved to where a plate begins or ceases to be loaded, and how many were.

    Args:
        events: The events.
        loads: Vertical force on every plate in every frame [N], shape (n,) each.
        least: Force from which a plate counts as loaded [N].
        rate: Frames per second [1/s].
    """
    edges: dict[EventKind, list[int]] = {"foot_strike": [], "toe_off": []}
    for load in loads:
        change = np.diff((load > least).astype(int))
        edges["foot_strike"] += (np.flatnonzero(change > 0) + 1).tolist()
        edges["toe_off"] += (np.flatnonzero(change < 0) + 1).tolist()
    moved = []
    for event in events:
        near = [frame for frame in edges[event.kind] if abs(frame - event.frame) <= _NEAR * rate]
        frame = min(near, key=lambda frame: abs(frame - event.frame), default=event.frame)
        moved.append((Event(event.side, event.kind, frame), bool(near)))
    ordered = sorted((event for event, _ in moved), key=lambda event: event.frame)
    return tuple(ordered), sum(near for _, near in moved)
