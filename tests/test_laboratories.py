"""Recordings as other laboratories store them: one made recording, changed in one way each.

Where shared/cases stands beside the checkout, files of real laboratories with the same troubles
must end the same way.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

from pathwalker_cli.cli import cli
from pathwalker_cli.conventions import SIDES, Condition
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.body import measured_body
from pathwalker_cli.inverse.c3d_trials import c3d_trials
from pathwalker_cli.inverse.joint_centres import beside_joint, hip_centre
from pathwalker_cli.inverse.kinematics import marker_paths
from pathwalker_cli.inverse.marker_sets import leg_length, recognised
from pathwalker_cli.inverse.markers import load_marker_set, marker_points
from pathwalker_cli.inverse.study import Paths, RecordedConfig
from pathwalker_cli.inverse.text import stance_notes, warnings
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.trials import kinematics_trials
from pathwalker_cli.inverse.walk import about_vertical, cut, turned
from pathwalker_cli.io.c3d import Recording, read_c3d
from pathwalker_cli.io.c3d_write import write_c3d
from pathwalker_cli.io.recordings import read_recording
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.starter.example import made_recordings

ezc3d = pytest.importorskip("ezc3d")

RECORDINGS = Path(__file__).parents[2] / "shared" / "recordings"
CASES = Path(__file__).parents[2] / "shared" / "cases"
needs_cases = pytest.mark.skipif(
    not CASES.is_dir(), reason="needs shared/cases beside the checkout"
)
SHIPPED = "sreenivasa2017-patient"


@cache
def walk() -> Recording:
    """Return a made walk with both feet's events and one plate, x along it and z up."""
    return next(iter(made_recordings(load_patient(SHIPPED), "barefoot")))


def evaluated(
    path: Path, patient: Patient | None = None, markers: str | None = None, **keys: Any
) -> list[Trial]:
    """Return the trials of a file."""
    config = RecordedConfig(patient=SHIPPED, markers=markers, **keys)
    patient = patient or load_patient(SHIPPED)
    return [trial for trial, _ in c3d_trials([path], patient, "barefoot", config)]


@cache
def right(folder: Path) -> Trial:
    """Return the made walk as it stands, evaluated."""
    write_c3d(folder / "walk.c3d", walk())
    (trial,) = evaluated(folder / "walk.c3d")
    return trial


@pytest.fixture(scope="module", name="good")
def _good(tmp_path_factory: pytest.TempPathFactory) -> Trial:
    return right(tmp_path_factory.mktemp("good"))


def edited(path: Path, change: Callable[[Any], None], recording: Recording | None = None) -> Path:
    """Write the made walk with its C3D parameters changed."""
    write_c3d(path, recording or walk())
    file = ezc3d.c3d(str(path))
    change(file)
    del file["data"]["meta_points"]
    file.write(str(path))
    return path


def said(trial: Trial) -> str:
    """Return all that a user is told about a trial."""
    return "\n".join((*trial.remarks, *stance_notes(trial), *warnings(trial, 1.25, 0.025)))


def angles(trial: Trial) -> np.ndarray:
    """Return height, tilt and joint angles [m, rad]."""
    return trial.motion.values[:, 1:]


def flat_times(file: Any) -> None:
    """Store minutes and seconds of all events in one row."""
    times = file["parameters"]["EVENT"]["TIMES"]
    times["value"] = np.asarray(times["value"]).ravel(order="F")


def seconds_alone(file: Any) -> None:
    """Store one number per event."""
    times = file["parameters"]["EVENT"]["TIMES"]
    times["value"] = np.asarray(times["value"])[1]


def sides_in_labels(file: Any) -> None:
    """Name sides and kinds in short labels, without contexts."""
    group = file["parameters"]["EVENT"]
    pairs = zip(group["CONTEXTS"]["value"], group["LABELS"]["value"], strict=True)
    labels = [f"{side[0]}{'HS' if kind.endswith('Strike') else 'TO'}" for side, kind in pairs]
    group["LABELS"]["value"] = labels
    del group["CONTEXTS"]


def later_start(file: Any) -> None:
    """Let the file begin at frame 1001, and count its events from there, as some programs do."""
    file["header"]["points"]["first_frame"] = 1000


