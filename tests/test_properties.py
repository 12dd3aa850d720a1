"""What holds for every child and every orthosis, tried on random ones.

The suite tries a few, always the same; `pytest tests/test_properties.py
--hypothesis-profile=long` tries many, each time others.
"""

from __future__ import annotations

import math
import re
import tempfile
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, Final

import casadi as ca
import numpy as np
import pytest
import yaml
from hypothesis import example, given, reject
from hypothesis import strategies as st
from pydantic import ValidationError

from helpers import stylised_series
from made_patients import (
    GOALS,
    USUAL,
    WEIGHTS,
    mirror_image,
    orthoses,
    patients,
    random_step,
    rows_of,
    similar,
)
from opensim_peer import read_opensim
from pathwalker_cli.case import Case, config_text
from pathwalker_cli.config import load_config
from pathwalker_cli.conventions import (
    COORDINATES,
    GENERATORS,
    SIDES,
    STIFFNESSES,
    Condition,
    mirror_permutation,
    mirrored,
    to_degrees,
)
from pathwalker_cli.errors import ConfigError, PatientError
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.cost_terms import cost_terms
from pathwalker_cli.gait.costs import Costs, Instant
from pathwalker_cli.gait.motion_file import read_motion, write_motion
from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.gait.symmetry import asymmetries, full_stride
from pathwalker_cli.inverse.files import write_strengths_yaml
from pathwalker_cli.io.opensim import write_opensim
from pathwalker_cli.io.trajectory_csv import read_trajectory, write_trajectory
from pathwalker_cli.io.yaml_file import yaml_text
from pathwalker_cli.model.anthropometry import segments
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.elements.curves import BezierChain, evaluate
from pathwalker_cli.model.elements.muscle import (
    ACTIVATION_TIME,
    DEACTIVATION_TIME,
    AndersonCurves,
    activation_rate,
    curves_of,
    excitation_from_rate,
)
from pathwalker_cli.model.elements.orthosis import OrthosisSide, orthosis_curve, orthosis_torque
from pathwalker_cli.model.parts import Parts
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.ocp.phased import PhasedMotion, PhaseMotion
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.patient.blocks import OrthosisData
from pathwalker_cli.results.text import angle_words, summary_rows
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import own_cycle, stride_of
from pathwalker_cli.trajectory import Trajectory

SEEDS: Final = st.integers(0, 2**32 - 1)
NUMBERS: Final = st.floats(-1e6, 1e6, allow_subnormal=False)
ORDER: Final = mirror_permutation(COORDINATES)
POINT_ORDER: Final = [4, 5, 6, 7, 0, 1, 2, 3]
"""Right heel and toe, x and z, after the left ones."""
WEIGHTS_END: Final = "_body_weights"
WRITTEN: Final = 1e-8
"""Nine digits of every number reach the rigid bodies."""


