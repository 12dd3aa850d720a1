"""Inverse kinematics: known motions are found again, published angles are reproduced."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli.conventions import COORDINATES, Condition
from pathwalker_cli.errors import ConfigError, DataError
from pathwalker_cli.inverse.kinematics import _Fit, inverse_kinematics
from pathwalker_cli.inverse.markers import (
    Gap,
    MarkerPoint,
    bridge_gaps,
    load_marker_set,
    marker_points,
)
from pathwalker_cli.inverse.walk import StandingError, walks
from pathwalker_cli.io.c3d import Recording, read_c3d
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient

SHARED = Path(__file__).parents[2] / "shared"
needs_shared = pytest.mark.skipif(
    not (SHARED / "published").is_dir(), reason="needs shared/published beside the checkout"
)

# Marker positions (forward, up) [mm] of single frames and the published angles [m, rad] there.
MEASURED: list[tuple[Condition, dict[str, tuple[float, float]], list[float]]] = [
    (
        "barefoot",
        {"RTHI": (-1144.248, 485.594), "RKNE": (-1048.940, 377.468), "RTIB": (-1067.119, 262.965),
         "RANK": (-1116.693, 102.178), "RTOE": (-1015.671, 89.660), "RHEE": (-1156.861, 74.597),
         "LTHI": (-1255.047, 434.143), "LKNE": (-1251.102, 284.688), "LTIB": (-1341.579, 154.191),
         "LANK": (-1423.549, 49.701), "LTOE": (-1333.472, 34.033), "LHEE": (-1458.944, 57.963),
         "LASI": (-1243.816, 604.083), "SACR": (-1333.452, 612.876), "C7": (-1331.308, 946.042),
         "CLAV": (-1215.411, 888.183)},
        [-1.27025, 0.60634, -0.14443, -0.727089, 1.04499, -0.190331, 0.118082, 0.619046,
         -0.409762, 0.227933],
    ),
    (
        "barefoot",
        {"RTHI": (264.822, 425.146), "RKNE": (261.619, 271.526), "RTIB": (165.402, 189.878),
         "RANK": (29.645, 102.717), "RTOE": (97.104, 32.427), "RHEE": (-17.332, 111.304),
         "LTHI": (322.927, 460.070), "LKNE": (392.644, 331.741), "LTIB": (388.080, 186.651),
         "LANK": (349.402, 50.001), "LTOE": (425.098, 41.071), "LHEE": (298.495, 44.208),
         "LASI": (274.495, 605.301), "SACR": (161.435, 607.282), "C7": (208.703, 931.392),
         "CLAV": (322.495, 863.312)},
        [0.23117, 0.597723, -0.0986403, 0.0313353, 0.950432, -0.199423, -0.559324, 0.821666,
         -0.114672, 0.318316],
    ),
    (
        "orthosis",
        {"RTHI": (-412.556, 495.068), "RKNE": (-446.621, 337.000), "RTIB": (-522.423, 205.135),
         "RANK": (-623.766, 114.717), "RTOE": (-532.175, 58.984), "RHEE": (-728.277, 96.831),
         "LTHI": (-377.294, 542.187), "LKNE": (-285.292, 438.964), "LTIB": (-270.375, 302.721),
         "LANK": (-287.616, 159.580), "LTOE": (-156.454, 148.188), "LHEE": (-350.857, 109.143),
         "LASI": (-438.855, 666.456), "SACR": (-522.613, 668.161), "C7": (-488.149, 996.907),
         "CLAV": (-380.621, 934.485)},
        [-0.474016, 0.66234, 0.00730835, -0.11456, 0.77407, -0.203362, -0.926183, 0.970515,
         -0.0907016, 0.210122],
    ),
]  # fmt: skip


@cache
def walker(condition: Condition = "barefoot") -> tuple[pin.Model, tuple[MarkerPoint, ...]]:
    """Return the shipped patient's model and marker points."""
    patient = load_patient("sreenivasa2017-patient")
    points = marker_points(load_marker_set(), patient, condition)
    return pinocchio_model(patient, condition), points


