"""Toes that a joint carries: the foot split in two, its stiff limit, its balances, and its walk."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from figure_measure import complaints
from helpers import energy_rate
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, with_values
from pathwalker_cli.conventions import SIDES, SUFFIX
from pathwalker_cli.errors import ConfigError, PatientError
from pathwalker_cli.export.osim import osim_text
from pathwalker_cli.gait import mesh
from pathwalker_cli.gait.further import with_further_joints
from pathwalker_cli.gait.motion_file import read_motion, write_motion
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.symmetry import asymmetries, full_stride
from pathwalker_cli.gait.typical import typical_walks
from pathwalker_cli.model.anthropometry import segments
from pathwalker_cli.model.contact import TIPS, ContactPhase, Feet, contact_pattern
from pathwalker_cli.model.skeleton import PLANAR_WALKER, walker_skeleton
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.figures.curves import TOES
from pathwalker_cli.stride.figures.save import figure_names, make_figure
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import body_points, phase_stances, stances_of, stride_of
from pathwalker_cli.stride.verify import second_engine_residual

PATIENT = load_patient("sreenivasa2017-patient")
FEET: tuple[Feet, ...] = ("points", "rockers", "sole", "compliant")
TOED = walker_skeleton(toes=True)
N, ALL = PLANAR_WALKER.size, TOED.size
ADULT = 75.0 * 1.75


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return coordinates, velocities and torques of anything."""
    rng = np.random.default_rng(seed)
    return 0.3 * rng.normal(size=ALL), rng.normal(size=ALL), 5.0 * rng.normal(size=ALL)


def test_the_ten_coordinates_of_recordings_come_first() -> None:
    assert TOED.coordinates == (*PLANAR_WALKER.coordinates, "mtp_r", "mtp_l")
    assert TOED.named("velocity")[-1] == "mtp_l_velocity"
    assert TOED.completed(np.ones((3, N))).sum(axis=1) == pytest.approx(np.full(3, N))
    assert tuple(build_walker(PATIENT, toes=True).model.names)[1:] == TOED.coordinates


@pytest.mark.parametrize("side", SIDES)
def test_foot_and_toes_weigh_what_the_foot_in_one_piece_does(side: str) -> None:
    s = SUFFIX[side]
    whole = {part.name: part for part in segments(PATIENT, "barefoot")}[f"foot_{s}"]
    parts = {part.name: part for part in segments(PATIENT, "barefoot", skeleton=TOED)}
    foot, toes = parts[f"foot_{s}"], parts[f"toes_{s}"]
    mass = foot.mass + toes.mass
    centre = np.array(toes.origin) + np.array(toes.com)
    common = (foot.mass * np.array(foot.com) + toes.mass * centre) / mass
    about = sum(
        part.inertia[1] + part.mass * float(np.sum((at - common) ** 2))
        for part, at in ((foot, np.array(foot.com)), (toes, centre))
    )
    assert mass == pytest.approx(whole.mass, rel=1e-14)
    assert common == pytest.approx(np.array(whole.com), abs=1e-15)
    assert about == pytest.approx(whole.inertia[1], rel=1e-12)
    assert toes.mass / mass == pytest.approx(0.2166 / 1.5666, rel=3e-3)
    assert toes.origin[0] == pytest.approx(0.65 * whole.length, rel=1e-6)
    assert toes.length == pytest.approx((1.0 / 0.73 - 1.0) * whole.length)


@pytest.mark.parametrize("backend", ["compiled", "direct"])
def test_both_back_ends_are_numeric_pinocchio(backend: str) -> None:
    walker = build_walker(PATIENT, toes=True, backend=backend)
    body, model, data = walker.rigid_body, walker.model, walker.model.createData()
    q, v, vdot = random_state(1)
    theta, rest = body.parameters, np.zeros(ALL)
    wanted = pin.rnea(model, data, q, v, vdot)
    assert np.asarray(body.inverse_dynamics(q, v, vdot, theta)).ravel() == pytest.approx(
        wanted, abs=1e-10
    )
    still = pin.rnea(model, data, q, rest, rest)
    mass = [pin.rnea(model, data, q, rest, unit) - still for unit in np.eye(ALL)]
    assert np.asarray(body.mass_matrix(q, theta)) == pytest.approx(np.array(mass), abs=1e-10)
    places = walker.frames(q, [point.name for point in walker.pattern.points])
    assert walker.contact_points(q) == pytest.approx(np.array([*places.values()]), abs=1e-12)


