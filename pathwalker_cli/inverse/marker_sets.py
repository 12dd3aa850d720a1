"""Marker sets that are recognised by their names, and where their markers sit on a patient.

Names say which landmark a marker stands for; where landmarks are comes from the recording as far as
it tells (depth of the pelvis, foot markers around the ankle), else from published regressions.
Markers on the thighs and shanks, on wands in many laboratories, are left out: nothing says how far
before or behind the bone they stand.

References:
    Davis, Ounpuu, Tyburski, Gage (1991), A gait analysis data collection and reduction technique,
    Human Movement Science 10, 575-587: the names of Plug-in Gait.
    Kadaba, Ramakrishnan, Wootten (1990), Journal of Orthopaedic Research 8, 383-392: Helen Hayes.
    Cappozzo, Catani, Della Croce, Leardini (1995), Clinical Biomechanics 10, 171-178: CAST.
    Leboeuf et al. (2019), Gait & Posture 69, 235-241: CGM2.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import SIDES, SUFFIX, Condition, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.joint_centres import Landmark, hip_centre
from pathwalker_cli.inverse.markers import MarkerPoint, load_marker_set
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import FootPoints

_NEEDED: Final[tuple[Landmark, ...]] = ("asis", "psis", "knee", "ankle", "toe")

_FEET: Final[tuple[Landmark, ...]] = ("toe", "heel")

_PLUG_IN_GAIT: Final[Mapping[Landmark, tuple[str, ...]]] = {
    "asis": ("{}ASI",), "psis": ("{}PSI",), "knee": ("{}KNE",), "ankle": ("{}ANK",),
    "toe": ("{}TOE",), "heel": ("{}HEE",), "c7": ("C7",), "clavicle": ("CLAV", "{}CLA"),
}  # fmt: skip

_LANDMARKS: Final[Mapping[str, Mapping[Landmark, tuple[str, ...]]]] = {
    "Plug-in Gait": _PLUG_IN_GAIT,
    "Plug-in Gait with a sacral marker": {**_PLUG_IN_GAIT, "psis": ("SACR",)},
    "CGM2": {**_PLUG_IN_GAIT, "toe": ("{}SMH",)},
    "Helen Hayes": {
        "asis": ("{}.ASIS", "{}ASIS"), "psis": ("V.Sacral", "Sacral", "SACRAL"),
        "knee": ("{}.Knee", "{}.Knee.Lat"), "ankle": ("{}.Ankle", "{}.Ankle.Lat"),
        "toe": ("{}.Toe", "{}.Toe.Tip"), "heel": ("{}.Heel",), "c7": ("C7",), "clavicle": (),
    },
    "Davis": {
        "asis": ("{} asis",), "psis": ("sacrum",), "knee": ("{} knee 1",), "ankle": ("{} mall",),
        "toe": ("{} met",), "heel": ("{} heel",), "c7": ("c7",), "clavicle": (),
    },
    "CAST": {
        "asis": ("{}_IAS", "{}IAS"), "psis": ("{}_IPS", "{}IPS"),
        "knee": ("{}_FLE", "{}LE", "{}_FME"), "ankle": ("{}_FAL", "{}LM", "{}_TAM"),
        "toe": ("{}_FM2", "{}SM", "{}_FM5"), "heel": ("{}_FCC", "{}CA"),
        "c7": ("CV7", "C7"), "clavicle": ("SJN", "SNJ", "CLAV"),
    },
}  # fmt: skip
"""Names by set and landmark, {} for the side's letter; of several names the first that is there."""

_TRUNK: Final[Mapping[Landmark, tuple[float, float]]] = {
    "c7": (-0.0611, 0.2276),
    "clavicle": (0.0306, 0.1781),
}
"""Trunk markers before and above the lumbar joint, in body heights, as in the published model."""

_LEAN: Final = 0.01
"""Weight of the trunk markers: they tell how the trunk leans, and must not lift or push the pelvis
where a trunk is longer than the model's."""

_LEG: Final = 1.1
"""Length of the leg, spine to malleolus, by thigh and shank: 0.9 m for 0.82 m."""

_FLAT: Final = 0.2
"""Share of the frames, those with the lowest foot markers, in which a foot stands flat: half of the
time it does."""

_LEVEL: Final = 0.18
"""Slope of heel to toe marker up to which a foot counts as flat on the ground [rad]; both are put
on at one height."""


FootPlaces = Mapping[tuple[Landmark, Side], tuple[float, float]]
"""Toe and heel markers before and above the ankle of a foot that stands flat [m]."""