@pytest.mark.parametrize("change", [flat_times, seconds_alone, sides_in_labels, later_start])
def test_every_layout_of_events(change: Callable[[Any], None], good: Trial, tmp_path: Path) -> None:
    (trial,) = evaluated(edited(tmp_path / "walk.c3d", change))
    assert trial.events == good.events
    assert angles(trial) == pytest.approx(angles(good), abs=1e-9)


def test_events_are_found_where_there_are_none(good: Trial, tmp_path: Path) -> None:
    write_c3d(tmp_path / "walk.c3d", replace(walk(), events=()))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert "events found by the markers" in said(trial)
    assert "at the edges of a plate's load" in said(trial)
    for event in good.events:
        same = [e.frame for e in trial.events if (e.side, e.kind) == (event.side, event.kind)]
        assert min(abs(frame - event.frame) for frame in same) <= 8  # 0.07 s
    assert [s.measured for s in trial.stances if s.plate is not None] == [True]


def test_a_name_that_stands_twice_is_refused(tmp_path: Path) -> None:
    names = ("LKNE", *walk().markers)
    positions = np.concatenate([walk().positions[:, :1], walk().positions], axis=1)
    write_c3d(tmp_path / "walk.c3d", replace(walk(), markers=names, positions=positions))
    with pytest.raises(DataError, match="has 2 markers LKNE; allowed: one of a name"):
        evaluated(tmp_path / "walk.c3d")


def test_labels_beyond_the_255th_are_read(good: Trial, tmp_path: Path) -> None:
    """C3D goes on with them in LABELS2."""
    others = np.ones((len(walk().positions), 260, 3))
    positions = np.concatenate([others, walk().positions], axis=1)
    names = (*[f"*{number}" for number in range(260)], *walk().markers)
    write_c3d(tmp_path / "walk.c3d", replace(walk(), markers=names, positions=positions))
    assert "LABELS2" in ezc3d.c3d(str(tmp_path / "walk.c3d"))["parameters"]["POINT"]
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert angles(trial) == pytest.approx(angles(good), abs=1e-9)


def test_one_of_two_subjects_is_chosen_by_name(good: Trial, tmp_path: Path) -> None:
    every = walk().markers
    names = (*[f"Anna:{n}" for n in every], *[f"Bob:{n}" for n in every])
    positions = np.concatenate([walk().positions, walk().positions + 0.5], axis=1)
    path = tmp_path / "walk.c3d"
    write_c3d(path, replace(walk(), markers=names, positions=positions))
    with pytest.raises(DataError, match=r"one subject of Anna, Bob; name the subject"):
        evaluated(path)
    with pytest.raises(DataError, match="names no subject Eve; allowed: Anna, Bob"):
        evaluated(path, subject="Eve")
    (trial,) = evaluated(path, subject="Anna")
    assert angles(trial) == pytest.approx(angles(good), abs=1e-9)


def test_frames_without_labels_at_the_ends_are_cut(good: Trial, tmp_path: Path) -> None:
    positions = walk().positions.copy()
    positions[:15] = np.nan
    positions[-4:, 3:] = np.nan
    write_c3d(tmp_path / "walk.c3d", replace(walk(), positions=positions))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    last = len(positions)
    assert f"cut to frames 16 to {last - 4} of 1 to {last}" in said(trial)
    assert angles(trial) == pytest.approx(angles(good)[15:-4], abs=1e-3)
    assert [e.frame + 15 for e in trial.events] == [
        e.frame for e in good.events if 15 <= e.frame < last - 4
    ]


@pytest.mark.parametrize("degrees", [10.0, 90.0, -170.0])
@pytest.mark.parametrize("rows", [(0, 1, 2), (1, 2, 0)], ids=["z up", "y up"])
def test_any_direction_of_travel_and_any_vertical(
    degrees: float, rows: tuple[int, ...], good: Trial, tmp_path: Path
) -> None:
    radians = np.radians(degrees)
    axes = about_vertical(np.array([np.cos(radians), np.sin(radians)]))[list(rows)]
    write_c3d(tmp_path / "walk.c3d", turned(walk(), axes))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert angles(trial) == pytest.approx(angles(good), abs=1e-6)
    assert trial.stances == good.stances
    assert trial.forces is not None
    assert good.forces is not None
    names = ("force_r_x", "force_r_z", "force_l_x", "force_l_z")
    found, expected = (t.forces.select(names).values for t in (trial, good))  # type: ignore[union-attr]
    assert found == pytest.approx(expected, abs=1e-3, nan_ok=True)


