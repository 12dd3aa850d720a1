"""Runs as other programs read them: tables, and a model in which OpenSim finds our torques."""

from __future__ import annotations

from functools import cache
from itertools import product
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from click.testing import CliRunner
from scipy.interpolate import CubicSpline

from conftest import MadeSolution
from helpers import stylised_series
from opensim_peer import opensim_says, read_opensim, with_opensim
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Condition
from pathwalker_cli.export.files import write_export
from pathwalker_cli.model.contact import Feet
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import body_points
from pathwalker_cli.trajectory import Trajectory

FOUND = Path(__file__).parent / "data" / "opensim_torques.csv"
PLAIN = {"motion.mot", "ground_forces.mot", "torques.sto", "points.trc"}
MODEL = {
    "model.osim", "states.sto", "controls.sto", "external_loads.xml", "inverse_dynamics.xml",
}  # fmt: skip
RUNS = (
    "ls-barefoot", "mapd-barefoot", "mapd-orthosis", "mapd-ws-orthosis", "mapd-healthy",
    "predict-barefoot", "predict-orthosis",
)  # fmt: skip
WALKERS: list[tuple[Condition, Feet, bool]] = [
    ("barefoot", "points", False),
    ("orthosis", "points", False),
    ("barefoot", "rockers", True),
    ("orthosis", "sole", True),
]


@cache
def walker_with(condition: Condition, feet: Feet, tissue: bool) -> Walker:
    """Return the published patient on such feet."""
    patient = load_patient("sreenivasa2017-patient")
    return build_walker(patient, condition, feet=feet, tissue=tissue)


def lively(walker: Walker, count: int = 12) -> GaitSeries:
    """Return random instants that obey the equations of motion, as no walk but with all forces."""
    rng, n = np.random.default_rng(3), len(COORDINATES)
    q, v = rng.uniform(-0.3, 0.3, (count, n)), rng.normal(0.0, 2.0, (count, n))
    activation = rng.uniform(0.0, 1.0, (count, len(walker.muscles)))
    force = rng.uniform(0.0, 200.0, (count, len(walker.pattern.forces)))
    force[:, [i for i, f in enumerate(walker.pattern.forces) if f.name.startswith("toe")][::2]] = 0
    elements = walker.element_forces(q, v, activation)
    vdot = np.zeros_like(q)
    for row, driven in enumerate(walker.generalised_forces(elements)):
        mass, bias, jacobian, *_ = map(np.asarray, walker.dynamics_terms(q[row], v[row]))
        vdot[row] = np.linalg.solve(mass, driven + jacobian.T @ force[row] - bias.ravel())
    return GaitSeries(
        walker=walker,
        motion=stylised_series().motion,
        time=np.linspace(0.0, 0.4, count),
        phase=(),
        q=q,
        v=v,
        vdot=vdot,
        activation=activation,
        activation_rate=np.zeros_like(activation),
        force=force,
        reserve=np.zeros_like(q),
        element_force=elements,
    )


@with_opensim
@pytest.mark.parametrize(("condition", "feet", "tissue"), WALKERS)
def test_opensim_finds_our_torques_and_accelerations(
    condition: Condition, feet: Feet, tissue: bool, tmp_path: Path
) -> None:
    write_export(tmp_path, lively(walker_with(condition, feet, tissue)), opensim=True)
    said = opensim_says(tmp_path)
    assert len(said["torques"]) == len(COORDINATES)
    assert max(said["torques"].values()) < 1e-6
    assert said["accelerations"] < 1e-5 * said["largest acceleration"]