def test_toes_held_still_leave_the_flat_footed_walker() -> None:
    toed, flat = build_walker(PATIENT, toes=True), build_walker(PATIENT)
    q, v, vdot = (values * ([1.0] * N + [0.0] * 2) for values in random_state(2))
    needed = toed.rigid_body.inverse_dynamics(q, v, vdot, toed.rigid_body.parameters)
    wanted = flat.rigid_body.inverse_dynamics(q[:N], v[:N], vdot[:N], flat.rigid_body.parameters)
    # a URDF has nine digits
    assert np.asarray(needed).ravel()[:N] == pytest.approx(np.asarray(wanted).ravel(), abs=1e-8)


def accelerations(toed: Walker, flat: Walker, stiffness: float) -> tuple[np.ndarray, np.ndarray]:
    """Return how both walkers accelerate in heel contact, toes bent by what holds them still."""
    q, v, tau = (values * ([1.0] * N + [0.0] * 2) for values in random_state(5))
    v *= 0.2
    q[1] -= float(toed.frames(q, ["heel_r"])["heel_r"][1])
    q[1] += 0.1  # no tip touches the ground
    phase = "right_heel_left_heel"
    wanted, force = flat.contact_dynamics(phase, q[:N], v[:N], tau[:N])
    body, theta = toed.rigid_body, toed.rigid_body.parameters
    jacobian = np.asarray(body.point_jacobian(q, theta))[: force.size]
    needed = body.inverse_dynamics(q, v, toed.skeleton.completed(wanted), theta)
    holding = (np.asarray(needed).ravel() - jacobian.T @ force)[N:]
    values = {f"toes.stiffness.{side}": stiffness for side in SIDES}
    q[N:] = -holding / stiffness
    passive = toed.with_values(values).element_forces(q[None], v[None], np.zeros((1, 14)))
    bent = toed.generalised_forces(passive)[0]
    assert bent[N:] == pytest.approx(holding, rel=1e-9)
    return toed.contact_dynamics(phase, q, v, tau + bent)[0], wanted


def test_a_stiff_toe_joint_tends_to_the_flat_foot_to_first_order() -> None:
    toed, flat = build_walker(PATIENT, toes=True), build_walker(PATIENT)
    errors = []
    for stiffness in (1e3, 1e4, 1e5):
        found, wanted = accelerations(toed, flat, stiffness)
        errors.append(float(np.abs(found[:N] - wanted).max() / np.abs(wanted).max()))
    orders = np.log10(np.array(errors[:-1]) / errors[1:])
    assert orders == pytest.approx(np.ones(2), abs=0.1)
    assert errors[-1] < 1e-5


@pytest.mark.parametrize("feet", FEET)
@pytest.mark.parametrize("seed", [3, 4])
def test_power_of_all_forces_is_the_change_of_energy(feet: Feet, seed: int) -> None:
    walker = build_walker(PATIENT, toes=True, feet=feet)
    q, v, tau = random_state(seed)
    q[1] = (
        -float(walker.contact_points(q)[:, 1].min()) - 0.004 + q[1]
    )  # some place is in the ground
    phase = walker.pattern.phases[0]
    vdot, force = walker.contact_dynamics(phase, q, v, tau)
    body, theta = walker.rigid_body, walker.rigid_body.parameters
    speeds = np.asarray(body.point_velocities(q, v, theta)).ravel()
    change = energy_rate(walker, q, v, vdot)
    power = float(tau @ v + force @ speeds)
    assert change == pytest.approx(power, rel=1e-5, abs=1e-5 * np.abs(tau * v).sum())


