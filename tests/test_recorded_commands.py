"""Commands about recorded gait: what they write, what they refuse and in which words."""

from __future__ import annotations

import csv
import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import click
import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from made_c3d import cut, folder, motion, text, write_c3d
from opensim_peer import read_opensim
from pathwalker_cli.commands.recorded import id_command, ik_command, import_command
from pathwalker_cli.errors import ConfigError, DataError, InputError
from pathwalker_cli.inverse.figures import joint_torque_figure, save_recorded_figures
from pathwalker_cli.inverse.residuals import residual_tables, study_warnings
from pathwalker_cli.inverse.strengths import strength_table
from pathwalker_cli.inverse.study import load_inverse_dynamics, load_inverse_kinematics
from pathwalker_cli.inverse.trials import dynamics_trials
from pathwalker_cli.io.atomic import staged_folder
from pathwalker_cli.io.opensim import write_opensim
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.io.trajectory_csv import read_trajectory
from pathwalker_cli.patient import load_patient
from pathwalker_cli.patient.blocks import Strengths
from pathwalker_cli.trajectory import Trajectory

pytestmark = pytest.mark.usefixtures("sketched")

PATIENT = "sreenivasa2017-patient"
RECORDINGS = Path(__file__).parents[2] / "shared" / "recordings"
needs_recordings = pytest.mark.skipif(
    not RECORDINGS.is_dir(), reason="needs shared/recordings beside the checkout"
)


def run(command: click.Command, *words: object) -> Result:
    """Run a command as a user would."""
    return CliRunner().invoke(command, [str(word) for word in words])


def imported(source: Path, out: Path, *more: object) -> Result:
    """Import C3D files as barefoot recordings of the shipped patient."""
    return run(import_command, source, "--patient", PATIENT, "--condition", "barefoot",
               "-o", out, *more)  # fmt: skip


def refused(result: Result, out: Path) -> str:
    """Return the message of a refusal that left nothing behind."""
    assert isinstance(result.exception, InputError), result.output
    assert not out.exists()
    assert not [path for path in out.parent.iterdir() if path.name.endswith(".tmp")]
    message = str(result.exception)
    assert "\n" not in message
    return message