def test_there_and_back_are_two_passes(good: Trial, tmp_path: Path) -> None:
    half = about_vertical(np.array([-1.0, 0.0]))
    back = turned(walk(), half)
    shift = walk().positions[-1, 0] - back.positions[0, 0]
    positions = np.concatenate([walk().positions, back.positions + shift * [1.0, 1.0, 0.0]])
    both = replace(walk(), positions=positions, plates=())
    write_c3d(tmp_path / "walk.c3d", both)
    first, second = evaluated(tmp_path / "walk.c3d")
    assert [first.name, second.name] == ["walk-1", "walk-2"]
    assert "turns round before frame" in said(first)
    write_c3d(tmp_path / "walk-1.c3d", walk())
    config = RecordedConfig(patient=SHIPPED, c3d=Paths(barefoot=(str(tmp_path),)))
    trials = kinematics_trials(config, load_patient(SHIPPED), lambda _: None)
    assert {trial.name for trial in trials} == {"walk-1", "walk-pass-1", "walk-pass-2"}
    for trial, begin in ((first, 0), (second, len(walk().positions))):
        row = trial.first_frame - 1 - begin
        own = angles(good)[row : row + len(angles(trial))]
        assert np.degrees(np.abs(angles(trial) - own)[:, 1:]).max() < 0.2
        assert trial.motion["pelvis_tx"][-1] > trial.motion["pelvis_tx"][0]


def test_a_pose_is_set_aside_or_refused(tmp_path: Path) -> None:
    still = replace(walk(), positions=walk().positions[:1].repeat(60, 0), plates=(), events=())
    (tmp_path / "c3d").mkdir()
    write_c3d(tmp_path / "c3d" / "static.c3d", still)
    config = RecordedConfig(
        patient=SHIPPED,
        conditions=("barefoot",),
        c3d=Paths(barefoot=(str(tmp_path / "c3d"),)),
    )
    with pytest.raises(DataError, match=r"static: LASI, SACR travel 0.00 m"):
        kinematics_trials(config, load_patient(SHIPPED), lambda _: None)
    rolling = walk().positions.copy()
    rolling[..., 0] -= np.linspace(rolling[0, 0, 0], rolling[-1, 0, 0], len(rolling))[:, None]
    write_c3d(tmp_path / "treadmill.c3d", replace(walk(), positions=rolling, plates=()))
    with pytest.raises(DataError, match="walks on a treadmill cannot be read"):
        evaluated(tmp_path / "treadmill.c3d")
    write_c3d(tmp_path / "c3d" / "walk.c3d", walk())
    (trial,) = kinematics_trials(config, load_patient(SHIPPED), lambda _: None)
    assert "static is set aside: its LASI, SACR travel 0.00 m" in said(trial)


def test_a_marker_that_jumps_is_left_out_and_named(good: Trial, tmp_path: Path) -> None:
    positions = walk().positions.copy()
    positions[60:66, walk().markers.index("LKNE")] += 0.8
    write_c3d(tmp_path / "walk.c3d", replace(walk(), positions=positions))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert "marker LKNE lies up to" in said(trial)
    assert "in 6 frames from 61 to 66: it is left out there" in said(trial)
    assert np.degrees(np.abs(angles(trial) - angles(good))[:, 1:]).max() < 1.0


def test_wands_are_left_out_and_named(good: Trial, tmp_path: Path) -> None:
    positions = walk().positions.copy()
    for name in ("RTHI", "LTHI", "RTIB", "LTIB"):
        positions[:, walk().markers.index(name), 0] += 0.15
    write_c3d(tmp_path / "walk.c3d", replace(walk(), positions=positions))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert "on wands far beside the line between the joints: RTHI, RTIB, LTHI, LTIB" in said(trial)
    assert np.degrees(np.abs(angles(trial) - angles(good))[:, 1:]).max() < 1.5


