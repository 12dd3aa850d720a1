"""Trajectories and recordings as CSV, there and back, and how wrong files are refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from pathwalker_cli.conventions import CONDITIONS, COORDINATES, Condition
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.recorded import recorded
from pathwalker_cli.io.recordings import read_recording, recording_names, write_recording
from pathwalker_cli.io.trajectory_csv import read_trajectory, write_trajectory
from pathwalker_cli.patient import load_patient
from pathwalker_cli.trajectory import Trajectory


def test_there_and_back(tmp_path: Path) -> None:
    values = np.array([[1.23456789, -2e-7], [np.nan, 3.0]])
    motion = Trajectory(np.array([0.0, 0.1]), ("hip_r", "force_r_z"), values, ("rad", "N"))
    write_trajectory(tmp_path / "a.csv", motion)
    first = (tmp_path / "a.csv").read_text(encoding="utf-8").splitlines()[0]
    assert first == "time [s],hip_r [rad],force_r_z [N]"
    back = read_trajectory(tmp_path / "a.csv", missing=True)
    assert (back.names, back.units) == (motion.names, motion.units)
    assert back.values == pytest.approx(values, rel=1e-5, nan_ok=True)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a.csv: is empty"),
        ("time [s],hip_r\n0,1\n", "row 1, column 2: 'hip_r' is no column header"),
        ("hip_r [rad],time [s]\n0,1\n", r"starts with 'hip_r \[rad\]'; allowed: time \[s\]"),
        ("time [s],a [m],a [m]\n0,1,1\n", "has column a twice"),
        ("time [s],a [m]\n", "no rows below its header"),
        ("time [s],a [m]\n0,1\n0.1\n", "row 3: has 1 cells; allowed: 2"),
        ("time [s],a [m]\n0,1\n0.1,x\n", "row 3, column a: is 'x'; allowed: a finite number"),
        ("time [s],a [m]\n0,\n", "row 2, column a: is empty"),
        ("time [s],a [m]\n0,inf\n", "row 2, column a: is 'inf'"),
        ("time [s],a [m]\n0,1\n0,2\n", "row 3, column time: time does not increase"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "a.csv"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(DataError, match=message):
        read_trajectory(path)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(DataError, match="no such file"):
        read_trajectory(tmp_path / "none.csv")


def test_shipped_recordings() -> None:
    patient = load_patient("sreenivasa2017-patient")
    assert len(recording_names(patient, "barefoot")) == 13
    assert len(recording_names(patient, "orthosis")) == 12
    trial = read_recording(patient, "barefoot", "3053171")
    assert trial.motion.names == COORDINATES
    assert trial.motion.time.size == 502
    assert trial.motion["knee_r"][0] == pytest.approx(1.04499, abs=1e-4)
    assert [event.frame for event in trial.events] == [172, 186, 230, 245, 288, 306, 350]
    assert trial.forces is not None
    stance = trial.forces["force_r_z"][240:296]
    assert 150.0 < stance.mean() < 250.0


@pytest.mark.parametrize("condition", CONDITIONS)
def test_recorded_block_is_what_the_recordings_say(condition: Condition) -> None:
    patient = load_patient("sreenivasa2017-patient")
    trials = [read_recording(patient, condition, n) for n in recording_names(patient, condition)]
    assert recorded(patient, condition, trials) == patient.recorded[condition]


def test_recordings_there_and_back(tmp_path: Path) -> None:
    shipped = load_patient("sreenivasa2017-patient")
    trial = read_recording(shipped, "orthosis", "3053141")
    source = shipped.recordings[0] / "orthosis"
    write_recording(tmp_path, trial)
    for kind in ("angles", "events", "forces"):
        name = f"3053141_{kind}.csv"
        assert (tmp_path / name).read_bytes() == (source / name).read_bytes()


def test_unknown_recording_lists_those_there_are() -> None:
    patient = load_patient("sreenivasa2017-patient")
    with pytest.raises(DataError, match=r"no barefoot recording 'x'; allowed: 3053171, 3053173"):
        read_recording(patient, "barefoot", "x")