@dataclass(frozen=True)
class KnownSet:
    """A marker set that was recognised: marker by landmark and side.

    Markers in the middle stand on both sides.
    """

    name: str
    markers: Mapping[tuple[Landmark, Side], str]

    def middle(self, landmark: Landmark, recording: Recording) -> np.ndarray:
        """Return the middle of both sides' landmarks [m], shape (n, 3)."""
        sides = [recording.marker(self.markers[landmark, side]) for side in SIDES]
        return np.asarray((sides[0] + sides[1]) / 2.0)


def recognised(recording: Recording, where: str) -> KnownSet | None:
    """Return the marker set that a recording shows, None for the shipped one.

    Of sets that are complete, the one with most landmarks counts.  The shipped set, with one marker
    at the front of the pelvis, is that of recordings without the other one, and of those whose
    markers were laid into the walking plane.

    Raises:
        DataError: If no set is complete; the closest is named with what it lacks.
    """
    shipped_set = load_marker_set()
    own = {entry.marker for entry in (*shipped_set.both, *shipped_set.barefoot)}
    has_own = own <= set(recording.markers)
    if has_own and _lies_in_a_plane(recording, sorted(own)):
        return None
    found = [_found(name, recording) for name in _LANDMARKS]
    complete = [known for known in found if not _missing(known)]
    if complete:
        return max(complete, key=lambda known: len(known.markers))
    closest = min(found, key=lambda known: len(_missing(known)))
    if len(own - set(recording.markers)) <= len(_missing(closest)):
        return None
    lacks = ", ".join(_missing(closest))
    raise DataError(
        f"shows no marker set that is known; closest is {closest.name}, which lacks {lacks}",
        where=where,
        allowed=f"{', '.join(_LANDMARKS)}, or the shipped markers.yaml",
        mend="correct the names in the file, or say with --markers where its markers sit",
    )


def _lies_in_a_plane(recording: Recording, names: list[str]) -> bool:
    """Return whether one horizontal coordinate of the markers is zero throughout."""
    positions = np.stack([recording.marker(name) for name in names], axis=1)
    return bool((np.nanmax(np.abs(positions), axis=(0, 1), initial=0.0)[:2] < 1e-6).any())


def _found(name: str, recording: Recording) -> KnownSet:
    """Return a set with the landmarks that a recording shows."""
    there = {label.upper(): label for label in recording.markers}
    markers: dict[tuple[Landmark, Side], str] = {}
    for landmark, names in _LANDMARKS[name].items():
        for side in SIDES:
            labels = [label.format(side[0].upper()).upper() for label in names]
            label = next((there[label] for label in labels if label in there), None)
            if label is not None:
                markers[landmark, side] = label
    return KnownSet(name, markers)


def _missing(known: KnownSet) -> list[str]:
    """Return the names of needed markers that are not there."""
    every = _LANDMARKS[known.name]
    lacking = [
        every[landmark][0].format(side[0].upper())
        for landmark in _NEEDED
        for side in SIDES
        if (landmark, side) not in known.markers
    ]
    return list(dict.fromkeys(lacking))


def set_points(
    known: KnownSet,
    patient: Patient | None = None,
    recording: Recording | None = None,
    condition: Condition = "barefoot",
    feet: FootPlaces | None = None,
) -> tuple[MarkerPoint, ...]:
    """Return where the markers of a known set sit on a patient's walker.

    Args:
        known: The set.
        patient: The patient; without one only the links count, and all places are 0.
        recording: A pass in the walking plane, which tells the depth of the pelvis and where the
            foot markers are around the ankles; without it these are 0.
        condition: What is worn: a shoe that stands flat may hold the foot at a pitch.
        feet: Where the foot markers are, as `foot_places` returns it, if the recording shall not
            tell.
    """
    points: dict[tuple[str, str], MarkerPoint] = {}

    def add(landmark: Landmark, side: Side, link: str, at: tuple[float, float]) -> None:
        marker = known.markers.get((landmark, side))
        if marker is not None:
            points[marker, link] = MarkerPoint(marker, link, at, _LEAN if link == "trunk" else 1.0)

    asis = _spine(patient) if patient else (0.0, 0.0)
    thighs, shanks = ({s: patient.length(n, s) if patient else 0.0 for s in SIDES}
                      for n in ("thigh", "shank"))  # fmt: skip
    height = patient.height if patient else 0.0
    depth = _pelvis_depth(known, recording) if recording else 0.0
    if recording and not feet:
        feet = foot_places(known, recording)
    for side in SIDES:
        add("asis", side, "pelvis", asis)
        add("psis", side, "pelvis", (asis[0] - depth, asis[1]))
        suffix = SUFFIX[side]
        add("knee", side, f"thigh_{suffix}", (0.0, -thighs[side]))
        add("ankle", side, f"shank_{suffix}", (0.0, -shanks[side]))
        add("ankle", side, f"foot_{suffix}", (0.0, 0.0))
        for landmark in _FEET:
            at = (feet or {}).get((landmark, side), (0.0, 0.0))
            if patient:
                at = _pitched(at, patient.contacts(condition)[side])
            add(landmark, side, f"foot_{suffix}", at)
    for landmark, (forward, up) in _TRUNK.items():
        for side in SIDES:
            add(landmark, side, "trunk", (forward * height, up * height))
    return tuple(points.values())


