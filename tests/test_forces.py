"""Force plates: known loads on made plates, and which stances count as measured."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from pathwalker_cli.conventions import COORDINATES, GRAVITY, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.c3d_trials import c3d_trials
from pathwalker_cli.inverse.dynamics import low_pass, smooth_rates
from pathwalker_cli.inverse.forces import (
    centre_of_pressure,
    foot_extents,
    ground_forces,
    plate_direction,
    plate_loads,
)
from pathwalker_cli.inverse.published import wrench_axis_at_ground
from pathwalker_cli.inverse.study import RecordedConfig
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.c3d_plates import ForcePlate, plate_axes
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import load_patient
from pathwalker_cli.trajectory import Trajectory

RECORDINGS = Path(__file__).parents[2] / "shared" / "recordings"
DEPTH = 0.027
CORNERS = np.array([[0.2, 0.3, 0.0], [-0.2, 0.3, 0.0], [-0.2, -0.3, 0.0], [0.2, -0.3, 0.0]])
FRAMES, PER_FRAME = 120, 9
ASIDE: dict[Side, np.ndarray] = {"right": np.zeros(FRAMES), "left": np.zeros(FRAMES)}


def plate(force: np.ndarray, point: np.ndarray, corners: np.ndarray = CORNERS) -> ForcePlate:
    """Return a made plate under a load given in its own axes.

    Args:
        force: Force on the body [N], shape (n, 3).
        point: Point (x, y) on the surface where it acts [m], shape (n, 2).
        corners: The plate's corners [m].
    """
    axes = plate_axes(corners)
    moment = np.cross(np.column_stack([point, np.zeros(len(point))]), force)
    depth = np.array([0.0, 0.0, -DEPTH]) @ axes
    return ForcePlate("made", corners, force @ axes, moment @ axes, depth)


def test_load_and_centre_of_pressure_are_found() -> None:
    rng = np.random.default_rng(2)
    force = np.column_stack([rng.normal(size=(20, 2)) * 30.0, rng.uniform(100, 300, 20)])
    point = rng.uniform(-0.1, 0.1, size=(20, 2))
    load = plate(force, point)
    assert load.force == pytest.approx(force)
    assert centre_of_pressure(load, 20.0)[:, :2] == pytest.approx(point, abs=1e-12)


def test_axes_of_a_turned_plate() -> None:
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    moved = CORNERS @ turn.T + np.array([1.0, 2.0, 0.0])
    force, point = np.array([[10.0, 20.0, 200.0]]), np.array([[0.05, -0.1]])
    load = plate(force, point, moved)
    assert load.force[0] == pytest.approx(turn @ force[0])
    expected = turn @ np.array([0.05, -0.1, 0.0]) + np.array([1.0, 2.0, 0.0])
    assert centre_of_pressure(load, 20.0)[0] == pytest.approx(expected)


def test_published_centre_ignores_the_depth() -> None:
    force, point = np.array([[40.0, 0.0, 200.0]]), np.array([[0.05, 0.0]])
    published = wrench_axis_at_ground(plate(force, point))[0, 0]
    assert published - 0.05 == pytest.approx(DEPTH * 0.2 + 0.05 * (1 / 1.04 - 1), abs=1e-3)


def test_unloaded_plate_has_no_centre() -> None:
    load = plate(np.array([[0.0, 0.0, 5.0]]), np.zeros((1, 2)))
    assert np.isnan(centre_of_pressure(load, 20.0)).all()


def test_filter_has_no_lag_and_rates_are_right() -> None:
    time = np.arange(600) / 120.0
    wave = np.sin(2.0 * np.pi * time)[:, None]
    middle = slice(60, -60)
    assert low_pass(wave, 120.0, 10.0)[middle] == pytest.approx(wave[middle], abs=2e-3)
    noise = np.sin(2.0 * np.pi * 40.0 * time)[:, None]
    assert np.abs(low_pass(noise, 120.0, 6.0)[60:-60]).max() < 1e-3
    motion = Trajectory(time, ("hip_r",), wave, ("rad",))
    q, v, vdot = smooth_rates(motion)
    speed = 2.0 * np.pi * np.cos(2.0 * np.pi * time)[:, None]
    assert q[middle] == pytest.approx(wave[middle], abs=2e-3)
    assert v[middle] == pytest.approx(speed[middle], abs=0.02)
    assert vdot[middle] == pytest.approx(-4.0 * np.pi**2 * wave[middle], abs=0.1)


@cache
def standing() -> tuple[pin.Model, Trajectory, float]:
    """Return the walker standing still for a second, and where its right heel is [m]."""
    model = pinocchio_model(load_patient("sreenivasa2017-patient"), "barefoot")
    q = np.zeros((FRAMES, 10))
    q[:, 1] = 0.65
    q[:, 6] = -0.8
    motion = Trajectory(np.arange(FRAMES) / 120.0, COORDINATES, q, ("m", "m", *["rad"] * 8))
    return model, motion, float(foot_extents(model, q[:1])["right"][0, 0])


def recording(share: float = 1.0, shift: float = 0.0, late: int = 0) -> Recording:
    """Return a recording in which the right foot stands on a plate from frame 30 to 90.

    Args:
        share: Share of body weight that the plate carries.
        shift: How far the load lies in front of the heel, beyond 0.05 m [m].
        late: Frames by which the load outlasts the stance.
    """
    model, _, heel = standing()
    weight = GRAVITY * pin.computeTotalMass(model)
    loaded = np.zeros(FRAMES * PER_FRAME)
    loaded[30 * PER_FRAME : (90 + late) * PER_FRAME] = share * weight
    force = np.column_stack([0.1 * loaded, 0.0 * loaded, loaded])
    point = np.tile([heel + 0.05 + shift, 0.0], (loaded.size, 1))
    events = (
        Event("left", "toe_off", 32),
        Event("right", "foot_strike", 30),
        Event("left", "foot_strike", 88),
        Event("right", "toe_off", 90),
        Event("right", "foot_strike", 110),
    )
    blank = np.zeros((FRAMES, 0, 3))
    loaded_plate = plate(force, point)
    noisy = replace(loaded_plate, force=loaded_plate.force + 1.5, moment=loaded_plate.moment + 0.4)
    return Recording("made", 120.0, (), blank, events, (noisy,), PER_FRAME)


def test_force_of_a_clean_stance() -> None:
    model, motion, heel = standing()
    forces = ground_forces(recording(), model, motion)
    assert [item.reason for item in forces.stances] == [""]
    feet = foot_extents(model, motion.values)
    assert plate_direction(plate_loads(recording()), feet, recording().events) == "+x"
    weight = GRAVITY * pin.computeTotalMass(model)
    right, left = (forces.table.select((f"force_{s}_x", f"force_{s}_z")).values for s in ("r", "l"))
    assert right[40:80, 1] == pytest.approx(weight, rel=0.01)
    assert right[40:80, 0] == pytest.approx(0.1 * weight, rel=0.01)
    assert forces.table["cop_r_x"][40:80] == pytest.approx(heel + 0.05, abs=1e-3)
    assert right[95:108] == pytest.approx(0.0, abs=0.0), "in the air"
    assert np.isnan(right[:20]).all(), "not measured"
    assert left[40:80] == pytest.approx(0.0, abs=0.0)
    assert np.isnan(left[95:]).all()


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        ({"share": 0.2}, "no plate below the foot"),
        ({"share": 0.7}, "carries 70 % of the body"),
        ({"shift": 0.3}, "load not under the foot"),
        ({"late": 15}, "loaded before or after"),
    ],
)
def test_doubtful_stances_are_not_measured(made: dict[str, float], reason: str) -> None:
    model, motion, _ = standing()
    forces = ground_forces(recording(**made), model, motion, ASIDE)  # type: ignore[arg-type]
    assert reason in forces.stances[0].reason
    assert np.isnan(forces.table.select(("force_r_x", "force_r_z")).values[40:80]).all()


def two_steps(part: float = 0.0, standing_on: float = 1.0) -> Recording:
    """Return a recording in which each foot has a plate; the left strikes while the right stands.

    Args:
        part: Share of the left foot's load that falls on the right foot's plate, for ten frames.
        standing_on: Share of the right foot's load that its plate carries.
    """
    model, motion, heel = standing()
    weight = GRAVITY * pin.computeTotalMass(model)
    ahead = float(foot_extents(model, motion.values[:1])["left"][0, 0]) - heel
    shift = np.array([ahead, 0.0, 0.0])
    frame = np.arange(FRAMES * PER_FRAME) / PER_FRAME
    right = weight * (np.interp(frame, [76, 90], [1.0, 0.0]) * (frame >= 30))
    left = weight * (np.interp(frame, [76, 90], [0.0, 1.0]) * (frame < 115))
    onto = part * left * ((frame >= 76) & (frame < 86))
    under_right, under_left = np.array([heel + 0.1, 0.0]), np.array([heel + 0.05, 0.0])
    first = _load((standing_on * right, under_right), (onto, under_left + shift[:2]))
    second = _load((left - onto, under_left))
    events = (
        Event("right", "foot_strike", 30),
        Event("left", "toe_off", 32),
        Event("left", "foot_strike", 76),
        Event("right", "toe_off", 90),
        Event("right", "foot_strike", 112),
        Event("left", "toe_off", 115),
    )
    plates = (
        replace(first, name="plate 1", corners=CORNERS * [4.0, 1.0, 1.0]),
        replace(second, name="plate 2", corners=CORNERS + shift),
    )
    return Recording("made", 120.0, (), np.zeros((FRAMES, 0, 3)), events, plates, PER_FRAME)


def _load(*loads: tuple[np.ndarray, np.ndarray]) -> ForcePlate:
    """Return a plate under vertical forces (n,) [N], each at one of its points [m]."""
    made = [plate(np.outer(up, [0.0, 0.0, 1.0]), np.tile(at, (up.size, 1))) for up, at in loads]
    force, moment = sum(p.force for p in made), sum(p.moment for p in made)
    return replace(made[0], force=np.asarray(force), moment=np.asarray(moment))


@pytest.mark.parametrize(
    ("made", "right", "left"),
    [
        ({}, "", ""),
        (
            {"part": 0.5},
            "plate 1 also carries the left foot from frame 77",
            "plate 1 carries part of the foot from frame 77",
        ),
        (
            {"part": 0.5, "standing_on": 0.0},
            "no plate below the foot",
            "plate 1 carries part of the foot from frame 77",
        ),
    ],
)
def test_a_foot_on_two_plates_spoils_both(made: dict[str, float], right: str, left: str) -> None:
    model, motion, _ = standing()
    forces = ground_forces(two_steps(**made), model, motion, ASIDE)
    assert [(item.stance.side, item.reason) for item in forces.stances] == [
        ("right", right),
        ("left", left),
    ]


def test_columns_of_the_table() -> None:
    model, motion, _ = standing()
    table = ground_forces(recording(), model, motion).table
    assert table.names == (
        "force_r_x", "force_r_z", "cop_r_x", "force_l_x", "force_l_z", "cop_l_x"
    )  # fmt: skip
    assert table.units == ("N", "N", "m") * 2


def test_no_plates_is_an_error() -> None:
    model, motion, _ = standing()
    with pytest.raises(DataError, match="no force plates"):
        ground_forces(replace(recording(), plates=()), model, motion)


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs shared/recordings beside the checkout")
@pytest.mark.parametrize(
    ("trial", "direction", "measured"),
    [
        ("barefoot/3053176", "+y", "l"),
        ("barefoot/3053179", "-y", "rl"),
        ("barefoot/3053183", "+y", "r"),
        ("barefoot/3053184", "-y", "l"),
        ("orthosis/3053141", "-y", "lr"),
        ("orthosis/3053144", "-y", "rl"),
        ("orthosis/3053145", "+y", ""),  # the left heel lands on the right foot's plate
        ("orthosis/3053146", "-y", "l"),
        ("orthosis/3053148", "+y", "lr"),
    ],
)
def test_recorded_stances(trial: str, direction: str, measured: str) -> None:
    patient = load_patient("sreenivasa2017-patient")
    condition = "orthosis" if trial.startswith("orthosis") else "barefoot"
    config = RecordedConfig(patient=patient.id)
    ((walk, read),) = c3d_trials([RECORDINGS / f"{trial}.c3d"], patient, condition, config)
    model = pinocchio_model(patient, condition)
    forces = ground_forces(read, model, walk.motion)
    feet = foot_extents(model, walk.motion.values)
    assert plate_direction(plate_loads(read), feet, read.events) == direction
    assert forces.stances == walk.stances
    found = [item for item in walk.stances if item.measured]
    assert "".join(item.stance.side[0] for item in found) == measured
