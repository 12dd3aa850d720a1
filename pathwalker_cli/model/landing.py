"""How the recorded feet of a child land: the use of a foot with heel and toe that they show.

References:
    Altman AR, Davis IS (2012). A kinematic method for footstrike pattern detection in barefoot and
    shod runners. Gait & Posture 35(2):298-300.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d_events import frames_of
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.model.contact import USES, Use
from pathwalker_cli.model.walker import Walker

_HEEL_FIRST: Final = float(np.deg2rad(8.0))
_TOE_FIRST: Final = float(np.deg2rad(-1.6))
"""Pitch of the sole at foot strike [rad], toe up positive, above which the heel lands first, and
below which the toe does; Altman and Davis (2012)."""

_STANDS: Final = 0.01
"""Height above the toe below which a heel counts as standing [m]: what skin over a marker moves."""

TOE_FIRST: Final = Use(("flat", "toe"), ("toe", "flat"))
"""Lands on the toe, then comes down flat."""


def recorded_use(walker: Walker, side: Side) -> Use:
    """Return how a foot of the walker is used in its recordings.

    The mean pitch of the sole at foot strike tells what lands first; where it is the toe, the heel
    comes down if it does so in most stances.

    Raises:
        DataError: If no recording in the walker's condition shows a stance of this foot.
    """
    strikes, lowest = _stances(walker, side)
    if not strikes:
        raise DataError(
            f"no {walker.condition} recording of patient {walker.patient.id} shows a whole stance "
            f"of the {side} foot, so nothing tells how it lands",
            where="model.contact",
            allowed=", ".join(USES),
            mend="name one of these, or import recordings first: pathwalker import",
        )
    pitch = float(np.mean(strikes))
    if pitch > _HEEL_FIRST:
        return USES["heel_toe"]
    if pitch >= _TOE_FIRST:
        return USES["flat"]
    return TOE_FIRST if np.median(lowest) < _STANDS else USES["toe"]


def _stances(walker: Walker, side: Side) -> tuple[list[float], list[float]]:
    """Return the pitch at strike [rad] and the least height of heel over toe [m] of all stances."""
    patient, condition = walker.patient, walker.condition
    strikes, lowest = [], []
    for name in recording_names(patient, condition):
        recording = read_recording(patient, condition, name)
        for strike, toe_off in frames_of(recording.events, side, "foot_strike", "toe_off"):
            poses = recording.motion.values[strike:toe_off].copy()
            poses[:, :2] = 0.0  # where the pelvis is does not matter, and may not be known
            if np.isfinite(poses).all():
                points = walker.foot_points(poses)[:, 2 * SIDES.index(side) :]
                forward, up = (points[:, 1] - points[:, 0]).T
                strikes.append(float(np.arctan2(up[0], forward[0])))
                lowest.append(float(-up.max()))
    return strikes, lowest
