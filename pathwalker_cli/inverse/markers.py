"""The markers of a recording: their place on the walker, gaps in their paths, their direction."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import model_validator
from scipy.interpolate import PchipInterpolator

from pathwalker_cli.conventions import COORDINATES, Condition
from pathwalker_cli.errors import ConfigError, DataError
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid
from pathwalker_cli.io.yaml_file import load_yaml
from pathwalker_cli.model.anthropometry import segments
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import Patient

Offset = Annotated[float, Quantity("m", -1.0, 1.0, *["is it in millimetres?"] * 2)]

LONGEST_GAP: Final = 0.1
"""Longest gap that is bridged by default [s]; about a quarter of a swing phase."""

_SHORTEST_WALK: Final = 0.3
"""Forward travel below which the direction is not certain [m]."""

_LARGEST_DRIFT: Final = 0.35
"""Sideways travel per forward travel above which nobody walks along that axis."""

_IN_PLANE: Final = 1e-6
"""Sideways coordinate below which a marker lies in the plane [m]."""

_LINKS: Final = ("pelvis", "trunk", "thigh_r", "shank_r", "foot_r", "thigh_l", "shank_l", "foot_l")


@dataclass(frozen=True)
class MarkerPoint:
    """A point of the walker that a marker was attached to.

    Args:
        marker: Name of the marker in the recording.
        link: Link it moves with.
        position: Forward and up in the link's frame [m].
        weight: Weight of its squared distance in the fit.
    """

    marker: str
    link: str
    position: tuple[float, float]
    weight: float

    @property
    def name(self) -> str:
        """Marker and link, for tables: "RANK on foot_r"."""
        return f"{self.marker} on {self.link}"


class MarkerEntry(YamlModel):
    """One line of the marker set: a marker, its link, and `at` or `along`."""

    marker: str
    link: str
    at: Annotated[tuple[Offset, Offset], AS_TUPLE] | None = None
    along: Annotated[float, Quantity("", -1.0, 2.0)] | None = None
    weight: Annotated[float, Quantity("", 0.0, 1000.0)] = 1.0

    @model_validator(mode="after")
    def _placed(self) -> MarkerEntry:
        if self.link not in _LINKS:
            raise invalid(f"has marker {self.marker} on '{self.link}'", allowed=", ".join(_LINKS))
        if (self.at is None) == (self.along is None):
            raise invalid(
                f"does not say where {self.marker} sits",
                allowed="either at: [forward, up] in m or along: share of the segment's length",
            )
        return self


class MarkerSet(YamlModel):
    """Marker sets of both conditions."""

    reference_height: Annotated[float, Quantity("m", 0.5, 2.2, above="is it in centimetres?")]
    both: tuple[MarkerEntry, ...]
    barefoot: tuple[MarkerEntry, ...] = ()
    orthosis: tuple[MarkerEntry, ...] = ()


def load_marker_set(path: str | Path | None = None) -> MarkerSet:
    """Read a marker set; the shipped one if no file is given.

    Raises:
        ConfigError: If the file is refused.
    """
    return load_yaml(path or shipped("configs") / "markers.yaml", MarkerSet, ConfigError)


def marker_points(
    marker_set: MarkerSet, patient: Patient, condition: Condition
) -> tuple[MarkerPoint, ...]:
    """Return the points of a patient's walker that the markers were attached to.

    Raises:
        ConfigError: If they are too few to fix all coordinates.
    """
    lengths = {segment.name: segment.length for segment in segments(patient, "barefoot")}
    scale = patient.height / marker_set.reference_height
    entries = [*marker_set.both, *getattr(marker_set, condition)]
    if 2 * len(entries) < len(COORDINATES):
        raise ConfigError(
            f"has {len(entries)} points for {condition}",
            where="marker set",
            allowed=f"at least {len(COORDINATES) // 2}, which fix {len(COORDINATES)} coordinates",
            mend=f"name the markers below both or {condition}",
        )
    return tuple(
        MarkerPoint(entry.marker, entry.link, _position(entry, lengths, scale), entry.weight)
        for entry in entries
    )


def _position(entry: MarkerEntry, lengths: dict[str, float], scale: float) -> tuple[float, float]:
    """Return where a marker sits in its link's frame [m]."""
    if entry.at is not None:
        return entry.at[0] * scale, entry.at[1] * scale
    distance = (entry.along or 0.0) * lengths[entry.link]
    if entry.link.startswith("foot"):
        return distance, 0.0
    return 0.0, distance if entry.link == "trunk" else -distance


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
