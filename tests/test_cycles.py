"""Stances, cycles, steps and ranges from events."""

from __future__ import annotations

import numpy as np
import pytest

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.inverse.cycles import (
    GaitCycle,
    Stance,
    gait_cycles,
    joint_ranges,
    stances,
    step_lengths,
    swings,
    walking_speed,
)
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.trajectory import Trajectory

EVENTS = (
    Event("left", "foot_strike", 10),
    Event("right", "toe_off", 22),
    Event("right", "foot_strike", 60),
    Event("left", "toe_off", 72),
    Event("left", "foot_strike", 110),
    Event("right", "toe_off", 122),
    Event("right", "foot_strike", 160),
)


def test_stances_cycles_and_swings() -> None:
    assert stances(EVENTS) == (Stance("left", 10, 72), Stance("right", 60, 122))
    assert gait_cycles(EVENTS) == (
        GaitCycle("left", 10, 72, 110),
        GaitCycle("right", 60, 122, 160),
    )
    assert swings(EVENTS, "right") == ((22, 60), (122, 160))


def test_missing_toe_off_breaks_stance_and_cycle() -> None:
    events = tuple(event for event in EVENTS if event.frame != 72)
    assert stances(events) == (Stance("right", 60, 122),)
    assert [cycle.side for cycle in gait_cycles(events)] == ["right"]


def test_step_lengths_from_flat_heels() -> None:
    frames = np.arange(200)
    left = np.where(frames < 90, 0.0, 0.7)
    right = np.where(frames < 40, -0.4, np.where(frames < 140, 0.3, 0.99))
    lengths = step_lengths(EVENTS, {"right": right, "left": left}, rate=120.0)
    assert lengths["right"] == pytest.approx((0.3, 0.29))
    assert lengths["left"] == pytest.approx((0.4,))


def test_step_without_flat_foot_is_left_out() -> None:
    heels = {"right": np.zeros(165), "left": np.zeros(165)}
    lengths = step_lengths(EVENTS, heels, rate=120.0)  # type: ignore[arg-type]
    assert len(lengths["right"]) == 1


def test_speed_and_ranges() -> None:
    time = np.arange(170) / 120.0
    values = np.zeros((170, 10))
    values[:, 0] = 0.6 * time
    values[:, 3] = np.linspace(-0.5, 0.4, 170)
    values[0, 3] = -9.0
    units = ("m", "m", *["rad"] * 8)
    motion = Trajectory(time, COORDINATES, values, units)
    assert walking_speed(motion) == pytest.approx(0.6)
    ranges = joint_ranges(((motion, gait_cycles(EVENTS)),))
    assert ranges["hip_r"] == pytest.approx((values[10, 3], values[160, 3]))
    assert tuple(ranges) == COORDINATES[2:]