def _pitched(at: tuple[float, float], sole: FootPoints) -> tuple[float, float]:
    """Return a place around the ankle of a foot that stands flat [m] in the frame of the foot."""
    pitch = np.arctan2(sole.toe[1] - sole.heel[1], sole.toe[0] - sole.heel[0])
    cos, sin = np.cos(pitch), np.sin(pitch)
    return float(cos * at[0] - sin * at[1]), float(sin * at[0] + cos * at[1])


def leg_length(patient: Patient) -> float:
    """Return the length of a leg from spine to malleolus [m], both sides' mean."""
    return _LEG * sum(patient.length(n, s) for n in ("thigh", "shank") for s in SIDES) / 2.0


def _spine(patient: Patient) -> tuple[float, float]:
    """Return where the anterior spines are before and above the pelvis origin [m]."""
    behind, _, below = hip_centre(leg_length(patient))
    return behind, below - patient.length("hip_drop", "right")


def _pelvis_depth(known: KnownSet, recording: Recording) -> float:
    """Return the distance between front and back of the pelvis [m]."""
    apart = known.middle("asis", recording) - known.middle("psis", recording)
    _require_seen(np.isfinite(apart[:, 0]), "both ends of the pelvis", recording)
    return float(np.nanmedian(np.linalg.norm(apart, axis=1)))


def _require_seen(frames: np.ndarray, what: str, recording: Recording) -> None:
    """Refuse a recording in which no frame shows what is measured."""
    if not frames.any():
        raise DataError(
            f"shows {what} in no frame at once",
            where=recording.name,
            mend="label the markers, or say with --markers where they sit",
        )


def foot_places(known: KnownSet, recording: Recording) -> FootPlaces:
    """Return toe and heel markers before and above the ankle of a foot that stands flat [m].

    Of a foot that never does, heel and toe marker are taken to be at one height; without a heel
    marker, the toe marker is as high beside the ankle as on the foot whose ankle comes lowest.
    """
    places: dict[tuple[Landmark, Side], np.ndarray] = {}
    ankles: dict[Side, float] = {}
    for side in SIDES:
        labels = {
            n: known.markers[n, side] for n in ("ankle", *_FEET) if (n, side) in known.markers
        }
        paths = {name: recording.marker(label)[:, [0, 2]] for name, label in labels.items()}
        seen = np.isfinite(np.hstack([*paths.values()])).all(axis=1)
        _require_seen(seen, f"all markers of the {side} foot", recording)
        parts = {name: path[seen] for name, path in paths.items()}
        ankle = parts.pop("ankle") if "heel" in parts else parts["ankle"]
        up = np.sum([part[:, 1] for part in parts.values()], axis=0)
        low = up <= np.quantile(up, _FLAT)
        ankles[side] = float(np.median(ankle[low, 1]))
        own = {n: np.median((p - ankle)[low], axis=0) for n, p in parts.items() if n != "ankle"}
        if "heel" in own:
            line = own["toe"] - own["heel"]
            slope = float(np.arctan2(line[1], line[0]))
            turn = np.array([[np.cos(slope), np.sin(slope)], [-np.sin(slope), np.cos(slope)]])
            own = {name: turn @ at if abs(slope) > _LEVEL else at for name, at in own.items()}
        places |= {(name, side): at for name, at in own.items()}
    lower = min(SIDES, key=lambda side: ankles[side])
    for name, side in list(places):
        if ("heel", side) not in places:
            places[name, side] = np.array([places[name, side][0], places[name, lower][1]])
    return {key: (float(x), float(z)) for key, (x, z) in places.items()}
