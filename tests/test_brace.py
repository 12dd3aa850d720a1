"""An orthosis as a body of its own: a shell on a hinge, and a cuff that presses on the shank."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
import yaml

from figure_measure import complaints
from helpers import energy_rate, stylised_series
from pathwalker_cli.animation.drawing import drawing
from pathwalker_cli.animation.frames import gait_frames
from pathwalker_cli.animation.viewer import walker_geometry
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, with_values
from pathwalker_cli.conventions import SIDES, SUFFIX
from pathwalker_cli.errors import ConfigError, DataError, InputError, PatientError
from pathwalker_cli.export.osim import osim_text
from pathwalker_cli.gait import mesh
from pathwalker_cli.gait.cost_terms import goal_values
from pathwalker_cli.gait.further import with_further_joints
from pathwalker_cli.gait.motion_file import read_motion, write_motion
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.gait.symmetry import asymmetries
from pathwalker_cli.gait.typical import typical_walks
from pathwalker_cli.model.skeleton import PLANAR_WALKER, Side, walker_skeleton
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.patient.variation import Variation, varied
from pathwalker_cli.results.tables import forces_table, torques_table
from pathwalker_cli.stride.balance import balance
from pathwalker_cli.stride.figures.save import figure_names, make_figure
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import body_points, stride_of
from pathwalker_cli.stride.verify import equation_residual, second_engine_residual

SHIPPED = "sreenivasa2017-patient"
PATIENT = load_patient(SHIPPED)
N, ALL = PLANAR_WALKER.size, PLANAR_WALKER.size + 2
ANKLES, HINGES = [5, 8], [10, 11]
APART = {
    "orthosis.hinge.forward.right": 0.012,
    "orthosis.hinge.up.right": -0.02,
    "orthosis.hinge.forward.left": -0.007,
    "orthosis.hinge.up.left": 0.015,
}
"""Hinges that are not on the axes of the ankles."""


def braced(**more: Any) -> Walker:
    """Return the shipped child with shells that are bodies of their own."""
    return build_walker(PATIENT, "orthosis", orthosis="body", **more)


def random_state(seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return coordinates, velocities and torques of anything, hinges near the ankles."""
    rng = np.random.default_rng(seed)
    q, v, tau = 0.3 * rng.normal(size=ALL), rng.normal(size=ALL), 5.0 * rng.normal(size=ALL)
    q[HINGES] = q[ANKLES] + 0.05 * rng.normal(size=2)
    return q, v, tau


def shift_of(walker: Walker, side: Side, q: np.ndarray) -> np.ndarray:
    """Return how far a cuff is off its place on the leg, across and along [m]."""
    state = walker.state(q, 0.0 * q, [None] * 14)
    return np.array(walker.device.cuffs[side].shift(state, walker.values))