def rows(path: Path) -> list[dict[str, str]]:
    """Return the rows of a CSV file."""
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_import_finds_the_made_motion(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = imported(write_c3d(tmp_path / "walk.c3d"), out)
    assert result.exception is None, result.output
    assert {path.name for path in out.iterdir()} == {
        "walk_angles.csv", "walk_angles.mot", "walk_events.csv", "walk_reading.json",
        "walk_residuals.csv",
    }  # fmt: skip
    angles = read_trajectory(out / "walk_angles.csv")
    assert angles.values == pytest.approx(motion()[0], abs=1e-5)
    assert read_opensim(out / "walk_angles.mot").values == pytest.approx(angles.values, abs=1e-5)
    assert len(rows(out / "walk_residuals.csv")) == 18
    assert "has no force plates, so there are no forces" in result.output
    reading = json.loads((out / "walk_reading.json").read_text(encoding="utf-8"))
    assert (reading["trial"], reading["frames"], reading["strides"]) == ("walk", 120, 2)
    assert reading["warnings"] == ["has no force plates, so there are no forces"]
    assert (reading["notes"], reading["laboratory"]) == ([], [])


def test_import_with_a_plate_writes_forces_and_says_why_they_are_unknown(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = imported(write_c3d(tmp_path / "walk.c3d", plate=True), out)
    assert result.exception is None, result.output
    words = "left stance from frame 11 is not measured: plate 1 loaded before or after the stance"
    assert f"note: walk: {words}" in result.output
    table = read_opensim(out / "walk_grf.mot")
    assert table.names[:4] == (
        "ground_force_r_vx", "ground_force_r_vy", "ground_force_r_vz", "ground_force_r_px"
    )  # fmt: skip
    assert table["ground_force_r_vy"][40] == 0.0, "in the air"
    assert np.isnan(table["ground_force_l_vy"][40]), "not measured"


def test_quiet_prints_warnings_only(tmp_path: Path) -> None:
    source = write_c3d(tmp_path / "walk.c3d", plate=True)
    assert imported(source, tmp_path / "out", "--quiet").output == ""


def test_import_keeps_other_files_of_the_folder(tmp_path: Path) -> None:
    source, out = write_c3d(tmp_path / "walk.c3d"), tmp_path / "out"
    out.mkdir()
    (out / "notes.txt").write_text("keep", encoding="utf-8")
    assert imported(source, out).exception is None
    assert (out / "notes.txt").read_text(encoding="utf-8") == "keep"
    assert (out / "walk_angles.csv").is_file()


BROKEN: dict[str, tuple[Callable[[Path], Path], str]] = {
    "not a C3D": (text, "not a C3D file"),
    "truncated": (cut, r"is cut off: \d+ of its 120 frames are there"),
    "no markers": (lambda p: write_c3d(p, markers=False), "shows no marker set that is known"),
    "marker missing": (lambda p: write_c3d(p, without="LASI"), "has no marker LASI; allowed: SACR"),
    "never seen": (lambda p: write_c3d(p, unseen="RKNE"), "never shows marker RKNE"),
    "m called mm": (lambda p: write_c3d(p, scale=1.0), "markers span 0.0.* mm and m confused"),
    "mm called m": (
        lambda p: write_c3d(p, unit="m"),
        r"markers span 9\d\d.* mm and m confused",
    ),
    "one frame": (lambda p: write_c3d(p, frames=1), "has 1 frame; allowed: at least 20"),
    "NaN in a plate": (
        lambda p: write_c3d(p, plate=True, nan_channel=True),
        "plate 1 holds NaN or infinity in 1 samples, first in 40",
    ),
    "plate without extent": (
        lambda p: write_c3d(p, plate=True, flat_plate=True),
        "plate 1 has no extent; allowed: four corners",
    ),
    "too slow": (
        lambda p: write_c3d(p, rate=25.0),
        "has 25 frames per second; allowed: at least 50",
    ),
    "empty folder": (folder, "no C3D file in this folder"),
    "no such file": (lambda p: p, "no such recording"),
}


@pytest.mark.parametrize("fault", BROKEN)
def test_broken_recordings_are_refused_in_one_sentence(fault: str, tmp_path: Path) -> None:
    make, words = BROKEN[fault]
    out = tmp_path / "out"
    message = refused(imported(make(tmp_path / "walk.c3d"), out), out)
    assert re.search(words, message), message
    assert "walk.c3d" in message


def test_one_broken_file_among_good_ones_leaves_nothing(tmp_path: Path) -> None:
    source, out = folder(tmp_path / "trials"), tmp_path / "out"
    write_c3d(source / "a.c3d")
    cut(source / "b.c3d")
    assert "b.c3d" in refused(imported(source, out), out)


def by_c3d(path: Path, out: Path, *more: object) -> Result:
    """Run inverse dynamics from C3D files."""
    changes = ["source=c3d", "conditions=[barefoot]", f"c3d.barefoot=['{path}']", *more]
    words = [word for change in changes for word in ("--set", change)]
    return run(id_command, "inverse-dynamics", "--out", out, *words)


def test_dynamics_needs_a_plate(tmp_path: Path) -> None:
    out = tmp_path / "out"
    message = refused(by_c3d(write_c3d(tmp_path / "walk.c3d"), out), out)
    assert "walk: has no force plates" in message


def test_a_plate_hit_by_both_feet_is_not_measured(tmp_path: Path) -> None:
    out = tmp_path / "out"
    message = refused(by_c3d(write_c3d(tmp_path / "walk.c3d", plate=True), out), out)
    assert "no stance is measured (plate 1 loaded before or after" in message


def test_published_method_is_for_the_published_trials(tmp_path: Path) -> None:
    out = tmp_path / "out"
    source = write_c3d(tmp_path / "walk.c3d", plate=True)
    message = refused(by_c3d(source, out, "method=published"), out)
    assert "none of the 1 barefoot files is a trial of the published tables" in message


def test_another_body_is_a_warning(tmp_path: Path) -> None:
    patient = yaml.safe_load(load_patient(PATIENT).source.read_text(encoding="utf-8"))  # type: ignore[union-attr]
    patient |= {"height": 1.7, "segment_lengths": {}, "recorded": {}}
    path = tmp_path / "patient.yaml"
    path.write_text(yaml.safe_dump(patient), encoding="utf-8")
    source, out = write_c3d(tmp_path / "walk.c3d"), tmp_path / "out"
    result = run(import_command, source, "--patient", path, "--condition", "barefoot", "-o", out)
    assert result.exception is None, result.output
    assert "warning: walk: markers lie" in result.output
    assert (out / "walk_angles.csv").is_file()


def test_another_mass_is_a_warning(tmp_path: Path) -> None:
    study = load_inverse_dynamics("inverse-dynamics", ("conditions=[barefoot]",))
    patient = load_patient(PATIENT)
    shipped = load_patient(PATIENT)
    heavy = patient.model_copy(update={"body_mass": 40.0})
    heavy._source = shipped.source
    trials = dynamics_trials(study, heavy, lambda name: None)
    tables = residual_tables(trials, heavy, study)
    warnings = study_warnings(trials, tables, heavy, study.largest_residual)
    assert len(warnings) == 1
    assert "are body_mass 40 kg and the segment lengths" in warnings[0]


@pytest.mark.drawn
def test_kinematics_study(tmp_path: Path) -> None:
    source, out = write_c3d(tmp_path / "walk.c3d"), tmp_path / "out"
    result = run(ik_command, "inverse-kinematics", "--out", out,
                 "--set", f"c3d.barefoot=['{source}']")  # fmt: skip
    assert result.exception is None, result.output
    found = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert {"marker_residuals.csv", "barefoot/walk_angles.csv", "barefoot/walk_angles.mot",
            "barefoot/joint_angles.png", "barefoot/marker_residuals.png"} <= found  # fmt: skip
    assert len(rows(out / "marker_residuals.csv")) == 18


def test_shipped_kinematics_config_asks_for_files() -> None:
    with pytest.raises(ConfigError, match=r"--set c3d.barefoot=\[FOLDER\]"):
        load_inverse_kinematics("inverse-kinematics")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ("method=published", "allowed: source c3d with method published"),
        ("motion_cutoff=.nan", "finite number"),
        ("motion_cutoff=6 Hz", "is '6 Hz', which is not a number in Hz; allowed: 1 to 50 Hz"),
        ("motion_cutof=6", "did you mean 'motion_cutoff'"),
        ("conditions=[]", "barefoot, orthosis"),
        ("source=c3d", "names no C3D file of barefoot or orthosis"),
        ("study=inverse-kinematics", "study"),
    ],
)
def test_refused_configs(change: str, words: str) -> None:
    with pytest.raises(ConfigError, match=r"^[^\n]+$") as problem:
        load_inverse_dynamics("inverse-dynamics", (change,))
    assert words in str(problem.value)