def made(frames: int = 30) -> tuple[Recording, np.ndarray]:
    """Return a recording of a known motion along the laboratory's x, and the motion's q."""
    model, points = walker()
    phase = np.linspace(0.0, 2.0, frames)[:, None]
    q = 0.3 * np.sin(phase * np.arange(1, 11)) + np.array(
        [0, 0.6, 0, -0.3, 0.8, 0, -0.2, 0.9, 0, 0]
    )
    q[:, 0] = phase[:, 0] * 0.6
    placed = np.array([_Fit(model, points).positions(row)[0] for row in q])
    names = tuple(dict.fromkeys(point.marker for point in points))
    positions = np.full((frames, len(names), 3), 0.1)
    for column, point in enumerate(points):
        positions[:, names.index(point.marker)][:, [0, 2]] = placed[:, column]
    return Recording("made", 120.0, names, positions, (), (), 0), q


@pytest.mark.parametrize("degrees", [0.0, 10.0, 90.0, 137.0, 180.0, -90.0])
@pytest.mark.parametrize("up", [(0, 1, 2), (2, 0, 1), (1, 2, 0)], ids=["z up", "x up", "y up"])
def test_known_motion_is_found_whatever_the_axes(degrees: float, up: tuple[int, ...]) -> None:
    model, points = walker()
    recording, q = made()
    x, y = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    axes = np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])[:, list(up)]
    (walk,) = walks(replace(recording, positions=recording.positions @ axes), points)
    motion, residuals = inverse_kinematics(model, walk, points)
    assert motion.names == COORDINATES
    assert motion.units[:3] == ("m", "m", "rad")
    assert motion.values[:, 1:] == pytest.approx(q[:, 1:], abs=1e-7)
    assert np.diff(motion.values[:, 0]) == pytest.approx(np.diff(q[:, 0]), abs=1e-7)
    assert residuals.distances.max() < 1e-7
    assert ("vertical" in "".join(walk.remarks)) == (up != (0, 1, 2))


@pytest.mark.parametrize(("condition", "markers", "expected"), MEASURED)
def test_published_angles_of_single_frames(
    condition: Condition, markers: dict[str, tuple[float, float]], expected: list[float]
) -> None:
    model, points = walker(condition)
    fit = _Fit(model, points)
    target = np.array([markers[point.marker] for point in points]) * 1e-3
    q, residuals = fit.solve(target, fit.start(target), "frame")
    assert q[:2] == pytest.approx(expected[:2], abs=1e-5)
    error = np.degrees(q[2:] - np.array(expected[2:]))
    assert np.sqrt((error**2).mean()) < 1e-3
    assert 0.005 < np.hypot(*residuals.T).mean() < 0.03


def test_jacobian_and_hessian_by_finite_differences() -> None:
    model, points = walker()
    fit = _Fit(model, points)
    rng = np.random.default_rng(3)
    q, weights = rng.normal(size=10) * 0.5, rng.uniform(0.5, 2.0, len(points))
    target = fit.positions(q)[0] + rng.normal(size=(len(points), 2)) * 0.1

    def gradient(at: np.ndarray) -> np.ndarray:
        placed, jacobian = fit.positions(at)
        return fit.newton(target - placed, jacobian, weights)[0]

    placed, jacobian = fit.positions(q)
    hessian = fit.newton(target - placed, jacobian, weights)[1]
    for column, step in enumerate(np.eye(10) * 1e-6):
        moved = (fit.positions(q + step)[0] - fit.positions(q - step)[0]) / 2e-6
        assert jacobian[:, :, column] == pytest.approx(moved, abs=1e-8)
        bent = (gradient(q - step) - gradient(q + step)) / 2e-6
        assert hessian[:, column] == pytest.approx(bent, abs=1e-7)