def negated(plate: Any) -> Any:
    """Store what the foot does to the plate."""
    return replace(plate, force=-plate.force, moment=-plate.moment)


def reordered(*order: int) -> Callable[[Any], Any]:
    """Store the corners in another order, with the channels as they were."""

    def change(file: Any) -> None:
        corners = file["parameters"]["FORCE_PLATFORM"]["CORNERS"]
        corners["value"] = np.asarray(corners["value"])[:, list(order)]

    return change


def thousandfold(file: Any) -> None:
    """Store moments in a unit that is not theirs."""
    file["data"]["analogs"][:, 3:6] *= 1e3


PLATES: dict[str, tuple[Callable[[Any], Any], str]] = {
    "half a turn": (reordered(2, 3, 0, 1), "corners seem to be stored half a turn round"),
    "mirrored": (reordered(0, 3, 2, 1), "corners seem to be stored mirrored about corners 1 and 3"),
    "moments": (thousandfold, "its moments 1000 times too large"),
}


@pytest.mark.parametrize("fault", PLATES)
def test_what_is_wrong_with_a_plate_is_named_and_mended_on_request(
    fault: str, good: Trial, tmp_path: Path
) -> None:
    change, words = PLATES[fault]
    path = edited(tmp_path / "walk.c3d", change)
    (trial,) = evaluated(path)
    assert "plate 1 is not used: it" in said(trial)
    assert "import --mend-plates" in said(trial)
    assert words in said(trial)
    assert not any(stance.measured for stance in trial.stances)
    (mended,) = evaluated(path, mend_plates=True)
    assert "plate 1 is mended" in said(mended)
    assert mended.forces is not None
    assert good.forces is not None
    assert mended.forces.values == pytest.approx(good.forces.values, abs=1e-2, nan_ok=True)


def test_forces_on_the_plate_are_named_and_mended(good: Trial, tmp_path: Path) -> None:
    write_c3d(tmp_path / "walk.c3d", replace(walk(), plates=tuple(map(negated, walk().plates))))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert "it seems to hold the forces on the plate, not on the body" in said(trial)
    (mended,) = evaluated(tmp_path / "walk.c3d", mend_plates=True)
    assert mended.stances == good.stances


def test_a_zero_level_is_named_and_mended(good: Trial, tmp_path: Path) -> None:
    lifted = tuple(replace(p, force=p.force + np.array([3.0, -2.0, 80.0])) for p in walk().plates)
    write_c3d(tmp_path / "walk.c3d", replace(walk(), plates=lifted))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert "plate 1 is not used: its zero level seems to be off by 80 N" in said(trial)
    (mended,) = evaluated(tmp_path / "walk.c3d", mend_plates=True)
    assert mended.stances == good.stances
    assert mended.forces is not None
    assert good.forces is not None
    assert mended.forces.values == pytest.approx(good.forces.values, abs=0.1, nan_ok=True)


def test_walks_backwards_exchanged_sides_and_bends_are_named(good: Trial, tmp_path: Path) -> None:
    still = ("faces away", "lie on the right", "bends by")
    assert not any(words in said(good) for words in still)
    turn = np.radians(np.linspace(0.0, 60.0, len(walk().positions)))
    bent = walk().positions.copy()
    bent[..., 1] += (np.cumsum(np.tan(turn) * np.gradient(walk().positions[:, 0, 0])))[:, None]
    recordings = (
        replace(walk(), positions=walk().positions[::-1]),
        replace(walk(), positions=walk().positions * [1.0, -1.0, 1.0]),
        replace(walk(), positions=bent),
    )
    for recording, words in zip(recordings, still, strict=True):
        write_c3d(tmp_path / "walk.c3d", replace(recording, plates=()))
        assert words in said(evaluated(tmp_path / "walk.c3d")[0])