def test_unknown_trial_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = run(id_command, "inverse-dynamics", "--out", out, "--set", "trials=['42']")
    assert "trials: there is no trial 42; allowed: 3053171, " in refused(result, out)


BROKEN_TABLES: dict[str, tuple[str, Callable[[list[str]], list[str]], str]] = {
    "few frames": ("angles", lambda lines: lines[:5], "has 4 rows; allowed: at least 20"),
    "degrees": (
        "angles",
        lambda lines: [lines[0].replace("rad", "deg"), *lines[1:]],
        r"has other columns; allowed: pelvis_tx \[m\], ",
    ),
    "fewer forces": ("forces", lambda lines: lines[:-9], "has 453 rows; allowed: 462, as many as"),
    "another column": (
        "forces",
        lambda lines: [lines[0].replace("force_r_z", "fz"), *lines[1:]],
        r"has other columns; allowed: force_r_x \[N\], force_r_z \[N\], ",
    ),
    "kilonewtons": (
        "forces",
        lambda lines: [lines[0].replace("[N]", "[kN]"), *lines[1:]],
        "has other columns",
    ),
    "not text": ("events", lambda _: ["\udcff\udcfe"], "cannot be read: 'utf-8' codec"),
}


@pytest.mark.parametrize("fault", BROKEN_TABLES)
def test_broken_recordings_of_a_patient_are_refused(fault: str, tmp_path: Path) -> None:
    kind, broken, words = BROKEN_TABLES[fault]
    source = load_patient(PATIENT).source
    assert source is not None
    shipped = source.parent
    own, out = tmp_path / "patient", tmp_path / "out"
    (own / "recordings" / "barefoot").mkdir(parents=True)
    shutil.copy(shipped / "patient.yaml", own)
    for path in (shipped / "recordings" / "barefoot").glob("3053179_*.csv"):
        shutil.copy(path, own / "recordings" / "barefoot")
    table = own / "recordings" / "barefoot" / f"3053179_{kind}.csv"
    lines = broken(table.read_text(encoding="utf-8").splitlines())
    table.write_text("\n".join(lines), encoding="utf-8", errors="surrogateescape")
    changes = (f"patient={own}", "conditions=[barefoot]")
    options = [word for change in changes for word in ("--set", change)]
    message = refused(run(id_command, "inverse-dynamics", "--out", out, *options), out)
    assert re.search(words, message), message
    assert table.name in message


