"""The command `init`: files that explain themselves and work, and recordings that are made."""

from __future__ import annotations

import re
import shlex
from pathlib import Path
from typing import get_args, get_origin

import ezc3d
import numpy as np
import pytest
from click.testing import CliRunner, Result
from pydantic import BaseModel

from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.inverse.c3d_trials import c3d_trials
from pathwalker_cli.inverse.recorded import with_block
from pathwalker_cli.inverse.study import (
    RecordedConfig,
    load_inverse_dynamics,
    load_inverse_kinematics,
)
from pathwalker_cli.io.commented_yaml import entries, reasons
from pathwalker_cli.io.fields import Sides
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import OrthosisData, Patient, load_patient
from pathwalker_cli.patient.file import healthy_child, healthy_strength
from pathwalker_cli.starter import example
from pathwalker_cli.starter.child import made_child
from pathwalker_cli.starter.configs import WIDTH
from pathwalker_cli.starter.files import explained_keys, folder_files, next_steps
from pathwalker_cli.starter.seen import Seen
from pathwalker_cli.studies.base import load_study
from pathwalker_cli.studies.landscape import LandscapeStudy
from pathwalker_cli.studies.perturbation import PerturbationStudy
from pathwalker_cli.studies.sensitivity import SensitivityStudy
from pathwalker_cli.studies.tradeoff import TradeoffStudy
from pathwalker_cli.studies.uncertainty import UncertaintyStudy

STUDIES = {
    "perturbation": PerturbationStudy,
    "landscape": LandscapeStudy,
    "uncertainty": UncertaintyStudy,
    "sensitivity": SensitivityStudy,
    "tradeoff": TradeoffStudy,
}


def run(*words: object) -> Result:
    """Run PathWalker as a user would."""
    return CliRunner().invoke(cli, [str(word) for word in words])


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def problems_of(worn: bool) -> tuple[str, ...]:
    """Return the problems that a folder has configs of."""
    return ("mapd-barefoot", "mapd-orthosis")[: 1 + worn]


@pytest.mark.parametrize("worn", [True, False])
def test_everything_that_is_written_loads(here: Path, worn: bool) -> None:
    result = run("init", "my-child", *["--without-orthosis"] * (not worn))
    assert result.exit_code == 0, result.output
    folder = here / "my-child"
    patient = load_patient(folder)
    assert (patient.id, patient.orthosis is not None) == ("my-child", worn)
    for problem in problems_of(worn):
        config = load_config(folder / f"{problem}.yaml", problem)
        assert load_patient(config.patient).source == folder / "patient.yaml"
        plain = type(config)(problem=problem, patient=config.patient)
        assert config == plain, "values that are written out are the defaults"
    for name, model in STUDIES.items():
        path = folder / f"{name}.yaml"
        if path.exists():
            study = load_study(path, model)
            assert load_config(study.base).problem == problems_of(worn)[-1]
    assert load_inverse_kinematics(folder / "inverse-kinematics.yaml").c3d.barefoot
    assert load_inverse_dynamics(folder / "inverse-dynamics.yaml").source == "recordings"


def test_a_folder_without_orthosis_speaks_of_none(here: Path) -> None:
    run("init", "child", "--without-orthosis")
    names = {path.name for path in (here / "child").iterdir()}
    assert not names & {"orthosis.yaml", "mapd-orthosis.yaml", "perturbation.yaml"}
    for path in (here / "child").iterdir():
        if not path.name.startswith(("inverse", "mapd")):  # comments of the shipped configs
            text = path.read_text(encoding="utf-8")
            assert "mapd-orthosis.yaml" not in text, path.name
            assert "orthosis: orthosis.yaml" not in text, path.name