def pose(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return coordinates and velocities of any configuration."""
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, 10), 4.0 * rng.normal(size=10)


def dynamics(walker: Walker, q: np.ndarray, v: np.ndarray) -> list[np.ndarray]:
    """Return mass matrix, bias, Jacobian of the contact points and their drift."""
    mass, bias, jacobian, drift, _ = map(np.asarray, walker.dynamics_terms(q, v))
    return [mass, bias.ravel(), jacobian, drift.ravel()]


def close(found: Any, wanted: Any, share: float = WRITTEN) -> None:
    """Compare arrays to a share of their largest entry."""
    found, wanted = np.asarray(found), np.asarray(wanted)
    assert found == pytest.approx(wanted, rel=share, abs=share * max(np.abs(wanted).max(), 1e-6))


# ---- Models ------------------------------------------------------------------


@given(patient=patients())
def test_segment_masses_add_up_to_the_body(patient: Patient) -> None:
    """The regressions give 99.98 % of the body mass at every age, and the orthoses add theirs."""
    body = 0.9998 * patient.body_mass
    device = patient.require_orthosis().mass
    worn = sum(part[side] for part in (device.shank, device.foot) for side in SIDES)
    for condition, mass in (("barefoot", body), ("orthosis", body + worn)):
        masses = [part.mass for part in segments(patient, condition)]
        assert sum(masses) == pytest.approx(mass, rel=1e-12)
        assert build_walker(patient, condition).total_mass == pytest.approx(mass, rel=WRITTEN)


@given(patient=patients(), seed=SEEDS, condition=st.sampled_from(["barefoot", "orthosis"]))
def test_mass_matrix_is_symmetric_and_positive(
    patient: Patient, seed: int, condition: Condition
) -> None:
    for part in segments(patient, condition):
        assert 0.0 < 2 * max(part.inertia) <= (1 + 1e-12) * sum(part.inertia), part.name
    walker = build_walker(patient, condition)
    q, v = pose(seed)
    mass, *_ = dynamics(walker, q, v)
    close(mass, mass.T, 1e-13)
    assert np.linalg.eigvalsh(mass)[0] > 0.0
    close(mass[:2, :2], walker.total_mass * np.eye(2), 1e-12)


@given(patient=patients() | patients(equal=True), seed=SEEDS)
def test_the_mirror_image_moves_in_mirror_image(patient: Patient, seed: int) -> None:
    walker, image = (build_walker(p, "orthosis") for p in (patient, mirror_image(patient)))
    (q, v), k = pose(seed), np.random.default_rng(seed).uniform(5.0, 90.0, 4)
    mass, bias, jacobian, drift = dynamics(walker, q, v)
    other = dynamics(image, q[ORDER], v[ORDER])
    close(other[0], mass[np.ix_(ORDER, ORDER)], 1e-12)
    close(other[1], bias[ORDER], 1e-12)
    close(other[2], jacobian[np.ix_(POINT_ORDER, ORDER)], 1e-12)
    close(other[3], drift[POINT_ORDER], 1e-12)
    close(
        image.orthosis_torques(q[ORDER], k[[1, 0]], k[[3, 2]]),
        walker.orthosis_torques(q, k[:2], k[2:])[::-1],
        1e-12,
    )
    if patient == mirror_image(patient):
        assert asymmetries(walker) == []
        close(dynamics(walker, q[ORDER], v[ORDER])[1], bias[ORDER], 1e-12)
    else:
        assert "orthoses" in asymmetries(walker)


def across(place: tuple[str, str]) -> tuple[str, str]:
    """Return name and place of the same row of the other step."""
    name, where = place
    subject, *rest = name.split(" ")
    if " excitation " in name and where.startswith(f"{PHASES[-1].name} at 100 %"):
        where = f"{PHASES[0].name} at 0 % of the phase"  # nodes are named where a phase begins
    for i, phase in enumerate(phase.name for phase in PHASES):
        if where.startswith(f"{phase} at"):
            opposite = PHASES[(i + len(PHASES) // 2) % len(PHASES)].name
            where = where.replace(phase, opposite, 1)
            break
    return " ".join([mirrored(subject), *rest]), where


@given(patient=patients(), seed=SEEDS)
def test_rows_of_a_mirrored_motion_are_mirrored(patient: Patient, seed: int) -> None:
    """The second step of a stride is to a patient what the first is to the mirror image."""
    stride = full_stride(Parts(), random_step(seed))
    swapped = stride.parameters[mirror_permutation(STIFFNESSES)]
    image = build_walker(mirror_image(patient), "orthosis")
    walker = build_walker(patient, "orthosis")
    cost, rows = rows_of(walker, stride)
    image_cost, image_rows = rows_of(image, replace(stride, parameters=swapped))
    assert image_cost == pytest.approx(cost, rel=1e-12)
    # the reference of tracking stands in the room, the second step elsewhere
    places = [place for place in rows if place[0] != "integral tracking"]
    close([image_rows[across(p)] for p in places], [rows[p] for p in places], 1e-10)
    ends = [value for (name, _), value in rows.items() if name.endswith("periodicity")]
    assert ends == pytest.approx(np.zeros(2 * len(COORDINATES) - 1 + 2 * len(GENERATORS)), abs=1e-9)

    gait, image_gait = (GaitProblem(w, "stride", GOALS) for w in (walker, image))
    terms = cost_terms(stride, gait.costs, WEIGHTS)
    assert terms == pytest.approx(cost_terms(stride, image_gait.costs, WEIGHTS), rel=1e-12)
    series = gait_series(walker, stride)
    image_series = gait_series(image, replace(stride, parameters=swapped))
    half = len(series.time) // 2  # the first instant comes before both steps
    first, second = slice(1, half + 1), slice(half + 1, None)
    for a, b in ((first, second), (second, first)):
        order = mirror_permutation(GENERATORS)
        close(image_series.muscle_torque[b], series.muscle_torque[a][:, order], 1e-12)
        close(image_series.orthosis_torque[b], series.orthosis_torque[a][:, ::-1], 1e-12)
        close(image_series.net_torque[b], series.net_torque[a][:, ORDER], 1e-12)


# ---- Scaling -----------------------------------------------------------------


@given(patient=patients(), a=st.floats(0.8, 1.15), b=st.floats(0.6, 1.6), seed=SEEDS)
def test_similar_bodies_move_alike(patient: Patient, a: float, b: float, seed: int) -> None:
    """Lengths x a and masses x b: times x sqrt(a), forces x b, torques x a b, for equal gravity."""
    try:
        walker, other = (build_walker(p, "orthosis") for p in (patient, similar(patient, a, b)))
    except ValidationError:
        reject()  # a length or strength left its range
    (q, v), rng = pose(seed), np.random.default_rng(seed)
    length = np.where([name in COORDINATES[:2] for name in COORDINATES], a, 1.0)
    force = b * a / length  # N x b, N m x a b
    mass, bias, jacobian, _ = dynamics(walker, q, v)
    faster = length * v / math.sqrt(a)
    found = dynamics(other, length * q, faster)
    close(found[0] * np.outer(length, length), mass * b * a**2)
    close(found[1] / force, bias, 1e-7)
    close(found[2] * length, jacobian * a)
    close(other.contact_points(length * q), a * walker.contact_points(q))
    tau = np.concatenate([np.zeros(3), 20.0 * rng.normal(size=7)])
    for phase in PHASES:
        vdot, load = walker.contact_dynamics(phase, q, v, tau)
        other_vdot, other_load = other.contact_dynamics(phase, length * q, faster, force * tau)
        # near a straight leg the constraints magnify the last digits of the lengths
        close(other_vdot * a / length, vdot, 1e-4)
        close(other_load / b, load, 1e-4)
    activation, k = rng.random(14), rng.uniform(5.0, 90.0, 4)
    close(other.muscle_torques(q, v, activation), a * b * walker.muscle_torques(q, v, activation))
    close(
        other.orthosis_torques(q, a * b * k[:2], a * b * k[2:]),
        a * b * walker.orthosis_torques(q, k[:2], k[2:]),
    )


@given(patient=patients(), factor=st.floats(0.01, 50.0), seed=SEEDS)
def test_torques_follow_strengths_and_stiffnesses(
    patient: Patient, factor: float, seed: int
) -> None:
    walker = build_walker(patient, "orthosis")
    strengths = [muscle.numbers[0].address for muscle in walker.muscles]
    stronger = walker.with_values({a: factor * walker.values[a] for a in strengths})
    (q, v), a = pose(seed), np.random.default_rng(seed).random(14)
    muscle = walker.muscle_torques(q, v, a)
    close(stronger.muscle_torques(q, v, a), factor * muscle, 1e-13)
    close(walker.muscle_torques(q, v, 0.5 * a), 0.5 * muscle, 1e-13)
    signs = np.array([g.torque_sign for g in walker.muscles])
    assert (signs * muscle >= -1e-12 * np.abs(muscle).max()).all()
    sides = walker.orthosis.values()
    angle, (k_d, k_p) = np.linspace(-0.6, 0.6, 41), np.random.default_rng(seed).uniform(5, 90, 2)
    for side in sides:
        torque = orthosis_torque(side, angle, k_d, k_p)
        names = ("preload_torque", "dorsiflexion_stop_stiffness", "plantarflexion_stop_stiffness")
        stiffer = replace(side, **{name: factor * getattr(side, name) for name in names})
        more = orthosis_torque(stiffer, angle, factor * k_d, factor * k_p)
        close(more, factor * torque, 1e-9)
        assert (torque * (angle - side.neutral_angle) <= 1e-9).all()  # restoring


@given(worn=orthoses(), share=st.floats(0.0, 1.0))
@example(worn=USUAL, share=0.5)
def test_a_spring_is_a_spring_between_play_and_stop(worn: dict[str, Any], share: float) -> None:
    data = accepted(worn)
    k_d, k_p = ranges_of(data)
    for i, side in enumerate(sides_of(data)):
        for k, other in zip(k_d, k_p, strict=True):
            chain = orthosis_curve(side, k, other)
            angle = chain.x[1] + share * (chain.x[2] - chain.x[1])
            torque = orthosis_torque(side, np.array(angle), k, k_p[0])
            edge = side.neutral_angle - side.free_play / 2
            assert torque == pytest.approx(side.preload_torque + k * (edge - angle), rel=1e-9), i


# ---- Round trips ---------------------------------------------------------------


@cache
def folder() -> Path:
    """Return a folder that lives as long as the process."""
    return Path(_FOLDER.name)


_FOLDER = tempfile.TemporaryDirectory()


@given(angle=st.floats(-10.0, 10.0))
def test_angles_come_back_from_degrees(angle: float) -> None:
    assert np.deg2rad(to_degrees(angle)) == pytest.approx(angle, rel=1e-15, abs=1e-300)
    said = re.fullmatch(r"(\d+(?:\.\d)?) deg( plantarflexion| dorsiflexion|)", angle_words(angle))
    assert said is not None
    assert bool(said[2]) == (said[1] != "0")
    sign = 1.0 if said[2] == " plantarflexion" else -1.0
    assert sign * np.deg2rad(float(said[1])) == pytest.approx(angle, abs=np.deg2rad(0.0501))


@given(stiffness=st.floats(1.0, 1000.0), share=st.floats(0.1, 10.0))
def test_stiffness_per_degree_and_body_weights(stiffness: float, share: float) -> None:
    series = stylised_series()
    found = metrics_of(stride_of(replace(series, force=share * series.force)))
    for side in SIDES:
        force, weights = (found[f"peak_vertical_force_{side}{end}"] for end in ("", WEIGHTS_END))
        assert weights * found["body_weight"] == pytest.approx(force, rel=1e-12)
        assert force == pytest.approx(share * series.vertical_force(side).max(), rel=1e-12)
    rows = dict(summary_rows({**found, "dorsiflexion_stiffness_left": stiffness}, "converged"))
    said = re.fullmatch(r"([\d.]+) N m/rad \(([\d.]+) N m/deg\)", rows["K_D left"])
    assert said is not None
    assert float(said[1]) == pytest.approx(stiffness, abs=0.0501)
    assert to_degrees(float(said[2])) == pytest.approx(stiffness, abs=to_degrees(0.00501))


@given(patient=patients(), worn=orthoses())
def test_a_patient_comes_back_from_its_file(patient: Patient, worn: dict[str, Any]) -> None:
    orthosis = accepted(worn)
    whole = patient.model_copy(update={"orthosis": orthosis})
    file = folder() / "patient.yaml"
    file.write_text(Case(load_config("mapd-orthosis"), whole).patient_text, encoding="utf-8")
    assert load_patient(file).model_dump() == whole.model_dump()
    (folder() / "hinge.yaml").write_text(
        yaml_text(orthosis.model_dump(mode="json", exclude_none=True), "A hinge."), encoding="utf-8"
    )
    content = yaml.safe_load(file.read_text(encoding="utf-8"))
    file.write_text(yaml.safe_dump({**content, "orthosis": "hinge.yaml"}), encoding="utf-8")
    assert load_patient(file).model_dump() == whole.model_dump()


@given(patient=patients())
def test_strengths_come_back_to_four_decimals(patient: Patient) -> None:
    file = folder() / "strengths.yaml"
    assert patient.strengths is not None
    write_strengths_yaml(file, patient.strengths, "made up")
    strengths = type(patient.strengths).model_validate(
        yaml.safe_load(file.read_text(encoding="utf-8"))["strengths"]
    )
    assert strengths.vector() == pytest.approx(patient.strengths.vector(), abs=0.50001e-4)


@given(
    friction=st.floats(0.1, 1.5),
    margin=st.floats(0.0, 1.5),
    knee=st.tuples(st.floats(-3.0, 0.0), st.floats(0.01, 3.0)),
    speed=st.just("recorded") | st.floats(0.0, 3.0),
    goals=st.dictionaries(st.sampled_from(["crouch", "peak_activation"]), st.floats(0.01, 100.0)),
    name=st.sampled_from(["mapd-orthosis", "mapd-barefoot", "mapd-healthy", "ls-barefoot"]),
)
def test_a_config_comes_back_from_the_one_of_its_run(
    friction: float,
    margin: float,
    knee: tuple[float, float],
    speed: str | float,
    goals: dict[str, float],
    name: str,
) -> None:
    config = load_config(name)
    bounds = config.bounds.model_dump(mode="json") | {
        "friction": friction,
        "joint_range_margin": margin,
        "joint_ranges": {"knee_r": list(knee)},
        "least_walking_speed": speed,
    }
    content = config.model_dump(mode="json") | {"bounds": bounds}
    if name.startswith("mapd"):
        content["cost"]["goals"] = goals
    config = type(config).model_validate(content)
    file = folder() / "config.yaml"
    file.write_text(config_text(config), encoding="utf-8")
    assert load_config(file) == config
    assert config_text(load_config(file)) == file.read_text(encoding="utf-8")


@given(seed=SEEDS)
def test_a_motion_comes_back_bit_by_bit(seed: int) -> None:
    motion = full_stride(Parts(), random_step(seed))
    file = folder() / "motion.npz"
    write_motion(file, motion)
    again = read_motion(file)
    assert np.array_equal(again.parameters, motion.parameters)
    for found, phase in zip(again.phases, motion.phases, strict=True):
        for key, value in vars(phase).items():
            assert np.array_equal(getattr(found, key), value), key


@given(data=st.data(), digits=st.integers(3, 17), rows=st.integers(1, 6), columns=st.integers(1, 4))
def test_a_table_comes_back_to_the_digits_written(
    data: st.DataObject, digits: int, rows: int, columns: int
) -> None:
    cells = st.lists(NUMBERS | st.just(math.nan), min_size=columns, max_size=columns)
    values = np.array(data.draw(st.lists(cells, min_size=rows, max_size=rows)))
    names = tuple(f"hip_{i}" for i in range(columns))
    table = Trajectory(0.01 * np.arange(rows), names, values, ("rad", "N m", "m/s", "1")[:columns])
    write_trajectory(folder() / "table.csv", table, digits)
    write_opensim(folder() / "table.mot", table, digits)
    again = read_trajectory(folder() / "table.csv", missing=True)
    assert (again.names, again.units) == (table.names, table.units)
    for found in (again, read_opensim(folder() / "table.mot")):
        assert found.names == table.names
        assert found.time == pytest.approx(table.time, rel=10.0 ** (1 - digits))
        wanted = pytest.approx(values, rel=0.51 * 10.0 ** (1 - digits), nan_ok=True)
        assert found.values == wanted
        if digits == 17:
            assert np.array_equal(found.values, values, equal_nan=True)


@given(durations=st.lists(st.floats(0.02, 0.8), min_size=8, max_size=8))
def test_percent_of_the_gait_cycle_is_time(durations: list[float]) -> None:
    """Every instant of the stride has its place in the cycle of either side, and only one."""
    series = stylised_series()
    phases: tuple[PhaseMotion, ...] = tuple(
        replace(phase, duration=t) for phase, t in zip(series.motion.phases, durations, strict=True)
    )
    series = gait_series(series.walker, PhasedMotion(phases, series.motion.parameters))
    for side in SIDES:
        cycle = own_cycle(series, side)
        assert (cycle.percent[0], cycle.percent[-1]) == (0.0, pytest.approx(100.0))
        assert (np.diff(cycle.percent) > -1e-9).all()
        assert set(cycle.index) == set(range(series.time.size))
        strike = series.time[cycle.index[0]]
        time = (strike + cycle.percent / 100.0 * series.duration) % series.duration
        apart = np.abs(time - series.time[cycle.index] % series.duration)
        assert np.minimum(apart, series.duration - apart) == pytest.approx(0.0, abs=1e-9)
        other = own_cycle(series, "left" if side == "right" else "right")
        assert 0.0 < cycle.toe_off < 100.0
        shift = (series.time[other.index[0]] - strike) / series.duration * 100.0 % 100.0
        assert 0.0 < shift < 100.0


# ---- Curves --------------------------------------------------------------------


def accepted(worn: dict[str, Any]) -> OrthosisData:
    """Return the orthosis, or pass over one that is refused."""
    try:
        return OrthosisData.model_validate(worn)
    except ValidationError:
        reject()


def sides_of(data: OrthosisData) -> tuple[OrthosisSide, ...]:
    """Return the fixed parameters right and left as the walker has them."""
    return tuple(
        OrthosisSide(
            data.neutral_angle[side],
            data.free_play[side],
            data.preload_torque[side],
            data.dorsiflexion_stop[side],
            data.plantarflexion_stop[side],
            data.stop_stiffness.dorsiflexion[side],
            data.stop_stiffness.plantarflexion[side],
        )
        for side in SIDES
    )


def ranges_of(data: OrthosisData) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return the range of K_D and that of K_P, which are those of both sides."""
    span = data.stiffness_range
    return span.dorsiflexion["right"], span.plantarflexion["right"]


def check_smooth(chain: BezierChain, tolerance: float = 1e-4) -> None:
    """Check values, slopes and curvatures on, beside and between all knots of a chain."""
    x, y, slopes = (np.array(column, float) for column in (chain.x, chain.y, chain.slopes))
    widths = np.diff(x)
    assert (widths > 0.0).all()
    steepest = np.abs(slopes).max()
    at = evaluate(chain, x)
    assert at.value == pytest.approx(y, rel=1e-9, abs=1e-9 * np.abs(y).max())
    assert at.slope == pytest.approx(slopes, rel=1e-6, abs=1e-6 * steepest)
    least = np.minimum(np.append(widths, np.inf), np.append(np.inf, widths))
    for beside in (-1e-9, 1e-9):
        near = evaluate(chain, x + beside * least)
        assert np.abs(near.value - y).max() <= 1e-6 * np.abs(y).max()
        assert np.abs(near.slope - slopes).max() <= tolerance * steepest
        assert (np.abs(near.curvature) * least).max() <= 0.01 * steepest
    for i, width in enumerate(widths):
        inner, h = x[i] + width * np.linspace(0.02, 0.98, 25), 1e-5 * width
        point, up, down = (evaluate(chain, inner + k) for k in (0.0, h, -h))
        settled = evaluate(replace(chain, newton_steps=30), inner)
        assert point.value == pytest.approx(settled.value, rel=0, abs=1e-9 * np.abs(y).max())
        noise = 1e-13 * np.abs(y).max() / h
        slope = (up.value - down.value) / (2 * h)
        assert slope == pytest.approx(point.slope, abs=tolerance * steepest + noise)
        bend = (up.slope - down.slope) / (2 * h)
        scale = np.abs(point.curvature).max() + steepest / width
        assert bend == pytest.approx(point.curvature, abs=1e-3 * scale)
        # a corner turns one way only, so its slopes lie between those of its ends
        low, high = sorted(slopes[i : i + 2])
        assert (point.slope >= low - 1e-6 * steepest).all()
        assert (point.slope <= high + 1e-6 * steepest).all()


SOFT_PRELOAD: Final = {**USUAL, "preload_torque": 0.1}
"""With the published slope at the neutral angle there is no curve: torques of millions of N m."""
WIDE_PLAY: Final = {**USUAL, "free_play": 0.1, "dorsiflexion_stop": -0.1, "preload_torque": 20.0}
"""The play reaches beyond the beginning of the stop."""


def between_springs(low: float, high: float) -> dict[str, Any]:
    """Return an orthosis with springs of a range for K_D, whose play has a slope of 100 N m/rad."""
    ranges = {**USUAL["stiffness_range"], "dorsiflexion": [low, high], "plantarflexion": [5.0, 9.0]}
    guess = {"dorsiflexion": low, "plantarflexion": 5.0}
    return {
        **USUAL, "preload_torque": 0.25, "stiffness_range": ranges, "stiffness_guess": guess
    }  # fmt: skip


HARD_STOP: Final = {
    **USUAL,
    "preload_torque": 0.0,
    "stop_stiffness": {"dorsiflexion": 1000.0, "plantarflexion": 1000.0},
    "stiffness_range": {**USUAL["stiffness_range"], "dorsiflexion": [1.0, 92.0]},
}
"""Springs so soft beside the stop that the parameter of the curve is not found."""


@given(worn=orthoses(), share=st.floats(0.0, 1.0))
@example(worn=SOFT_PRELOAD, share=0.5)
@example(worn=WIDE_PLAY, share=0.5)
@example(worn=HARD_STOP, share=0.0)
@example(worn=between_springs(5.0, 50.0), share=1.0)
@example(worn=between_springs(25.0, 75.0), share=0.5)
@example(worn=between_springs(100.0, 300.0), share=0.0)
@example(worn={**USUAL, "preload_torque": 0.0}, share=0.5)
@example(worn=USUAL, share=0.0)
def test_torque_of_an_orthosis_is_smooth_and_restoring(worn: dict[str, Any], share: float) -> None:
    """Whatever orthosis is accepted, with whatever springs of its range."""
    data = accepted(worn)
    k_d, k_p = (low + share * (high - low) for low, high in ranges_of(data))
    for side in sides_of(data):
        chain = orthosis_curve(side, k_d, k_p)
        check_smooth(chain)
        reach = chain.x[-1] - chain.x[0]
        angles = np.linspace(chain.x[0] - 0.2 * reach, chain.x[-1] + 0.2 * reach, 4001)
        assert (np.diff(orthosis_torque(side, angles, k_d, k_p)) <= 1e-9).all()
        assert orthosis_torque(side, np.array(side.neutral_angle), k_d, k_p) == pytest.approx(
            0.0, abs=1e-9
        )


@pytest.mark.parametrize(
    ("worn", "said"),
    [
        (WIDE_PLAY, "not between the right stops"),
        (HARD_STOP, "too far from stop_stiffness.dorsiflexion 1000"),
    ],
)
def test_an_orthosis_without_an_exact_torque_is_refused(worn: dict[str, Any], said: str) -> None:
    file = folder() / "rough.yaml"
    content = load_patient("sreenivasa2017-patient").model_dump(mode="json", exclude_none=True)
    file.write_text(yaml.safe_dump({**content, "orthosis": worn}), encoding="utf-8")
    with pytest.raises(PatientError, match=said):
        load_patient(file)


def test_springs_of_a_config_must_fit_the_stops() -> None:
    walker = build_walker(load_patient("sreenivasa2017-patient"), "orthosis")
    bounds = load_config("mapd-orthosis").bounds
    wide = bounds.model_copy(update={"stiffness": {"dorsiflexion_stiffness_left": (5.0, 6e4)}})
    with pytest.raises(ConfigError, match=r"stiffness_left: .* too far from stop_stiffness"):
        gait_bounds(walker, wide)


@cache
def orthosis_expansion() -> ca.Function:
    """Return torque, gradient and Hessian in angle, K_D and K_P of any orthosis."""
    x, side = ca.SX.sym("x", 3), ca.SX.sym("side", 7)
    torque = orthosis_torque(OrthosisSide(*ca.vertsplit(side)), *ca.vertsplit(x))
    hessian, gradient = ca.hessian(torque, x)
    return ca.Function("expansion", [x, side], [torque, gradient, hessian])


@given(worn=orthoses(), seed=SEEDS)
@example(worn=USUAL, seed=0)
def test_torque_of_an_orthosis_is_smooth_in_its_springs(worn: dict[str, Any], seed: int) -> None:
    """Gradient and Hessian of the solver against finite differences, also across moving knots."""
    data, rng = accepted(worn), np.random.default_rng(seed)
    k = np.array([low + (high - low) * rng.uniform(0.01, 0.99) for low, high in ranges_of(data)])
    function = orthosis_expansion()
    for side in sides_of(data):
        numbers = list(vars(side).values())
        chain = orthosis_curve(side, *k)
        knots, steepest = np.array(chain.x), np.abs(chain.slopes).max()
        between = knots[:-1] + np.diff(knots) * rng.random(6)
        # a curve bends within the distance of its corner from the nearer knot
        corners = np.array([chain.corner(i) for i in range(6)])
        sharp = np.minimum(corners - knots[:-1], knots[1:] - corners)
        width = np.concatenate([np.repeat(sharp.min(), 7), sharp])
        for angle, near in zip([*knots, *between], width, strict=True):
            x = np.array([angle, *k])
            value, slope, bend = (np.asarray(part) for part in function(x, numbers))
            plain = orthosis_torque(side, np.array(angle), *k)
            assert value.item() == pytest.approx(float(plain), rel=1e-9, abs=1e-9)
            for j, step in enumerate((1e-5 * near, *(1e-5 * k))):
                ends = [function(x + sign * step * np.eye(3)[j], numbers) for sign in (1, -1)]
                (up, up_slope), (down, down_slope) = (
                    (float(end[0]), np.asarray(end[1]).ravel()) for end in ends
                )
                rate, bends = (up - down) / (2 * step), (up_slope - down_slope) / (2 * step)
                noise = 1e-12 * (1.0 + abs(up)) / step
                assert rate == pytest.approx(slope[j, 0], rel=1e-3, abs=1e-3 + noise)
                fuzzy = 1e-9 * k.max() / step + 1e-2 * steepest / near
                assert bends == pytest.approx(bend[:, j], rel=1e-2, abs=fuzzy)


@given(
    name=st.sampled_from(GENERATORS),
    width=st.floats(0.7, 1.4),
    shift=st.floats(-0.5, 0.5),
    speed=st.floats(0.5, 2.0),
    eccentric=st.floats(0.5, 2.0),
)
@example(name="hip_extension_r", width=1.0, shift=0.0, speed=1.0, eccentric=1.0)
def test_muscle_curves_are_smooth_and_fall_with_speed(
    name: str, width: float, shift: float, speed: float, eccentric: float
) -> None:
    """Those of the table, and neighbours of them."""
    table = curves_of(name)
    curves = AndersonCurves(
        table.strength,
        table.angle_width * width,
        table.best_angle + shift,
        table.speed_75 * speed,
        table.speed_50 * speed,
        table.eccentric * eccentric,
    )
    angle, velocity = curves.active_torque_angle, curves.torque_angular_velocity
    for chain in (angle, velocity):
        check_smooth(chain)
    x = np.linspace(angle.x[0] - 0.5, angle.x[-1] + 0.5, 2001)
    value, slope = evaluate(angle, x).value, evaluate(angle, x).slope
    assert value.min() >= -1e-12
    assert value.max() <= 1.0 + 1e-12
    assert (slope * np.sign(curves.best_angle - x) >= -1e-9).all()
    speeds = np.linspace(velocity.x[0] - 5.0, velocity.x[-1] + 5.0, 2001)
    factor = evaluate(velocity, speeds)
    assert (factor.slope <= 1e-9).all()
    assert factor.value.min() >= -1e-12
    assert factor.value.max() <= 1.4 + 1e-12
    assert evaluate(velocity, np.array(0.0)).value == pytest.approx(1.0)


@given(data=st.data(), curviness=st.floats(0.1, 0.9), pieces=st.integers(1, 6))
def test_every_chain_with_corners_between_its_knots_is_smooth(
    data: st.DataObject, curviness: float, pieces: int
) -> None:
    widths = data.draw(st.lists(st.floats(0.01, 2.0), min_size=pieces, max_size=pieces))
    corners = data.draw(st.lists(st.floats(0.05, 0.95), min_size=pieces, max_size=pieces))
    steps = st.sampled_from([-1.0, 1.0]).flatmap(
        lambda sign: st.floats(0.1, 5.0).map(lambda x: sign * x)
    )
    slopes = np.cumsum([0.0, *data.draw(st.lists(steps, min_size=pieces, max_size=pieces))])
    x, y = [0.0], [0.0]
    for i, (width, corner) in enumerate(zip(widths, corners, strict=True)):
        x.append(x[-1] + width)
        y.append(y[-1] + width * (corner * slopes[i] + (1 - corner) * slopes[i + 1]))
    check_smooth(BezierChain(x, y, slopes.tolist(), curviness))


@given(a=st.floats(0.0, 1.0), e=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=2))
def test_activation_rises_with_excitation(a: float, e: list[float]) -> None:
    low, high = activation_rate(np.array(sorted(e)), a)
    assert low <= high
    assert -a / DEACTIVATION_TIME - 1e-9 <= low <= high <= (1 - a) / ACTIVATION_TIME + 1e-9
    again = excitation_from_rate(np.array([low, high]), a)
    assert again == pytest.approx(sorted(e), abs=1e-9)


