"""Inverse dynamics, residuals and strengths: identities, and the published tables."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli.conventions import COORDINATES, GRAVITY, Condition
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.bands import cycle_band, resampled
from pathwalker_cli.inverse.cycles import GaitCycle, Stance
from pathwalker_cli.inverse.dynamics import inverse_dynamics
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.process import process_trial
from pathwalker_cli.inverse.published import TURNED, forward_difference, published_torques
from pathwalker_cli.inverse.published_tables import (
    AVERAGED_TRIALS,
    PublishedTrial,
    published_residuals,
    published_strengths,
)
from pathwalker_cli.inverse.residuals import residual_range, residuals
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.inverse.strengths import (
    Peak,
    isometric_torque,
    stance_curves,
    strengths,
    strengths_of,
)
from pathwalker_cli.io.c3d import read_c3d
from pathwalker_cli.model.elements.muscle import generators
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient
from pathwalker_cli.trajectory import Trajectory

SHARED = Path(__file__).parents[2] / "shared"
needs_shared = pytest.mark.skipif(
    not (SHARED / "published").is_dir(), reason="needs shared/published beside the checkout"
)
NOTHING = {"right": np.zeros((1, 2)), "left": np.zeros((1, 2))}
NOWHERE = {"right": np.full(1, np.nan), "left": np.full(1, np.nan)}


@cache
def walker(condition: Condition = "barefoot", published: bool = False) -> pin.Model:
    """Return the shipped patient's model."""
    return pinocchio_model(load_patient("sreenivasa2017-patient"), condition, published)


