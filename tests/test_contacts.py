"""Round feet: closed forms of rolling, soles, patterns of contact, and solves with each."""

from __future__ import annotations

from itertools import product
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from scipy.integrate import solve_ivp

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig, load_config, with_values
from pathwalker_cli.conventions import CONTACT_POINTS
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.solve import solve_study
from pathwalker_cli.gait.symmetry import full_stride
from pathwalker_cli.model.backends import available_backends, rigid_body_functions
from pathwalker_cli.model.backends.functions import RigidBodyFunctions
from pathwalker_cli.model.contact import (
    PHASES,
    SOLES,
    USES,
    Use,
    contact_pattern,
    mirrored_phase,
)
from pathwalker_cli.model.parts import Parts
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.ground import touched
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.stride.verify import second_engine_residual

FEET = ("points", "rockers", "sole")
PATIENT = load_patient("sreenivasa2017-patient")
MASS, RADIUS = 2.0, 0.3


def floating(inertia: float, lever: float, bottom: float, slope: float = 0.0) -> pin.Model:
    """Return one body in the plane whose contact point lies `bottom` under its origin.

    Args:
        inertia: About the centre of mass [kg m^2].
        lever: Height of the centre of mass above the origin [m].
        bottom: Depth of the contact point [m].
        slope: Angle by which the ground falls forwards [rad].
    """
    model = pin.Model()
    body = 0
    for name, joint in (("x", pin.JointModelPX()), ("z", pin.JointModelPZ()),
                        ("turn", pin.JointModelRY())):  # fmt: skip
        body = model.addJoint(body, joint, pin.SE3.Identity(), name)
    centre = np.array([0.0, 0.0, lever])
    model.inertias[body] = pin.Inertia(MASS, centre, np.diag([0.1, inertia, 0.1]))
    place = pin.SE3(np.eye(3), np.array([0.0, 0.0, -bottom]))
    model.addFrame(pin.Frame("bottom", body, 0, place, pin.OP_FRAME), False)
    model.gravity.linear = 9.81 * np.array([np.sin(slope), 0.0, -np.cos(slope)])
    return model


