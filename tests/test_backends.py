"""Every back end against numeric Pinocchio."""

from __future__ import annotations

import os
from importlib import resources

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli.conventions import CONTACT_POINTS, COORDINATES
from pathwalker_cli.errors import BackendError
from pathwalker_cli.model import backends
from pathwalker_cli.model.backends import bindings, compiled
from pathwalker_cli.model.backends.functions import (
    SIGNATURES,
    RigidBodyFunctions,
    Topology,
    all_parameters,
    parameters_of,
)

TOLERANCE = 1e-10
STATES = 200
PARENTS = dict(zip(COORDINATES, (0, 1, 2, 3, 4, 5, 3, 7, 8, 3), strict=True))


def translation(*xyz: float) -> pin.SE3:
    return pin.SE3(np.eye(3), np.array(xyz, dtype=float))


def planar_body(rng: np.random.Generator) -> pin.Inertia:
    com = np.array([rng.uniform(-0.1, 0.1), 0.0, rng.uniform(-0.3, 0.3)])
    return pin.Inertia(rng.uniform(0.5, 10), com, np.diag(rng.uniform(0.01, 0.02, 3)))


def walker(seed: int) -> pin.Model:
    """Return a planar walker with random lengths and bodies; its root joints are massless."""
    rng, model = np.random.default_rng(seed), pin.Model()
    types = {"pelvis_tx": pin.JointModelPX, "pelvis_tz": pin.JointModelPZ}
    for name, parent in PARENTS.items():
        height = 0.0 if name.startswith("pelvis") else rng.uniform(-0.4, -0.1)
        joint = types.get(name, pin.JointModelRY)()
        number = model.addJoint(parent, joint, translation(0, 0, height), name)
        if name not in types:
            model.appendBodyToJoint(number, planar_body(rng), pin.SE3.Identity())
    for point in CONTACT_POINTS:
        foot = model.getJointId(f"ankle_{point[-1]}")
        place = translation(rng.uniform(-0.1, 0.1), 0, rng.uniform(-0.1, -0.05))
        model.addFrame(pin.Frame(point, foot, 0, place, pin.OP_FRAME))
    return model


def spatial_chain(seed: int) -> pin.Model:
    """Return a tree of every joint type with turned placements and full inertias."""
    rng, model = np.random.default_rng(seed), pin.Model()
    for number, kind in enumerate(("PX", "RY", "RY", "PZ", "RX", "RZ", "PY", "RX", "RX")):
        place = pin.SE3.Random() if number % 2 else translation(*rng.normal(size=3))
        parent = number if number < 7 else 3
        joint = model.addJoint(parent, getattr(pin, f"JointModel{kind}")(), place, f"j{number}")
        model.appendBodyToJoint(joint, pin.Inertia.Random(), pin.SE3.Identity())
    for name, joint in (("heel_r", 7), ("toe_r", 9)):
        model.addFrame(pin.Frame(name, joint, 0, pin.SE3.Random(), pin.OP_FRAME))
    return model