def test_missing_marker_is_skipped() -> None:
    model, points = walker()
    recording, q = made()
    positions = recording.positions.copy()
    positions[5:9, recording.markers.index("RTIB")] = np.nan
    holed = Recording("holed", 120.0, recording.markers, positions, (), (), 0)
    motion, residuals = inverse_kinematics(model, holed, points)
    assert motion.values == pytest.approx(q, abs=1e-7)
    column = residuals.names.index("RTIB on shank_r")
    assert np.isnan(residuals.distances[5:9, column]).all()
    assert residuals.rms()["RTIB on shank_r"] < 1e-7


def test_too_few_markers_are_refused() -> None:
    model, points = walker()
    recording, _ = made()
    positions = recording.positions.copy()
    positions[4, 4:] = np.nan
    holed = Recording("holed", 120.0, recording.markers, positions, (), (), 0)
    with pytest.raises(DataError, match="holed, frame 5: shows"):
        inverse_kinematics(model, holed, points)


def test_gaps_are_bridged_up_to_a_length_and_reported() -> None:
    recording, _ = made(frames=60)
    positions = recording.positions.copy()
    knee, ankle = recording.markers.index("RKNE"), recording.markers.index("LANK")
    positions[10:14, knee] = np.nan
    positions[20:40, ankle] = np.nan
    positions[:2, ankle] = np.nan
    holed = Recording("holed", 120.0, recording.markers, positions, (), (), 0)
    bridged, gaps = bridge_gaps(holed, ("RKNE", "LANK"), longest=0.05)
    assert gaps == (
        Gap("RKNE", 10, 4, True),
        Gap("LANK", 0, 2, False),
        Gap("LANK", 20, 20, False),
    )
    error = bridged.marker("RKNE")[10:14] - recording.marker("RKNE")[10:14]
    assert np.abs(error).max() < 5e-3
    assert np.isnan(bridged.marker("LANK")[20:40]).all()
    assert np.isnan(holed.marker("RKNE")[10]).all(), "the original stays"


def test_direction_must_be_certain() -> None:
    recording, _ = made()
    still = Recording(
        "still", 120.0, recording.markers, recording.positions[:1].repeat(30, 0), (), (), 0
    )
    with pytest.raises(StandingError, match=r"still: LASI, SACR travel 0.00 m"):
        walks(still, walker()[1])


def test_marker_set_scales_with_height_and_refuses_nonsense(tmp_path: Path) -> None:
    patient = load_patient("sreenivasa2017-patient")
    taller = patient.model_copy(update={"height": 1.5})
    points = {point.name: point for point in marker_points(load_marker_set(), taller, "barefoot")}
    assert points["LASI on pelvis"].position == pytest.approx((0.061667 * 1.2, 0.0))
    assert points["RTHI on thigh_r"].position == pytest.approx((0.0, -0.2647 / 2))
    assert points["LTOE on foot_l"].position == pytest.approx((0.65 * 0.13, 0.0))
    file = tmp_path / "markers.yaml"
    file.write_text("reference_height: 1.25\nboth:\n  - {marker: X, link: tail, along: 1}\n")
    with pytest.raises(ConfigError, match=r"marker X on 'tail'; allowed: pelvis"):
        load_marker_set(file)
    file.write_text("reference_height: 1.25\nboth:\n  - {marker: X, link: trunk}\n")
    with pytest.raises(ConfigError, match=r"does not say where X sits"):
        load_marker_set(file)


@needs_shared
@pytest.mark.parametrize(
    "file", sorted((SHARED / "published" / "inverse").glob("*.csv")), ids=lambda path: path.stem
)
def test_published_angles(file: Path) -> None:
    condition, trial = file.stem.split("_")
    model, points = walker("orthosis" if condition == "orthosis" else "barefoot")
    recording = read_c3d(SHARED / "recordings" / condition / f"{trial}.c3d")
    motion, _ = inverse_kinematics(model, recording, points)
    published = np.loadtxt(file, delimiter=",")
    assert motion.time == pytest.approx(published[:, 0], abs=1e-4)
    assert motion.values[:, :2] == pytest.approx(published[:, 1:3], abs=1e-5)
    error = np.degrees(motion.values[:, 2:] - published[:, 3:])
    assert np.sqrt((error**2).mean()) < 1e-3