def keys_of(model: type[BaseModel], prefix: str = "") -> set[str]:
    """Return the dotted keys of a model down to its numbers and texts."""
    found = set()
    for name, field in model.model_fields.items():
        listed = get_origin(field.annotation) in (tuple, dict)
        kinds = (field.annotation, *(() if listed else get_args(field.annotation)))
        blocks = [k for k in kinds if isinstance(k, type) and issubclass(k, BaseModel)]
        inner = next((k for k in blocks if not issubclass(k, Sides)), None)
        nested = inner is not None and name != "orthosis"
        found |= keys_of(inner, f"{prefix}{name}.") if nested and inner else {f"{prefix}{name}"}
    return found


def test_every_key_of_patient_and_orthosis_is_explained() -> None:
    told = explained_keys()
    assert keys_of(Patient) - {"recorded"} == told["patient"].keys()
    assert keys_of(OrthosisData) == told["orthosis"].keys()
    assert all(len(text) > 10 for texts in told.values() for text in texts.values())


def test_units_and_ranges_come_from_the_models() -> None:
    files = folder_files(made_child("child"), Seen(), False)
    text = " ".join(files["patient.yaml"].replace("#", " ").split())
    assert "without orthoses. [kg], 5 to 150 body_mass: 29" in text
    assert "Hip extensors. [N m], 0.1 to 500 hip_extension:" in text
    orthosis = " ".join(files["orthosis.yaml"].replace("#", " ").split())
    assert "K_D. [N m/rad], 1 to 1000 dorsiflexion: [5.0, 92.0]" in orthosis


def test_comments_of_configs_are_those_of_the_shipped_ones() -> None:
    files = folder_files(made_child("child"), Seen(), False)
    text = " ".join(files["mapd-orthosis.yaml"].replace("#", " ").split())
    why = reasons(shipped("configs") / "mapd-orthosis.yaml")
    for key in ("bounds.least_walking_speed", "bounds.distance", "starts", "start.knee_flexion"):
        assert " ".join(why[key].split()) in text, key


@pytest.mark.parametrize("worn", [True, False])
@pytest.mark.parametrize("made", [True, False])
def test_no_line_is_wider_than_a_terminal(worn: bool, made: bool) -> None:
    for name, text in folder_files(
        made_child("child"), Seen("planned" if worn else "none"), made
    ).items():
        assert text.endswith("\n")
        assert "\n\n\n" not in text, name
        assert [line for line in text.splitlines() if len(line) > WIDTH] == [], name


def test_numbers_of_the_child_follow_from_what_is_given() -> None:
    assert made_child("a").age == 9.0
    grown = made_child("a", age=12.0)
    assert (grown.body_mass, grown.height) == (39.5, 1.49)
    small = made_child("a", age=5.0, mass=17.0)
    assert (small.body_mass, small.height) == (17.0, 1.07)
    healthy = healthy_child()
    same = healthy_strength("hip_extension", healthy.body_mass, healthy.height)
    assert same == pytest.approx(48.82541)


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--age", "30"], ("--age", "4 to 15")),
        (["--mass", "2"], ("--mass", "is 2 kg", "5 to 150 kg")),
        (["--height", "131"], ("--height", "is 131 m", "0.5 to 2.2 m")),
        (["--id", "Anna Lena"], ("--id", "not safe as the name of a folder")),
    ],
)
def test_children_that_are_refused(here: Path, words: list[str], parts: tuple[str, ...]) -> None:
    result = run("init", "child", *words)
    assert result.exit_code == 2
    (line,) = result.output.splitlines()
    assert all(part in line for part in parts), line
    assert not list(here.iterdir())


def test_a_folder_that_holds_something_is_left_alone(here: Path) -> None:
    (here / "child").mkdir()
    (here / "child" / "notes.txt").write_text("mine", encoding="utf-8")
    result = run("init", "child")
    assert result.exit_code == 2
    assert "child: is not empty: it holds notes.txt" in result.output
    assert [path.name for path in (here / "child").iterdir()] == ["notes.txt"]


