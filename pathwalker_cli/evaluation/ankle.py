"""The net torque-angle profile of the ankle over stance and its mean slope."""

from __future__ import annotations

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SUFFIX, Side
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.inverse.cycles import POINTS
from pathwalker_cli.inverse.strengths import stance_curves

__all__ = ["ankle_line", "ankle_profile", "recorded_ankle_profiles"]


def ankle_profile(gait: Gait, side: Side, points: int = POINTS) -> np.ndarray | None:
    """Return dorsiflexion [rad] and net plantarflexing torque [N m] over stance, (points, 2).

    The torque is that of muscles and orthosis together, as inverse dynamics cannot tell them
    apart.  None if the torques of the gait are not known.
    """
    if gait.net_torque is None:
        return None
    ankle = COORDINATES.index(f"ankle_{SUFFIX[side]}")
    columns = np.stack([-gait.q[:, ankle], gait.net_torque[:, ankle]], axis=1)
    return gait.over_stance(columns, side, points)


def recorded_ankle_profiles(recorded: RecordedGait, side: Side) -> np.ndarray:
    """Return the profiles of all measured stances of a side, shape (stances, POINTS, 2).

    Angle and torque are those of inverse dynamics, filtered alike.
    """
    curves = stance_curves(recorded.trials).get(f"ankle_{SUFFIX[side]}", [])
    if not curves:
        return np.empty((0, POINTS, 2))
    return np.stack([np.stack([-curve[:, 1], curve[:, 0]], axis=1) for curve in curves])


def ankle_line(profile: np.ndarray) -> tuple[float, float]:
    """Return slope [N m/rad] and torque at zero angle [N m] of the line through a profile.

    The least-squares line of torque over dorsiflexion, every per cent of stance counting alike.
    Positive like a spring that resists dorsiflexion.

    Args:
        profile: Dorsiflexion [rad] and torque [N m], shape (POINTS, 2).
    """
    slope, offset = np.polyfit(profile[:, 0], profile[:, 1], 1)
    return float(slope), float(offset)
