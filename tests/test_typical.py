"""Walks of made-up children as starts: how they scale, which one is taken, and what if it fails."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from pydantic import ValidationError

from helpers import stylised_series
from pathwalker_cli.case import load_case
from pathwalker_cli.config.schema import StartConfig
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.typical import TypicalWalk, typical_walks
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.phased import PhasedMotion

COARSE = ("mesh.intervals=12", "mesh.refinements=0")


@pytest.fixture(scope="module")
def stride() -> tuple[Walker, PhasedMotion]:
    """The shipped child barefoot and a stride of it."""
    series = stylised_series("barefoot")
    return series.walker, series.motion


def walk_of(walker: Walker, motion: PhasedMotion) -> TypicalWalk:
    """Return the walk of a walker itself."""
    return TypicalWalk("own", motion, walker.leg_length, walker.weight, walker.max_isometric_torque)


def test_a_walk_is_itself_for_its_own_child(stride: tuple[Walker, PhasedMotion]) -> None:
    walker, motion = stride
    walk = walk_of(walker, motion)
    assert walk.distance(walker) == pytest.approx(0.0)
    for scaled, phase in zip(walk.scaled(walker, np.zeros(0)).phases, motion.phases, strict=True):
        assert scaled.duration == pytest.approx(phase.duration)
        for name in ("states", "inner_states", "algebraic", "controls"):
            assert getattr(scaled, name) == pytest.approx(getattr(phase, name)), name


def test_a_walk_of_a_smaller_child_scales_by_dynamic_similarity(
    stride: tuple[Walker, PhasedMotion],
) -> None:
    walker, motion = stride
    own = walk_of(walker, motion)
    # a child of a quarter of the leg, half the weight, and muscles that just suit that
    small = replace(
        own, leg_length=own.leg_length / 4, weight=own.weight / 2, strengths=own.strengths / 8
    )
    scaled, phase = small.scaled(walker, np.zeros(0)).phases[0], motion.phases[0]
    assert small.distance(walker) == pytest.approx(0.0)
    assert scaled.duration == pytest.approx(2.0 * phase.duration)
    position, angle, speed, turning = 0, 3, 10, 13
    for column, factor in ((position, 4.0), (angle, 1.0), (speed, 2.0), (turning, 0.5)):
        assert scaled.states[:, column] == pytest.approx(factor * phase.states[:, column])
    forces = slice(10, -10)
    assert scaled.algebraic[..., forces] == pytest.approx(2.0 * phase.algebraic[..., forces])
    assert scaled.algebraic[..., 0] == pytest.approx(phase.algebraic[..., 0])
    assert scaled.algebraic[..., 3] == pytest.approx(phase.algebraic[..., 3] / 4.0)
    assert scaled.controls == pytest.approx(phase.controls / 2.0)


def test_the_most_similar_child_comes_first() -> None:
    for problem in ("mapd-barefoot", "mapd-orthosis"):
        walker = GaitSolver(load_case(problem)).walker
        walks = typical_walks(walker)
        distances = [walk.distance(walker) for walk in walks]
        assert len(walks) == 3
        assert distances == sorted(distances)
        assert walks[0].name.startswith("half-9y-points")


def test_a_solve_begins_with_a_typical_walk_and_says_so() -> None:
    quick, slow = (
        GaitSolver(load_case("mapd-healthy", "", (*COARSE, f"start.gait={gait}"))).solve()
        for gait in ("typical", "synthetic")
    )
    assert quick.converged
    assert quick.start == "typical walk strong-6_5y-points-barefoot"
    assert [stage.name for stage in quick.stages] == ["first mesh"]
    assert slow.start == "synthetic"
    assert quick.iterations < slow.iterations


def test_a_walk_that_leads_nowhere_is_left_for_the_synthetic_stride(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(choices, "TYPICAL_PATIENCE", 1)
    solution = GaitSolver(load_case("mapd-healthy", "", COARSE)).solve()
    assert solution.converged
    assert solution.start == "synthetic"
    assert [stage.name for stage in solution.stages] == ["first mesh", "tracking", "first mesh"]


def test_feet_without_a_typical_walk_have_none() -> None:
    case = load_case("mapd-barefoot", "", ("model.feet=rockers", "model.contact=toe"))
    assert typical_walks(GaitSolver(case).walker) == []


def test_the_shape_of_a_synthetic_stride_asks_for_one() -> None:
    assert StartConfig().gait == "typical"
    assert StartConfig.model_validate({"knee_flexion": 0.5}).gait == "synthetic"
    with pytest.raises(ValidationError, match=r"start.knee_flexion, which a typical walk does not"):
        StartConfig.model_validate({"gait": "typical", "knee_flexion": 0.5})
