"""Typically developing children by speed: the table, its classes, and what lies within it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from pathwalker_cli.conventions import GRAVITY
from pathwalker_cli.evaluation.norms import (
    CLASSES,
    PROFILE,
    norms,
    speed_class,
    within_norms,
)
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.stride.stride import Stride

PUBLISHED = {
    ("free", "angle_knee", 72): (59.1317, 5.8779),
    ("very_slow", "angle_hip", 0): (30.1953, 6.1943),
    ("fast", "angle_ankle", 62): (-22.0458, 8.8855),
    ("slow", "moment_ankle", 50): (1.1291, 0.2137),
}
"""Mean and standard deviation by speed, curve and per cent, Schwartz et al. (2008)."""


@pytest.mark.parametrize("place", PUBLISHED)
def test_the_table_is_the_published_one(place: tuple[str, str, int]) -> None:
    speed, key, percent = place
    norm = norms(speed)[key]
    point = norm.mean[percent // 2], norm.sd[percent // 2]
    assert point == pytest.approx(PUBLISHED[place], rel=1e-3)


def test_every_class_has_every_curve() -> None:
    for name, _ in CLASSES:
        for key, norm in norms(name).items():
            assert norm.mean.shape == norm.sd.shape == (51,), key
            assert (norm.sd > 0.0).all()


def stride(speed: float, shift: float) -> Stride:
    """Return a stride that walks as typical children do at its speed, the knee shifted [deg]."""
    walker = build_walker(load_patient("sreenivasa2017-healthy"))
    count = 101
    q = np.zeros((count, 10))
    q[:, 0] = speed * np.linspace(0.0, 1.0, count)
    bare = Stride("made", walker, np.linspace(0.0, 1.0, count), q,
                  {"right": (0.0, 0.6), "left": (0.0, 0.6)})  # fmt: skip
    typical = norms(speed_class(bare))
    percent = np.linspace(0.0, 100.0, count)
    for joint, sign in (("pelvis_tilt", 1.0), ("hip", -1.0), ("knee", 1.0), ("ankle", -1.0)):
        mean = np.interp(percent, np.linspace(0.0, 100.0, 51), typical[f"angle_{joint}"].mean)
        mean = mean + shift * (joint == "knee")
        for column in [2] if joint == "pelvis_tilt" else _columns(joint):
            q[:, column] = np.deg2rad(sign * mean)
    return replace(bare, q=q)


def _columns(joint: str) -> list[int]:
    first = {"hip": 3, "knee": 4, "ankle": 5}[joint]
    return [first, first + 3]


def test_typical_children_are_within_and_others_are_not() -> None:
    shares = within_norms(stride(1.0, 0.0))
    assert shares == pytest.approx(dict.fromkeys(shares, 1.0))
    assert set(shares) == {"angle_pelvis_tilt", "angle_hip", "angle_knee", "angle_ankle"}
    assert within_norms(stride(1.0, 40.0))["angle_knee"] == 0.0


def test_the_profile_is_how_far_off_and_the_score_their_root_mean_square() -> None:
    made = stride(1.0, 8.0)
    profile = {measure.key: measure.of(made) for measure in PROFILE}
    assert np.degrees(profile["movement_profile_knee_right"]) == pytest.approx(8.0)
    assert profile["movement_profile_hip_left"] == pytest.approx(0.0, abs=1e-9)
    for key in ("gait_profile_score", "gait_profile_score_left"):
        assert np.degrees(profile[key]) == pytest.approx(8.0 / np.sqrt(4.0))
    own = replace(made, side="left", part="stride")
    assert [m.key for m in PROFILE if m.of(own) is None and m.side == "left"] == []
    assert [m.key for m in PROFILE if m.of(own) is not None and m.side == "right"] == []


def test_numbers_over_leg_length_are_those_of_every_size() -> None:
    """A stride of 1 s at the speed whose square is gravity times leg length."""
    leg = build_walker(load_patient("sreenivasa2017-healthy")).leg_length
    made = stride(float(np.sqrt(GRAVITY * leg)), 0.0)
    assert measure_of("normalised_walking_speed").of(made) == pytest.approx(1.0)
    expected = 2.0 * np.sqrt(leg / GRAVITY)
    assert measure_of("normalised_cadence").of(made) == pytest.approx(expected)


@pytest.mark.parametrize(
    ("froude", "name"),
    [(0.1, "very_slow"), (0.3, "slow"), (0.45, "free"), (0.6, "fast"), (0.7, "very_fast")],
)
def test_the_class_follows_the_root_of_the_froude_number(froude: float, name: str) -> None:
    length = build_walker(load_patient("sreenivasa2017-healthy")).leg_length
    assert speed_class(stride(froude * float(np.sqrt(GRAVITY * length)), 0.0)) == name
