"""C3D files: units, names, gaps, events, and the analog offsets that ezc3d misreads."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from made_c3d import write_c3d
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.c3d import read_c3d
from pathwalker_cli.io.c3d_plates import analog_offset_error

ezc3d = pytest.importorskip("ezc3d")

RECORDINGS = Path(__file__).parents[2] / "shared" / "recordings"
needs_recordings = pytest.mark.skipif(
    not RECORDINGS.is_dir(), reason="needs shared/recordings beside the checkout"
)


def written(folder: Path, unit: str = "mm") -> Path:
    """Write a C3D file of four frames with two markers and one event."""
    file = ezc3d.c3d()
    file["parameters"]["POINT"]["RATE"]["value"] = [100]
    file["parameters"]["POINT"]["LABELS"]["value"] = ["Anna:RKNE", "LKNE"]
    file["parameters"]["POINT"]["UNITS"]["value"] = [unit]
    points = np.ones((4, 2, 4))
    points[:3, 0] = np.arange(12).reshape(3, 4) * 100.0
    points[:3, 1, :] = 500.0
    points[:3, 1, 2] = np.nan
    file["data"]["points"] = points
    file.add_parameter("EVENT", "CONTEXTS", ["Left", "Left", "General"])
    file.add_parameter("EVENT", "LABELS", ["Foot Strike", "Foot Off", "Event"])
    file.add_parameter("EVENT", "TIMES", np.array([[0.0, 0.0, 0.0], [0.01, 0.03, 0.02]]))
    path = folder / "trial.c3d"
    file.write(str(path))
    return path


def test_positions_are_in_metres_and_names_without_subject(tmp_path: Path) -> None:
    recording = read_c3d(written(tmp_path))
    assert recording.name == "trial"
    assert recording.rate == 100.0
    assert recording.markers == ("RKNE", "LKNE")
    assert recording.marker("RKNE")[1] == pytest.approx([0.1, 0.5, 0.9])
    assert np.isnan(recording.marker("LKNE")[2]).all()
    assert recording.time == pytest.approx([0.0, 0.01, 0.02, 0.03])


def test_events_count_from_frame_one_at_time_zero(tmp_path: Path) -> None:
    events = read_c3d(written(tmp_path)).events
    assert [(e.side, e.kind, e.frame) for e in events] == [
        ("left", "foot_strike", 1),
        ("left", "toe_off", 3),
    ]


def test_unknown_unit_and_marker_are_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="'inch'; allowed: mm, cm, m"):
        read_c3d(written(tmp_path, unit="inch"))
    with pytest.raises(DataError, match="no marker C7; allowed: RKNE, LKNE"):
        read_c3d(written(tmp_path)).marker("C7")


def test_files_that_are_not_c3d_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "no.c3d"
    path.write_text("not a recording", encoding="utf-8")
    with pytest.raises(DataError, match="not a C3D file"):
        read_c3d(path)
    with pytest.raises(DataError, match="no such recording"):
        read_c3d(tmp_path / "none.c3d")


def test_a_damaged_file_does_not_fill_the_memory(tmp_path: Path) -> None:
    """With this byte, the library alone takes 13 GB and a minute before it gives up."""
    path = write_c3d(tmp_path / "walk.c3d", plate=True)
    data = bytearray(path.read_bytes())
    data[data.index(b"ORIGIN") - 3] = 128  # length of the description before
    path.write_bytes(data)
    with pytest.raises(DataError, match="reading takes more than 4 GB of memory"):
        read_c3d(path)


@pytest.mark.parametrize(
    ("offset", "scale", "median_as_read"),
    [
        (-32724, -0.0195331, -1.699),
        (-32709, -0.046423, -5.524),
        (-32699, -0.174691, -24.457),
        (32384, -0.0197046, 0.020),
        (-32689, -0.0464089, -7.472),
    ],
)
def test_offset_of_unloaded_channels(offset: int, scale: float, median_as_read: float) -> None:
    """Five channels of one recording: what ezc3d 1.7.2 gives for them, unloaded."""
    error = analog_offset_error(np.array([offset]), np.array([scale]), unsigned=True)
    assert abs(median_as_read - error[0]) < 4.0 * abs(scale)


def test_offset_of_signed_files_is_the_signed_word() -> None:
    error = analog_offset_error(np.array([-10, 10]), np.array([2.0, 2.0]), unsigned=False)
    assert error == pytest.approx([-40.0, 0.0])


@needs_recordings
@pytest.mark.parametrize("trial", ["barefoot/3053171", "orthosis/3053141", "orthosis/3053146"])
def test_unloaded_plates_read_nothing(trial: str) -> None:
    recording = read_c3d(RECORDINGS / f"{trial}.c3d")
    assert len(recording.plates) == 3
    assert recording.samples_per_frame == 9
    for plate in recording.plates:
        assert np.abs(np.median(plate.force, axis=0)).max() < 12.0
    unused = recording.plates[0].force[:, 2]
    assert np.abs(unused).max() < 15.0


@needs_recordings
def test_events_of_a_recording() -> None:
    recording = read_c3d(RECORDINGS / "barefoot" / "3053171.c3d")
    assert recording.positions.shape[0] == 502
    found = " ".join(f"{e.frame - 2}{e.side[0]}{e.kind[0]}" for e in recording.events)
    assert found == "170lf 184rt 228rf 243lt 286lf 304rt 348rf"
