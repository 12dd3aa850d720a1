"""Markers that are not where their set says: those that jumped away, and wands."""

from __future__ import annotations

from dataclasses import replace
from typing import Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.inverse.kinematics import MarkerResiduals, inverse_kinematics
from pathwalker_cli.inverse.markers import MarkerPoint, bridge_gaps
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.trajectory import Trajectory

JUMPED: Final = 0.12
"""Distance from the walker beyond which a marker jumped, in body heights.  The shipped recordings
give up to 0.07, wands that the set takes for skin markers 0.08."""

WAND: Final = 0.185
"""Distance from the line between two joints, as a share of its length, from which a marker stands
on a wand.  The shipped recordings give up to 0.17, wands of four laboratories 0.2 to 0.32."""

_ROUNDS: Final = 3
"""Fits after which the rest of the jumps is left to the warnings."""


def robust_kinematics(
    model: pin.Model,
    recording: Recording,
    points: tuple[MarkerPoint, ...],
    height: float,
    longest_gap: float,
) -> tuple[Trajectory, MarkerResiduals, tuple[str, ...]]:
    """Fit the walker; markers that jump away and markers on wands have no say in it.

    Args:
        model: The walker.
        recording: The recording in the walking plane, its short gaps bridged.
        points: Where its markers sit.
        height: Height of the body [m].
        longest_gap: Longest gap that is bridged where a marker is left out [s].

    Returns:
        As `inverse_kinematics`, and a sentence on every marker that was left out.
    """
    motion, residuals = inverse_kinematics(model, recording, points)
    doubts: list[str] = []
    for _ in range(_ROUNDS):
        away = _jumps(residuals, JUMPED * height)
        if not away:
            break
        positions = recording.positions.copy()
        for point, rows in away.items():
            marker = points[point].marker
            positions[rows, recording.markers.index(marker)] = np.nan
            far = residuals.distances[rows, point].max()
            first, last = recording.first_frame + rows[[0, -1]]
            doubts.append(
                f"marker {marker} lies up to {far:.2g} m from the walker in {rows.size} frames "
                f"from {first} to {last}: it is left out there"
            )
        names = tuple(points[point].marker for point in away)
        recording, _ = bridge_gaps(replace(recording, positions=positions), names, longest_gap)
        motion, residuals = inverse_kinematics(model, recording, points)
    wands = _wands(points, residuals)
    if wands:
        left_out = ", ".join(p.marker for p in points if p.name in wands)
        doubts.append(
            f"left out, as if on wands far beside the line between the joints: {left_out}"
        )
        points = tuple(p for p in points if p.name not in wands)
        motion, residuals = inverse_kinematics(model, recording, points)
    return motion, residuals, tuple(doubts)


def _jumps(residuals: MarkerResiduals, limit: float) -> dict[int, np.ndarray]:
    """Return the frames in which a point is the worst of all and beyond a limit [m]."""
    distances = np.nan_to_num(residuals.distances)
    worst, rows = distances.argmax(axis=1), distances.max(axis=1) > limit
    return {int(point): np.flatnonzero(rows & (worst == point)) for point in set(worst[rows])}


def _wands(points: tuple[MarkerPoint, ...], residuals: MarkerResiduals) -> set[str]:
    """Return the names of points along a segment whose markers stand far beside it."""
    rms = residuals.rms()
    lengths = {
        link: max(-p.position[1] for p in points if p.link == link)
        for link in {p.link for p in points if p.link.startswith(("thigh", "shank"))}
    }
    return {
        point.name
        for point in points
        if point.link in lengths
        and 0.0 < -point.position[1] < lengths[point.link]
        and rms[point.name] > WAND * lengths[point.link]
    }
