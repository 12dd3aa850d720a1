"""Reserve actuators: help for a solve that fails, and what a patient too weak to walk lacks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from helpers import stylised_series, walker_of
from pathwalker_cli.case import load_case
from pathwalker_cli.config import MeshConfig, load_config
from pathwalker_cli.conventions import COORDINATES, GENERATORS
from pathwalker_cli.gait import mesh as meshing
from pathwalker_cli.gait.bounds import gait_bounds, helped_bounds
from pathwalker_cli.gait.solution import (
    TOO_WEAK,
    GaitSolution,
    MissingTorque,
    Shortfall,
    missing_torques,
)
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.skeleton import PLANAR_WALKER
from pathwalker_cli.results.text import failure_text, shortfall_text


def test_help_counts_for_the_muscle_that_pulls_its_way_and_small_help_does_not() -> None:
    series = stylised_series("barefoot")
    reserve = np.zeros_like(series.reserve)
    knee, ankle = COORDINATES.index("knee_r"), COORDINATES.index("ankle_l")
    extension = next(g for g in series.walker.muscles if g.name == "knee_extension_r")
    reserve[10, knee] = 6.0 * extension.torque_sign
    strength = series.walker.max_isometric_torque[GENERATORS.index("ankle_flexion_l")]
    flexion = next(g for g in series.walker.muscles if g.name == "ankle_flexion_l")
    reserve[20, ankle] = 0.009 * strength * flexion.torque_sign
    (missing,) = missing_torques(replace(series, reserve=reserve))
    assert missing.generator == "knee_extension_r"
    assert missing.torque == 6.0
    assert missing.strength == series.walker.max_isometric_torque[2]
    assert missing.percent == pytest.approx(100 * series.time[10] / series.time[-1])


def test_joints_are_helped_and_the_pelvis_is_not() -> None:
    config = load_config("mapd-barefoot")
    bounds = gait_bounds(walker_of("barefoot"), config.bounds)
    table = helped_bounds(PLANAR_WALKER, bounds)
    free = [name for name in COORDINATES if table.entries[(f"{name}_reserve",)] != (0.0, 0.0)]
    assert free == list(COORDINATES[3:])
    other = {key: pair for key, pair in table.entries.items() if "_reserve" not in key[0]}
    assert all(bounds.table.entries[key] == pair for key, pair in other.items())


@pytest.mark.parametrize(
    ("shortfall", "text"),
    [
        (Shortfall(False), "not even muscles of any strength"),
        (Shortfall(True), "the muscles are strong enough"),
        (
            Shortfall(True, (MissingTorque("ankle_extension_l", 4.83, 20.0, 43.2),)),
            "is left ankle extension 4.8 N m beyond its 20.0 N m, at 43 % of the stride",
        ),
        (
            Shortfall(True, (MissingTorque("lumbar_flexion", 4.83, 20.0, 43.2),) * 5),
            "lumbar flexion 4.8 N m beyond its 20.0 N m, at 43 % of the stride; of 2 others",
        ),
    ],
)
def test_a_shortfall_is_told_in_words(shortfall: Shortfall, text: str) -> None:
    assert text in shortfall_text(shortfall)


def test_who_is_too_weak_is_told_what_is_lacking_and_no_violations(
    made_solution: Callable[..., GaitSolution],
) -> None:
    lacking = Shortfall(True, (MissingTorque("hip_extension_r", 4.83, 20.0, 43.2),))
    sentence = failure_text(made_solution(status=TOO_WEAK, shortfall=lacking), "runs/weak")
    assert "too weak" in sentence
    assert "right hip extension 4.8 N m" in sentence
    assert "violations" not in sentence
    sentence = failure_text(made_solution(status="stalled", shortfall=Shortfall(False)), "runs/x")
    assert "any strength" in sentence
    assert "constraints" in sentence or "violations" in sentence


def test_a_patient_too_weak_to_walk_is_a_result() -> None:
    coarse = {"mesh.intervals": 16, "mesh.refinements": 0, "solver.max_iterations": 100}
    weak = {"variation.scale": {"strengths": 0.15}}
    solution = GaitSolver(load_case("mapd-barefoot").with_values(coarse | weak)).solve()
    names = [stage.name for stage in solution.stages]
    tracked = ["tracking", "first mesh", "helped", "first mesh again", "least help"]
    assert names == ["first mesh", *tracked]
    assert solution.status == TOO_WEAK
    assert solution.shortfall is not None
    for missing in solution.shortfall.missing:
        assert missing.torque > 0.01 * missing.strength
    worst = {missing.generator for missing in solution.shortfall.missing[:6]}
    assert any("ankle" in name for name in worst)


def test_bounds_that_contradict_each_other_are_not_blamed_on_muscles() -> None:
    coarse = {"mesh.intervals": 16, "mesh.refinements": 0, "solver.max_iterations": 20}
    stiff = {"bounds.joint_ranges": {"knee_r": [0.3, 0.31], "hip_r": [-0.31, -0.3]}}
    solution = GaitSolver(load_case("mapd-barefoot").with_values(coarse | stiff)).solve()
    assert solution.shortfall == Shortfall(within_bounds=False)
    assert solution.status != TOO_WEAK


def test_late_rounds_split_what_just_met_the_tolerance() -> None:
    meshes = (np.linspace(0.0, 1.0, 5),)
    errors = meshing.Reintegration((np.array([0.0, 5e-4, 1e-4, 2e-3]),), (np.zeros(4),))
    cheap = (np.zeros(4, bool),)
    early, late = (meshing.refined(meshes, errors, cheap, MeshConfig(), s)[0] for s in (1.0, 0.3))
    assert len(late) > len(early)
    assert 0.375 in late
    assert 0.375 not in early