def states(count: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return random q, v and vdot."""
    return tuple(np.random.default_rng(5).normal(size=(3, count, 10)) * 0.4)  # type: ignore[return-value]


def test_free_fall_needs_no_force() -> None:
    q, v, _ = states()
    vdot = np.zeros((1, 10))
    vdot[0, 1] = -GRAVITY
    tau = inverse_dynamics(walker(), q, 0.0 * v, vdot, NOTHING, NOWHERE)  # type: ignore[arg-type]
    assert tau == pytest.approx(0.0, abs=1e-9)


def test_inverse_of_forward_dynamics() -> None:
    model = walker()
    q, v, _ = states()
    tau = np.random.default_rng(6).normal(size=10)
    vdot = pin.aba(model, model.createData(), q[0], v[0], tau)[None]
    found = inverse_dynamics(model, q, v, vdot, NOTHING, NOWHERE)  # type: ignore[arg-type]
    assert found[0] == pytest.approx(tau, abs=1e-9)


def test_force_acts_by_the_jacobian_of_its_point() -> None:
    model = walker()
    q, v, vdot = states()
    force, centre = np.array([30.0, 200.0]), 0.12
    forces = NOTHING | {"left": force[None]}
    bare = inverse_dynamics(model, q, v, vdot, NOTHING, NOWHERE)  # type: ignore[arg-type]
    found = inverse_dynamics(model, q, v, vdot, forces, {**NOWHERE, "left": np.array([centre])})  # type: ignore[arg-type]
    data = model.createData()
    pin.computeJointJacobians(model, data, q[0])
    foot = model.getJointId("ankle_l")
    jacobian = pin.getJointJacobian(model, data, foot, pin.ReferenceFrame.WORLD)
    wrench = np.array([force[0], 0.0, force[1], 0.0, -centre * force[1], 0.0])
    assert bare[0] - found[0] == pytest.approx(jacobian.T @ wrench, abs=1e-9)


def test_weight_under_the_centre_of_mass_leaves_no_residual() -> None:
    model = walker()
    q = np.zeros((1, 10))
    data = model.createData()
    centre = pin.centerOfMass(model, data, q[0])[0]
    weight = GRAVITY * pin.computeTotalMass(model)
    forces = NOTHING | {"right": np.array([[0.0, weight]])}
    still = np.zeros((1, 10))
    tau = inverse_dynamics(model, q, still, still, forces, {**NOWHERE, "right": np.array([centre])})  # type: ignore[arg-type]
    assert tau[0, :3] == pytest.approx(0.0, abs=1e-9)


def test_unknown_force_leaves_the_other_leg_alone() -> None:
    model = walker()
    q, v, vdot = states()
    forces = {"right": np.array([[5.0, 150.0]]), "left": np.full((1, 2), np.nan)}
    tau = inverse_dynamics(model, q, v, vdot, forces, {**NOWHERE, "right": np.array([0.1])})  # type: ignore[arg-type]
    assert np.isnan(tau[0, [0, 1, 2, 6, 7, 8]]).all()
    assert np.isfinite(tau[0, [3, 4, 5, 9]]).all()
    found = residuals("trial", tau)
    assert found.frames == 0


def test_residual_statistics() -> None:
    tau = np.zeros((4, 10))
    tau[:, 1] = [2.0, 4.0, np.nan, 100.0]
    one = residuals("a", tau, np.arange(3))
    assert (one.mean[1], one.frames) == (3.0, 2)
    assert one.rms[1] == pytest.approx(np.sqrt(10.0))
    two = residuals("b", np.ones((2, 10)))
    both = residual_range((one, two, residuals("c", np.full((1, 10), np.nan))), per=2.0)
    assert (both.lowest[1], both.mean[1], both.highest[1]) == (0.5, 1.0, 1.5)


def test_isometric_torque_inverts_the_muscle() -> None:
    for generator in generators():
        q, v = 0.3 * generator.angle_sign, -0.4 * generator.torque_sign
        torque = generator.torque_sign * float(generator.torque(q, v, 0.9, 25.0))
        assert isometric_torque(generator, torque, q, v) == pytest.approx(25.0)


def test_flexion_and_trunk_follow_from_extension() -> None:
    """Table 1 of the article from its extension strengths alone."""
    extension = {
        "hip_extension_r": 18.63684, "hip_extension_l": 30.35641, "knee_extension_r": 22.39998,
        "knee_extension_l": 24.55091, "ankle_extension_r": 32.32569, "ankle_extension_l": 16.84245,
    }  # fmt: skip
    peaks = tuple(Peak(name, 1.0, 0.0, 0.0, value, 1) for name, value in extension.items())
    found = np.array(strengths_of(peaks).vector())
    published = load_patient("sreenivasa2017-patient").max_isometric_torque
    assert found == pytest.approx(np.array(published), abs=2e-5)
    with pytest.raises(DataError, match="no measured stance shows ankle_extension_l"):
        strengths_of(peaks[:-1])


def test_cut_off_of_the_motion_reaches_the_stance_curves() -> None:
    time = np.arange(240) / 120.0
    fast = np.sin(2.0 * np.pi * 15.0 * time)[:, None]
    motion = Trajectory(time, COORDINATES, np.tile(fast, 10), ("m", "m", *["rad"] * 8))
    known = StanceForce(Stance("right", 60, 180), 0, "")
    trial = StudyTrial("made", "barefoot", motion, (), (), tau=motion, stances=(known,))
    smooth, kept = (stance_curves([trial], cutoff)["hip_r"][0][:, 2] for cutoff in (4.0, 50.0))
    assert np.abs(smooth).max() < 0.5
    assert np.abs(kept).max() == pytest.approx(2.0 * np.pi * 15.0, rel=0.05)
    unmeasured = replace(trial, stances=(replace(known, reason="no plate below the foot"),))
    assert stance_curves([unmeasured]) == {}


def test_resampled_keeps_lines() -> None:
    columns = np.stack([np.arange(7.0), np.ones(7)], axis=1)
    assert resampled(columns)[[0, 50, 100]] == pytest.approx(np.array([[0, 1], [3, 1], [6, 1]]))


def test_band_over_cycles_leaves_out_what_is_not_measured() -> None:
    time = np.arange(21) / 10.0
    values = np.stack([time, np.full(21, 2.0)], axis=1)
    holed = values + 1.0
    holed[:, 1] = np.nan
    cycles = (GaitCycle("left", 0, 6, 10), GaitCycle("right", 5, 11, 15))
    trials = [
        (Trajectory(time, ("a", "b"), part, ("rad", "N")), cycles) for part in (values, holed)
    ]
    band = cycle_band(trials, "left")
    assert band.mean[[0, 100]] == pytest.approx(np.array([[0.5, 2.0], [1.5, 2.0]]))
    assert band.deviation[50] == pytest.approx([0.5, 0.0])
    assert (band.lowest[0, 0], band.highest[0, 0]) == (0.0, 1.0)
    assert band.count[0].tolist() == [2, 1]
    with pytest.raises(DataError, match="no complete gait cycle of the right"):
        cycle_band([(trials[0][0], cycles[:1])], "right")


def test_forward_difference_repeats_its_last() -> None:
    values = np.array([[0.0], [1.0], [4.0]])
    assert forward_difference(values, 10.0)[:, 0] == pytest.approx([10.0, 30.0, 30.0])


@needs_shared
@pytest.mark.parametrize(
    "file", sorted((SHARED / "published" / "inverse").glob("*.torque")), ids=lambda path: path.stem
)
def test_published_torques(file: Path) -> None:
    name, trial = file.stem.split("_")
    model = walker("orthosis" if name == "orthosis" else "barefoot", published=True)
    q = np.loadtxt(file.with_suffix(".csv"), delimiter=",")[:, 1:]
    recording = read_c3d(SHARED / "recordings" / name / f"{trial}.c3d")
    tau, _ = published_torques(model, recording, q)
    published = np.loadtxt(file, delimiter=",")[:, 1:]
    assert tau == pytest.approx(published, rel=1e-5, abs=1e-3)


def published_trials(condition: Condition) -> tuple[PublishedTrial, ...]:
    """Return the averaged trials; angles are the published ones where they are at hand."""
    patient, found = load_patient("sreenivasa2017-patient"), []
    for name in AVERAGED_TRIALS[condition]:
        path = SHARED / "recordings" / condition / f"{name}.c3d"
        q = process_trial(path, patient, condition).motion.values
        recording = read_c3d(path)
        tau, _ = published_torques(walker(condition, published=True), recording, q)
        found.append(PublishedTrial(recording, q, tau))
    return tuple(found)


@needs_shared
def test_published_tables_barefoot() -> None:
    trials = published_trials("barefoot")
    table = published_residuals(trials, 24.7)
    assert table.mean == pytest.approx(np.array([-0.02, 1.36, -0.02]), abs=0.015)
    assert table.lowest == pytest.approx(np.array([-0.27, -0.04, -0.11]), abs=0.03)
    assert table.highest == pytest.approx(np.array([0.16, 2.80, 0.09]), abs=0.03)
    found = {peak.generator: peak.strength for peak in published_strengths(trials)}
    expected = {"hip_extension_r": 18.64, "hip_extension_l": 30.36, "knee_extension_r": 22.40,
                "knee_extension_l": 24.55}  # fmt: skip
    for generator, value in expected.items():
        assert found[generator] == pytest.approx(value, rel=0.1)


@needs_shared
def test_published_table_orthosis() -> None:
    table = published_residuals(published_trials("orthosis"), 24.7)
    assert table.mean[[0, 2]] == pytest.approx(np.array([-0.05, -0.05]), abs=0.02)
    assert table.highest[[0, 2]] == pytest.approx(np.array([0.01, 0.11]), abs=0.02)


@needs_shared
def test_own_residuals_and_strengths() -> None:
    patient = load_patient("sreenivasa2017-patient")
    names = ("3053176", "3053178", "3053179", "3053183", "3053184")
    trials = [
        process_trial(SHARED / "recordings" / "barefoot" / f"{name}.c3d", patient, "barefoot")
        for name in names
    ]
    found = [residuals(t.name, t.tau.values) for t in trials if t.tau is not None]
    table = residual_range(tuple(found))
    assert np.abs(table.mean[[0, 2]]).max() < 3.0
    assert 0.0 < table.mean[1] < 25.0
    assert strengths(trials).hip_extension.left == pytest.approx(30.36, rel=0.15)


def test_turned_trials_are_only_those_the_published_evaluation_knows() -> None:
    known = {"3053176", "3053178", "3053183"}
    assert known == TURNED