@with_opensim
@pytest.mark.slow
@pytest.mark.parametrize("config", RUNS)
def test_opensim_finds_the_torques_of_shipped_problems(
    config: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    run, out = str(tmp_path / "run"), tmp_path / "out"
    for words in (
        ["solve", load_config(config).problem, config, "--out", run, "--set", "verdict=false"],
        ["export", run, "-o", str(out), "--opensim"],
    ):
        result = CliRunner().invoke(cli, words)
        assert result.exit_code == 0, result.output
    said = opensim_says(out)
    assert max(said["torques"].values()) < 1e-3, "[N m], at the pelvis [N] too"
    assert said["accelerations"] < 1e-5 * said["largest acceleration"]


# What a model holds, read without OpenSim


def floats(element: ElementTree.Element | None) -> np.ndarray:
    """Return the numbers of a node."""
    assert element is not None
    assert element.text
    return np.array(element.text.split(), float)


def read_osim(path: Path) -> tuple[pin.Model, ElementTree.Element]:
    """Return the rigid bodies of a model file as a reader of its own sees them, and its root."""
    root = ElementTree.parse(path).getroot().find("Model")
    assert root is not None
    model = pin.Model()
    model.gravity.linear = floats(root.find("gravity"))
    bodies = {body.get("name"): body for body in root.iterfind("BodySet/objects/Body")}
    places = {"/ground": (0, pin.SE3.Identity())}
    for joint in root.iterfind("JointSet/objects/*"):
        frame = joint.find("frames/PhysicalOffsetFrame")
        assert frame is not None
        assert joint.findtext("socket_parent_frame") == frame.get("name")
        holder, above = places[frame.findtext("socket_parent", "")]
        place = above * pin.SE3(np.eye(3), floats(frame.find("translation")))
        moves = [axis for axis in joint.iterfind("SpatialTransform/TransformAxis")
                 if axis.findtext("coordinates")]  # fmt: skip
        for axis in sorted(moves, key=lambda each: each.get("name", ""), reverse=True):
            slides = axis.get("name", "").startswith("translation")
            kind = pin.JointModelPrismaticUnaligned if slides else pin.JointModelRevoluteUnaligned
            name = axis.findtext("coordinates")
            holder = model.addJoint(holder, kind(floats(axis.find("axis"))), place, name)
            place = pin.SE3.Identity()
        child = joint.findtext("socket_child_frame", "")
        body = bodies.pop(child.rpartition("/")[2])
        inertia = np.diag(floats(body.find("inertia"))[:3])
        mass, centre = floats(body.find("mass"))[0], floats(body.find("mass_center"))
        model.appendBodyToJoint(holder, pin.Inertia(mass, centre, inertia), place)
        places[child] = (holder, place)
    assert not bodies, "every body hangs on a joint"
    return model, root


def torques(model: pin.Model, *state: np.ndarray) -> np.ndarray:
    """Return inverse dynamics, shape (m, 10), of q, v, vdot in the order of the coordinates."""
    order = [list(model.names)[1:].index(name) for name in COORDINATES]
    found = []
    for rows in zip(*state, strict=True):
        given = [np.zeros(len(order)) for _ in rows]
        for vector, row in zip(given, rows, strict=True):
            vector[order] = row
        found.append(pin.rnea(model, model.createData(), *given)[order])
    return np.array(found)


@pytest.mark.parametrize(("condition", "feet", "tissue"), WALKERS)
def test_the_model_holds_the_walker(
    condition: Condition, feet: Feet, tissue: bool, tmp_path: Path
) -> None:
    walker = walker_with(condition, feet, tissue)
    series = lively(walker)
    write_export(tmp_path, series, opensim=True)
    model, root = read_osim(tmp_path / "model.osim")
    state = series.q, series.v, series.vdot
    expected = torques(walker.model, *state)  # its URDF has nine digits
    np.testing.assert_allclose(torques(model, *state), expected, rtol=1e-7, atol=1e-6)
    # actuators and orthoses give back the torques of all elements
    driven = {name: np.zeros_like(series.time) for name in COORDINATES}
    controls = read_opensim(tmp_path / "controls.sto")
    for actuator in root.iterfind("ForceSet/objects/CoordinateActuator"):
        control = controls[f"/forceset/{actuator.get('name')}"]
        least = float(actuator.findtext("min_control", "-inf"))
        assert (least == 0.0) == (not actuator.get("name", "").startswith("passive"))
        assert control.min() >= least, "muscles pull one way"
        driven[actuator.findtext("coordinate", "")] += (
            control * floats(actuator.find("optimal_force"))[0]
        )
    for name, spline in splines(root).items():
        ankle = name.replace("orthosis", "ankle")
        driven[ankle] = driven[ankle] + spline(-series.column(ankle))
    net = np.column_stack(list(driven.values()))
    np.testing.assert_allclose(net, series.net_torque, rtol=1e-7, atol=1e-5)


def splines(root: ElementTree.Element) -> dict[str, CubicSpline]:
    """Return the moment that each bushing resists with over the turn of its foot."""
    found = {}
    for bushing in root.iterfind("ForceSet/objects/FunctionBasedBushingForce"):
        points = bushing.find("m_z_theta_z_function/SimmSpline")
        assert points is not None
        x, y = floats(points.find("x")), floats(points.find("y"))
        found[bushing.get("name", "")] = CubicSpline(x, y, bc_type="natural")
    return found


def test_opensim_found_these_torques(tmp_path: Path) -> None:
    """Stored once from OpenSim 4.6: inverse dynamics without loads, and moments of the orthoses."""
    walker = walker_with("orthosis", "points", False)
    write_export(tmp_path, lively(walker), opensim=True)
    model, root = read_osim(tmp_path / "model.osim")
    with FOUND.open(encoding="utf-8") as file:
        names = file.readline().strip().split(",")
        stored = dict(zip(names, np.loadtxt(file, delimiter=",").T, strict=True))
    q, v, vdot, tau = (
        np.column_stack([stored[f"{kind} {name}"] for name in COORDINATES])
        for kind in ("q", "v", "vdot", "tau")
    )
    np.testing.assert_allclose(torques(model, q, v, vdot), tau, rtol=1e-9, atol=1e-8)
    for name, spline in splines(root).items():
        turn = -stored[f"q {name.replace('orthosis', 'ankle')}"]
        np.testing.assert_allclose(spline(turn), stored[name], atol=1e-5)


def test_markers_and_circles_are_on_the_feet(tmp_path: Path) -> None:
    walker = walker_with("orthosis", "rockers", False)
    write_export(tmp_path, lively(walker), opensim=True)
    model, root = read_osim(tmp_path / "model.osim")
    zero = np.zeros(len(COORDINATES))
    data, names = model.createData(), list(model.names)
    pin.forwardKinematics(model, data, zero)
    places = body_points(walker, zero)
    for marker in root.iterfind("MarkerSet/objects/Marker"):
        body = marker.findtext("socket_parent_frame", "").rpartition("/")[2]
        joint = {"thigh": "hip", "shank": "knee", "foot": "ankle"}.get(body[:-2], "lumbar")
        holder = names.index(joint if joint == "lumbar" else f"{joint}_{body[-1]}")
        at = data.oMi[holder].translation + floats(marker.find("location"))
        expected = [*places[marker.get("name", "")], 0.0]
        np.testing.assert_allclose(at, expected, atol=1e-12)
    spheres = root.findall("ContactGeometrySet/objects/ContactSphere")
    assert [floats(sphere.find("radius"))[0] for sphere in spheres] == pytest.approx(walker.shapes)
    for sphere in spheres:
        foot = root.find(f"MarkerSet/objects/Marker[@name='{sphere.get('name', '')[:-7]}']")
        assert foot is not None
        low = floats(sphere.find("location")) - [0.0, floats(sphere.find("radius"))[0], 0.0]
        np.testing.assert_allclose(low, floats(foot.find("location")), atol=1e-12)


# The command


@pytest.mark.parametrize("opensim", [False, True])
def test_tables_hold_the_run(opensim: bool, made_runs: Path, tmp_path: Path) -> None:
    series, out = stylised_series("orthosis"), tmp_path / "out"
    words = ["export", str(made_runs / "mapd-orthosis"), "-o", str(out)]
    result = CliRunner().invoke(cli, words + ["--opensim"] * opensim)
    assert result.exit_code == 0, result.output
    assert {path.name for path in out.iterdir()} == PLAIN | (MODEL if opensim else set())
    assert all(name in result.output for name in PLAIN)
    motion = read_opensim(out / "motion.mot")
    assert motion.names == COORDINATES
    np.testing.assert_allclose(motion.time, series.time, rtol=1e-10)
    np.testing.assert_allclose(motion.values, series.q, rtol=1e-10, atol=1e-12)
    net = read_opensim(out / "torques.sto")
    np.testing.assert_allclose(net["knee_l_moment"], series.net_torque[:, 7], rtol=1e-9)


def test_forces_act_where_they_did(made_runs: Path, tmp_path: Path) -> None:
    """Force and moment of each foot about the origin are those of the contact points."""
    series = stylised_series("orthosis")
    words = ["export", str(made_runs / "mapd-orthosis"), "-o", str(tmp_path)]
    assert CliRunner().invoke(cli, words).exit_code == 0
    table = read_opensim(tmp_path / "ground_forces.mot")
    for side in SIDES:
        s, rows = SUFFIX[side], series.walker.pattern.rows(side)
        # at time 0 the run solves for its forces; the stylised ones do not obey any equation
        force = series.force.reshape(len(series.time), -1, 2)[1:, rows]
        moment = (force[..., 1] * series.contact_position[1:, rows, 0]).sum(axis=1)
        np.testing.assert_allclose(table[f"ground_force_{s}_vx"][1:], force[..., 0].sum(axis=1))
        up = table[f"ground_force_{s}_vy"][1:]
        np.testing.assert_allclose(up, force[..., 1].sum(axis=1))
        np.testing.assert_allclose(table[f"ground_force_{s}_px"][1:] * up, moment, atol=1e-6)


def test_points_move_with_the_walker(made_runs: Path, tmp_path: Path) -> None:
    series = stylised_series("orthosis")
    words = ["export", str(made_runs / "mapd-orthosis"), "-o", str(tmp_path)]
    assert CliRunner().invoke(cli, words).exit_code == 0
    lines = (tmp_path / "points.trc").read_text(encoding="utf-8").splitlines()
    names = [name for name in lines[3].split("\t")[2:] if name]
    rows = np.array([line.split("\t") for line in lines[6:]], float)
    assert len(rows) == int(100 * series.duration) + 1
    motion = Trajectory(series.time, COORDINATES, series.q, ("",) * len(COORDINATES))
    for frame, name in product((0, 40, len(rows) - 1), names):
        forward, up = 1e3 * body_points(series.walker, motion.at(rows[[frame], 1])[0])[name]
        at = rows[frame, 2 + 3 * names.index(name) :][:3]
        np.testing.assert_allclose(at, [forward, up, 0.0], atol=1e-3)


def test_what_is_no_solution_or_no_folder_is_refused(
    made_runs: Path, made_solution: MadeSolution, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    write_run(tmp_path / "failed", made_solution("mapd-barefoot", status="iteration limit"))
    (tmp_path / "file").touch()
    for run, out, said in (
        (tmp_path / "failed", "out", "solve it again first"),
        (tmp_path, "out", "is no run folder"),
        (made_runs / "mapd-barefoot", "file", "choose a folder"),
    ):
        result = CliRunner().invoke(cli, ["export", str(run), "-o", str(tmp_path / out)])
        assert (result.exit_code, said in result.output) == (2, True), result.output
    assert not (tmp_path / "out").exists()