def numeric(
    model: pin.Model, points: tuple[str, ...], q: np.ndarray, v: np.ndarray, vdot: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the values of all functions as Pinocchio computes them in numbers."""
    data, plane, axes = model.createData(), [0, 2], pin.LOCAL_WORLD_ALIGNED
    values = {
        "inverse_dynamics": pin.rnea(model, data, q, v, vdot).copy(),
        "mass_matrix": pin.crba(model, data, q).copy(),
        "bias": pin.nle(model, data, q, v).copy(),
        "centre_of_mass": pin.centerOfMass(model, data, q).copy(),
    }
    pin.computeJointJacobians(model, data, q)
    pin.forwardKinematics(model, data, q, v, vdot)
    pin.updateFramePlacements(model, data)
    frames = [model.getFrameId(point) for point in points]
    of_points = {
        "point_positions": lambda f: data.oMf[f].translation[plane],
        "point_velocities": lambda f: pin.getFrameVelocity(model, data, f, axes).linear[plane],
        "point_accelerations": lambda f: pin.getFrameClassicalAcceleration(
            model, data, f, axes
        ).linear[plane],
        "point_jacobian": lambda f: pin.getFrameJacobian(model, data, f, axes)[plane],
    }
    return values | {
        name: np.concatenate([value(f) for f in frames]) for name, value in of_points.items()
    }


def assert_agrees(
    functions: RigidBodyFunctions, model: pin.Model, theta: np.ndarray, states: int
) -> None:
    rng = np.random.default_rng(7)
    for _ in range(states):
        q, v, vdot = rng.uniform(-3, 3, (3, model.nq))
        given = {"q": q, "v": v, "vdot": vdot, "theta": theta}
        for name, wanted in numeric(model, functions.topology.points, q, v, vdot).items():
            got = getattr(functions, name)(*(given[argument] for argument in SIGNATURES[name]))
            np.testing.assert_allclose(
                np.asarray(ca.densify(got)).reshape(wanted.shape),
                wanted,
                rtol=TOLERANCE,
                atol=TOLERANCE * max(1.0, np.abs(wanted).max()),
                err_msg=name,
            )


@pytest.fixture(params=backends.available_backends())
def backend(request: pytest.FixtureRequest) -> str:
    return request.param


def test_agrees_with_pinocchio(backend: str) -> None:
    model = walker(0)
    functions = backends.rigid_body_functions(model, CONTACT_POINTS, backend)
    assert functions.backend == backend
    assert functions.nq == len(COORDINATES)
    assert_agrees(functions, model, functions.parameters, STATES)


def test_new_parameter_values_make_another_patient(backend: str) -> None:
    functions = backends.rigid_body_functions(walker(0), CONTACT_POINTS, backend)
    other = walker(1)
    theta = functions.parameters_for(other)
    assert not np.any(theta == functions.parameters)
    assert_agrees(functions, other, theta, 20)


def test_supports_every_joint_type_in_space(backend: str) -> None:
    model = spatial_chain(0)
    functions = backends.rigid_body_functions(model, ("heel_r", "toe_r"), backend)
    assert_agrees(functions, model, functions.parameters, 20)


def test_no_points_give_empty_point_functions(backend: str) -> None:
    functions = backends.rigid_body_functions(walker(0), (), backend)
    zero = np.zeros(functions.nq)
    assert functions.point_positions(zero, functions.parameters).shape == (0, 1)
    assert functions.point_jacobian(zero, functions.parameters).shape == (0, functions.nq)


def test_root_translation_does_not_enter_the_dynamics(backend: str) -> None:
    functions = backends.rigid_body_functions(walker(0), CONTACT_POINTS, backend)
    for name in ("inverse_dynamics", "mass_matrix", "bias", "point_jacobian"):
        function = getattr(functions, name)
        jacobian = function.jac_sparsity(0, 0)
        assert not set(jacobian.get_col()) & {0, 1}, name


def test_structural_zeros_carry_no_parameter() -> None:
    functions = backends.rigid_body_functions(walker(0), CONTACT_POINTS)
    names = functions.parameter_names
    assert {"hip_r.placement.z", "hip_r.mass", "heel_r.position.x"} <= set(names)
    assert not [name for name in names if name.endswith(("placement.y", "com.y", "position.y"))]
    assert not [name for name in names if name.startswith("pelvis_t") and "tilt" not in name]
    assert len(names) == functions.parameters.size == functions.inverse_dynamics.numel_in(3)


def test_models_of_one_topology_share_the_graph() -> None:
    first, second = (backends.rigid_body_functions(walker(i), CONTACT_POINTS) for i in (0, 1))
    assert first.inverse_dynamics is second.inverse_dynamics
    assert first.parameter_names == second.parameter_names


def test_a_folded_parameter_must_stay_zero() -> None:
    functions = backends.rigid_body_functions(walker(0), CONTACT_POINTS)
    other = walker(1)
    other.jointPlacements[4].translation = np.array([0.01, 0.0, -0.1])
    with pytest.raises(BackendError, match=r"hip_r\.placement\.x must be zero"):
        functions.parameters_for(other)


def test_another_topology_is_refused() -> None:
    functions = backends.rigid_body_functions(walker(0), CONTACT_POINTS)
    other = walker(1)
    other.jointPlacements[4].rotation = pin.utils.rotate("x", 0.1)
    with pytest.raises(BackendError, match="rigid_body_functions"):
        functions.parameters_for(other)


def test_an_unknown_parameter_is_named() -> None:
    with pytest.raises(BackendError, match=r"no parameter wing\.mass"):
        parameters_of(walker(0), Topology.of(walker(0), CONTACT_POINTS), ("wing.mass",))


def test_the_report_names_every_back_end() -> None:
    report = backends.backend_report()
    assert tuple(entry.name for entry in report) == backends.BACKENDS
    assert all(entry.detail for entry in report)
    assert "direct" in backends.available_backends()


@pytest.mark.parametrize(
    ("points", "backend", "message"),
    [
        (CONTACT_POINTS, "fastest", "no back end 'fastest'; available: auto"),
        (("elbow",), "direct", "no frame 'elbow'"),
    ],
)
def test_wrong_names_are_refused(points: tuple[str, ...], backend: str, message: str) -> None:
    with pytest.raises(BackendError, match=message):
        backends.rigid_body_functions(walker(0), points, backend)


def test_other_joint_types_are_refused() -> None:
    model = pin.Model()
    model.addJoint(0, pin.JointModelFreeFlyer(), pin.SE3.Identity(), "root")
    with pytest.raises(BackendError, match="'root' is of type FreeFlyer; allowed: RX"):
        backends.rigid_body_functions(model, ())


def test_an_unavailable_back_end_says_how_to_mend_it() -> None:
    missing = [entry for entry in backends.backend_report() if not entry.available]
    if not missing:
        pytest.skip("every back end is available")
    with pytest.raises(BackendError, match="install"):
        backends.rigid_body_functions(walker(0), CONTACT_POINTS, missing[0].name)


def test_compiled_back_end_is_available() -> None:
    if os.environ.get("PATHWALKER_ALLOW_PURE_PYTHON"):
        pytest.skip("PATHWALKER_ALLOW_PURE_PYTHON is set")
    assert "compiled" in backends.available_backends()


@pytest.mark.parametrize("versions", ["4.0.0 {casadi}", "{pin} 3.7.0"])
def test_other_library_versions_are_refused(versions: str) -> None:
    compiled.check_versions(f"{pin.__version__} {ca.CasadiMeta.version()}")
    with pytest.raises(BackendError, match="install pathwalker-cli again"):
        compiled.check_versions(
            versions.format(pin=pin.__version__, casadi=ca.CasadiMeta.version())
        )


def test_a_missing_extension_is_reported(
    monkeypatch: pytest.MonkeyPatch, tmp_path: os.PathLike[str]
) -> None:
    monkeypatch.setattr(resources, "files", lambda _: tmp_path)
    compiled.library.cache_clear()
    with pytest.raises(BackendError, match="was not compiled"):
        compiled.library()
    compiled.library.cache_clear()


def test_the_bindings_route_agrees_in_numbers() -> None:
    """Pip ships no `pinocchio.casadi`; the same calls on numbers exercise its code."""
    model = walker(0)
    q, v, vdot = np.random.default_rng(3).uniform(-3, 3, (3, model.nq))
    theta = all_parameters(model, CONTACT_POINTS)
    topology = Topology.of(model, CONTACT_POINTS)
    got = bindings.evaluate(pin, topology, q=q, v=v, vdot=vdot, theta=theta)
    wanted = numeric(model, CONTACT_POINTS, q, v, vdot)
    assert set(got) == set(SIGNATURES)
    for name, value in wanted.items():
        np.testing.assert_allclose(got[name], value, rtol=TOLERANCE, atol=TOLERANCE, err_msg=name)
