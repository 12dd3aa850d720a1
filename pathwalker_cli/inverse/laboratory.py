"""A laboratory's own angles and moments, stored in its file, beside ours: everyone can check us.

Names, signs and units are those of Plug-in Gait: flexion, dorsiflexion and forward tilt positive,
internal moments of extensors and plantarflexors positive.

References:
    Kadaba, Ramakrishnan, Wootten (1990), Journal of Orthopaedic Research 8, 383-392.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from pathwalker_cli.conventions import SIDES, SUFFIX, Side
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.stride.figures.curves import CLINICAL_ANGLE, EXTENSION

ANGLES: Final = ("pelvis", *CLINICAL_ANGLE)
MOMENTS: Final = tuple(EXTENSION)

_PER_KG: Final = 5.0
"""Moment beyond which values are not per kg of body mass [N m]: walking takes up to 3 N m/kg, and
the ankles of a child of 15 kg 10 N m."""

_LOADED: Final = 0.25
"""Share of our peak ankle moment from which the laboratory's model knew the force of a stance."""


@dataclass(frozen=True)
class Difference:
    """What ours minus the laboratory's is over the strides, or measured stances, of a side.

    Args:
        quantity: "knee angle", "knee moment" and so on.
        side: The side.
        unit: "deg" or "N m/kg".
        rms: Root mean square.
        offset: Mean: where a model takes zero, or a joint, to be.
        offset_free: Root mean square around the mean.
    """

    quantity: str
    side: Side
    unit: str
    rms: float
    offset: float
    offset_free: float


def _label(joint: str, side: Side, what: Literal["Angles", "Moment"]) -> str:
    """Return the name of a curve, e.g. LKneeAngles."""
    return f"{side[0].upper()}{joint.capitalize()}{what}"


def angles(trial: Trial) -> dict[str, np.ndarray]:
    """Return our angles under the laboratory's names and signs [rad], shape (n,) each."""
    found = {}
    for side in SIDES:
        for joint in ANGLES:
            name = "pelvis_tilt" if joint == "pelvis" else f"{joint}_{SUFFIX[side]}"
            values = CLINICAL_ANGLE.get(joint, 1.0) * trial.motion[name]
            found[_label(joint, side, "Angles")] = values
    return found


def moments(trial: Trial, body_mass: float) -> dict[str, np.ndarray]:
    """Return our moments under the laboratory's names and signs [N m/kg]; none without torques."""
    if trial.tau is None:
        return {}
    return {
        _label(joint, side, "Moment"):
        EXTENSION[joint] * trial.tau[f"{joint}_{SUFFIX[side]}"] / body_mass
        for side in SIDES
        for joint in MOMENTS
    }  # fmt: skip


def differences(trial: Trial, body_mass: float) -> tuple[Difference, ...]:
    """Return ours minus what the file of a trial stores; nothing of what it does not.

    Angles count over the complete strides of their side, else over all frames; moments over the
    stances that are measured and of which the laboratory's model knew the force too, per
    `body_mass` [kg].
    """
    if trial.walk is None or not trial.walk.stored:
        return ()
    theirs = {name: values[:, 0] for name, values in trial.walk.stored.items()}
    return tuple(_angles(trial, theirs)) + tuple(_moments(trial, theirs, body_mass))


def _angles(trial: Trial, theirs: Mapping[str, np.ndarray]) -> Iterator[Difference]:
    ours = angles(trial)
    for joint in ANGLES:
        for side in SIDES:
            name = _label(joint, side, "Angles")
            if name in theirs:
                spans = [slice(c.start, c.end + 1) for c in trial.cycles if c.side == side]
                off = np.degrees(ours[name] - theirs[name])
                yield from _difference(f"{joint} angle", side, "deg", off, spans or [slice(None)])


def _moments(
    trial: Trial, theirs: Mapping[str, np.ndarray], body_mass: float
) -> Iterator[Difference]:
    ours = moments(trial, body_mass)
    there = ours.keys() & theirs.keys()
    absolute = any(np.nanmax(np.abs(theirs[name]), initial=0.0) > _PER_KG for name in there)
    mass = body_mass if absolute else 1.0
    for side in SIDES:
        ankle = _label("ankle", side, "Moment")
        if ankle not in there:
            continue
        spans = [
            span
            for item in trial.stances
            if item.measured and item.stance.side == side
            for span in [slice(item.stance.strike, item.stance.toe_off)]
            if _peak(theirs[ankle][span]) / mass > _LOADED * _peak(ours[ankle][span])
        ]
        for joint in MOMENTS:
            name = _label(joint, side, "Moment")
            if name in there and spans:
                off = ours[name] - theirs[name] / mass
                yield from _difference(f"{joint} moment", side, "N m/kg", off, spans)


def _peak(values: np.ndarray) -> float:
    """Return the largest of some values, 0 if none is known."""
    return float(np.nanmax(values, initial=0.0))


def _difference(
    quantity: str, side: Side, unit: str, off: np.ndarray, spans: Iterable[slice]
) -> Iterator[Difference]:
    """Yield a difference over some frames, nothing where none of them is known."""
    parts = np.concatenate([off[span] for span in spans])
    known = parts[np.isfinite(parts)]
    if known.size:
        rms = float(np.sqrt(np.mean(known**2)))
        yield Difference(quantity, side, unit, rms, float(known.mean()), float(known.std()))


SHOWN: Final = {"rms": "RMS", "offset": "offset", "offset_free": "RMS without offset"}
"""What a difference holds, in words."""


def laboratory_rows(every: Iterable[Difference]) -> list[tuple[str, tuple[str, ...]]]:
    """Return the differences over several trials, a row a quantity.

    Returns:
        Quantity with unit, and for each of `SHOWN` right and left: root mean squares over the
        trials, and mean offsets.
    """
    rows: dict[str, dict[Side, list[Difference]]] = {}
    for each in every:
        rows.setdefault(f"{each.quantity} [{each.unit}]", {}).setdefault(each.side, []).append(each)
    return [
        (name, tuple(_over(own.get(side, ()), what) for what in SHOWN for side in SIDES))
        for name, own in rows.items()
    ]


def _over(every: Sequence[Difference], what: str) -> str:
    """Return one number over several trials as text, "-" without any."""
    if not every:
        return "-"
    values = np.array([getattr(each, what) for each in every])
    over = values.mean() if what == "offset" else np.sqrt(np.mean(values**2))
    digits = 1 if every[0].unit == "deg" else 2
    return f"{round(float(over), digits) + 0.0:.{digits}f}"  # no -0.0