def commands(output: str) -> list[list[str]]:
    """Return the commands that `init` printed, as a shell reads them."""
    joined = output.replace("\\\n", " ")
    found = [line.strip() for line in joined.splitlines() if line.startswith("  ")]
    return [shlex.split(line) for line in found]


def test_the_way_from_made_recordings_to_a_checked_prediction(
    here: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(example, "TRIALS", 5)
    printed = commands(run("init", "my child", "--example").output)
    assert printed[0] == ["cd", "my child"]
    monkeypatch.chdir(here / "my child")
    assert "made, not recorded" in Path("README.txt").read_text(encoding="utf-8")
    for words in printed[1:]:
        assert words[0] == "pathwalker"
        if words[1] in ("import", "ik", "id", "check"):
            result = run(*words[1:])
            assert result.exit_code == 0, result.output
    patient = load_patient(".")
    assert patient.strengths is not None
    assert patient.strengths.hip_extension.right != made_child("a").strength("hip_extension")[0]
    assert {"barefoot", "orthosis"} == patient.recorded.keys()
    text = Path("patient.yaml").read_text(encoding="utf-8")
    assert "# Hip joint centre to knee joint centre" in text, "comments are kept"
    assert run("id", "inverse-dynamics.yaml", "--update-patient").exit_code == 0
    assert Path("patient.yaml").read_text(encoding="utf-8") == text, "a second time changes nothing"


def test_printed_solves_name_problems_and_configs_that_are_there() -> None:
    for worn in (True, False):
        seen = Seen("planned" if worn else "none")
        files = folder_files(made_child("child"), seen, False)
        for step in next_steps(seen, False):
            for command in step.commands:
                for word in shlex.split(command):
                    assert not word.endswith(".yaml") or word in files, command


def test_update_patient_leaves_shipped_patients_alone(here: Path) -> None:
    result = run("id", "inverse-dynamics", "--update-patient")
    assert result.exit_code == 2
    assert "comes with PathWalker and is not changed" in result.output
    assert not list(here.iterdir())


def test_made_recordings_say_so_and_give_back_the_motion(tmp_path: Path) -> None:
    run("init", tmp_path / "child")
    patient = load_patient(tmp_path / "child")
    recording = next(example.made_recordings(patient, "barefoot"))
    again = next(example.made_recordings(patient, "barefoot"))
    assert np.array_equal(recording.positions, again.positions), "the noise has a fixed seed"
    path = tmp_path / "made.c3d"
    example.write_c3d(path, recording, description="Made by PathWalker; not recorded")
    assert "not recorded" in ezc3d.c3d(str(path))["parameters"]["TRIAL"]["DESCRIPTION"]["value"][0]
    ((trial, _),) = c3d_trials([path], patient, "barefoot", RecordedConfig(patient=patient.id))
    assert 0.5e-3 < trial.markers.mean < 2e-3, "what remains is the noise"
    assert [s.measured for s in trial.stances if s.plate is not None] == [True]
    assert trial.forces is not None
    single = trial.forces["force_r_z"]
    weight = 9.81 * patient.body_mass
    assert 0.8 < np.nanmax(single) / weight < 1.6


def test_a_block_is_replaced_and_the_rest_kept() -> None:
    text = "# head\na: 1\n# of b\nb:\n  # inside\n  c: 2\n\n# of d\nd: 3\n"
    new = with_block(text, "b", ["b:", "  c: 5"])
    assert new == "# head\na: 1\n# of b\nb:\n  c: 5\n\n# of d\nd: 3\n"
    assert with_block("a: 1\n", "b", ["b: 2"]) == "a: 1\n\nb: 2\n"
    assert with_block("b:\n  c: 1\n", "b", ["b: 2"]) == "b: 2\n"


def test_entries_are_written_as_in_the_file(tmp_path: Path) -> None:
    path = tmp_path / "x.yaml"
    text = "a: 1.0e-3  # small\nb:\n  # above\n  c: [1,\n      2]\n  d:\n    - x\n    - y\n"
    path.write_text(text, encoding="utf-8")
    found = {entry.place: (entry.value, entry.comment) for entry in entries(path)}
    assert found["a"] == ("1.0e-3", "small")
    assert found["b"] == ("", "")
    assert found["b.c"] == ("[1, 2]", "above")
    assert found["b.d"] == ("[x, y]", "")


def test_what_init_prints_fits_a_terminal(here: Path) -> None:
    output = run("init", "my-child").output
    assert [line for line in output.splitlines() if len(line) > WIDTH] == []
    assert re.search(r"^  cd my-child$", output, re.MULTILINE)


SEEN = ("--brace", "worn", "--speed", 0.8, "--knee-flexion", "40,30 deg",
        "--examined", "popliteal_angle=55", "--examined", "hip_extension=-5,0")  # fmt: skip


def test_what_was_seen_decides_the_predictions(here: Path) -> None:
    result = run("init", "child", *SEEN)
    assert result.exit_code == 0, result.output
    patient = load_patient(here / "child")
    assert patient.examination.popliteal_angle == Sides[float](right=55.0, left=55.0)
    assert patient.examination.hip_extension == Sides[float](right=-5.0, left=0.0)
    barefoot, worn = (load_config(here / "child" / f"{p}.yaml") for p in problems_of(True))
    assert barefoot.bounds.least_walking_speed == worn.bounds.least_walking_speed == 0.8
    assert barefoot.bounds.joint_ranges["knee_r"][0] == pytest.approx(np.deg2rad(40.0), abs=1e-3)
    assert barefoot.bounds.joint_ranges["knee_l"][0] == pytest.approx(np.deg2rad(30.0), abs=1e-3)
    straighter = barefoot.bounds.joint_ranges["knee_l"][0] - worn.bounds.joint_ranges["knee_l"][0]
    assert straighter == pytest.approx(0.2), "with orthoses the knee may become straighter"
    assert barefoot.model.tissue, "tightness that was examined counts"
    assert "c3d/orthosis" in (here / "child" / "README.txt").read_text(encoding="utf-8")


def test_on_a_terminal_it_asks(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("pathwalker_cli.commands.init._at_a_terminal", lambda: True)
    answers = "none\n0.7\n25\n\n60,50\n\n\n\n"
    result = CliRunner().invoke(cli, ["init", "child"], input=answers)
    assert result.exit_code == 0, result.output
    assert "Examined popliteal angle [deg; right,left]" in result.output
    patient = load_patient(here / "child")
    assert patient.orthosis is None
    assert patient.examination.popliteal_angle == Sides[float](right=60.0, left=50.0)
    assert load_config(here / "child" / "mapd-barefoot.yaml").bounds.least_walking_speed == 0.7
    silent = CliRunner().invoke(cli, ["init", "open"], input="\n" * 8)
    assert silent.exit_code == 0, silent.output
    assert load_config(here / "open" / "mapd-orthosis.yaml").bounds.joint_ranges == {}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (("--speed", 40), "--speed: is 40 m/s; allowed: 0.05 to 2.5 m/s"),
        (("--knee-flexion", "bent"), "--knee-flexion: is 'bent'; allowed: degrees, or right,left"),
        (("--knee-flexion", "1,2,3"), "--knee-flexion: is '1,2,3'"),
        (("--knee-flexion", 170), "allowed: 3 to 85 deg"),
        (("--examined", "poplitael_angle=50"), "did you mean 'popliteal_angle'?"),
        (("--examined", "hip_extension"), "--examined hip_extension: is ''"),
        (("--brace", "worn", "--without-orthosis"), "contradicts --brace worn"),
    ],
)
def test_what_cannot_have_been_seen_is_refused(
    here: Path, words: tuple[object, ...], told: str
) -> None:
    result = run("init", "child", *words)
    assert result.exit_code == 2
    assert told in result.output
    assert result.output.count("\n") == 1
    assert not (here / "child").exists()