@pytest.mark.parametrize("points", ["[]", "[{marker: LASI, link: pelvis, at: [0.06, 0.0]}]"])
def test_a_marker_set_must_fix_all_coordinates(points: str, tmp_path: Path) -> None:
    markers, out = tmp_path / "markers.yaml", tmp_path / "out"
    markers.write_text(f"reference_height: 1.25\nboth: {points}\n", encoding="utf-8")
    source = write_c3d(tmp_path / "walk.c3d")
    message = refused(imported(source, out, "--markers", markers), out)
    assert re.search("marker set: has [01] points for barefoot; allowed: at least 5", message)


@pytest.mark.drawn
def test_dynamics_of_the_shipped_recordings(tmp_path: Path) -> None:
    """The whole command on a fresh install, and the numbers of its tables."""
    out = tmp_path / "out"
    result = run(id_command, "inverse-dynamics", "--out", out)
    assert result.exception is None, result.output
    found = {(r["condition"], r["part"], r["trial"]): r for r in rows(out / "residuals.csv")}
    mean = found["barefoot", "single support", "mean over trials"]
    assert float(mean["forward mean [N]"]) == pytest.approx(0.1, abs=0.5)
    assert float(mean["up mean [N]"]) == pytest.approx(16.1, abs=1.0)
    assert float(mean["moment mean [N m]"]) == pytest.approx(-1.2, abs=0.3)
    assert float(mean["up mean [N/kg]"]) == pytest.approx(float(mean["up mean [N]"]) / 24.7, 1e-3)
    worn = found["orthosis", "whole cycle", "mean over trials"]
    assert float(worn["up mean [N]"]) == pytest.approx(18.6, abs=1.0)
    expected = {
        "hip_extension_r": 27.2, "knee_extension_r": 18.5, "ankle_extension_r": 17.7,
        "hip_extension_l": 32.6, "knee_extension_l": 18.3, "ankle_extension_l": 14.0,
    }  # fmt: skip
    strengths = {row["generator"]: row for row in rows(out / "strengths.csv")}
    for generator, value in expected.items():
        assert float(strengths[generator]["strength [N m]"]) == pytest.approx(value, rel=0.02)
    assert strengths["ankle_extension_r"]["patient file [N m]"] == "32.326"
    block = yaml.safe_load((out / "strengths.yaml").read_text(encoding="utf-8"))
    assert Strengths.model_validate(block["strengths"]).hip_extension.right > 20.0
    torques = read_opensim(out / "barefoot" / "3053179_torques.sto")
    assert torques.names[3:6] == ("hip_r_moment", "knee_r_moment", "ankle_r_moment")
    assert (out / "orthosis" / "joint_torques.png").stat().st_size > 20_000
    assert "Pelvis residuals" in result.output


def test_strengths_need_barefoot_stances() -> None:
    study = load_inverse_dynamics("inverse-dynamics", ("trials=['3053176']",))
    patient = load_patient(PATIENT)
    trials = dynamics_trials(study, patient, lambda name: None)
    table = strength_table(trials, patient, study)
    assert table.strengths is None
    assert "no measured stance shows hip_extension_r" in table.reason
    worn = load_inverse_dynamics("inverse-dynamics", ("conditions=[orthosis]",))
    trials = dynamics_trials(worn, patient, lambda name: None)
    assert strength_table(trials, patient, worn).reason == "no barefoot trials"