def acceleration(body: RigidBodyFunctions, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the accelerations of a body whose contact neither slips nor lifts."""
    theta, still = body.parameters, np.zeros(body.nq)
    mass, bias = np.array(body.mass_matrix(q, theta)), np.array(body.bias(q, v, theta)).ravel()
    jacobian = np.array(body.point_jacobian(q, theta))
    drift = np.array(body.point_accelerations(q, v, still, theta)).ravel()
    matrix = np.block([[mass, -jacobian.T], [jacobian, np.zeros((2, 2))]])
    return np.asarray(np.linalg.solve(matrix, np.concatenate([-bias, -drift]))[: body.nq])


def rolled(body: RigidBodyFunctions, turn: float, speed: float, time: np.ndarray) -> np.ndarray:
    """Return q and v over time of a body that begins with this turn and speed on the ground."""
    q = np.array([0.0, 0.0, turn])
    q[1] = -float(np.array(body.point_positions(q, body.parameters))[1, 0])
    jacobian = np.array(body.point_jacobian(q, body.parameters))
    v = np.append(-np.linalg.solve(jacobian[:, :2], jacobian[:, 2] * speed), speed)

    def rate(_: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[3:], acceleration(body, x[:3], x[3:])])

    found = solve_ivp(rate, time[[0, -1]], np.concatenate([q, v]), "DOP853", time, rtol=1e-11,
                      atol=1e-12)  # fmt: skip
    return np.asarray(found.y.T)


@pytest.mark.parametrize("backend", available_backends())
def test_a_disc_rolls_down_a_slope(backend: str) -> None:
    slope, inertia = 0.2, 0.5 * MASS * RADIUS**2
    model = floating(inertia, 0.0, RADIUS, slope)
    body = rigid_body_functions(model, ("bottom",), backend, (RADIUS,))
    time = np.linspace(0.0, 1.0, 21)
    x = rolled(body, 0.0, 0.0, time)
    expected = 9.81 * np.sin(slope) / (1.0 + inertia / (MASS * RADIUS**2))
    assert x[:, 0] == pytest.approx(expected * time**2 / 2.0, rel=1e-8, abs=1e-10)
    assert x[:, 2] == pytest.approx(x[:, 0] / RADIUS, rel=1e-8, abs=1e-10)
    assert np.ptp(x[:, 1]) < 1e-10


def test_a_half_disc_rocks_in_its_time() -> None:
    """About its lowest point, I + m (r - c)^2, against m g c, with c = 4 r / (3 pi)."""
    c = 4.0 * RADIUS / (3.0 * np.pi)
    inertia = 0.5 * MASS * RADIUS**2 - MASS * c**2
    body = rigid_body_functions(floating(inertia, -c, RADIUS), ("bottom",), shapes=(RADIUS,))
    expected = 2 * np.pi * np.sqrt((inertia + MASS * (RADIUS - c) ** 2) / (MASS * 9.81 * c))
    time = np.linspace(0.0, expected, 201)
    x = rolled(body, 1e-3, 0.0, time)
    assert x[-1, 2] == pytest.approx(1e-3, rel=1e-5)
    assert x[100, 2] == pytest.approx(-1e-3, rel=1e-5)
    energy = 0.5 * MASS * (x[:, 3:5] ** 2).sum(axis=1)
    assert energy.max() > 0.0
    assert np.array(body.point_positions(x[50, :3], body.parameters))[1] == pytest.approx(
        0.0, abs=1e-10
    )


def test_a_passive_walker_on_round_feet_repeats_its_step() -> None:
    """The synthetic wheel: feet of the leg's length, light legs; its step lasts 4.058 / omega.

    omega is the frequency of the free leg, and the step is the same for all (small) lengths.

    References:
        McGeer (1990) Int. J. Robot. Res. 9(2):62-82, the synthetic wheel.
    """
    length, centre, radius, light, begin = 0.8, 0.3, 0.2, 1e-6, 0.005
    model = floating(1.0, 0.0, length)  # all of its mass at the hip
    leg = model.addJoint(3, pin.JointModelRY(), pin.SE3.Identity(), "hip")
    inertia = light * np.diag([radius**2, radius**2, radius**2])
    model.inertias[leg] = pin.Inertia(light, np.array([0.0, 0.0, -centre]), inertia)
    body = rigid_body_functions(model, ("bottom",), shapes=(length,))
    omega = np.sqrt(9.81 * centre / (radius**2 + centre**2))
    step = 4.058 / omega
    rate = 2 * begin / step
    # the standing leg reaches forward, the other one, which stood before, is as far behind
    q = np.array([0.0, 0.0, -begin, 2 * begin])
    q[1] = -float(np.array(body.point_positions(q, body.parameters))[1, 0])
    jacobian = np.array(body.point_jacobian(q, body.parameters))
    v = np.append(-np.linalg.solve(jacobian[:, :2], jacobian[:, 2] * rate), [rate, 0.0])

    def change(_: float, x: np.ndarray) -> np.ndarray:
        return np.concatenate([x[4:], acceleration(body, x[:4], x[4:])])

    end = solve_ivp(change, (0.0, step), np.concatenate([q, v]), "DOP853", rtol=1e-11, atol=1e-13)
    x = end.y[:, -1]
    assert x[2] == pytest.approx(begin, rel=1e-3)
    assert x[2] + x[3] == pytest.approx(-begin, rel=1e-3)
    assert x[6] == pytest.approx(rate, rel=1e-3)  # a wheel goes on as it began


@pytest.mark.parametrize("backend", available_backends())
@pytest.mark.parametrize("feet", FEET)
def test_contacts_agree_with_differences_and_a_second_opinion(feet: Any, backend: str) -> None:
    walker = build_walker(PATIENT, backend=backend, feet=feet)
    body, theta = walker.rigid_body, walker.rigid_body.parameters
    rng, h = np.random.default_rng(3), 1e-6
    data = walker.model.createData()
    for _ in range(5):
        q, v, vdot = rng.uniform(-0.6, 0.6, 10), rng.normal(size=10), rng.normal(size=10)

        def speed(q: np.ndarray, v: np.ndarray) -> np.ndarray:
            return np.array(body.point_velocities(q, v, theta)).ravel()

        jacobian = np.array(body.point_jacobian(q, theta))
        assert jacobian @ v == pytest.approx(speed(q, v), abs=1e-12)
        rising = walker.contact_points(q + h * v) - walker.contact_points(q - h * v)
        assert rising[:, 1] / (2 * h) == pytest.approx(speed(q, v)[1::2], abs=1e-7)
        change = (speed(q + h * v, v + h * vdot) - speed(q - h * v, v - h * vdot)) / (2 * h)
        found = np.array(body.point_accelerations(q, v, vdot, theta)).ravel()
        assert found == pytest.approx(change, abs=1e-7)
        pin.framesForwardKinematics(walker.model, data, q)
        places = [place.position[[0, 2]] for place in touched(walker, data)]
        assert np.array(places) == pytest.approx(walker.contact_points(q), abs=1e-12)


def test_circles_without_radius_are_the_points_bit_by_bit() -> None:
    points, rockers = (build_walker(PATIENT, feet=feet) for feet in ("points", "rockers"))
    none = rockers.with_values(dict.fromkeys((n.address for n in rockers.parts.shapes), 0.0))
    flat = rigid_body_functions(points.model, CONTACT_POINTS, shapes=[0.0] * 4)
    assert flat.parameter_names == points.rigid_body.parameter_names
    rng = np.random.default_rng(0)
    for _ in range(5):
        q, v, a = rng.uniform(-0.6, 0.6, 10), rng.normal(size=10), rng.normal(size=10)
        body, other = points.rigid_body, none.rigid_body
        known = {"positions": (q,), "velocities": (q, v), "accelerations": (q, v, a)}
        for name, arguments in {**known, "jacobian": (q,)}.items():
            name = f"point_{name}"
            wanted = np.array(getattr(body, name)(*arguments, body.parameters))
            assert np.array_equal(
                np.array(getattr(flat, name)(*arguments, flat.parameters)), wanted
            )
            close = np.array(getattr(other, name)(*arguments, other.parameters))
            assert close == pytest.approx(wanted, rel=1e-13, abs=1e-13)


def test_a_sole_lies_between_its_ends_and_tends_to_them() -> None:
    walker = build_walker(PATIENT, feet="sole")
    ends = walker.with_values({n.address: 0.0 for n in walker.parts.shapes if n.unit == "m"})
    q = np.zeros(10)
    q[1] = 0.7
    assert walker.contact_points(q)[0, 0] == pytest.approx(walker.foot_points(q)[:2, 0].mean())
    q[5], length = 0.4, 0.145
    low = ends.foot_points(q)[:2, 1].min()
    for roundness in (5.0, 10.0, 20.0, 40.0):
        round_sole = ends.with_values({"sole_roundness.right": roundness})
        above = round_sole.contact_points(q)[0, 1] - low
        assert above == pytest.approx(np.log(2.0) * length / (4.0 * roundness), rel=1e-2)
    # the arc that it rolls over is the way of the place under the ankle and the ankle's own
    turns = np.linspace(-0.8, 0.8, 161)
    places = np.array([walker.contact_points(np.array([*q[:5], t, *q[6:]]))[0] for t in turns])
    height = walker.foot_points(np.array([*q[:5], 0.0, *q[6:]]))[0, 1] + 0.05 - places[:, 1]
    radius = np.gradient(places[:, 0], turns) + height
    values = walker.values
    flat = values["sole_roundness.right"] * length + values["rocker_radius.heel.right"]
    assert radius[80] == pytest.approx(flat, rel=1e-2)
    assert radius.argmax() == 80
    assert radius[1:-1].min() > 0.0  # convex everywhere


def test_patterns_hold_together() -> None:
    assert contact_pattern().phases == PHASES
    others = Use(("flat", "toe"), ("toe", "flat")), Use(("heel", "flat", "toe"), ("heel",))
    uses = product((*USES.values(), *others), repeat=2)
    for pattern in (
        *(contact_pattern("points", pair) for pair in uses),
        *map(contact_pattern, SOLES),
    ):
        assert len(set(pattern.names)) == len(pattern.phases)
        first, last = pattern.phases[0], pattern.phases[-1]
        assert last.feet == ("right", "left")
        right, left = pattern.steps
        assert right + left == pattern.phases
        if not first.compliant:  # whose feet stand when they are loaded
            assert first.feet == ("right",)  # a stride begins when the left foot leaves the ground
            assert pattern.toe_off("left") == 0
            assert pattern.phases[pattern.strike("left")].feet == ("right", "left")
            assert pattern.phases[pattern.toe_off("right")] == left[0]
        durations = pattern.durations(np.arange(1.0, 9.0))
        assert len(durations) == len(pattern.phases)
        assert durations.sum() == 36.0
        assert durations[: len(right)].sum() == 10.0
        for phase in pattern.phases:
            mirror = mirrored_phase(phase.name)
            assert mirrored_phase(mirror.name) == phase
            assert mirror.step != phase.step
            assert all(force in pattern.forces for force in phase.forces)


def coarse(feet: str, contact: Any, problem: str = "mapd-barefoot") -> StudyConfig:
    """Return a study on a coarse mesh of the pattern of these feet."""
    uses = USES[contact["right"]], USES[contact["left"]]
    pattern = contact_pattern("sole" if feet == "sole" else "points", uses)
    mesh = (10 if feet == "sole" else 3,) * len(pattern.phases)  # a round foot is quick
    values = {"model.feet": feet, "model.contact": contact, "mesh.intervals": mesh,
              "mesh.refinements": 0, "solver.tolerance": 1e-3, "verdict": False}  # fmt: skip
    return with_values(load_config(problem), values)


HEEL_TOE = {"right": "heel_toe", "left": "heel_toe"}


@pytest.mark.parametrize(
    ("feet", "contact"),
    [
        ("rockers", HEEL_TOE),
        ("points", {"right": "flat", "left": "flat"}),
        ("rockers", {"right": "toe", "left": "heel_toe"}),
        ("sole", HEEL_TOE),
    ],
    ids=["rockers", "flat", "mixed", "sole"],
)
def test_a_walk_with_these_feet_is_solved_and_holds(feet: str, contact: Any) -> None:
    solution = solve_study(coarse(feet, contact))
    assert solution.converged
    series = gait_series(solution.walker, solution.last_motion)
    assert second_engine_residual(series) < 1e-6
    stride = stride_of(series)
    pattern = solution.walker.pattern
    assert tuple(stride.phase_durations) == pattern.names
    heights = series.contact_position[:, :, 1]
    assert heights.min() > -2e-3
    assert np.abs(heights[stride.contacts]).max() < 1e-3
    if contact["right"] == "toe":
        assert not series.force[:, 0:2].any()  # no heel of that side ever stands
    for side in ("right", "left"):
        strike, off = stride.stance(side)  # type: ignore[arg-type]
        assert 0.3 < (off - strike) / stride.duration < 0.9


def test_a_symmetric_walk_on_soles_is_one_step_twice() -> None:
    config = with_values(
        load_config("mapd-healthy"),
        {"model.feet": "sole", "mesh.intervals": (4, 3, 4, 3), "mesh.refinements": 0,
         "solver.tolerance": 1e-3, "verdict": False, "bounds.phase_durations": {}},
    )  # fmt: skip
    solution = solve_study(config)
    assert solution.converged
    motion = solution.last_motion
    assert [p.name for p in motion.phases] == list(solution.walker.pattern.names)
    again = full_stride(Parts(), type(motion)(motion.phases[:2], motion.parameters))
    assert again.phases[2].states == pytest.approx(motion.phases[2].states)
    assert stride_of(gait_series(solution.walker, motion)).step_length("right") > 0.0


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"model.feet": "wheels"}, "points.*rockers.*sole"),
        ({"model.contact": "tiptoe"}, "heel_toe.*flat.*toe"),
        ({"model.feet": "sole", "model.contact": "toe"}, "roll over whatever they land on"),
        ({"model.feet": "sole", "mesh.intervals": [2] * 8}, "one per phase: 4 .right_sole"),
        ({"bounds.phase_durations": {"right_sole": [0.1, 0.5]}}, "which these feet do not have"),
        ({"model.feet": "sole", "cost.goals": {"centre_of_pressure": 1.0}}, "a sole rolls"),
        ({"free": {"sole_roundness": [1.0, 2.0]}}, "sole_roundness"),
    ],
)
def test_feet_that_cannot_be_are_refused(values: dict[str, Any], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        Case.of(with_values(load_config("mapd-barefoot"), values)).walker()


def test_shapes_are_numbers_like_all_others() -> None:
    parts = Parts(feet="sole")
    assert [n.address for n in parts.shapes][:2] == ["rocker_radius.heel.right",
                                                     "rocker_radius.toe.right"]  # fmt: skip
    free = ("sole_roundness", "rocker_radius.toe.left")
    walker: Walker = build_walker(PATIENT, feet="sole", free=free)
    assert [u.name for u in walker.unknowns] == ["sole_roundness", "toe_radius_left"]
    moved = walker.with_parameters([2.0, 0.04])
    numbers = [number for unknown in walker.unknowns for number in unknown.numbers]
    slopes = [walker.body_slopes(number) for number in numbers]
    changes = [moved.values[n.address] - walker.values[n.address] for n in numbers]
    assert moved.rigid_body.parameters == pytest.approx(
        walker.rigid_body.parameters + np.array(changes) @ np.array(slopes)
    )
    assert ca.DM(moved.rigid_body.parameters).is_regular()
    given = PATIENT.model_copy(update={"numbers": {"rocker_radius.heel": 0.05}})
    assert build_walker(given, feet="rockers").shapes[0] == 0.05


def test_a_calf_that_is_too_short_walks_on_its_toes() -> None:
    """Alike on soles, where it comes out, and with a pattern in which no heel ever stands."""
    short = {f"examination.dorsiflexion_knee_{knee}.{side}": reach for side in ("right", "left")
             for knee, reach in (("extended", -20.0), ("flexed", -15.0))}  # fmt: skip
    walks = {}
    for feet, contact in (("sole", "heel_toe"), ("rockers", "toe")):
        values = {"numbers": short, "model.feet": feet, "model.contact": contact,
                  "mesh.intervals": (14, 7, 14, 7), "mesh.refinements": 0,
                  "solver.tolerance": 1e-4, "verdict": False}  # fmt: skip
        solution = solve_study(with_values(load_config("predict-barefoot"), values))
        assert solution.converged
        walks[feet] = stride_of(gait_series(solution.walker, solution.last_motion))
    metrics = {feet: metrics_of(stride) for feet, stride in walks.items()}
    for key, apart in (("walking_speed", 0.05), ("stride_time", 0.06),
                       ("min_stance_knee_flexion_right", 0.05)):  # fmt: skip
        assert metrics["sole"][key] == pytest.approx(metrics["rockers"][key], abs=apart), key
    stride = walks["sole"]
    for side, index in (("right", 0), ("left", 1)):
        assert metrics["sole"][f"strike_index_{side}"] > 2 / 3  # lands on the forefoot
        heel, toe = (
            np.array([stride.walker.foot_points(q)[2 * index + k, 0] for q in stride.q])
            for k in (0, 1)
        )
        share = (stride.contact_position[:, index, 0] - heel) / (toe - heel)
        assert share[stride.stands(side)].min() > 0.6  # type: ignore[arg-type]
