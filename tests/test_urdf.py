"""The generated URDF and the Pinocchio model made of it."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli.conventions import CONTACT_POINTS, COORDINATES, Condition
from pathwalker_cli.model.anthropometry import segments
from pathwalker_cli.model.urdf import pinocchio_model, urdf_text
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import load_patient

PATIENT = "sreenivasa2017-patient"
WALKERS: list[tuple[str, Condition]] = [
    (PATIENT, "barefoot"),
    (PATIENT, "orthosis"),
    ("sreenivasa2017-healthy", "barefoot"),
]


def place(model: pin.Model, q: np.ndarray, frame: str) -> np.ndarray:
    """Return the (x, z) position of a frame [m]."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, q)
    return data.oMf[model.getFrameId(frame)].translation[[0, 2]]


def pose(**angles: float) -> np.ndarray:
    """Return q with the named coordinates set."""
    q = np.zeros(len(COORDINATES))
    for name, value in angles.items():
        q[COORDINATES.index(name)] = value
    return q


@pytest.mark.parametrize(("name", "condition"), WALKERS)
def test_shipped_files_are_up_to_date(name: str, condition: Condition) -> None:
    file = shipped("urdf") / f"{name}-{condition}.urdf"
    assert file.read_bytes() == urdf_text(load_patient(name), condition).encode()


@pytest.mark.parametrize(("name", "condition"), WALKERS)
def test_model_has_the_coordinates_in_order(name: str, condition: Condition) -> None:
    patient = load_patient(name)
    model = pinocchio_model(patient, condition)
    assert tuple(model.names)[1:] == COORDINATES
    assert (model.nq, model.nv) == (10, 10)
    assert model.gravity.linear == pytest.approx([0.0, 0.0, -9.81], abs=0.0)
    expected = sum(part.mass for part in segments(patient, condition))
    assert pin.computeTotalMass(model) == pytest.approx(expected, abs=1e-7)
    assert all(model.existFrame(point) for point in CONTACT_POINTS)


def test_reordered_model_moves_as_the_parsed_one() -> None:
    patient = load_patient(PATIENT)
    parsed = pin.buildModelFromXML(urdf_text(patient, "barefoot"))
    model = pinocchio_model(patient, "barefoot")
    rng = np.random.default_rng(1)
    q, v, vdot = rng.normal(size=(3, 10)) * 0.4
    order = [parsed.joints[parsed.getJointId(name)].idx_q for name in COORDINATES]
    q_parsed, v_parsed, vdot_parsed = np.zeros((3, 10))
    q_parsed[order], v_parsed[order], vdot_parsed[order] = q, v, vdot
    tau_parsed = pin.rnea(parsed, parsed.createData(), q_parsed, v_parsed, vdot_parsed)
    tau = pin.rnea(model, model.createData(), q, v, vdot)
    assert tau == pytest.approx(tau_parsed[order], abs=1e-10)
    for frame in ("heel_r", "toe_l", "hand_r", "head"):
        assert place(model, q, frame) == pytest.approx(place(parsed, q_parsed, frame), abs=1e-12)


def test_published_switch_gives_the_published_upper_body() -> None:
    model = pinocchio_model(load_patient(PATIENT), "barefoot", published=True)
    upper = model.inertias[model.getJointId("lumbar")]
    found = (upper.mass, upper.lever[2], upper.inertia[1, 1])
    assert found == pytest.approx((12.967994, 0.216507, 0.341859), abs=1e-5)


def test_leg_geometry_in_the_zero_pose() -> None:
    model = pinocchio_model(load_patient(PATIENT), "barefoot")
    ankle = -(0.054496 + 0.2647 + 0.2834)
    assert place(model, pose(), "knee_r") == pytest.approx([0.0, -0.054496 - 0.2647])
    assert place(model, pose(), "heel_r") == pytest.approx([-0.05075, ankle - 0.05])
    assert place(model, pose(), "toe_r") == pytest.approx([0.09425, ankle - 0.05])
    assert place(model, pose(), "lumbar") == pytest.approx([0.0, 0.05])


def test_signs_of_the_coordinates() -> None:
    model = pinocchio_model(load_patient(PATIENT), "barefoot")
    zero = pose()
    assert place(model, pose(pelvis_tx=1.0), "pelvis") == pytest.approx([1.0, 0.0])
    assert place(model, pose(pelvis_tz=1.0), "pelvis") == pytest.approx([0.0, 1.0])
    assert place(model, pose(pelvis_tilt=0.3), "head")[0] > 0.0, "forward lean"
    assert place(model, pose(lumbar=0.3), "head")[0] > 0.0, "forward lean"
    assert place(model, pose(hip_r=0.3), "knee_r")[0] < 0.0, "extension"
    assert place(model, pose(knee_r=0.3), "ankle_r")[0] < 0.0, "flexion"
    assert place(model, pose(ankle_r=0.3), "toe_r")[1] < place(model, zero, "toe_r")[1], "plantar"


def test_shoe_stands_flat_toe_down() -> None:
    model = pinocchio_model(load_patient(PATIENT), "orthosis")
    q = pose(ankle_l=0.1574)
    heel, toe = place(model, q, "heel_l"), place(model, q, "toe_l")
    assert heel[1] == pytest.approx(toe[1], abs=1e-4)