RENAMED: dict[str, dict[str, str]] = {
    "Plug-in Gait with a sacral marker": {},
    "Helen Hayes": {
        "LASI": "L.ASIS", "RASI": "R.ASIS", "SACR": "V.Sacral", "LKNE": "L.Knee", "RKNE": "R.Knee",
        "LANK": "L.Ankle", "RANK": "R.Ankle", "LTOE": "L.Toe", "RTOE": "R.Toe", "LHEE": "L.Heel",
        "RHEE": "R.Heel", "CLAV": "X",
    },
    "Davis": {
        "LASI": "l asis", "RASI": "r asis", "SACR": "sacrum", "LKNE": "l knee 1",
        "RKNE": "r knee 1", "LANK": "l mall", "RANK": "r mall", "LTOE": "l met", "RTOE": "r met",
        "LHEE": "l heel", "RHEE": "r heel", "C7": "c7", "CLAV": "x",
    },
    "CAST": {
        "LASI": "L_IAS", "RASI": "R_IAS", "SACR": "L_IPS", "SACR2": "R_IPS", "LKNE": "L_FLE",
        "RKNE": "R_FLE", "LANK": "L_FAL", "RANK": "R_FAL", "LTOE": "L_FM2", "RTOE": "R_FM2",
        "LHEE": "L_FCC", "RHEE": "R_FCC", "C7": "CV7", "CLAV": "SJN",
    },
    "Plug-in Gait": {"SACR": "LPSI", "SACR2": "RPSI"},
    "CGM2": {"SACR": "LPSI", "SACR2": "RPSI", "LTOE": "LSMH", "RTOE": "RSMH"},
}  # fmt: skip


def relabelled(names: dict[str, str]) -> Recording:
    """Return the made walk with a second front and back of the pelvis, under other names."""
    every = (*walk().markers, "RASI", "SACR2")
    copied = [walk().marker("LASI"), walk().marker("SACR")]
    positions = np.concatenate([walk().positions, np.stack(copied, axis=1)], axis=1)
    apart = {"LASI": 0.1, "RASI": -0.1} | ({"SACR": 0.04, "SACR2": -0.04} if names else {})
    for name, aside in apart.items():
        positions[:, every.index(name), 1] += aside
    return replace(walk(), markers=tuple(names.get(n, n) for n in every), positions=positions)


@pytest.mark.parametrize("name", RENAMED)
def test_marker_sets_are_recognised(name: str, good: Trial, tmp_path: Path) -> None:
    write_c3d(tmp_path / "walk.c3d", relabelled(RENAMED[name]))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert f"its markers are those of {name}" in said(trial).splitlines()
    error = np.degrees(angles(trial) - angles(good))[:, 1:]
    # hips lie 4 cm further ahead than in the shipped set; the way of the angles is the same
    assert error.std(axis=0)[:7].max() < 4.0
    assert [stance.measured for stance in trial.stances if stance.plate is not None] == [True]


def with_turning_pelvis(degrees: float) -> Recording:
    """Return the made walk with hips, knees and ankles beside the plane, on a pelvis that turns."""
    walk_ = relabelled({})
    positions, names = walk_.positions.copy(), list(walk_.markers)
    yaw = np.radians(degrees) * np.sin(np.linspace(0.0, 9.0, len(positions)))
    axis = np.stack([-np.sin(yaw), np.cos(yaw), 0.3 * np.sin(yaw)], axis=1)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    aside = hip_centre(leg_length(load_patient(SHIPPED)), 0.2)[1]
    levers = dict.fromkeys(("TOE", "HEE", "THI", "TIB"), aside) | {"ASI": 0.1}
    levers |= {mark: aside + beside_joint(n, "left", 1.25, {}) for n, mark in JOINTS.items()}
    middle = walk().marker("LASI")
    for side, sign in (("R", -1.0), ("L", 1.0)):
        for name, lever in levers.items():
            path = middle if name == "ASI" else walk().marker(side + name)
            positions[:, names.index(side + name)] = path + sign * lever * axis
    return replace(walk_, positions=positions, plates=())


JOINTS = {"knee": "KNE", "ankle": "ANK"}


def test_a_pelvis_that_turns_does_not_bend_the_legs(tmp_path: Path) -> None:
    """15 degrees move one leg 2 cm ahead, the other back; angles were off by up to 14 degrees."""
    every = []
    for degrees in (0.0, 15.0):
        write_c3d(tmp_path / "walk.c3d", with_turning_pelvis(degrees))
        (trial,) = evaluated(tmp_path / "walk.c3d")
        every.append(angles(trial))
    assert np.degrees(np.abs(every[1] - every[0])[:, 1:]).max() < 2.0


