"""The markers of a recording: their place on the walker, and gaps in their paths.

A set is read from a file or the shipped `configs/markers.yaml`; those of other laboratories, which
are recognised by their names, are in `inverse.marker_sets`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Final

import numpy as np
from pydantic import model_validator
from scipy.interpolate import PchipInterpolator

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Condition
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid
from pathwalker_cli.io.yaml_file import load_yaml
from pathwalker_cli.model.anthropometry import segments
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import Patient

Offset = Annotated[float, Quantity("m", -1.0, 1.0, *["is it in millimetres?"] * 2)]

LONGEST_GAP: Final = 0.1
"""Longest gap that is bridged by default [s]; about a quarter of a swing phase."""

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
    shod = patient.braced(condition) or SIDES
    bare = tuple(f"_{SUFFIX[side]}" for side in SIDES if side not in shod)
    entries = [
        *marker_set.both,
        *(entry for entry in getattr(marker_set, condition) if not entry.link.endswith(bare)),
        *(entry for entry in marker_set.barefoot if entry.link.endswith(bare)),
    ]
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
    """A run of frames in which a marker was not seen, and whether its path was interpolated there.

    `first` is the first frame without it, `frames` their number.
    """

    marker: str
    first: int
    frames: int
    bridged: bool


def bridge_gaps(
    recording: Recording, markers: tuple[str, ...], longest: float = LONGEST_GAP
) -> tuple[Recording, tuple[Gap, ...]]:
    """Interpolate gaps up to a length [s] by monotone cubics; leave those at the ends.

    The recording comes back without them, and with it every gap that there was.
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
                seen = np.flatnonzero(np.isfinite(path[:, 0]))
                curve = PchipInterpolator(seen, path[seen], axis=0)
                positions[rows, recording.markers.index(name)] = curve(rows)
    positions.setflags(write=False)
    return replace(recording, positions=positions), tuple(gaps)


def _runs(missing: np.ndarray) -> list[tuple[int, int]]:
    """Return first frame and length of each run of True."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(int)))
    return [(int(a), int(b - a)) for a, b in zip(edges[::2], edges[1::2], strict=True)]