@given(edge=st.floats(-1.0, 1.0), width=st.floats(0.0, 1.0), beyond=st.floats(-1.0, 3.0))
def test_discomfort_is_smooth_and_grows_outside_the_range(
    edge: float, width: float, beyond: float
) -> None:
    goals = Costs(("discomfort",), comfort_ranges={"knee_r": (edge - width, edge)})

    def cost(angle: Any) -> Any:
        q = [0.0] * len(COORDINATES)
        q[COORDINATES.index("knee_r")] = angle
        zeros = [0.0] * len(GENERATORS)
        point = Instant(PHASES[0], q, q, zeros, zeros)
        return goals.integrands(
            point, goals.numbers(stylised_series("barefoot").walker), goals.goals
        )[0]

    angle = ca.SX.sym("angle")
    hessian, gradient = ca.hessian(cost(angle), angle)
    function = ca.Function("cost", [angle], [cost(angle), gradient, hessian])
    x, h = edge + beyond, 1e-5
    values, slopes = ([float(function(x + k)[i]) for k in (-h, h)] for i in (0, 1))
    assert np.diff(values) / (2 * h) == pytest.approx(float(function(x)[1]), rel=1e-4, abs=1e-6)
    assert np.diff(slopes) / (2 * h) == pytest.approx(float(function(x)[2]), rel=1e-4, abs=1e-2)
    if beyond > 1e-3:
        assert float(function(x)[1]) > 0.0
        assert float(function(x)[0]) >= beyond**2