def cuff_torques(walker: Walker, side: Side, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Return the torques of a cuff on ankle and hinge [N m]."""
    state = walker.state(q, v, [None] * 14)
    return np.array(walker.device.cuffs[side].forces(state, walker.values))


def test_hinges_stand_behind_the_ten_coordinates_of_recordings() -> None:
    skeleton = braced().skeleton
    assert skeleton == walker_skeleton(shelled=SIDES)
    assert skeleton.coordinates == (*PLANAR_WALKER.coordinates, "hinge_r", "hinge_l")
    assert {"shell_r", "shell_l"} <= skeleton.links
    assert tuple(braced().model.names)[1:] == skeleton.coordinates
    assert braced().as_recorded.skeleton == PLANAR_WALKER
    again = pickle.loads(pickle.dumps(braced()))  # noqa: S301 - made just now
    assert again.values == braced().values
    assert build_walker(PATIENT, "barefoot", orthosis="body").skeleton == PLANAR_WALKER


@pytest.mark.parametrize("backend", ["compiled", "direct"])
def test_both_back_ends_are_numeric_pinocchio_wherever_the_hinge_is(backend: str) -> None:
    walker = braced(backend=backend).with_values(APART)
    body, model, data = walker.rigid_body, walker.model, walker.model.createData()
    q, v, vdot = random_state(1)
    wanted = pin.rnea(model, data, q, v, vdot)
    found = body.inverse_dynamics(q, v, vdot, body.parameters)
    assert np.asarray(found).ravel() == pytest.approx(wanted, abs=1e-10)


def test_a_shell_that_turns_with_the_shank_weighs_what_it_does_glued() -> None:
    own, glued = braced(), build_walker(PATIENT, "orthosis")
    q, v, vdot = random_state(2)
    for values in (q, v, vdot):
        values[HINGES] = values[ANKLES]
    theirs, alone = own.rigid_body, glued.rigid_body
    needed = np.asarray(theirs.inverse_dynamics(q, v, vdot, theirs.parameters)).ravel()
    wanted = alone.inverse_dynamics(q[:N], v[:N], vdot[:N], alone.parameters)
    # what the hinge feels is part of what a laboratory, to which both are one, finds at the ankle
    felt = own.joint_torques_of(needed)[:N]
    assert felt == pytest.approx(np.asarray(wanted).ravel(), abs=1e-8)
    assert own.total_mass == pytest.approx(glued.total_mass)


@pytest.mark.parametrize("side", SIDES)
def test_the_shift_is_that_of_frames_in_numeric_pinocchio(side: Side) -> None:
    walker, s = braced().with_values(APART), SUFFIX[side]
    q, _, _ = random_state(3)
    height = walker.values[f"orthosis.cuff_height.{side}"]
    hinge = [walker.values[f"orthosis.hinge.{way}.{side}"] for way in ("forward", "up")]
    data = walker.model.createData()
    pin.framesForwardKinematics(walker.model, data, q)
    shell, shank = (data.oMf[walker.model.getFrameId(f"{link}_{s}")] for link in ("shell", "shank"))
    on_shell = shell.act(np.array([-hinge[0], 0.0, height - hinge[1]]))
    ankle = data.oMi[walker.model.getJointId(f"ankle_{s}")].translation
    place = ankle + shank.rotation @ np.array([0.0, 0.0, height])
    seen = shank.rotation.T @ (on_shell - place)
    assert shift_of(walker, side, q) == pytest.approx(seen[[0, 2]], abs=1e-12)
    # what is drawn of a shell is there too
    points = body_points(walker, q)
    knee = shell.act(np.array([-hinge[0], 0.0, PATIENT.length("shank", side) - hinge[1]]))
    assert points[f"shell_knee_{s}"] == pytest.approx(knee[[0, 2]], abs=1e-9)


@pytest.mark.parametrize("side", SIDES)
def test_torques_are_the_slope_of_the_energy_in_the_cuff(side: Side) -> None:
    walker = braced().with_values(APART)
    q, _, _ = random_state(4)
    k = [walker.values[f"orthosis.cuff_stiffness.{way}.{side}"] for way in ("across", "along")]
    index = SIDES.index(side)

    def energy(which: int, step: float) -> float:
        moved = q.copy()
        moved[(ANKLES, HINGES)[which][index]] += step
        return float(np.dot(k, shift_of(walker, side, moved) ** 2) / 2.0)

    slopes = [(energy(i, 1e-6) - energy(i, -1e-6)) / 2e-6 for i in range(2)]
    assert cuff_torques(walker, side, q, 0.0 * q) == pytest.approx(-np.array(slopes), rel=1e-6)


def test_the_power_of_a_cuff_is_the_energy_it_gives_less_what_it_damps() -> None:
    walker, side = braced().with_values(APART), SIDES[0]
    q, v, _ = random_state(5)
    k, c = (
        np.array(
            [walker.values[f"orthosis.cuff_{kind}.{way}.{side}"] for way in ("across", "along")]
        )
        for kind in ("stiffness", "damping")
    )
    h = 1e-6
    rate = (shift_of(walker, side, q + h * v) - shift_of(walker, side, q - h * v)) / (2.0 * h)
    power = cuff_torques(walker, side, q, v) @ v[[ANKLES[0], HINGES[0]]]
    stored = float(k * shift_of(walker, side, q) @ rate)
    assert power == pytest.approx(-stored - float(c @ rate**2), rel=1e-6)


def test_one_expression_serves_numpy_and_casadi() -> None:
    walker = braced().with_values(APART)
    q, v, _ = random_state(6)
    activation = np.linspace(0.1, 0.6, 14)
    forces = walker.element_forces(q[None], v[None], activation[None])
    each, total = walker.force_function(q, v, activation)
    assert np.asarray(each).ravel() == pytest.approx(forces[0], abs=1e-9)
    assert np.asarray(total).ravel() == pytest.approx(
        walker.generalised_forces(forces)[0], abs=1e-9
    )
    symbols = [ca.SX.sym(name) for name in walker.skeleton.coordinates]
    state = walker.state(symbols, [ca.SX(0)] * ALL, [None] * 14)
    shift = walker.device.cuffs["left"].shift(state, walker.values)
    value = ca.Function("shift", [ca.vertcat(*symbols)], [ca.vertcat(*shift)])(q)
    assert np.asarray(value).ravel() == pytest.approx(shift_of(walker, "left", q), abs=1e-12)


def test_at_rest_the_cuff_presses_with_the_torque_over_its_height() -> None:
    walker = braced()
    height = walker.values["orthosis.cuff_height.right"]
    spring = walker.values["orthosis.cuff_stiffness.across.right"]
    start = np.zeros((1, N))
    start[0, 5] = -0.09  # between free play and stop: K_D at work
    (q,) = _postures_at_rest(walker, start)
    v = np.zeros(ALL)
    forces = walker.element_forces(q[None], v[None], np.zeros((1, 14)))
    torque = walker.device_torques(forces)[0, 0]
    assert torque > 3.0  # it resists dorsiflexion
    across, along, *_ = walker.cuff_forces(q[None], v[None], forces)[0]
    bent = q[5] - q[10]
    assert -0.01 < bent < 0.0  # the ankle is further bent than the hinge
    assert across == pytest.approx(-torque / height, rel=bent**2)
    assert shift_of(walker, "right", q)[0] == pytest.approx(
        -torque / (height * spring), rel=bent**2
    )
    assert along / across == pytest.approx(-bent / 6.0, rel=1e-3)  # a circle leaves its tangent
    net = walker.generalised_forces(forces)[0]
    assert net[10] == pytest.approx(0.0, abs=1e-9)
    assert net[5] == pytest.approx(torque, abs=1e-9)  # and the ankle feels all of it


def _postures_at_rest(walker: Walker, q: np.ndarray) -> np.ndarray:
    """Return postures (n, 10) with hinges where spring and cuff are in balance."""
    plain = typical_walks(walker.as_recorded)[0].scaled(walker, np.zeros(len(walker.unknowns)))
    first = plain.phases[0]
    states = np.repeat(first.states[:1], len(q), axis=0)
    states[:, :N] = q
    one = replace(plain, phases=(replace(first, states=states),))
    return with_further_joints(walker, one).phases[0].states[:, :ALL]


@pytest.mark.parametrize("angle", [-0.3, 0.2])
def test_a_hinge_off_the_axis_slides_the_cuff_as_geometry_says(angle: float) -> None:
    walker = braced()
    q = np.zeros(ALL)
    q[[5, 10]] = angle  # shell and shank are parallel
    assert shift_of(walker, "right", q) == pytest.approx(np.zeros(2), abs=1e-15)
    x, z = 0.01, 0.004
    moved = walker.with_values({"orthosis.hinge.forward.right": x, "orthosis.hinge.up.right": z})
    sin, cos = np.sin(angle), np.cos(angle)
    wanted = np.array([x * (cos - 1.0) + z * sin, z * (cos - 1.0) - x * sin])
    assert shift_of(moved, "right", q) == pytest.approx(wanted, abs=1e-15)
    assert shift_of(moved, "right", 0.0 * q) == pytest.approx(np.zeros(2), abs=1e-15)


@pytest.mark.parametrize("seed", [7, 8])
def test_power_of_all_forces_is_the_change_of_energy(seed: int) -> None:
    walker = braced().with_values(APART)
    q, v, tau = random_state(seed)
    phase = walker.pattern.phases[0]
    vdot, force = walker.contact_dynamics(phase, q, v, tau)
    body, theta = walker.rigid_body, walker.rigid_body.parameters
    speeds = np.asarray(body.point_velocities(q, v, theta)).ravel()
    change = energy_rate(walker, q, v, vdot)
    assert change == pytest.approx(float(tau @ v + force @ speeds), rel=1e-5, abs=1e-3)


def rigid_limit(stiffness: float) -> tuple[float, float]:
    """Return how far ankle torques and accelerations are from those of the glued model, relative.

    Both stand in heel contact; the cuff is bent by what lets the shell turn with the shank.
    """
    ways = {f"orthosis.cuff_stiffness.{way}.{side}": stiffness
            for way in ("across", "along") for side in SIDES}  # fmt: skip
    own, glued = braced().with_values(ways), build_walker(PATIENT, "orthosis")
    q, v, _ = random_state(9)
    v *= 0.2
    q[ANKLES] = -0.11, -0.05
    q[HINGES], v[HINGES] = q[ANKLES], v[ANKLES]
    phase, still = "right_heel_left_heel", np.zeros((1, 14))
    bare = glued.element_forces(q[None, :N], v[None, :N], still)
    wanted, _ = glued.contact_dynamics(phase, q[:N], v[:N], glued.generalised_forces(bare)[0])
    body, theta = own.rigid_body, own.rigid_body.parameters
    vdot = np.concatenate([wanted, wanted[ANKLES]])
    needed = np.asarray(body.inverse_dynamics(q, v, vdot, theta)).ravel()[HINGES]
    for _ in range(3):  # where the cuff exerts it on the shell beside the spring
        forces = own.element_forces(q[None], v[None], still)
        lacking = needed - own.generalised_forces(forces)[0, HINGES]
        heights = [own.values[f"orthosis.cuff_height.{side}"] for side in SIDES]
        q[HINGES] -= lacking / (stiffness * np.square(heights) + 200.0)
    forces = own.element_forces(q[None], v[None], still)
    felt = own.joint_torques_of(own.generalised_forces(forces))[0, ANKLES]
    before = glued.generalised_forces(bare)[0, ANKLES]
    found, _ = own.contact_dynamics(phase, q, v, own.generalised_forces(forces)[0])
    return (
        float(np.abs(felt - before).max() / np.abs(before).max()),
        float(np.abs(found[:N] - wanted).max() / np.abs(wanted).max()),
    )


def test_a_stiff_cuff_tends_to_the_glued_orthosis_to_first_order() -> None:
    errors = np.array([rigid_limit(k) for k in (1e5, 1e6, 1e7)])
    orders = np.log10(errors[:-1] / errors[1:])
    assert orders == pytest.approx(np.ones((2, 2)), abs=0.15)
    assert errors[-1].max() < 1e-3
    assert rigid_limit(1e9)[0] < 1e-4


def solver_of(**values: object) -> GaitSolver:
    """Return a solver of a braced walk on a mesh too coarse for more than a check."""
    given = {"model.orthosis": "body", "mesh.refinements": 0, "mesh.intervals": 24}
    return GaitSolver(Case.of(with_values(load_config("mapd-orthosis"), {**given, **values})))


def made_series(**values: object) -> GaitSeries:
    """Return a stylised stride with resting hinges; accelerations follow from the postures."""
    solver = solver_of(**values)
    walker, costs = solver.walker, len(solver.gait.costs.integrals)
    meshes = mesh.uniform([3] * 8)
    motion = solver.stride.motion(walker, solver.parameter_guess(), meshes, 3, costs)
    plain = replace(motion, phases=tuple(
        replace(p, states=p.states[..., [*range(N), *range(ALL, ALL + N)]],
                inner_states=p.inner_states[..., [*range(N), *range(ALL, ALL + N)]],
                algebraic=np.delete(p.algebraic, [N, N + 1, -2, -1], axis=-1))
        for p in motion.phases))  # fmt: skip
    series = gait_series(walker, with_further_joints(walker, plain))
    vdot, force = np.empty_like(series.vdot), np.empty_like(series.force)
    for k, (q, v) in enumerate(zip(series.q, series.v, strict=True)):
        vdot[k], force[k] = walker.contact_dynamics(series.phase[k], q, v, series.net_torque[k])
    return replace(series, vdot=vdot, force=force)


@pytest.fixture(scope="module")
def series() -> GaitSeries:
    """Return it with hinges that are off the axes."""
    return made_series(numbers=APART)


def test_the_second_engine_agrees_and_finds_a_wrong_hinge(series: GaitSeries) -> None:
    scale = float(np.abs(series.force).max())
    assert second_engine_residual(series) < 1e-9 * scale
    assert equation_residual(series, series.walker) < 1e-9 * scale
    moved = series.walker.with_values({"orthosis.hinge.forward.right": 0.02})
    assert second_engine_residual(replace(series, walker=moved)) > 1e-3


def test_resting_hinges_feel_no_torque_and_are_kept_in_files(
    series: GaitSeries, tmp_path: Path
) -> None:
    for phase in series.motion.phases:
        q = phase.states[:, :ALL]
        forces = series.walker.element_forces(q, 0.0 * q, np.zeros((len(q), 14)))
        torques = series.walker.generalised_forces(forces)[:, HINGES]
        assert np.abs(torques).max() < 1e-6
    write_motion(tmp_path / "motion.npz", series.motion)
    again = read_motion(tmp_path / "motion.npz")
    assert np.array_equal(again.phases[3].states, series.motion.phases[3].states)


def test_measures_and_tables_tell_what_the_cuff_does(series: GaitSeries) -> None:
    stride, walker = stride_of(series), series.walker
    found = metrics_of(stride)
    state = walker.state(series.q.T, series.v.T, [None] * 14)
    for i, side in enumerate(SIDES):
        cuff = walker.device.cuffs[side]
        across, along = cuff.load(state, walker.values, None)
        x, z = cuff.shift(state, walker.values)
        assert series.cuff_force[:, 2 * i : 2 * i + 2] == pytest.approx(
            np.stack([across, along], 1)
        )
        assert found[f"peak_shin_force_{side}"] == pytest.approx(max(0.0, -across.min()))
        assert found[f"peak_calf_force_{side}"] == pytest.approx(max(0.0, across.max()))
        pressure = np.abs(across).max() / PATIENT.cuff_area(side)
        assert found[f"peak_cuff_pressure_{side}"] == pytest.approx(pressure)
        assert found[f"peak_cuff_shear_{side}"] == pytest.approx(np.abs(along).max())
        assert found[f"pistoning_{side}"] == pytest.approx(z.max() - z.min())
        assert found[f"cuff_depth_{side}"] == pytest.approx(np.abs(x).max())
        apart = np.abs(series.q[:, ANKLES[i]] - series.q[:, HINGES[i]]).max()
        assert found[f"hinge_difference_{side}"] == pytest.approx(apart)
    squares = (series.cuff_force**2).sum(axis=1) / walker.weight**2
    value = goal_values(series.motion, walker, {})["cuff_load"]
    assert value == pytest.approx(series.quadrature @ squares / stride.distance, rel=1e-9)
    forces, torques = forces_table(series), torques_table(series)
    assert forces.names[-4:] == ("cuff_r_across", "cuff_r_along", "cuff_l_across", "cuff_l_along")
    net = torques.values[:, torques.names.index("ankle_r_net_torque")]
    assert net == pytest.approx(series.net_torque[:, 5] + series.net_torque[:, 10])


def test_of_a_glued_orthosis_there_is_no_pistoning() -> None:
    glued = build_walker(PATIENT, "orthosis")
    (cuff,) = {type(c) for c in glued.device.cuffs.values()}
    still = glued.state(np.zeros(N), np.zeros(N), [None] * 14)
    assert cuff("right").shift(still, glued.values) == (0.0, 0.0)
    assert metrics_of(stride_of(stylised_series("orthosis")))["pistoning_right"] is None


def test_shells_are_drawn_where_they_are(series: GaitSeries) -> None:
    frames = gait_frames(series, "braced", "mapd-orthosis", 20)
    shells = [shape for shape in drawing(frames).shapes if shape.kind == "shell"]
    assert {"shell_knee_r", "shell_knee_l"} <= {shape.start for shape in shells}
    assert np.abs(frames.points["shell_knee_r"] - frames.points["knee_r"]).max() > 1e-3
    geometry, data = walker_geometry(series.walker), series.walker.model.createData()
    placed, zero = pin.GeometryData(geometry), np.zeros(ALL)
    pin.updateGeometryPlacements(series.walker.model, data, geometry, placed, zero)
    at = placed.oMg[geometry.getGeometryId("shell_r")].translation[[0, 2]]
    points = body_points(series.walker, zero)
    wanted = 0.3 * points["knee_r"] + 0.7 * points["ankle_r"]
    assert at == pytest.approx(wanted, abs=1e-9)
    assert {"orthosis_curves", "cuffs"} <= set(figure_names(series))
    assert complaints(make_figure("cuffs", series)) == []
    curve = make_figure("orthosis_curves", series).axes[0].get_lines()
    walked = -np.rad2deg(series.q[:, HINGES[0]])
    spans = [line.get_xdata() for line in curve if len(line.get_xdata()) > 2]
    ends = {(round(float(min(x)), 6), round(float(max(x)), 6)) for x in spans}
    assert (round(float(walked.min()), 6), round(float(walked.max()), 6)) in ends


def test_places_of_hinges_and_cuffs_can_be_found_by_the_optimiser() -> None:
    free = {
        "orthosis.hinge.forward": (-0.01, 0.02),
        "orthosis.hinge.up.left": (-0.02, 0.02),
        "orthosis.cuff_height": (0.15, 0.22),
    }
    solver = solver_of(free=free)
    names = [unknown.name for unknown in solver.walker.unknowns[4:]]
    assert names == ["hinge_forward", "hinge_up_left", "cuff_height"]
    values = [50.0, 50.0, 5.0, 5.0, 0.015, -0.01, 0.18]
    moved = solver.walker.with_parameters(values)
    theta = solver.walker.rigid_body.parameters
    for unknown, value in zip(solver.walker.unknowns[4:6], values[4:6], strict=True):
        theta = theta + value * sum(map(solver.walker.body_slopes, unknown.numbers))
    assert theta == pytest.approx(moved.rigid_body.parameters, abs=1e-12)
    with pytest.raises(ConfigError, match=r"reaches 0\.2 m"):
        solver_of(free={"orthosis.hinge.up": (0.0, 0.2)})


@pytest.mark.parametrize(
    ("place", "before"),
    [("orthosis.hinge.forward", 0.0), ("orthosis.hinge.up.left", 0.0),
     ("orthosis.cuff_height", 0.7 * 0.2927), ("orthosis.cuff_area.left", 0.06 * 0.2927**2)],
)  # fmt: skip
def test_places_that_the_file_leaves_out_can_be_varied(place: str, before: float) -> None:
    changed = varied(PATIENT, Variation(shift={place: 0.002}))
    address = place if place.endswith("left") else f"{place}.left"
    assert changed.number(address) == pytest.approx(before + 0.002)
    assert varied(PATIENT, Variation(scale={"body_mass": 1.1})).orthosis == PATIENT.orthosis


def test_left_and_right_cuffs_that_differ_are_no_half_cycle() -> None:
    alike = {
        f"orthosis.cuff_{kind}.{way}.{side}": 1.0e4 if kind == "stiffness" else 1.0e2
        for kind in ("stiffness", "damping")
        for way in ("across", "along")
        for side in SIDES
    }
    sizes = {"cuff_height": 0.2, "dorsiflexion_stop": -0.13, "plantarflexion_stop": 0.1}
    alike |= {f"orthosis.{n}.{side}": x for side in SIDES for n, x in sizes.items()}
    walker = braced().with_values(alike)
    assert "orthoses" not in asymmetries(walker)
    other = walker.with_values({"orthosis.cuff_damping.along.left": 50.0})
    assert "orthoses" in asymmetries(other)


def test_a_shell_on_one_leg_alone(tmp_path: Path) -> None:
    source = PATIENT.source
    assert source is not None
    content = yaml.safe_load(source.read_text(encoding="utf-8"))
    content["orthosis"] |= {"sides": ["left"], "dorsiflexion_stop": -0.12, "hinge": {"up": 0.01}}
    content["orthosis"] |= {"plantarflexion_stop": 0.09, "cuff_stiffness": {"across": 2.0e4}}
    (tmp_path / "patient.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    walker = build_walker(load_patient(tmp_path), "orthosis", orthosis="body")
    assert walker.skeleton.coordinates == (*PLANAR_WALKER.coordinates, "hinge_l")
    assert walker.values["orthosis.cuff_stiffness.across.left"] == 2.0e4
    assert walker.values["orthosis.cuff_damping.across.left"] == 2.0e2
    assert walker.values["orthosis.hinge.up.left"] == 0.01
    q = np.zeros((1, N + 1))
    q[0, 8] = -0.1
    forces = walker.element_forces(q, 0.0 * q, np.zeros((1, 14)))
    loads = walker.cuff_forces(q, 0.0 * q, forces)[0]
    assert (loads[:2] == 0.0).all()
    height = walker.values["orthosis.cuff_height.left"]
    shin = 2.0e4 * height * np.sin(0.1)  # the shank leans into a shell that stands upright
    assert loads[2] == pytest.approx(-shin)
    values = {"patient": str(tmp_path), "bounds.joint_ranges": {"hinge_r": (-0.2, 0.2)}}
    with pytest.raises(ConfigError, match="hinge_r of a side on which"):
        solver_of(**values)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"transcription": "multiple-shooting"}, "shooting of an orthosis that is a body"),
        ({"model.orthosis": "glued", "bounds.joint_ranges": {"hinge_r": (-0.2, 0.2)}},
         "bounds hinge_r of an orthosis that is no body of its own"),
        ({"model.toes": True}, "gives toes to feet with orthoses"),
    ],
)  # fmt: skip
def test_what_a_shell_cannot_is_refused(values: dict[str, object], sentence: str) -> None:
    with pytest.raises(ConfigError, match=sentence):
        with_values(load_config("mapd-orthosis"), {"model.orthosis": "body", **values})


def test_a_shell_wants_a_mass_and_opensim_knows_none() -> None:
    case = Case.of(with_values(load_config("mapd-orthosis"), {
        "model.orthosis": "body", "numbers": {"orthosis.mass.shank.left": 0.0},
    }))  # fmt: skip
    with pytest.raises(PatientError, match="a shell without mass cannot be a body of its own"):
        case.walker()
    with pytest.raises(InputError, match="cannot be written for OpenSim"):
        osim_text(braced())


def test_a_walk_of_other_joints_is_no_start(series: GaitSeries) -> None:
    solver = solver_of(**{"model.orthosis": "glued"})
    with pytest.raises(DataError, match="moves 12 coordinates; allowed: a walk of the same 10"):
        solver.solve(series.motion)


@pytest.mark.slow
def test_a_braced_walk_is_found_and_proven() -> None:
    solution = solver_of(verdict=False).solve()
    assert solution.converged
    assert solution.second_engine < 1e-6
    found, stride = balance(solution.series), metrics_of(stride_of(solution.series))
    assert found.energy < 5e-3 * found.work_scale
    assert found.impulse < 5e-5 * found.impulse_scale
    assert found.orthosis_work < 0.0  # cuffs take up what they damp
    assert 0.005 < stride["cuff_depth_right"] < 0.02
    assert stride["peak_shin_force_right"] > 100.0