def test_the_file_tells_the_breadth_of_joints() -> None:
    told = {"LKneeWidth": 90.0, "RKneeWidth": 9.0}  # the right one is in cm
    usual = beside_joint("knee", "right", 1.5, {})
    assert beside_joint("knee", "left", 1.5, told) == pytest.approx(0.052)
    assert beside_joint("knee", "right", 1.5, told) == usual == pytest.approx(0.049, abs=1e-3)


def test_the_closest_set_is_named_with_what_it_lacks() -> None:
    labels = relabelled(RENAMED["CAST"])
    lacking = replace(labels, markers=tuple(n.replace("L_FAL", "x") for n in labels.markers))
    with pytest.raises(DataError, match=r"closest is CAST, which lacks L_FAL"):
        recognised(lacking, "walk.c3d")


def test_a_foot_beside_the_plate_does_not_strike_it(good: Trial, tmp_path: Path) -> None:
    """A load that rolls far ahead while the other foot comes down beside the plate."""
    (plate,) = walk().plates
    wide = plate.corners + np.sign(plate.corners - plate.centre) * [0.5, 0.0, 0.0]
    write_c3d(tmp_path / "walk.c3d", replace(walk(), plates=(replace(plate, corners=wide),)))
    (trial,) = evaluated(tmp_path / "walk.c3d")
    assert [s.reason for s in trial.stances if s.plate is not None] == [""]


def on_tiptoe(recording: Recording, degrees: float) -> Recording:
    """Return a walk whose feet are plantarflexed further in every frame."""
    positions = recording.positions.copy()
    cos, sin = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    turn = np.array([[cos, 0.0, -sin], [0.0, 1.0, 0.0], [sin, 0.0, cos]])
    for side in "LR":
        ankle, toe = recording.marker(f"{side}ANK"), recording.marker(f"{side}TOE")
        positions[:, recording.markers.index(f"{side}TOE")] = ankle + (toe - ankle) @ turn
    return replace(recording, positions=positions, plates=())


def standing(recording: Recording) -> Recording:
    """Return the made child upright on flat feet, the markers of a walk as far aside as there."""
    patient = load_patient(SHIPPED)
    points = marker_points(load_marker_set(), patient, "barefoot")
    (pose,) = marker_paths(pinocchio_model(patient, "barefoot"), points, np.zeros((1, 10)))
    positions = recording.positions[:1].repeat(60, 0)
    at = dict(zip([point.marker for point in points], pose, strict=True))
    at |= {"RASI": at["LASI"], "SACR2": at["SACR"]}
    for column, name in enumerate(recording.markers):
        positions[:, column, [0, 2]] = at.get(name, [0.0, 0.0]) + np.array([0.0, 0.6])
    return replace(recording, positions=positions, plates=(), events=())


def test_a_pose_tells_the_zero_of_feet_that_never_stand_flat(tmp_path: Path) -> None:
    """Without heel markers the walk alone does not tell it."""
    heels = ("LHEE", "RHEE")
    flat = relabelled({name: f"no {name}" for name in heels})
    flat = replace(flat, markers=tuple(n.replace("no SACR2", "SACR2") for n in flat.markers))
    write_c3d(tmp_path / "flat.c3d", flat)
    write_c3d(tmp_path / "tiptoe.c3d", on_tiptoe(flat, 25.0))
    config = RecordedConfig(patient=SHIPPED, c3d=Paths(barefoot=(str(tmp_path),)))

    def higher() -> np.ndarray:
        trials = kinematics_trials(config, load_patient(SHIPPED), lambda _: None)
        both = [trial.motion.select(("ankle_r", "ankle_l")).values for trial in trials]
        return np.degrees(both[1] - both[0]).mean(axis=0)

    assert (np.abs(higher() - 25.0) > 15.0).all()
    write_c3d(tmp_path / "static.c3d", standing(flat))
    assert higher() == pytest.approx([25.0, 25.0], abs=1.0)
    trial, _ = kinematics_trials(config, load_patient(SHIPPED), lambda _: None)
    assert "where its foot markers sit is measured in the pose" in said(trial)


