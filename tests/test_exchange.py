"""What other programs read of a recording, and what laboratories store beside ours."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from opensim_peer import read_opensim
from pathwalker_cli.cli import cli
from pathwalker_cli.inverse.laboratory import angles, differences, moments
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.trials import with_torques
from pathwalker_cli.io.c3d import read_c3d
from pathwalker_cli.io.c3d_write import write_c3d, write_copy
from pathwalker_cli.patient import load_patient
from test_laboratories import SHIPPED, evaluated, walk

PATIENT = load_patient(SHIPPED)


@pytest.fixture(scope="module", name="original")
def _original(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the file of the made walk."""
    path = tmp_path_factory.mktemp("c3d") / "walk.c3d"
    write_c3d(path, walk())
    return path


@pytest.fixture(scope="module", name="trial")
def _trial(original: Path) -> Trial:
    (trial,) = evaluated(original)
    return with_torques(trial, PATIENT)


@pytest.fixture(scope="module", name="exchanged")
def _exchanged(original: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of an import with everything for other programs."""
    out = tmp_path_factory.mktemp("out")
    words = ["import", original, "--patient", SHIPPED, "--condition", "barefoot", "-o", out]
    result = CliRunner().invoke(cli, [*map(str, words), "--exchange", "--json"])
    assert result.exception is None, result.output
    assert json.loads(result.stdout)["trials"][0]["laboratory"] == []
    return out


def plain_points(path: Path) -> dict[str, np.ndarray]:
    """Return the points of a C3D file of floats by label, read from its bytes alone, (n, 4)."""
    data = path.read_bytes()
    points, channels, first, last, _ = struct.unpack("<5H", data[2:12])
    scale, start, per_frame = struct.unpack("<fHH", data[12:20])
    assert scale < 0.0
    assert channels % max(per_frame, 1) == 0
    at, groups, labels = (data[0] - 1) * 512 + 4, {}, []
    while (length := struct.unpack("b", data[at : at + 1])[0]) != 0:
        number = struct.unpack("b", data[at + 1 : at + 2])[0]
        name = data[at + 2 : at + 2 + abs(length)].decode()
        step = at + 2 + abs(length)
        if number < 0:
            groups[-number] = name
        elif groups[number] == "POINT" and name == "LABELS":
            width, count = data[step + 4], data[step + 5]
            text = data[step + 6 : step + 6 + width * count].decode()
            labels = [text[i * width : (i + 1) * width].strip() for i in range(count)]
        at = step + struct.unpack("<h", data[step : step + 2])[0]
    frames, row = last - first + 1, 4 * points + channels
    values = np.frombuffer(data, "<f4", frames * row, (start - 1) * 512).reshape(frames, row)
    every = values[:, : 4 * points].reshape(frames, points, 4)
    return {label: every[:, i] for i, label in enumerate(labels)}


def test_the_copy_holds_our_curves_beside_what_the_file_has(
    original: Path, trial: Trial, exchanged: Path
) -> None:
    before, after = plain_points(original), plain_points(exchanged / "walk_pathwalker.c3d")
    for label, values in before.items():
        np.testing.assert_array_equal(after[label], values)
    for label, radians in angles(trial).items():
        np.testing.assert_allclose(after[label][:, 0], np.degrees(radians), rtol=1e-4, atol=1e-4)
    ours = moments(trial, PATIENT.body_mass)
    assert after.keys() == before.keys() | angles(trial).keys() | ours.keys()
    known = np.isfinite(ours["RAnkleMoment"])
    stored = after["RAnkleMoment"]
    assert known.any()
    np.testing.assert_allclose(stored[known, 0], 1e3 * ours["RAnkleMoment"][known], rtol=1e-4)
    np.testing.assert_array_equal(stored[:, 3], np.where(known, 0.0, -1.0))


def test_the_copy_is_read_as_the_file(original: Path, exchanged: Path) -> None:
    file, copy = read_c3d(original), read_c3d(exchanged / "walk_pathwalker.c3d")
    assert (copy.markers, copy.events, copy.rate) == (file.markers, file.events, file.rate)
    np.testing.assert_array_equal(copy.positions, file.positions)
    np.testing.assert_array_equal(copy.plates[0].force, file.plates[0].force)


def test_channels_with_offsets_keep_their_loads(original: Path, tmp_path: Path) -> None:
    """The library takes offsets beyond 32767 for positive ones of another size, and writes none."""
    data = bytearray(original.read_bytes())
    at = data.index(b"OFFSET") + len("OFFSET") + 2  # to the next parameter: two bytes
    _, dimensions, count = data[at : at + 3]
    assert dimensions == 1
    data[at + 3 : at + 3 + 2 * count] = struct.pack("<H", 33_000) * count
    source = tmp_path / "source.c3d"
    source.write_bytes(data)
    write_copy(tmp_path / "copy.c3d", source, {}, 1)
    one, other = (read_c3d(tmp_path / f"{name}.c3d") for name in ("source", "copy"))
    assert np.abs(one.plates[0].force - read_c3d(original).plates[0].force).max() > 1.0
    np.testing.assert_allclose(one.plates[0].force, other.plates[0].force, atol=0.1)


def test_ours_do_not_take_the_names_of_theirs(
    original: Path, exchanged: Path, trial: Trial, tmp_path: Path
) -> None:
    names = write_copy(tmp_path / "twice.c3d", exchanged / "walk_pathwalker.c3d", angles(trial), 1)
    assert all(name.endswith("Angles_PathWalker") for name in names)
    twice = read_c3d(tmp_path / "twice.c3d")
    assert twice.markers == read_c3d(original).markers
    assert set(names) < set(twice.stored)


def test_markers_for_opensim(trial: Trial, exchanged: Path) -> None:
    lines = (exchanged / "walk_markers.trc").read_text(encoding="utf-8").splitlines()
    facts = dict(zip(lines[1].split("\t"), lines[2].split("\t"), strict=True))
    assert trial.walk is not None
    names = [name for name in lines[3].split("\t")[2:] if name]
    assert int(facts["NumMarkers"]) == len(names) == len(trial.walk.markers)
    assert int(facts["NumFrames"]) == len(lines) - 6 == len(trial.walk.positions)
    rows = np.array([line.split("\t") for line in lines[6:]], dtype=float)
    column = 2 + 3 * names.index("LTOE")
    x, y, z = trial.walk.marker("LTOE").T
    expected = 1e3 * np.column_stack([x, z, -y])
    np.testing.assert_allclose(rows[:, column : column + 3], expected, atol=1e-3)


def test_plates_for_opensim(trial: Trial, exchanged: Path) -> None:
    table = read_opensim(exchanged / "walk_plates.mot")
    assert trial.forces is not None
    (stance,) = [item.stance for item in trial.stances if item.measured]
    side = "r" if stance.side == "right" else "l"
    rows = slice(stance.strike + 5, stance.toe_off - 5)
    for theirs, ours in (("vx", "force_{}_x"), ("vy", "force_{}_z"), ("px", "cop_{}_x")):
        expected = trial.forces[ours.format(side)][rows]
        np.testing.assert_allclose(table[f"plate_1_{theirs}"][rows], expected, rtol=1e-5)


@pytest.mark.parametrize("mass", [1.0, PATIENT.body_mass], ids=["per kg", "not per kg"])
def test_stored_curves_are_compared(
    mass: float, original: Path, trial: Trial, tmp_path: Path
) -> None:
    """An offset of the knees, and moments in either unit, with a tenth more at the ankles."""
    curves = angles(trial) | {n: m * mass for n, m in moments(trial, PATIENT.body_mass).items()}
    for side in "RL":
        curves[f"{side}KneeAngles"] = curves[f"{side}KneeAngles"] + np.radians(2.0)
        curves[f"{side}AnkleMoment"] = 1.1 * curves[f"{side}AnkleMoment"]
    write_copy(tmp_path / "theirs.c3d", original, curves, 1)
    (again,) = evaluated(tmp_path / "theirs.c3d")
    again = with_torques(again, PATIENT)
    found = {(d.quantity, d.side): d for d in differences(again, PATIENT.body_mass)}
    assert {quantity for quantity, _ in found} == {
        *(f"{name} angle" for name in ("pelvis", "hip", "knee", "ankle")),
        *(f"{name} moment" for name in ("hip", "knee", "ankle")),
    }
    knee, hip = found["knee angle", "left"], found["hip angle", "left"]
    assert (knee.offset, knee.offset_free) == pytest.approx((-2.0, 0.0), abs=1e-3)
    assert (hip.rms, found["hip moment", "right"].rms) == pytest.approx((0.0, 0.0), abs=1e-3)
    (stance,) = [item.stance for item in trial.stances if item.measured]
    ours = moments(trial, PATIENT.body_mass)[f"{stance.side[0].upper()}AnkleMoment"]
    expected = -0.1 * ours[stance.strike : stance.toe_off].mean()
    assert found["ankle moment", stance.side].offset == pytest.approx(expected, rel=1e-3)


def test_stances_whose_force_the_laboratory_missed_do_not_count(
    original: Path, trial: Trial, tmp_path: Path
) -> None:
    curves = {n: 0.01 * m for n, m in moments(trial, PATIENT.body_mass).items()}
    write_copy(tmp_path / "blind.c3d", original, curves, 1)
    (again,) = evaluated(tmp_path / "blind.c3d")
    assert differences(with_torques(again, PATIENT), PATIENT.body_mass) == ()
    assert differences(replace(trial, walk=None), PATIENT.body_mass) == ()
