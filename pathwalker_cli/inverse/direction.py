"""The walking plane of a recording: forward is where the patient goes, whatever the lab's axes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d import Recording

__all__ = ["WalkingPlane", "is_projected", "walking_plane"]

_SHORTEST_WALK: Final = 0.3
"""Forward travel below which the direction is not certain [m]."""

_LARGEST_DRIFT: Final = 0.35
"""Sideways travel per forward travel above which nobody walks along that axis."""


_IN_PLANE: Final = 1e-6
"""Sideways coordinate below which a marker lies in the plane [m]."""


@dataclass(frozen=True)
class WalkingPlane:
    """The laboratory axis along which the patient walks, seen as +x of the walker.

    Args:
        axis: 0 for the laboratory's x, 1 for its y.
        sign: +1 or -1: walking along or against that axis.
    """

    axis: int
    sign: int

    @property
    def name(self) -> str:
        """The direction as text: "-y"."""
        return f"{'+' if self.sign > 0 else '-'}{'xy'[self.axis]}"

    def project(self, vectors: np.ndarray) -> np.ndarray:
        """Return (forward, up) of laboratory vectors, shape (..., 3) to (..., 2)."""
        return np.stack([self.sign * vectors[..., self.axis], vectors[..., 2]], axis=-1)


def walking_plane(recording: Recording, markers: tuple[str, ...]) -> WalkingPlane:
    """Return the walking plane from the travel of some markers, best those of the pelvis.

    Args:
        recording: The recording.
        markers: Markers whose mean travel gives the direction.

    Raises:
        DataError: If they hardly travel, or travel at an angle to both laboratory axes.
    """
    travel = _travel(np.stack([recording.marker(name) for name in markers], axis=1))
    axis = int(np.argmax(np.abs(travel[:2])))
    forward, sideways = abs(travel[axis]), abs(travel[1 - axis])
    if forward < _SHORTEST_WALK:
        raise DataError(
            f"{', '.join(markers)} travel {forward:.2f} m",
            where=recording.name,
            allowed=f"at least {_SHORTEST_WALK} m, so that the walking direction is certain",
        )
    if sideways > _LARGEST_DRIFT * forward:
        raise DataError(
            f"walks {forward:.2f} m along lab {'xy'[axis]} and {sideways:.2f} m across",
            where=recording.name,
            allowed="walking along one laboratory axis",
            mend="turn the recording about the vertical first",
        )
    return WalkingPlane(axis, 1 if travel[axis] > 0 else -1)


def is_projected(recording: Recording, plane: WalkingPlane, markers: tuple[str, ...]) -> bool:
    """Return whether the markers were laid into the walking plane before they were stored.

    Then they may have been turned as well, and say nothing about the laboratory's axes.
    """
    sideways = [recording.marker(name)[:, 1 - plane.axis] for name in markers]
    return bool(np.nanmax(np.abs(sideways)) < _IN_PLANE)


def _travel(positions: np.ndarray) -> np.ndarray:
    """Return the mean displacement from first to last sight of the markers [m], shape (3,)."""
    travels = []
    for marker in range(positions.shape[1]):
        seen = np.flatnonzero(np.isfinite(positions[:, marker, 0]))
        if seen.size > 1:
            travels.append(positions[seen[-1], marker] - positions[seen[0], marker])
    return np.mean(travels, axis=0) if travels else np.zeros(3)