def test_the_joint_is_a_published_spring_and_damper_of_a_child() -> None:
    walker = build_walker(PATIENT, toes=True)
    size = PATIENT.body_mass * PATIENT.height / ADULT
    q, v = np.zeros((1, ALL)), np.zeros((1, ALL))
    q[0, N:], v[0, N:] = (-0.4, 0.1), (2.0, -1.0)
    forces = walker.element_forces(q, v, np.zeros((1, 14)))
    torque = walker.generalised_forces(forces)[0, N:]
    assert torque == pytest.approx(size * (25.0 * np.array([0.4, -0.1]) - [4.0, -2.0]))
    others = [i for i in range(forces.shape[1]) if forces[0, i] and i < forces.shape[1] - 2]
    assert not others  # activations are 0


def test_tips_push_in_every_phase_and_hold_nothing() -> None:
    for feet in FEET:
        bare, toed = contact_pattern(feet), contact_pattern(feet, toes=True)
        assert toed.names == bare.names
        assert toed.points == (*bare.points, *TIPS)
        for phase, plain, after in zip(toed.phases, bare.phases, toed.following, strict=True):
            assert phase.rigid == plain.rigid
            assert {force.point for force in phase.yielding} >= set(TIPS)
            assert (phase.feet, phase.points) == (plain.feet, plain.points)
            for forces in (phase.touched_down(after), phase.lifted_off(after)):
                assert not {force.point for force in forces}.intersection(TIPS)
            assert toed.in_the_air(phase) == bare.in_the_air(plain)
            assert contact_pattern(feet, toes=True).phase(phase.name) == phase
    assert isinstance(contact_pattern(toes=True).phase(0), ContactPhase)


def toed_solver(**values: object) -> GaitSolver:
    """Return a solver of a walk with toes on a mesh too coarse for more than a check."""
    config = with_values(
        load_config("mapd-barefoot"),
        {"model.toes": True, "mesh.refinements": 0, "mesh.intervals": 24, **values},
    )
    return GaitSolver(Case.of(config))


def made_series() -> GaitSeries:
    """Return a stylised stride whose accelerations and forces follow from its postures."""
    solver = toed_solver()
    walker, meshes = solver.walker, mesh.uniform([3] * 8)
    costs = len(solver.gait.costs.integrals)
    motion = solver.stride.motion(walker, solver.parameter_guess(), meshes, 3, costs)
    series = gait_series(walker, motion)
    vdot, force = np.empty_like(series.vdot), np.empty_like(series.force)
    for k, (q, v) in enumerate(zip(series.q, series.v, strict=True)):
        vdot[k], force[k] = walker.contact_dynamics(series.phase[k], q, v, series.net_torque[k])
    return replace(series, vdot=vdot, force=force)


def test_the_second_engine_agrees_and_finds_a_wrong_push() -> None:
    series = made_series()
    scale = float(np.abs(series.force).max())
    assert second_engine_residual(series) < 1e-9 * scale
    force = series.force.copy()
    force[5, series.walker.pattern.upward(TIPS)] += 1.0
    assert second_engine_residual(replace(series, force=force)) > 0.5


def test_toes_are_drawn_exported_and_measured() -> None:
    series = made_series()
    assert "toe_joints" in figure_names(series)
    assert "orthosis_curves" not in figure_names(series)
    figure = make_figure("toe_joints", series)
    assert complaints(figure) == []
    shown = [ax for ax in figure.axes if ax.axison]
    assert [len({line.get_linestyle() for line in ax.get_lines()}) >= 2 for ax in shown] == [
        True
    ] * 3
    assert all("[" in ax.get_ylabel() for ax in shown)
    right = TOES.columns(stride_of(series), "right")[:, 0]
    assert right == pytest.approx(-np.rad2deg(series.column("mtp_r")))
    points = body_points(series.walker, np.zeros(ALL))
    reach = points["tip_r"] - points["toe_r"]
    assert reach == pytest.approx([series.walker.patient.toes_length("right"), 0.0], abs=1e-9)
    text = osim_text(series.walker)
    for name in ("toes_r", "mtp_l", "passive_mtp_r", "tip_l"):
        assert f'name="{name}"' in text
    assert asymmetries(series.walker) == asymmetries(build_walker(PATIENT))
    assert stride_of(series).q.shape[1] == ALL


