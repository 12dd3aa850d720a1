"""Where the joints, feet, neck and head of a walker are in the plane of walking."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from pathwalker_cli.model.walker import Walker

__all__ = ["body_points"]


def body_points(walker: Walker, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return positions of joints, heels, toes, neck and head (x, z) [m].

    Args:
        walker: Who walks.
        q: Generalised coordinates, shape (10,).
    """
    data = walker.model.createData()
    pin.framesForwardKinematics(walker.model, data, np.asarray(q, dtype=float))
    legs = [f"{name}_{s}" for name in ("hip", "knee", "ankle", "heel", "toe") for s in "rl"]
    points = {
        name: data.oMf[walker.model.getFrameId(name)].translation[[0, 2]].copy()
        for name in (*legs, "lumbar", "head")
    }
    points["neck"] = points.pop("head")
    points["head"] = points["neck"] + 0.25 * (points["neck"] - points["lumbar"])
    return points