def test_few_stances_and_steep_curves_are_said_in_words() -> None:
    changes = ("trials=['3053178', '3053179']", "least_stances=3", "largest_sensitivity=0.05")
    study = load_inverse_dynamics("inverse-dynamics", changes)
    patient = load_patient(PATIENT)
    table = strength_table(dynamics_trials(study, patient, lambda name: None), patient, study)
    remarks = {row.generator: row.remark for row in table.rows}
    assert "only 2 stances" in remarks["hip_extension_r"]
    assert "ill-conditioned: " in remarks["hip_extension_r"]
    assert remarks["lumbar_extension"] == "mean of both hips"


def test_figure_shows_only_measured_strides() -> None:
    study = load_inverse_dynamics("inverse-dynamics", ("conditions=[barefoot]",))
    trials = dynamics_trials(study, load_patient(PATIENT), lambda name: None)
    figure = joint_torque_figure(trials, 24.7)
    labels = [entry.get_text() for entry in figure.axes[-1].get_legend().get_texts()]
    assert labels[:2] == ["right, mean of\n4 measured strides", "left, mean of\n5 measured strides"]
    assert [ax.get_ylabel() for ax in figure.axes[:3]] == ["net torque\n[N m/kg]"] * 3


def test_trials_without_forces_get_figures_of_angles_only(tmp_path: Path) -> None:
    study = load_inverse_dynamics("inverse-dynamics", ("conditions=[barefoot]",))
    trials = dynamics_trials(study, load_patient(PATIENT), lambda name: None)
    unmeasured = [trial for trial in trials if trial.name == "3053173"]
    assert save_recorded_figures(unmeasured, tmp_path, 24.7, ("png",)) == ("joint_angles.png",)


def test_opensim_tables_are_read_again(tmp_path: Path) -> None:
    values = np.array([[1.0, np.nan], [-2.5e-7, 3.0]])
    table = Trajectory(np.array([0.0, 0.1]), ("a", "b"), values, ("rad", "N"))
    path = tmp_path / "x.mot"
    write_opensim(path, table)
    assert path.read_text(encoding="utf-8").splitlines()[:6] == [
        "x", "version=1", "nRows=2", "nColumns=3", "inDegrees=no", "endheader"
    ]  # fmt: skip
    assert read_opensim(path).values == pytest.approx(values, nan_ok=True)


def test_staged_folder_refuses_a_file_in_its_place(tmp_path: Path) -> None:
    place = tmp_path / "taken"
    place.write_text("", encoding="utf-8")
    with pytest.raises(DataError, match="is a file"), staged_folder(place / "out"):
        pass


def test_folder_that_cannot_be_written_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(**_: object) -> str:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tempfile.mkdtemp", full)
    with pytest.raises(DataError, match="cannot be written: No space"), staged_folder(tmp_path):
        pass


@needs_recordings
def test_import_gives_the_shipped_recordings_again(tmp_path: Path) -> None:
    result = imported(RECORDINGS / "barefoot" / "3053179.c3d", tmp_path / "out")
    assert result.exception is None, result.output
    shipped = read_recording(load_patient(PATIENT), "barefoot", "3053179")
    assert "3053179" in recording_names(load_patient(PATIENT), "barefoot")
    found = read_trajectory(tmp_path / "out" / "3053179_forces.csv", missing=True)
    assert shipped.forces is not None
    assert found.values == pytest.approx(shipped.forces.values, abs=0.3, nan_ok=True)
    assert "markers lie" not in result.output


@needs_recordings
def test_published_tables_by_the_command(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = by_c3d(RECORDINGS / "barefoot", out, "method=published")
    assert result.exception is None, result.output
    found = {(r["part"], r["trial"]): r for r in rows(out / "residuals.csv")}
    columns = ("forward mean [N/kg]", "up mean [N/kg]", "moment mean [N m/kg]")
    table = {"mean over trials": (-0.02, 1.36, -0.02), "min over trials": (-0.27, -0.04, -0.11),
             "max over trials": (0.16, 2.80, 0.09)}  # fmt: skip
    for name, values in table.items():
        row = found["whole cycle", name]
        assert [float(row[c]) for c in columns] == pytest.approx(values, abs=0.03)


@needs_recordings
def test_a_recording_of_both_feet_on_one_plate(tmp_path: Path) -> None:
    out = tmp_path / "out"
    message = refused(by_c3d(RECORDINGS / "barefoot" / "3053173.c3d", out), out)
    assert "plate 2 loaded before or after the stance" in message
