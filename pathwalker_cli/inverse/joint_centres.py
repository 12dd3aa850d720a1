"""From markers on the skin to joint centres, and from a pelvis that turns to one that does not.

A marker stands beside its joint, and hips stand beside the middle of the pelvis.  Where the pelvis
turns or drops, that moves them ahead and up in the walking plane, on one side the other way than on
the other: 10 degrees move hips by 1.5 cm, and the thighs seem to turn by 2 degrees.  The walker's
hips share one place, so each leg is laid there.

References:
    Davis, Ounpuu, Tyburski, Gage (1991), Human Movement Science 10, 575-587: hip joint centres.
    Ross, Wilson (1974), Acta Paediatrica Belgica 28, 169-182: breadths of knees and ankles.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Final, Literal

import numpy as np

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.io.c3d import Recording

Landmark = Literal["asis", "psis", "knee", "ankle", "toe", "heel", "c7", "clavicle"]
"""What a marker stands for."""

_BREADTHS: Final = {"knee": 0.0952 / 1.7018, "ankle": 0.0668 / 1.7018}
"""Breadth of a joint in body heights."""

_ABOVE: Final[Mapping[Landmark, Landmark]] = {"knee": "asis", "ankle": "knee"}
"""Landmark at the other end of the segment above a joint."""

_MARKER: Final = 0.007
"""From a marker's centre to the skin [m], as in the regression of the hips."""

_BONE: Final = 0.25
"""Share of its width by which a pelvis may seem to change; beyond that a marker jumped."""

LEFTWARD: Final[Mapping[Side, float]] = {"right": -1.0, "left": 1.0}


def hip_centre(leg: float, width: float = 0.0) -> tuple[float, float, float]:
    """Return how far a hip joint is behind, beside and below the middle of the front spines [m].

    Along the axes of the pelvis, by the regression of Davis et al. (1991), for a leg [m] from spine
    to malleolus and front spines that are `width` [m] apart.
    """
    size, depth = 0.115 * leg - 0.0153, 0.1288 * leg - 0.04856 + _MARKER
    theta, beta = np.radians(28.4), np.radians(18.0)
    behind = depth * np.cos(beta) - size * np.cos(theta) * np.sin(beta)
    below = depth * np.sin(beta) + size * np.cos(theta) * np.cos(beta)
    return float(behind), float(width / 2.0 - size * np.sin(theta)), float(below)


def beside_joint(joint: str, side: Side, height: float, numbers: Mapping[str, float]) -> float:
    """Return how far the marker of a knee or ankle stands beside the joint [m].

    By the breadth that the file tells, e.g. LKneeWidth [mm], else by the height of the body.

    Args:
        joint: "knee" or "ankle".
        side: The side.
        height: Height of the body [m].
        numbers: What the file says about the subject.
    """
    told = 1e-3 * numbers.get(f"{side[0].upper()}{joint.capitalize()}Width", 0.0)
    usual = _BREADTHS[joint] * height
    return (told if 0.5 < told / usual < 2.0 else usual) / 2.0 + _MARKER


def legs_in_plane(
    recording: Recording, legs: Mapping[tuple[Landmark, Side], str], leg: float, height: float
) -> tuple[Recording, dict[Side, np.ndarray]]:
    """Return a recording whose legs hang below the middle of the pelvis, markers at the joints.

    Every marker of a leg moves along the line between the front spines; those of knee and ankle
    also move to the joint, square to the segment above.

    Args:
        recording: A pass in the walking plane, markers in three dimensions.
        legs: Marker by landmark and side, the front spines (`asis`) among them.
        leg: Length of the leg, spine to malleolus [m].
        height: Height of the body [m].

    Returns:
        The recording, and per side how far its leg stood ahead of there [m], shape (n,).
    """
    right, left = (recording.marker(legs["asis", side]) for side in SIDES)
    apart = np.linalg.norm(left - right, axis=1)
    width = float(np.nanmedian(apart))
    apart[np.abs(apart - width) > _BONE * width] = np.nan
    axis = _without_gaps((left - right) / apart[:, None])
    _, aside, _ = hip_centre(leg, width)
    positions = recording.positions.copy()
    for (landmark, side), marker in legs.items():
        if landmark in ("knee", "ankle", "toe", "heel"):
            path = recording.marker(marker)
            shift = aside * axis
            if landmark in _ABOVE:
                along = path - recording.marker(legs[_ABOVE[landmark], side])
                beside = beside_joint(landmark, side, height, recording.numbers)
                shift = shift + beside * _across(axis, along)
            positions[:, recording.markers.index(marker)] = path - LEFTWARD[side] * shift
    positions.setflags(write=False)
    ahead = {side: LEFTWARD[side] * aside * axis[:, 0] for side in SIDES}
    return replace(recording, positions=positions), ahead


def _across(axis: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return the part of vectors (n, 3) that is square to others, of length one."""
    square = axis - along * ((axis * along).sum(axis=1) / (along**2).sum(axis=1))[:, None]
    return np.asarray(square / np.linalg.norm(square, axis=1, keepdims=True))


def _without_gaps(paths: np.ndarray) -> np.ndarray:
    """Return columns (n, m) with straight lines through their gaps."""
    rows, seen = np.arange(len(paths)), np.isfinite(paths[:, 0])
    return np.stack([np.interp(rows, rows[seen], path[seen]) for path in paths.T], axis=1)
