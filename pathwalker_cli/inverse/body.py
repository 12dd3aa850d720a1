"""The body of a person from one recording: a pose or a walk, and what the file says of them.

References:
    Davis et al. (1991): hip joint centres, as in `marker_sets`.
    Gordon et al. (1989), Anthropometric Survey of US Army Personnel: height of the seventh cervical
    vertebra, 0.865 of the standing height.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.conventions import GRAVITY, SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.joint_centres import LEFTWARD, beside_joint, hip_centre
from pathwalker_cli.inverse.marker_sets import KnownSet, foot_places, recognised, set_points
from pathwalker_cli.inverse.walk import about_vertical, turned, upright
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_checks import check_markers, readable_recording
from pathwalker_cli.patient.proportions import ANKLE_HEIGHT

_MASS: Final = ("bodymass", "mass", "weight")
_HEIGHT: Final = ("height", "bodyheight")
_CERVICAL: Final = 0.865
_HEIGHTS: Final = (0.5, 2.2)
"""Standing heights that are read as such [m]; a file may hold them in mm or cm."""
_CHILD: Final = 1.4
"""Height by which units are judged as long as nothing is known [m]; they are off by 10 or 1000."""
_WIDTHS: Final = (0.08, 0.45)
"""Distances of the front spines that can be [m]."""
_ANKLES: Final = (0.02, 0.13)
"""Heights of an ankle marker over the floor that can be [m]; otherwise z = 0 is not the floor."""
_ANKLE: Final = 0.06
"""Height of an ankle of a body of unknown height [m]: that of 1.5 m."""
_STILL: Final = 0.05
"""Standard deviation of the load on all plates, as a share of it, up to which somebody stands there
and does not walk: walks give 0.47 or more."""
_LIGHTEST: Final = 5.0
"""Body mass below which plates carry something else [kg]."""
_TO_TOE: Final = 0.78
"""Ankle to toe marker as a share of heel to toe marker: 0.67 to 0.87 on eight feet in four public
recordings that have heel markers."""
_TO_HEEL: Final = 0.28
"""Heel marker behind the ankle as a share of the toe marker before it: 0.19 to 0.53 on these."""
_LOWEST: Final = 0.1
"""Quantile of the height of an ankle at which its foot stands flat."""

Sole = Mapping[str, tuple[float, float]]


@dataclass(frozen=True)
class Body:
    """What a recording tells of a person.

    Args:
        mass: Body mass [kg], None if it is not known.
        height: Standing height [m], None if it is not known.
        lengths: Thigh, shank and foot (heel to toe marker), right and left [m].
        soles: Per side, heel and toe [forward, up] of the ankle, on the ground [m].
        sources: Where each number comes from, a line each.
    """

    mass: float | None
    height: float | None
    lengths: Mapping[str, tuple[float, float]]
    soles: Mapping[Side, Sole]
    sources: tuple[str, ...]


def measured_body(
    path: Path, mass: float | None = None, height: float | None = None, subject: str | None = None
) -> Body:
    """Return what a recording tells of a person.

    Args:
        path: A C3D file with a marker set that is recognised: a pose, else a walk.
        mass: Body mass [kg], if it is known better.
        height: Standing height [m], if it is known better.
        subject: Whose markers, if the file names several.

    Raises:
        DataError: If the file cannot be read, or its markers are not known.
    """
    recording = readable_recording(path, subject)
    known = recognised(recording, str(path))
    if known is None:
        raise DataError(
            "lacks a marker on one of the front spines of the pelvis",
            where=str(path),
            allowed="LASI and RASI, or their names in other marker sets",
            mend="use init without --from and measure lengths by tape",
        )
    check_markers(recording, [*known.markers.values()], height or _CHILD, path)
    recording = facing(recording, known)
    sources: list[str] = []
    mass = _told(recording, _MASS, mass, "body mass", sources)
    if mass is None:
        mass = _weighed(recording, sources)
    height = _told(recording, _HEIGHT, height, "height", sources)
    hips = _hips(recording, known)
    lengths = _lengths(recording, known, hips, height or _CHILD)
    if height is None:
        height = _from_neck(recording, known, hips, lengths, sources)
    name = recording.name
    sources += [
        f"thigh, shank: {name}, hip joint centres by Davis et al. (1991)",
        f"foot, contact points: {name}, markers around the ankle of a flat foot",
    ]
    return Body(mass, height, lengths, _soles(recording, known, height), tuple(sources))


def facing(recording: Recording, known: KnownSet) -> Recording:
    """Return a recording with z up and x to where the pelvis faces."""
    front, back = known.middle("asis", recording), known.middle("psis", recording)
    if not np.isfinite(front - back).any():
        raise DataError("never shows the whole pelvis", where=recording.name)
    recording = upright(recording, set_points(known))
    ahead = known.middle("asis", recording) - known.middle("psis", recording)
    return turned(recording, about_vertical(np.nanmean(ahead, axis=0)[:2]))


def _told(
    recording: Recording, names: tuple[str, ...], value: float | None, what: str, sources: list[str]
) -> float | None:
    """Return a number that was given, else the one of the file; note where it comes from."""
    if value is not None:
        sources.append(f"{what}: as given")
        return value
    for name, number in recording.numbers.items():
        if name.lower().replace(" ", "").replace("_", "") in names and number > 0.0:
            if what == "height":  # in m, cm or mm
                heights = (round(scale * number, 3) for scale in (1.0, 0.01, 0.001))
                number = next((h for h in heights if _HEIGHTS[0] <= h <= _HEIGHTS[1]), 0.0)
            if number:
                sources.append(f"{what}: PROCESSING:{name} of {recording.name}")
                return number
    return None


def _weighed(recording: Recording, sources: list[str]) -> float | None:
    """Return the mass that the plates carry in a pose, None if nobody stands on them [kg]."""
    if not recording.plates:
        return None
    up = np.abs(np.sum([plate.force[:, 2] for plate in recording.plates], axis=0))
    mean, spread = float(np.median(up)), float(np.std(up))
    if mean < _LIGHTEST * GRAVITY or spread > _STILL * mean:
        return None
    sources.append(f"body mass: what the plates carry in {recording.name}")
    return round(mean / GRAVITY, 1)


def _from_neck(
    recording: Recording,
    known: KnownSet,
    hips: Mapping[Side, np.ndarray],
    lengths: Mapping[str, tuple[float, float]],
    sources: list[str],
) -> float | None:
    """Return the height that belongs to the seventh cervical vertebra, None without it [m].

    Trunk and legs are laid end to end, so that it does not matter how far the knees bend.
    """
    marker = known.markers.get(("c7", "right"))
    if marker is None:
        return None
    trunk = _apart(recording.marker(marker), (hips["right"] + hips["left"]) / 2.0)
    legs = (sum(lengths["thigh"]) + sum(lengths["shank"])) / len(SIDES)
    ankle = sum(_ankle_height(recording, known, side, None) for side in SIDES) / len(SIDES)
    height = (trunk + legs + ankle) / _CERVICAL
    if not _HEIGHTS[0] <= height <= _HEIGHTS[1]:
        return None
    sources.append(
        f"height: {marker} of {recording.name} above straight legs, {_CERVICAL:g} of it "
        "(Gordon et al. 1989)"
    )
    return round(height, 3)


def _hips(recording: Recording, known: KnownSet) -> dict[Side, np.ndarray]:
    """Return the hip joint centres [m], shape (n, 3) each."""
    front, back = known.middle("asis", recording), known.middle("psis", recording)
    spines = {side: recording.marker(known.markers["asis", side]) for side in SIDES}
    ahead = _unit(front - back)
    left = spines["left"] - spines["right"]
    left = left - (left * ahead).sum(axis=1, keepdims=True) * ahead
    width = _apart(left, np.zeros(3))
    if not _WIDTHS[0] <= width <= _WIDTHS[1]:
        raise DataError(
            f"has front spines of the pelvis {width:.2f} m apart",
            where=recording.name,
            allowed=f"{_WIDTHS[0]} to {_WIDTHS[1]} m",
            mend="check the pelvis' markers; those laid into a plane tell no lengths",
        )
    left = _unit(left)
    up = np.cross(ahead, left)
    hips = {}
    for side, spine in spines.items():
        knee, ankle = (recording.marker(known.markers[n, side]) for n in ("knee", "ankle"))
        behind, aside, below = hip_centre(_apart(spine, knee) + _apart(knee, ankle), width)
        hips[side] = front - behind * ahead + LEFTWARD[side] * aside * left - below * up
    return hips


def _lengths(
    recording: Recording, known: KnownSet, hips: Mapping[Side, np.ndarray], body_height: float
) -> dict[str, tuple[float, float]]:
    """Return the lengths of both sides [m], medians over the frames."""
    every: dict[str, list[float]] = {"thigh": [], "shank": [], "foot": []}
    for side, hip in hips.items():
        knee, ankle, toe = (
            recording.marker(known.markers[n, side]) for n in ("knee", "ankle", "toe")
        )
        heel = known.markers.get(("heel", side))
        beside = beside_joint("knee", side, body_height, recording.numbers)
        every["thigh"].append(round(float(np.sqrt(_apart(hip, knee) ** 2 - beside**2)), 3))
        every["shank"].append(_apart(knee, ankle))
        foot = _apart(recording.marker(heel), toe) if heel else _apart(ankle, toe) / _TO_TOE
        every["foot"].append(round(foot, 3))
    lost = [name for name, values in every.items() if not np.isfinite(values).all()]
    if lost:
        raise DataError(f"never shows both ends of the {lost[0]} at once", where=recording.name)
    return {name: (values[0], values[1]) for name, values in every.items()}


def _soles(
    recording: Recording, known: KnownSet, height: float | None
) -> dict[Side, dict[str, tuple[float, float]]]:
    """Return where heel and toe of both feet touch the ground, from the ankle [m]."""
    places = foot_places(known, recording)
    soles: dict[Side, dict[str, tuple[float, float]]] = {}
    for side in SIDES:
        ankle = _ankle_height(recording, known, side, height)
        toe = places["toe", side][0]
        heel = places.get(("heel", side), (-_TO_HEEL * toe, 0.0))[0]
        soles[side] = {"heel": (round(heel, 3), -round(ankle, 3)),
                       "toe": (round(toe, 3), -round(ankle, 3))}  # fmt: skip
    return soles


def _ankle_height(recording: Recording, known: KnownSet, side: Side, height: float | None) -> float:
    """Return how high an ankle is over its sole [m]; by the height where z = 0 is no floor."""
    ankle = float(np.nanquantile(recording.marker(known.markers["ankle", side])[:, 2], _LOWEST))
    if _ANKLES[0] <= ankle <= _ANKLES[1]:
        return ankle
    return ANKLE_HEIGHT * height if height else _ANKLE


def _apart(one: np.ndarray, other: np.ndarray) -> float:
    """Return the median distance of two paths (n, 3) [m], to the millimetre."""
    return round(float(np.nanmedian(np.linalg.norm(one - other, axis=1))), 3)


def _unit(vectors: np.ndarray) -> np.ndarray:
    """Return vectors (n, 3) of length one."""
    return np.asarray(vectors / np.linalg.norm(vectors, axis=1, keepdims=True))
