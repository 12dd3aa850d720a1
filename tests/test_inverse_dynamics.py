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
from pathwalker_cli.inverse.c3d_trials import c3d_trials
from pathwalker_cli.inverse.cycles import GaitCycle, Stance, cycle_band, resampled
from pathwalker_cli.inverse.dynamics import inverse_dynamics
from pathwalker_cli.inverse.forces import force_columns
from pathwalker_cli.inverse.published import (
    AVERAGED_TRIALS,
    TURNED,
    forward_difference,
    published_torques,
)
from pathwalker_cli.inverse.residuals import (
    residual_range,
    residuals,
    trial_residuals,
)
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.inverse.strengths import (
    Peak,
    extension_peaks,
    isometric_torque,
    stance_curves,
    strengths_of,
)
from pathwalker_cli.inverse.study import InverseDynamicsConfig, RecordedConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.trials import dynamics_trials, with_torques
from pathwalker_cli.io.c3d import read_c3d
from pathwalker_cli.model.elements.muscle import generators
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient
from pathwalker_cli.trajectory import Trajectory

SHARED = Path(__file__).parents[2] / "shared"
needs_shared = pytest.mark.skipif(
    not (SHARED / "published").is_dir(), reason="needs shared/published beside the checkout"
)
NOTHING = (0.0, 0.0, np.nan)
"""No force forward and up [N], which acts nowhere [m]."""


@cache
def walker(condition: Condition = "barefoot", published: bool = False) -> pin.Model:
    """Return the shipped patient's model."""
    return pinocchio_model(load_patient("sreenivasa2017-patient"), condition, published)


def states(count: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return random q, v and vdot."""
    return tuple(np.random.default_rng(5).normal(size=(3, count, 10)) * 0.4)  # type: ignore[return-value]


def loads(right: tuple[float, ...] = NOTHING, left: tuple[float, ...] = NOTHING) -> Trajectory:
    """Return a table of ground forces in one frame: forward, up [N] and where they act [m]."""
    return force_columns(np.zeros(1), {"right": np.array([right]), "left": np.array([left])})


def test_free_fall_needs_no_force() -> None:
    q, v, _ = states()
    vdot = np.zeros((1, 10))
    vdot[0, 1] = -GRAVITY
    tau = inverse_dynamics(walker(), q, 0.0 * v, vdot, loads())
    assert tau == pytest.approx(0.0, abs=1e-9)


def test_inverse_of_forward_dynamics() -> None:
    model = walker()
    q, v, _ = states()
    tau = np.random.default_rng(6).normal(size=10)
    vdot = pin.aba(model, model.createData(), q[0], v[0], tau)[None]
    found = inverse_dynamics(model, q, v, vdot, loads())
    assert found[0] == pytest.approx(tau, abs=1e-9)


def test_force_acts_by_the_jacobian_of_its_point() -> None:
    model = walker()
    q, v, vdot = states()
    force, centre = np.array([30.0, 200.0]), 0.12
    bare = inverse_dynamics(model, q, v, vdot, loads())
    found = inverse_dynamics(model, q, v, vdot, loads(left=(*force, centre)))
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
    still = np.zeros((1, 10))
    tau = inverse_dynamics(model, q, still, still, loads(right=(0.0, weight, centre)))
    assert tau[0, :3] == pytest.approx(0.0, abs=1e-9)


def test_unknown_force_leaves_the_other_leg_alone() -> None:
    model = walker()
    q, v, vdot = states()
    forces = loads(right=(5.0, 150.0, 0.1), left=(np.nan, np.nan, np.nan))
    tau = inverse_dynamics(model, q, v, vdot, forces)
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
    both = residual_range((one, two, residuals("c", np.full((1, 10), np.nan))))
    assert [both[name][1] for name in ("min", "mean", "max")] == [1.0, 2.0, 3.0]


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
    peaks = tuple(Peak(name, 1.0, 0.0, 0.0, value, (value,)) for name, value in extension.items())
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
    trial = Trial("made", motion, (), None, "barefoot", (), tau=motion, stances=(known,))
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


@cache
def published_trials(condition: Condition) -> tuple[Trial, ...]:
    """Return the averaged trials by the published method."""
    folder = str(SHARED / "recordings" / condition)
    config = InverseDynamicsConfig.model_validate(
        {"study": "inverse-dynamics", "patient": "sreenivasa2017-patient", "method": "published",
         "conditions": (condition,), "source": "c3d", "c3d": {condition: (folder,)}}
    )  # fmt: skip
    trials = dynamics_trials(config, load_patient(config.patient), lambda _: None)
    assert tuple(trial.name for trial in trials) == AVERAGED_TRIALS[condition]
    return trials


def published_table(condition: Condition) -> dict[str, np.ndarray]:
    """Return table 3 of the article, per body mass."""
    own = [trial_residuals(trial, "whole cycle") for trial in published_trials(condition)]
    return {name: values / 24.7 for name, values in residual_range(own).items()}


@needs_shared
def test_published_tables_barefoot() -> None:
    table = published_table("barefoot")
    assert table["mean"] == pytest.approx(np.array([-0.02, 1.36, -0.02]), abs=0.015)
    assert table["min"] == pytest.approx(np.array([-0.27, -0.04, -0.11]), abs=0.03)
    assert table["max"] == pytest.approx(np.array([0.16, 2.80, 0.09]), abs=0.03)
    peaks = extension_peaks(stance_curves(published_trials("barefoot")), published=True)
    found = {peak.generator: peak.strength for peak in peaks}
    expected = {"hip_extension_r": 18.64, "hip_extension_l": 30.36, "knee_extension_r": 22.40,
                "knee_extension_l": 24.55}  # fmt: skip
    for generator, value in expected.items():
        assert found[generator] == pytest.approx(value, rel=0.1)


@needs_shared
def test_published_table_orthosis() -> None:
    table = published_table("orthosis")
    assert table["mean"][[0, 2]] == pytest.approx(np.array([-0.05, -0.05]), abs=0.02)
    assert table["max"][[0, 2]] == pytest.approx(np.array([0.01, 0.11]), abs=0.02)


@needs_shared
def test_own_residuals_and_strengths() -> None:
    patient = load_patient("sreenivasa2017-patient")
    config = RecordedConfig(patient=patient.id)
    names = ("3053176", "3053178", "3053179", "3053183", "3053184")
    paths = [SHARED / "recordings" / "barefoot" / f"{name}.c3d" for name in names]
    trials = [
        with_torques(c3d_trials([path], patient, "barefoot", config)[0][0], patient)
        for path in paths
    ]
    found = [residuals(t.name, t.tau.values) for t in trials if t.tau is not None]
    table = residual_range(found)
    assert np.abs(table["mean"][[0, 2]]).max() < 3.0
    assert 0.0 < table["mean"][1] < 25.0
    strengths = strengths_of(extension_peaks(stance_curves(trials)))
    assert strengths.hip_extension.left == pytest.approx(30.36, rel=0.15)


def test_turned_trials_are_only_those_the_published_evaluation_knows() -> None:
    known = {"3053176", "3053178", "3053183"}
    assert known == TURNED