def with_numbers(file: Any) -> None:
    """Add what processing programs keep about the subject, lengths in mm."""
    file.add_parameter("PROCESSING", "Bodymass", [24.7])
    file.add_parameter("PROCESSING", "Height", [1250.0])


def test_a_folder_from_a_recording(tmp_path: Path) -> None:
    """Lengths of the made walk are those of the shipped patient, hips 4 cm further ahead."""
    path = edited(tmp_path / "static.c3d", with_numbers, relabelled({}))
    words = ["init", str(tmp_path / "new"), str(path), "--from", str(path), "--sex", "male"]
    unmeasured = CliRunner().invoke(cli, ["init", str(tmp_path / "new"), str(path)])
    assert "is given without --from" in unmeasured.output
    refused = CliRunner().invoke(cli, words)
    assert "no recording tells a child's age and sex" in refused.output
    result = CliRunner().invoke(cli, [*words, "--age", "6"])
    assert result.exception is None, result.output
    assert "body mass: PROCESSING:Bodymass of static" in result.output
    assert (tmp_path / "new" / "c3d" / "barefoot" / "static.c3d").is_file()
    made, shipped = load_patient(tmp_path / "new"), load_patient(SHIPPED)
    assert (made.sex, made.age, made.body_mass, made.height) == ("male", 6.0, 24.7, 1.25)
    for side in SIDES:
        for name, error in (("shank", 0.003), ("foot", 0.003), ("thigh", 0.05)):
            assert made.length(name, side) == pytest.approx(shipped.length(name, side), abs=error)
        heel, toe = made.contacts("barefoot")[side].heel, made.contacts("barefoot")[side].toe
        assert toe[0] - heel[0] == pytest.approx(shipped.length("foot", side), abs=0.004)
    (trial,) = evaluated(path, made)
    assert trial.markers is not None
    assert trial.markers.mean < 0.02


def test_a_recording_without_a_known_set_makes_no_folder(tmp_path: Path) -> None:
    write_c3d(tmp_path / "static.c3d", walk())
    with pytest.raises(DataError, match="lacks a marker on one of the front spines"):
        measured_body(tmp_path / "static.c3d")


def test_plates_weigh_who_stands_on_them(tmp_path: Path) -> None:
    (plate,) = walk().plates
    force = np.zeros_like(plate.force)
    force[:, 2] = 245.0
    still = relabelled({})
    still = replace(still, plates=(replace(plate, force=force, moment=np.zeros_like(force)),))
    write_c3d(tmp_path / "static.c3d", still)
    body = measured_body(tmp_path / "static.c3d")
    assert body.mass == pytest.approx(25.0, abs=0.1)
    assert body.height is not None
    assert body.height == pytest.approx(1.25, abs=0.15), "from the neck"
    write_c3d(tmp_path / "pose.c3d", standing(relabelled({})))
    upright = measured_body(tmp_path / "pose.c3d")
    assert body.height == pytest.approx(upright.height, abs=0.04), "however far the knees bend"


# --- files of real laboratories -------------------------------------------------------------------


@pytest.mark.skipif(not RECORDINGS.is_dir(), reason="needs shared/recordings beside the checkout")
@pytest.mark.parametrize(("condition", "measured"), [("barefoot", 9), ("orthosis", 13)])
def test_the_shipped_trials_stay_what_they_were(condition: Condition, measured: int) -> None:
    """Angles to the digits of the shipped tables, and as many measured stances."""
    patient, count = load_patient(SHIPPED), 0
    for path in sorted((RECORDINGS / condition).glob("*.c3d")):
        config = RecordedConfig(patient=SHIPPED)
        ((trial, _),) = c3d_trials([path], patient, condition, config)
        shipped = read_recording(patient, condition, path.stem)
        expected = shipped.motion.values[:, 1:]  # with six digits
        assert angles(trial) == pytest.approx(expected, rel=5.1e-6, abs=1e-6)
        assert trial.events == shipped.events
        assert trial.remarks == trial.doubts == ()
        count += sum(item.measured for item in trial.stances)
    assert count == measured


