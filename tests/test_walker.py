"""Muscles, orthosis and contact dynamics against published numbers, a second engine and physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli import build_walker, load_patient
from pathwalker_cli.conventions import GENERATORS
from pathwalker_cli.errors import InputError
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.elements.curves import evaluate
from pathwalker_cli.model.elements.muscle import activation_rate, curves_of, excitation_from_rate
from pathwalker_cli.model.elements.orthosis import OrthosisSide, orthosis_curve, orthosis_torque
from pathwalker_cli.model.walker import Walker
from published_rows import ROWS, PublishedRow

SHARED = Path(__file__).parents[2] / "shared" / "published" / "ls-barefoot"
RIGHT = OrthosisSide(-0.02, 0.01, 1.0, -0.13, 0.10, 200.0, 200.0)
LEFT = OrthosisSide(-0.02, 0.01, 1.0, -0.12, 0.09, 200.0, 200.0)


@pytest.fixture(scope="module")
def published() -> Walker:
    return build_walker(load_patient("sreenivasa2017-patient"), "barefoot", published=True)


@pytest.fixture(scope="module")
def shod() -> Walker:
    return build_walker(load_patient("sreenivasa2017-patient"), "orthosis")


@pytest.mark.parametrize("row", ROWS, ids=[phase.name for phase in PHASES])
def test_published_torques_and_forces(published: Walker, row: PublishedRow) -> None:
    muscle = published.muscle_torques(row.q, row.v, row.activation)
    assert muscle == pytest.approx(row.muscle_torque, abs=0.01)
    tau = published.joint_torques(row.muscle_torque)
    _, force = published.contact_dynamics(row.phase, row.q, row.v, tau)
    assert force == pytest.approx(row.force, abs=0.01)


@pytest.mark.skipif(not SHARED.is_dir(), reason="the published solution does not stand beside")
def test_every_published_row(published: Walker) -> None:
    table = np.loadtxt(SHARED / "pathWalker2d_augmented.txt", delimiter=",")
    text = (SHARED / "pathWalker2d.csv").read_text().split("DATA:")[1]
    q = np.array([[float(k) for k in line.split(",")[1:11]] for line in text.strip().splitlines()])
    for i, values in enumerate(table[: len(q)]):
        v, activation, muscle = values[1:11], values[11:25], values[39:53]
        assert published.muscle_torques(q[i], v, activation) == pytest.approx(muscle, abs=0.01)
        tau = published.joint_torques(muscle)
        _, force = published.contact_dynamics(int(values[91]), q[i], v, tau)
        wanted = values[79:91].reshape(4, 3)[:, [0, 2]].ravel()
        assert force == pytest.approx(wanted, abs=0.01)


ORTHOSIS_TABLE = (
    # angle [rad], left 55/5, right 55/5, right 45.9/13.2, left 62.8/19.7: minus the torque [N m]
    (-0.25, -32.225000, -30.775000, -29.819500, -32.966000),
    (-0.17, -16.225000, -14.775000, -13.819500, -16.966000),
    (-0.14, -10.225000, -8.775000, -7.819500, -10.966000),
    (-0.13, -8.225000, -6.912391, -5.951917, -8.966000),
    (-0.12, -6.350527, -6.225004, -5.360504, -7.093457),
    (-0.11, -5.675000, -5.675000, -4.901500, -6.338000),
    (-0.08, -4.025000, -4.025000, -3.524500, -4.454000),
    (-0.05, -2.375000, -2.375000, -2.147500, -2.570000),
    (-0.03, -1.275000, -1.275000, -1.229500, -1.314000),
    (-0.02, 0.000000, 0.000000, 0.000000, 0.000000),
    (-0.01, 1.025000, 1.025000, 1.066000, 1.098500),
    (0, 1.075000, 1.075000, 1.198000, 1.295500),
    (0.03, 1.225000, 1.225000, 1.594000, 1.886500),
    (0.08, 1.475001, 1.475000, 2.254000, 2.871502),
    (0.09, 1.589759, 1.525028, 2.386044, 3.168686),
    (0.1, 3.525000, 1.642819, 2.610320, 5.068500),
    (0.11, 5.525000, 3.575000, 4.518000, 7.068500),
    (0.15, 13.525000, 11.575000, 12.518000, 15.068500),
    (0.25, 33.525000, 31.575000, 32.518000, 35.068500),
)


@pytest.mark.parametrize("row", ORTHOSIS_TABLE)
def test_orthosis_torque_is_the_published_curve(row: tuple[float, ...]) -> None:
    angle, *torques = row
    cases = ((LEFT, 55, 5), (RIGHT, 55, 5), (RIGHT, 45.9, 13.2), (LEFT, 62.8, 19.7))
    for (side, k_d, k_p), torque in zip(cases, torques, strict=True):
        assert orthosis_torque(side, np.array(angle), k_d, k_p) == pytest.approx(-torque, abs=1e-6)


def test_orthosis_stages_lie_on_their_lines() -> None:
    """Between free play and stop the curve is the preloaded spring, beyond the stop the stop."""
    k_d, k_p = 45.9, 13.2
    spring = orthosis_torque(RIGHT, np.array([-0.10, -0.06, 0.03, 0.06]), k_d, k_p)
    assert spring[:2] == pytest.approx([1 + k_d * 0.075, 1 + k_d * 0.035], abs=1e-9)
    assert spring[2:] == pytest.approx([-1 - k_p * 0.045, -1 - k_p * 0.075], abs=1e-9)
    beyond = orthosis_torque(RIGHT, np.array([-0.30, -0.29]), k_d, k_p)
    assert np.diff(beyond) == pytest.approx(-200 * 0.01, abs=1e-9)
    assert orthosis_torque(RIGHT, np.array(-0.02), k_d, k_p) == pytest.approx(0.0, abs=1e-12)


def test_orthosis_is_the_same_in_numpy_and_casadi() -> None:
    x, k_d, k_p = (ca.SX.sym(name) for name in ("x", "k_d", "k_p"))
    function = ca.Function("orthosis", [x, k_d, k_p], [orthosis_torque(LEFT, x, k_d, k_p)])
    for angle in np.linspace(-0.4, 0.4, 41):
        symbolic = float(function(angle, 37.0, 11.0))
        assert symbolic == pytest.approx(float(orthosis_torque(LEFT, angle, 37.0, 11.0)), abs=1e-12)


@pytest.mark.parametrize("k_d", [1.0, 99.9, 100.0, 150.0, 199.999999, 200.0, 250.0, 400.0, 700.0])
@pytest.mark.parametrize("k_p", [5.0, 200.0, 600.0])
def test_orthosis_is_a_curve_with_springs_of_any_stiffness(k_d: float, k_p: float) -> None:
    """At 200 N m/rad a spring is as stiff as its stop, and as the rise of its preload."""
    chain = orthosis_curve(RIGHT, k_d, k_p)
    for i in range(len(chain.x) - 1):
        a, b = chain.controls(i)
        assert 0.0 <= a <= 0.7
        assert 0.3 <= b <= 1.0
    torque = orthosis_torque(RIGHT, np.linspace(-0.3, 0.3, 6001), k_d, k_p)
    assert np.diff(torque).max() < 0.0


@pytest.mark.parametrize("preload", [0.0, 1.0])
def test_orthosis_is_smooth_in_its_stiffness(preload: float) -> None:
    side = replace(RIGHT, preload_torque=preload)
    angle, k_d = ca.SX.sym("angle"), ca.SX.sym("k_d")
    bend, slope = ca.hessian(orthosis_torque(side, angle, k_d, 60.0), k_d)
    function = ca.Function("torque", [angle, k_d], [slope, bend])
    h = 1e-3
    for at in (-0.16, -0.131, -0.028, -0.023, -0.021, -0.012):
        for edge in (100.0, 200.0):
            below, above = (np.array(function(at, edge + k)).ravel() for k in (-h, h))
            assert above == pytest.approx(below, abs=1e-6), (at, edge)


@pytest.mark.parametrize("name", GENERATORS[:6])
def test_curves_are_smooth_to_the_second_derivative(name: str) -> None:
    for chain in (curves_of(name).active_torque_angle, curves_of(name).torque_angular_velocity):
        x = np.linspace(chain.x[0] - 0.3, chain.x[-1] + 0.3, 801)
        h = 1e-6
        point, up, down = (evaluate(chain, x + k) for k in (0.0, h, -h))
        assert (up.value - down.value) / (2 * h) == pytest.approx(point.slope, abs=1e-7)
        inside = (np.abs(x[:, None] - np.array(chain.x)) > 2 * h).all(axis=1)
        rate = (up.slope - down.slope) / (2 * h)
        assert rate[inside] == pytest.approx(point.curvature[inside], abs=1e-5)
        at_knots = evaluate(chain, np.array(chain.x))
        assert at_knots.value == pytest.approx(chain.y, abs=1e-12)
        assert at_knots.curvature == pytest.approx(np.zeros(len(chain.x)), abs=1e-6)


@pytest.mark.parametrize("name", GENERATORS)
def test_symbolic_curves_are_the_numeric_ones(name: str) -> None:
    for chain in (curves_of(name).active_torque_angle, curves_of(name).torque_angular_velocity):
        values = np.linspace(chain.x[0] - 0.3, chain.x[-1] + 0.3, 801)
        x, lists = ca.SX.sym("x"), replace(chain, x=[*chain.x], y=[*chain.y])
        for same in (chain, lists):  # looked up, and built anew
            point = ca.Function("point", [x], [*vars(evaluate(same, x)).values()])
            for got, wanted in zip(
                point(values), vars(evaluate(chain, values)).values(), strict=True
            ):
                scale = np.abs(wanted).max()
                assert np.asarray(got).ravel() == pytest.approx(
                    wanted, rel=1e-12, abs=1e-12 * scale
                )


def test_excitation_is_the_inverse_of_the_activation_rate() -> None:
    e, a = np.meshgrid(np.linspace(0, 1, 21), np.linspace(0.01, 0.99, 15))
    assert excitation_from_rate(activation_rate(e, a), a) == pytest.approx(e, abs=1e-12)
    symbols = ca.SX.sym("e"), ca.SX.sym("a")
    function = ca.Function("rate", [*symbols], [activation_rate(*symbols)])
    assert float(function(0.7, 0.2)) == pytest.approx(activation_rate(0.7, 0.2), rel=1e-14)
    assert float(function(0.1, 0.6)) == pytest.approx(activation_rate(0.1, 0.6), rel=1e-14)


@pytest.mark.parametrize("phase", PHASES, ids=lambda phase: phase.name)
def test_contact_dynamics_meet_the_equations_of_motion_in_numeric_pinocchio(
    shod: Walker, phase: object
) -> None:
    rng = np.random.default_rng(3)
    model, data = shod.model, shod.model.createData()
    for _ in range(5):
        q, v = 0.4 * rng.normal(size=10), rng.normal(size=10)
        tau = np.concatenate([np.zeros(3), 10 * rng.normal(size=7)])
        vdot, force = shod.contact_dynamics(phase, q, v, tau)  # type: ignore[arg-type]
        again, _ = shod.contact_dynamics(phase, q, v, tau[3:])  # type: ignore[arg-type]
        assert vdot == pytest.approx(again)
        needed = pin.rnea(model, data, q, v, vdot)
        pin.computeJointJacobians(model, data, q)
        pin.updateFramePlacements(model, data)
        for i, name in enumerate(("heel_r", "toe_r", "heel_l", "toe_l")):
            frame = model.getFrameId(name)
            jacobian = pin.getFrameJacobian(model, data, frame, pin.LOCAL_WORLD_ALIGNED)
            needed = needed - jacobian[[0, 2]].T @ force[2 * i : 2 * i + 2]
        assert needed == pytest.approx(tau, abs=1e-8)


def test_points_in_the_air_carry_no_force(shod: Walker) -> None:
    _, force = shod.contact_dynamics("right_toe_left_flat", *np.zeros((3, 10)))
    assert force.shape == (8,)
    assert force[:2].tolist() == [0.0, 0.0]  # the right heel


def test_shapes_and_orders(shod: Walker) -> None:
    points = shod.contact_points(np.zeros(10))
    assert points.shape == (4, 2)
    assert points[0, 0] < points[1, 0]
    assert points[0, 1] < points[1, 1] < 0
    right, left = shod.orthosis_torques(np.zeros(10), (45.9, 62.8), (13.2, 19.7))
    assert right == pytest.approx(float(orthosis_torque(RIGHT, np.array(0.0), 45.9, 13.2)))
    assert left == pytest.approx(float(orthosis_torque(LEFT, np.array(0.0), 62.8, 19.7)))


def test_bad_arguments_are_named(shod: Walker) -> None:
    with pytest.raises(InputError, match="q has 9 entries; allowed: 10 finite numbers"):
        shod.contact_points(np.zeros(9))
    with pytest.raises(InputError, match="there is no phase 'flying'"):
        shod.contact_dynamics("flying", np.zeros(10), np.zeros(10), np.zeros(10))
