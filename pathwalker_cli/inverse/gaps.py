"""Gaps in marker paths: short ones are bridged, all are reported."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Final

import numpy as np
from scipy.interpolate import PchipInterpolator

from pathwalker_cli.io.c3d import Recording

__all__ = ["LONGEST_GAP", "Gap", "bridge_gaps"]

LONGEST_GAP: Final = 0.1
"""Longest gap that is bridged by default [s]; about a quarter of a swing phase."""


@dataclass(frozen=True)
class Gap:
    """A run of frames in which a marker was not seen.

    Args:
        marker: Name of the marker.
        first: First frame without it.
        frames: Number of frames without it.
        bridged: Whether the path was interpolated there.
    """

    marker: str
    first: int
    frames: int
    bridged: bool


def bridge_gaps(
    recording: Recording, markers: tuple[str, ...], longest: float = LONGEST_GAP
) -> tuple[Recording, tuple[Gap, ...]]:
    """Interpolate short gaps by monotone cubics; leave long ones and those at the ends.

    Args:
        recording: The recording.
        markers: Markers to look at.
        longest: Longest gap that is bridged [s].

    Returns:
        The recording without the short gaps, and every gap that there was.
    """
    positions = recording.positions.copy()
    gaps: list[Gap] = []
    for name in dict.fromkeys(markers):
        path = recording.marker(name)
        for first, frames in _runs(np.isnan(path[:, 0])):
            inside = first > 0 and first + frames < path.shape[0]
            bridged = inside and frames <= longest * recording.rate + 1e-9
            gaps.append(Gap(name, first, frames, bridged))
            if bridged:
                rows = np.arange(first, first + frames)
                positions[rows, recording.markers.index(name)] = _interpolated(path, rows)
    positions.setflags(write=False)
    return replace(recording, positions=positions), tuple(gaps)


def _runs(missing: np.ndarray) -> list[tuple[int, int]]:
    """Return first frame and length of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int)))
    return [(int(a), int(b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _interpolated(path: np.ndarray, rows: np.ndarray) -> np.ndarray:
    """Return the path at these rows from its seen frames."""
    seen = np.flatnonzero(np.isfinite(path[:, 0]))
    return np.asarray(PchipInterpolator(seen, path[seen], axis=0)(rows))