REAL: dict[str, tuple[str, str | None, str, int]] = {
    # file: patient, marker set, words that are said, measured stances
    "good": ("child", None, "", 1),
    "event_times_flat": ("child", None, "", 1),
    "event_no_contexts": ("child", None, "", 1),
    "no_events": ("child", None, "names no foot strikes: 6 events found", 1),
    "unlabelled_start": ("child", None, "cut to frames 186 to 380 of 171 to 380", 1),
    "y_up": ("child", None, "its vertical is +y", 1),
    "forces_negated": ("child", None, "the forces on the plate, not on the body", 0),
    "corners_half_turn": ("child", None, "corners seem to be stored half a turn round", 0),
    "corners_mirrored": ("child", None, "corners seem to be stored mirrored about corners 1", 0),
    "there_and_back": ("child", None, "turns round before frame", 1),
    "outlier_marker": ("child", None, "marker LKNE lies up to 22 m", 1),
    "real_type2_plates": ("adult_74kg", "low", "", 2),
    "real_straight": ("child_47kg", "pig", "no force plates", 0),
    "real_push_off_beyond_toe": ("adult_74kg", "low", "", 2),
    "real_qualisys_push_off": ("qualisys", "qualisys", "", 2),
    "real_long_push_off": ("adult_66kg", "pig", "", 1),
    "real_crouch": ("crouch", "crouch", "between the joints: RTHI, RTIB, LTHI, LTIB", 0),
}


def case(name: str, markers: str | None = "as given") -> list[Trial]:
    """Return the trials of a real case."""
    who, given, _, _ = REAL[name]
    patient = CASES / (who if (CASES / who).is_dir() else f"{who}.yaml")
    given = given if markers == "as given" else markers
    file = str(CASES / f"markers_{given}.yaml") if given else None
    return evaluated(CASES / f"{name}.c3d", load_patient(str(patient)), file)


@needs_cases
@pytest.mark.parametrize("name", REAL)
def test_real_cases(name: str) -> None:
    trials = case(name)
    _, _, words, measured = REAL[name]
    assert words in "\n".join(map(said, trials))
    assert sum(item.measured for trial in trials for item in trial.stances) == measured
    if name in ("event_times_flat", "event_no_contexts", "y_up"):
        (right_one,) = case("good")
        assert angles(trials[0]) == pytest.approx(angles(right_one), abs=1e-6)
        assert trials[0].events == right_one.events


@needs_cases
def test_real_duplicate_is_refused() -> None:
    with pytest.raises(DataError, match="has 2 markers LKNE"):
        evaluated(CASES / "duplicate_label.c3d", load_patient(str(CASES / "child")))


@needs_cases
def test_real_oblique_walk_has_the_angles_of_the_straight_one() -> None:
    (straight,) = case("real_straight")
    file = str(CASES / "markers_pig.yaml")
    patient = load_patient(str(CASES / "child_47kg.yaml"))
    (oblique,) = evaluated(CASES / "real_oblique_10deg.c3d", patient, file)
    assert np.degrees(np.abs(angles(oblique) - angles(straight))[:, 1:]).max() < 0.01


@needs_cases
@pytest.mark.parametrize(
    ("markers", "hip", "knee", "ankle"), [("crouch", 7.5, 8.0, 9.0), (None, 3.0, 2.0, 6.0)]
)
def test_real_crouch_beside_its_laboratorys_angles(
    markers: str | None, hip: float, knee: float, ankle: float
) -> None:
    """Root mean square of the differences [deg]; they were 24.5, 10.2 and 17.2 with the wands."""
    (trial,) = case("real_crouch", markers)
    stored = read_c3d(CASES / "real_crouch.c3d")
    for joint, sign, limit in (("Hip", -1.0, hip), ("Knee", 1.0, knee), ("Ankle", -1.0, ankle)):
        for side in "rl":
            own = sign * np.degrees(trial.motion[f"{joint.lower()}_{side}"])
            theirs = np.degrees(stored.stored[f"{side.upper()}{joint}Angles"][:, 0])
            assert np.sqrt(np.nanmean((own - theirs) ** 2)) < limit


def test_cuts_keep_plates_and_frames_together() -> None:
    part = cut(walk(), 10, 50)
    assert part.first_frame == walk().first_frame + 10
    assert len(part.plates[0].force) == 40 * walk().samples_per_frame
    assert all(0 <= event.frame < 40 for event in part.events)
