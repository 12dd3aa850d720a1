"""What no child does is said of a stride, and nothing of an ordinary one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from helpers import stylised_series
from pathwalker_cli.stride.stride import Stride, stride_of
from pathwalker_cli.stride.unusual import unusual


@pytest.fixture(scope="module")
def stride() -> Stride:
    made = stride_of(stylised_series("barefoot"))
    calm = {side: np.minimum(force, made.walker.weight) for side, force in made.force.items()}
    return replace(made, force=calm)


def test_an_ordinary_walk_is_not_remarked(stride: Stride) -> None:
    assert unusual(stride) == ()


@pytest.mark.parametrize(("coordinate", "degrees"), [("pelvis_tilt", 40.0), ("lumbar", 50.0)])
def test_a_swing_beyond_that_of_children_is_told(
    stride: Stride, coordinate: str, degrees: float
) -> None:
    q = stride.q.copy()
    row = stride.walker.skeleton.index(coordinate)
    q[:, row] = np.deg2rad(degrees) * np.linspace(0.0, 1.0, len(q))
    (told,) = unusual(replace(stride, q=q))
    assert f"by {degrees:.0f} deg in a stride" in told


def test_a_hard_landing_and_running_are_told(stride: Stride) -> None:
    force = {side: 1.9 * stride.walker.weight * np.ones_like(f) for side, f in stride.force.items()}
    (told,) = unusual(replace(stride, force=force))
    assert "1.90 (right) and 1.90 (left) body weights" in told
    stances = dict.fromkeys(("right", "left"), (0.0, 0.4 * stride.duration))
    (told,) = unusual(replace(stride, stances=stances))
    assert told.startswith("the right and left foot is on the ground for less than half")
