"""Where feet touch the ground, from numeric Pinocchio alone: the second opinion on contacts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from pathwalker_cli.model.contact import POINTS
from pathwalker_cli.model.walker import Walker


@dataclass(frozen=True)
class Touched:
    """Where one contact touches the ground, or would.

    Args:
        frame: Number of a frame of the foot.
        arm: From that frame to the place, in world axes [m], shape (3,).
        position: The place [m], shape (3,).
    """

    frame: int
    arm: np.ndarray
    position: np.ndarray


def touched(walker: Walker, data: pin.Data) -> list[Touched]:
    """Return the contacts in the order of `walker.pattern.points`; frames are placed in `data`.

    Points touch where they are, circles below their centres, soles where the softest of maxima of
    their ends lies lowest (docs/theory.md).
    """
    points = walker.parts.frames
    frames = [walker.model.getFrameId(point.name) for point in points]
    at = [np.array(data.oMf[frame].translation) for frame in frames]
    radii = np.array(walker.shapes[: len(points)] or [0.0] * len(points))
    upright = np.array([0.0, 0.0, 1.0])
    low = [
        place + radius * (np.array(data.oMf[frame].rotation)[:, 2] - upright)
        for frame, place, radius in zip(frames, at, radii, strict=True)
    ]
    alone = [
        Touched(frame, lowest - place, lowest)
        for frame, place, lowest in zip(frames, at, low, strict=True)
    ]
    if not walker.parts.soles:
        return alone
    found = []
    for (i, j), roundness in zip(((0, 1), (2, 3)), walker.shapes[len(points) :], strict=True):
        sharpness = 4.0 * roundness / float(np.linalg.norm(at[j] - at[i]))
        tilt = sharpness * (low[i][2] - low[j][2]) / 2.0
        place = (low[i] + low[j] + np.tanh(tilt) * (low[j] - low[i])) / 2.0
        place[2] = (low[i][2] + low[j][2]) / 2.0 - np.log(np.cosh(tilt)) / sharpness
        found.append(Touched(frames[i], place - at[i], place))
    return found + alone[len(POINTS) :]