def test_a_foot_is_off_the_ground_when_its_toes_are() -> None:
    series = made_series()
    pattern, force = series.walker.pattern, np.zeros_like(series.force)
    off = phase_stances(pattern, series.motion.durations)["right"][1]
    tip, later = pattern.upward(TIPS)[0], (series.time - off) % series.duration
    force[:, tip] = np.where(later < 0.1, 40.0 * (1.0 - later / 0.1), 0.0)  # 20 N after 0.05 s
    pushing = replace(series, force=force)
    assert stances_of(pushing)["right"][1] - off == pytest.approx(0.05, abs=0.03)
    assert stances_of(replace(series, force=0.0 * force))["right"][1] == pytest.approx(off)
    stride = stride_of(pushing)
    rows = (later > 0.0) & (later < 0.04)
    assert stride.stands("right")[rows].all()
    assert stride.contacts[:, pattern.points.index(TIPS[0])].sum() == np.sum(force[:, tip] > 20.0)


def test_a_walk_is_given_toes_that_lie_on_the_ground(tmp_path: Path) -> None:
    solver = toed_solver()
    walker = solver.walker
    plain = typical_walks(walker.as_recorded)[0].scaled(walker, solver.parameter_guess())
    motion = with_further_joints(walker, plain)
    deepest = 0.0
    for phase in motion.phases:
        for q in phase.states[:, :ALL]:
            assert q[N:].max() <= 0.0
            places = walker.frames(q, [f"{name}_{s}" for name in ("tip", "toe") for s in "rl"])
            tips, balls = np.array([*places.values()])[:, 1].reshape(2, 2)
            deepest = min(deepest, *(t - min(b, 0.0) for t, b in zip(tips, balls, strict=True)))
    assert -0.02 < deepest < 0.0
    write_motion(tmp_path / "motion.npz", motion)
    again = read_motion(tmp_path / "motion.npz")
    assert np.array_equal(again.phases[3].states, motion.phases[3].states)
    half = replace(motion, phases=motion.phases[:4])
    mirrored = full_stride(walker.parts, half)
    first, turned = (m.phases[i].states[0, N:ALL] for m, i in ((motion, 0), (mirrored, 4)))
    assert turned == pytest.approx(first[::-1])


@pytest.mark.parametrize(
    ("name", "values", "sentence"),
    [
        ("mapd-orthosis", {}, "gives toes to feet with orthoses, whose soles are one plate"),
        (
            "mapd-barefoot",
            {"transcription": "multiple-shooting"},
            "shooting of feet with toes, too quick",
        ),
    ],
)
def test_what_feet_with_toes_cannot_is_refused(
    name: str, values: dict[str, object], sentence: str
) -> None:
    with pytest.raises(ConfigError, match=sentence):
        with_values(load_config(name), {"model.toes": True, **values})


def test_ranges_of_toes_want_toes() -> None:
    ranges = {"bounds.joint_ranges": {"mtp_r": (-1.0, 0.2)}}
    with pytest.raises(ConfigError, match="bounds mtp_r of toes that no joint carries"):
        with_values(load_config("mapd-barefoot"), ranges)
    bounds = toed_solver(**ranges).bounds
    assert bounds.table.entries[("mtp_r",)] == (-1.0, 0.2)
    assert bounds.table.entries[("mtp_l",)] == (-1.2, 0.6)


def test_a_toe_point_in_front_of_the_ball_is_refused() -> None:
    with pytest.raises(PatientError, match="too far in front of the foot r to be the ball"):
        build_walker(load_patient("sreenivasa2017-healthy"), toes=True)


@pytest.mark.slow
def test_a_walk_with_toes_is_found_and_proven() -> None:
    solution = toed_solver().solve()
    assert solution.converged
    series = solution.series
    assert solution.second_engine < 1e-6
    # the heel rises over toes that stay on the ground
    assert series.q[:, N:].min(axis=0) == pytest.approx([-0.25, -0.15], abs=0.15)
    assert series.force[:, series.walker.pattern.upward(TIPS)].max() > 20.0
    found = balance(series)
    assert found.energy < 5e-3 * found.work_scale
    assert found.impulse < 5e-5 * found.impulse_scale
