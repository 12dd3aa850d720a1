"""Passive joint torques: the published equations, what an examination shifts, and one code path."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

from pathwalker_cli.case import load_case
from pathwalker_cli.inverse.strengths import strength_table
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.trials import recorded_trials
from pathwalker_cli.model.elements.tissue import _EXAMINATION, passive_torques
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import Patient, load_patient

USUAL = {name: usual for name, (usual, _) in _EXAMINATION.items()}

POSES = ((0.0, 0.0, 0.0), (30.0, 60.0, -10.0), (-10.0, 20.0, -20.0))
"""Hip flexion, knee flexion, plantarflexion [deg]."""


def radians(h: float, k: float, a: float) -> tuple[float, float, float]:
    return float(np.deg2rad(-h)), float(np.deg2rad(k)), float(np.deg2rad(a))


@pytest.mark.parametrize("angles", POSES)
def test_torques_are_those_of_the_published_equations(angles: tuple[float, float, float]) -> None:
    h, k, a = angles
    by_hand = (
        np.exp(1.4655 - 0.0034 * k - 0.0750 * h) - np.exp(1.3403 - 0.0226 * k + 0.0305 * h) + 8.072,
        np.exp(1.800 - 0.0460 * a - 0.0352 * k + 0.0217 * h)
        - np.exp(-3.971 - 0.0004 * a + 0.0495 * k - 0.0128 * h)
        - 4.820
        + np.exp(2.220 - 0.150 * k),
        np.exp(2.1016 - 0.0843 * a - 0.0176 * k)
        - np.exp(-7.9763 + 0.1949 * a + 0.0008 * k)
        - 1.792,
    )
    hip, knee, ankle = passive_torques(*radians(h, k, a), USUAL)
    assert (-hip, knee, ankle) == pytest.approx(by_hand, rel=1e-12)


@pytest.mark.parametrize(
    ("name", "joint", "pose"),
    [
        ("hip_extension", 0, (-20.0, 10.0, 0.0)),
        ("popliteal_angle", 1, (90.0, 40.0, 0.0)),
        ("knee_extension", 1, (0.0, 5.0, 0.0)),
        ("dorsiflexion_knee_extended", 2, (0.0, 0.0, -15.0)),
    ],
)
def test_a_shorter_range_meets_the_same_resistance_earlier(
    name: str, joint: int, pose: tuple[float, float, float]
) -> None:
    """Ten degrees lost make the torque at a pose larger, in the sense that resists."""
    worse = 10.0 if name == "popliteal_angle" else -10.0
    lost = {**USUAL, name: USUAL[name] + worse}
    if name == "dorsiflexion_knee_extended":
        lost["dorsiflexion_knee_flexed"] += worse  # the coupling stays
    before, after = (passive_torques(*radians(*pose), each)[joint] for each in (USUAL, lost))
    resists = -1.0 if joint == 0 else 1.0  # the hip's coordinate counts extension
    assert resists * (after - before) > 0.5


def test_a_dorsiflexion_that_depends_on_the_knee_is_met_at_both_ranges() -> None:
    examined = {**USUAL, "dorsiflexion_knee_extended": 2.0, "dorsiflexion_knee_flexed": 12.0}
    straight = passive_torques(*radians(0.0, 0.0, -2.0), examined)[2]
    typical = passive_torques(*radians(0.0, 0.0, -13.0), USUAL)[2]
    bent = passive_torques(*radians(0.0, 90.0, -12.0), examined)[2]
    assert straight == pytest.approx(typical, rel=1e-3)
    assert bent == pytest.approx(straight, rel=1e-3)


def test_symbols_and_arrays_agree_and_no_posture_overflows() -> None:
    rng = np.random.default_rng(3)
    poses = rng.uniform(-2.5, 2.5, (50, 3))
    q = ca.SX.sym("q", 3)
    torques = ca.vertcat(*passive_torques(*ca.vertsplit(q), USUAL))
    both = ca.Function("torques", [q], [torques, ca.jacobian(torques, q)])
    for pose in poses:
        value, slope = (np.asarray(x) for x in both(pose))
        assert value.ravel() == pytest.approx(passive_torques(*pose, USUAL), rel=1e-12)
        assert np.isfinite(slope).all()
        for j in range(3):
            step = 1e-6 * np.eye(3)[j]
            ends = [np.array(passive_torques(*(pose + s * step), USUAL)) for s in (-1, 1)]
            difference = (ends[1] - ends[0]) / 2e-6
            assert slope[:, j] == pytest.approx(difference, rel=1e-5, abs=1e-3)


def walker(tissue: bool = True, **numbers: float) -> Walker:
    patient = load_patient("sreenivasa2017-patient")
    values = {place.replace("__", "."): value for place, value in numbers.items()}
    return build_walker(patient.model_copy(update={"numbers": values}), tissue=tissue)


def test_tissue_is_there_only_when_asked_for() -> None:
    assert walker(tissue=False).tissue == ()
    assert [element.name for element in walker().tissue] == ["tissue_r", "tissue_l"]


def test_damping_takes_up_power_and_size_scales() -> None:
    plain, thick = walker(tissue__damping=0.3), walker(tissue__damping=0.3, tissue__size=0.5)
    q, v, a = np.full((1, 10), 0.2), np.zeros((1, 10)), np.zeros((1, 14))
    v[0, 3:9] = np.linspace(-4.0, 4.0, 6)
    still, moving = (plain.element_forces(q, speed, a) for speed in (0.0 * v, v))
    assert (moving - still)[0, plain.columns(plain.tissue)] == pytest.approx(-0.3 * v[0, 3:9])
    columns = plain.columns(plain.tissue)
    other = thick.element_forces(q, 0.0 * v, a)
    share = 0.5 / (24.7 * 1.25 / (75.0 * 1.75))
    assert other[:, columns] == pytest.approx(share * still[:, columns])


def test_the_examination_of_a_patient_counts() -> None:
    patient = load_patient("sreenivasa2017-patient")
    content = patient.model_dump(mode="json", exclude_none=True)
    content["examination"] = {"popliteal_angle": {"right": 60.0, "left": 26.0}}
    examined = build_walker(type(patient).model_validate(content), tissue=True)
    assert examined.values["examination.popliteal_angle.right"] == 60.0
    assert examined.values["examination.popliteal_angle.left"] == 26.0


def test_a_range_no_joint_has_is_refused() -> None:
    content = load_patient("sreenivasa2017-patient").model_dump(mode="json", exclude_none=True)
    content["examination"] = {"popliteal_angle": 260.0}
    with pytest.raises(ValueError, match="popliteal_angle"):
        Patient.model_validate(content)


def test_numbers_of_a_config_stand_over_the_patient_and_below_its_variation() -> None:
    changes = (
        "numbers={strengths.ankle_extension.left: 20.0, tissue.damping: 0.4}",
        "variation.scale={strengths.ankle_extension.left: 2.0, tissue.damping: 1.5}",
        "model.tissue=true",
    )
    values = load_case("mapd-barefoot", changes=changes).walker().values
    assert values["strengths.ankle_extension.left"] == 40.0
    assert values["strengths.ankle_extension.right"] == pytest.approx(32.32569)
    assert values["tissue.damping"] == pytest.approx(0.6)


def test_strengths_are_of_what_muscles_give() -> None:
    """A stiffer ankle carries more of the recorded torque: it takes a weaker muscle."""
    patient = load_patient("sreenivasa2017-patient")
    stiff = patient.model_copy(update={"numbers": {"tissue.ankle_stiffness": 2.0}})
    config = InverseDynamicsConfig(
        study="inverse-dynamics", patient=patient.id, conditions=("barefoot",)
    )
    trials = recorded_trials(config, patient, "barefoot", lambda _: None)
    with_tissue = config.model_copy(update={"tissue": True})
    tables = (
        strength_table(trials, who, each)
        for who, each in ((patient, config), (patient, with_tissue), (stiff, with_tissue))
    )
    ankles = [{r.generator: r.value for r in t.rows}["ankle_extension_r"] for t in tables]
    assert ankles[0] > ankles[1] > ankles[2] > 0.0
