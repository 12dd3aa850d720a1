"""The command `check`: what it says of files in order, and what it refuses in which words."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from made_c3d import write_c3d
from pathwalker_cli.checking.consistency import odd_patient
from pathwalker_cli.checking.kinds import check_file
from pathwalker_cli.checking.prediction import FIXED, MEASURED, expected
from pathwalker_cli.checking.report import checked_lines
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config, smoke_version
from pathwalker_cli.io.yaml_file import read_mapping
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.text import orthosis_rows

PATIENT = "sreenivasa2017-patient"


def run(*words: object) -> Result:
    """Check files as a user would."""
    return CliRunner().invoke(cli, ["check", *(str(word) for word in words)])


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in an empty folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


# Files in order


def test_a_prediction_is_told_in_full(here: Path) -> None:
    result = run("mapd-orthosis")
    assert result.exit_code == 0, result.output
    assert [line for line in result.output.splitlines() if len(line) > 80 and "/" not in line] == []
    text = " ".join(result.output.split())
    for part in (
        "mapd-orthosis: prediction, in order",
        "male, 7 years, 24.7 kg, 1.25 m",
        "ankle extension 86 / 45 %",
        "phases 8: right_flat,",
        "free parameters: 4",
        "knee_r: [0.420, 1.597] rad, barefoot recordings widened by 0.2 rad",
        "walking_speed: at least 0.636 m/s, mean of the barefoot recordings",
        "dorsiflexion_stiffness_right: [5, 92] N m/rad, real springs",
        "duration of every phase: [0.02, 0.45] s",
        "effort per distance: 1",
        "not the default nothing",
        "13 barefoot, 12 orthosis, beside the patient's file",
        "runs/mapd-orthosis-sreenivasa2017-patient, a new folder",
        "machine of docs/performance.md",
    ):
        assert part in text, part
    assert not list(here.iterdir()), "nothing is written"


def test_size_is_that_of_the_first_mesh() -> None:
    content = check_file("mapd-orthosis").content
    assert content["intervals"] == 70
    assert content["unknowns"] == 11369
    assert content["free_parameters"] == [
        f"{kind}_stiffness_{side}"
        for kind in ("dorsiflexion", "plantarflexion")
        for side in ("right", "left")
    ]
    half = check_file("mapd-healthy").content
    assert len(half["phases"]) == 4
    assert half["free_parameters"] == []


def test_settings_that_differ_are_named(here: Path) -> None:
    path = config_of(here, bounds={"friction": 0.6}, starts=4)
    content = check_file(str(path)).content
    assert content["not_default"] == {
        "starts": "4 (default 1)",
        "bounds.friction": "0.6 (default 0.8)",
    }


def test_the_output_folder_is_looked_at(here: Path) -> None:
    folder = here / "runs" / f"mapd-orthosis-{PATIENT}"
    folder.mkdir(parents=True)
    (folder / "metrics.json").write_text("{}", encoding="utf-8")
    assert "replaces the run that is there" in " ".join(run("mapd-orthosis").output.split())
    (folder / "thesis.txt").write_text("mine", encoding="utf-8")
    text = " ".join(run("mapd-orthosis").output.split())
    assert "cannot be used: is not empty and no run folder: it holds thesis.txt" in text


@pytest.mark.parametrize(
    ("name", "kind", "solves"),
    [
        ("perturbation", "perturbation", 4),
        ("sensitivity", "sensitivity", 6),
        ("uncertainty", "uncertainty", 100),
        ("landscape", "landscape", 68),
        ("tradeoff", "tradeoff", 10),
        ("cohort", "study of many cases", 4),
    ],
)
def test_studies_say_how_much_they_solve(name: str, kind: str, solves: int) -> None:
    checked = check_file(name)
    assert (checked.kind, checked.content["solves"]) == (kind, solves)


@pytest.mark.parametrize("path", sorted(shipped("configs").glob("*.yaml")), ids=lambda p: p.stem)
def test_every_shipped_config_is_recognised_and_in_order(path: Path) -> None:
    result = run(path)
    if path.stem == "inverse-kinematics":
        assert "names no C3D file of barefoot or orthosis" in result.output
        return
    assert result.exit_code == 0, result.output


def test_patients_and_orthoses_are_checked_too(here: Path) -> None:
    assert check_file(PATIENT).kind == "patient"
    CliRunner().invoke(cli, ["init", "child"])
    assert check_file("child").kind == "patient"
    assert check_file("child/patient.yaml").kind == "patient"
    assert check_file("child/orthosis.yaml").kind == "orthosis"


def test_a_folder_that_is_called_like_a_shipped_config_does_not_hide_it(here: Path) -> None:
    (here / "landscape").mkdir()
    assert check_file("landscape").kind == "landscape"
    result = run(".")
    assert result.exit_code == 2
    assert result.output.startswith("Error: .: Is a directory")


def test_c3d_files_of_a_study_are_looked_into(here: Path) -> None:
    write_c3d(here / "walk.c3d")
    path = here / "angles.yaml"
    content = {"study": "inverse-kinematics", "patient": PATIENT, "c3d": {"barefoot": ["walk.c3d"]}}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert check_file(str(path)).content["trials"] == {"barefoot": ["walk"]}
    write_c3d(here / "walk.c3d", without="LASI")
    result = run(path)
    assert result.exit_code == 2
    assert "walk.c3d: has no marker LASI" in result.output


def test_json_is_one_document(here: Path) -> None:
    result = CliRunner().invoke(cli, ["check", "mapd-orthosis", "perturbation", "--json"])
    content = json.loads(result.stdout)
    assert content["ok"] is True
    first, second = content["configs"]
    assert first["expected_seconds"]["least"] < first["expected_seconds"]["likely"]
    words = ["check", "mapd-orthosis", "--set", "verdict=false", "--json"]
    (unjudged,) = json.loads(CliRunner().invoke(cli, words).stdout)["configs"]
    share = unjudged["expected_seconds"]["likely"] / first["expected_seconds"]["likely"]
    assert share < 0.7, "judging the springs takes its time too"
    assert first["bounds"]["walking_speed"].startswith("at least 0.636 m/s")
    assert (second["kind"], second["solves"]) == ("perturbation", 4)


def test_json_tells_of_good_files_beside_those_that_are_refused(here: Path) -> None:
    words = ["check", "nowhere.yaml", "mapd-barefoot", "--json"]
    result = CliRunner().invoke(cli, words)
    assert result.exit_code == 2
    sentence = "nowhere.yaml: no such file; check the path"
    assert result.stderr == f"Error: {sentence}\n"
    content = json.loads(result.stdout)
    assert content["ok"] is False
    bad, good = content["configs"]
    assert bad == {"config": "nowhere.yaml", "ok": False, "error": sentence}
    assert (good["config"], good["ok"], good["intervals"]) == ("mapd-barefoot", True, 70)


# Overrides


def test_overrides_are_checked_too(here: Path) -> None:
    words = ("mapd-orthosis", "mapd-barefoot", "--set", "bounds.friction=0.6")
    result = run(*words)
    assert result.exit_code == 0, result.output
    assert result.output.count("bounds.friction: 0.6 (default 0.8)") == 2
    refused = run("mapd-orthosis", "--set", "bounds.frictoin=0.6")
    assert refused.exit_code == 2
    assert "--set bounds.frictoin=0.6: unknown key" in refused.output
    assert check_file("perturbation", changes=("factors=[0.9]",)).content["solves"] == 4
    assert check_file("cohort", changes=("grid={}",)).content["solves"] == 2
    inverse = check_file("inverse-dynamics", changes=("conditions=[barefoot]",))
    assert list(inverse.content["trials"]) == ["barefoot"]


def test_overrides_of_what_is_no_config_are_refused() -> None:
    result = run(PATIENT, "--set", "body_mass=20")
    assert result.exit_code == 2
    assert f"--set body_mass=20: overrides keys of configs, and {PATIENT} is none" in result.output


# Orthoses


@pytest.fixture
def child(here: Path) -> Path:
    """Return the folder of a new child, with an orthosis in a file of its own."""
    CliRunner().invoke(cli, ["init", "child"])
    return here / "child"


def replaced(path: Path, old: str, new: str) -> Path:
    """Write something else in a file."""
    text = path.read_text(encoding="utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    return path


@pytest.mark.parametrize("file", ["orthosis.yaml", "patient.yaml", "mapd-orthosis.yaml"])
def test_an_orthosis_is_told_in_degrees_with_directions(child: Path, file: str) -> None:
    text = " ".join(run(child / file).output.split())
    for part in (
        "neutral angle 1.1 deg dorsiflexion, play 0.6 deg around it, preload 1 N m either way",
        "stops right and left: 7.4 deg dorsiflexion to 5.7 deg plantarflexion, as stiff as 200 and",
        "springs right and left: K_D 5 to 92, K_P 5 to 92 N m/rad",
        "real springs K_D flexible 40.1, stiff 91.7; K_P softest 5, flexible 40.1 N m/rad",
    ):
        assert part in text, part
    replaced(child / "orthosis.yaml", "neutral_angle: -0.02", "neutral_angle: 0.02")
    assert "neutral angle 1.1 deg plantarflexion" in " ".join(run(child / file).output.split())


def test_stops_that_differ_are_told_per_side() -> None:
    orthosis = load_patient(PATIENT).require_orthosis()
    rows = orthosis_rows(orthosis.model_copy(update={"springs": None}))
    stops = [text.split(":")[0] for label, text in rows if label == "stops"]
    assert stops == ["right", "left"]
    assert not [label for label, _ in rows if label == "real springs"], "none are listed"


def test_stops_that_barefoot_strides_would_load_are_told() -> None:
    (note,) = [n for n in check_file("mapd-orthosis").notes if "hard stops would carry" in n]
    patient = load_patient(PATIENT)
    beyond = -0.13 - patient.recorded["barefoot"].joint_ranges["ankle_r"][0]
    assert f"right dorsiflexion stop passed by {np.rad2deg(beyond):.1f} deg" in note
    # 1 N m of preload and 0.105 rad of way, with the softest and the stiffest spring
    softest, stiffest = (200 * beyond / (200 * beyond + 1 + 0.105 * k) for k in (5, 92))
    assert f"carry {100 * stiffest:.0f} to {100 * softest:.0f} %" in note
    assert "plantarflexion" not in note
    held = check_file("mapd-orthosis", changes=("variation.scale={orthosis.stop_stiffness: 0.02}",))
    assert not [n for n in held.notes if "hard stops would carry" in n], "springs carry more"


def test_barefoot_nothing_is_told_of_orthoses(child: Path) -> None:
    assert "neutral angle" not in run(child / "mapd-barefoot.yaml").output
    assert check_file(str(child / "mapd-barefoot.yaml")).content["orthosis"] is None
    content = check_file(str(child / "mapd-orthosis.yaml")).content
    assert content["orthosis"]["neutral_angle"] == {"right": -0.02, "left": -0.02}


@pytest.mark.parametrize(
    ("file", "parts"),
    [
        ("child/orthosis.yaml", ("is an orthosis file", "the key orthosis of a patient's file")),
        ("child/patient.yaml", ("is a patient file", "--set patient=FILE")),
        ("child", ("is a patient file", "the key patient of a config")),
        ("landscape", ("is a landscape file", "pathwalker landscape")),
    ],
)
def test_another_file_in_place_of_a_config_is_told_where_it_belongs(
    child: Path, file: str, parts: tuple[str, ...]
) -> None:
    for words in (("solve", "mapd-orthosis", file), ("check", file, "--problem", "mapd-orthosis")):
        result = CliRunner().invoke(cli, list(words))
        assert result.exit_code == 2
        assert result.output.startswith(f"Error: {file}: ")
        for part in parts:
            assert part in result.output


# Expected time


def test_measured_seconds_are_those_of_the_documentation() -> None:
    page = Path(__file__).parent.parent / "docs" / "performance.md"
    section = page.read_text(encoding="utf-8").split("## Whole solves")[1].split("\n## ")[0]
    rows = re.findall(r"^\| `([\w-]+)` \|(.*)\|$", section, re.MULTILINE)
    assert {name for name, _ in rows} == MEASURED.keys()
    for name, cells in rows:
        first, _, cached, refined, _, cached_refined, *_ = (c.strip() for c in cells.split("|"))
        plain, fine = MEASURED[name]
        assert plain.seconds == float(cached)
        assert fine.seconds == float(cached_refined)
        for measured, text in ((plain, first), (fine, refined)):
            assert measured.iterations == sum(map(int, re.findall(r"\d+", text)))


def test_time_grows_with_intervals_and_starts() -> None:
    config = load_config("mapd-barefoot")
    once = expected(config, 64)
    assert once.likely == pytest.approx(MEASURED["mapd-barefoot"][1].seconds)
    twice = expected(config.model_copy(update={"starts": 2}), 64)
    assert twice.likely - FIXED == pytest.approx(2.0 * (once.likely - FIXED))
    assert expected(config, 128).likely == pytest.approx(twice.likely)
    assert expected(smoke_version(config), 16).likely < once.likely
    orthosis = load_config("mapd-orthosis")
    judged, alone = (
        expected(orthosis.model_copy(update={"verdict": v}), 64) for v in (True, False)
    )
    assert judged.likely - FIXED > 2.0 * (alone.likely - FIXED), "springs are judged"


# Files that are refused


def config_of(folder: Path, **blocks: Any) -> Path:
    """Write a config of the shipped patient with these blocks."""
    path = folder / "study.yaml"
    content = {"problem": "mapd-orthosis", "patient": PATIENT, **blocks}
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


def text_of(folder: Path, text: str, name: str = "study.yaml") -> Path:
    """Write a file as it stands."""
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def patient_without(folder: Path, *keys: str) -> Path:
    """Write a config of the shipped patient without some blocks of its file."""
    source = load_patient(PATIENT).source
    assert source is not None
    mapping = {k: v for k, v in read_mapping(source)[0].items() if k not in keys}
    (folder / "someone.yaml").write_text(yaml.safe_dump(mapping), encoding="utf-8")
    return config_of(folder, patient="someone.yaml")


FLAT = {"pelvis_tilt": [0.0, 0.1], "hip_r": [0.0, 0.1], "knee_r": [0.8, 1.0], "ankle_r": [0.0, 0.1]}

BROKEN: dict[str, tuple[Callable[[Path], Path], tuple[str, ...]]] = {
    "wrong key": (
        lambda f: config_of(f, bounds={"frictoin": 0.6}),
        ("study.yaml, line 2: bounds.frictoin", "unknown key", "did you mean 'friction'?"),
    ),
    "degrees": (
        lambda f: config_of(f, bounds={"joint_ranges": {"knee_r": [10.0, 60.0]}}),
        ("study.yaml", "bounds.joint_ranges.knee_r", "is it in degrees?"),
    ),
    "missing patient": (
        lambda f: config_of(f, patient="nobody"),
        ("study.yaml: patient: no patient 'nobody'", "a YAML file"),
    ),
    "bounds reversed": (
        lambda f: config_of(f, bounds={"distance": [2.0, 0.5]}),
        ("study.yaml", "bounds.distance", "upside down"),
    ),
    "unknown problem": (
        lambda f: config_of(f, problem="mapd-shoes"),
        ("study.yaml", "problem", "is 'mapd-shoes'", "mapd-barefoot"),
    ),
    "bad YAML": (
        lambda f: text_of(f, "problem: mapd-orthosis\nbounds: {friction: 0.8\n"),
        ("study.yaml, line", "not valid YAML"),
    ),
    "a NaN": (
        lambda f: config_of(f, bounds={"friction": float("nan")}),
        ("study.yaml", "bounds.friction", "is not a finite number"),
    ),
    "springs that do not exist": (
        lambda f: config_of(f, bounds={"dorsiflexion_stiffness": [200.0, 400.0]}),
        ("study.yaml: bounds.dorsiflexion_stiffness", "no real spring", "within 5 to 92 N m/rad"),
    ),
    "one spring that does not exist": (
        lambda f: config_of(f, bounds={"stiffness": {"plantarflexion_stiffness_left": [2.0, 3.0]}}),
        ("study.yaml: bounds.stiffness.plantarflexion_stiffness_left", "no real spring"),
    ),
    "a missing recording": (
        lambda f: config_of(f, start={"gait": "recorded", "trial": "99"}),
        ("study.yaml: start.trial: ", "no barefoot recording '99'", "3053171"),
    ),
    "no recordings at all": (
        lambda f: config_of(f, problem="mapd-healthy", patient="sreenivasa2017-healthy",
                            half_cycle=False, start={"gait": "recorded"}),
        ("study.yaml", "no barefoot recording of a whole stride", "start.gait"),
    ),
    "a speed that no phases allow": (
        lambda f: config_of(
            f, bounds={"least_walking_speed": 2.0, "phase_duration": [0.2, 0.4],
                       "distance": [0.3, 1.0]}
        ),
        ("study.yaml: bounds.least_walking_speed", "is 2 m/s", "at most 1 m takes at least 1.6 s",
         "up to 0.625 m/s"),
    ),
    "a stride longer than the legs": (
        lambda f: config_of(f, bounds={"distance": [4.0, 5.0]}),
        ("study.yaml: bounds.distance", "longer than both legs", "a lower end of up to"),
    ),
    "a foot that cannot stand flat": (
        lambda f: config_of(f, bounds={"joint_ranges": FLAT}),
        ("study.yaml: bounds.joint_ranges", "sole of the right foot never lie flat"),
    ),
    "no orthosis": (
        lambda f: patient_without(f, "orthosis"),
        ("study.yaml", "someone.yaml", "has no orthosis, which problem mapd-orthosis needs"),
    ),
    "no strengths": (
        lambda f: patient_without(f, "strengths"),
        ("study.yaml", "someone.yaml", "strengths is not given"),
    ),
    "half a cycle of unequal sides": (
        lambda f: config_of(f, half_cycle=True),
        ("study.yaml", "half_cycle"),
    ),
    "perturbation without springs": (
        lambda f: text_of(f, "base: mapd-barefoot\nfactors: [0.9]\n"),
        ("study.yaml, base", "walked barefoot and has no springs"),
    ),
    "perturbation of a prescribed spring": (
        lambda f: text_of(f, "base: mapd-orthosis\nsprings: [dorsiflexion_stiffness_left]\n"
                          "set: {bounds.dorsiflexion_stiffness: [60, 60]}\n"),
        ("study.yaml: springs", "is prescribed by the problem"),
    ),
    "sensitivity to a number that is not there": (
        lambda f: text_of(f, "base: mapd-orthosis\nplaces: [strengths.elbow]\n"),
        ("study.yaml: places: the patient's file has no 'elbow' in strengths"),
    ),
    "an uncertain number that is not there": (
        lambda f: text_of(f, "base: mapd-orthosis\nquantities: {body_mas: {relative: 0.1}}\n"),
        ("study.yaml", "has no 'body_mas'", "did you mean 'body_mass'?"),
    ),
    "a landscape upside down": (
        lambda f: text_of(f, "base: mapd-orthosis\nside: left\ndorsiflexion: {from: 100.0}\n"),
        ("study.yaml: dorsiflexion", "runs from 100 to 92 N m/rad"),
    ),
    "a trade-off of a fit": (
        lambda f: text_of(f, "base: ls-barefoot\nwalking_speed_weights: [0.0, 1.0]\n"),
        ("study.yaml, base", "follows a recording"),
    ),
    "a study of a base that is not there": (
        lambda f: text_of(f, "base: nowhere.yaml\nfactors: [0.9]\n"),
        ("study.yaml, base", "nowhere.yaml: no such file"),
    ),
    "a cohort of nobody": (
        lambda f: text_of(f, "patients: [children/*.yaml]\nproblems: [mapd-barefoot]\n"),
        ("study.yaml: patients", "'children/*.yaml' leads to no patient"),
    ),
    "a cohort that cannot walk so fast": (
        lambda f: text_of(f, f"patients: [{PATIENT}]\nproblems: [mapd-barefoot]\n"
                          "set: {bounds.least_walking_speed: 3.0, bounds.distance: [0.3, 0.4]}\n"),
        ("study.yaml, case ", "bounds.least_walking_speed", "is 3 m/s"),
    ),
    "a trial that is not there": (
        lambda f: text_of(f, f"study: inverse-dynamics\npatient: {PATIENT}\ntrials: [walk]\n"),
        ("study.yaml: trials", "there is no trial walk"),
    ),
    "C3D files that are not there": (
        lambda f: text_of(f, f"study: inverse-kinematics\npatient: {PATIENT}\n"
                          "c3d: {barefoot: [nowhere.c3d]}\n"),
        ("study.yaml: c3d: nowhere.c3d", "no such recording"),
    ),
    "a marker on no link": (
        lambda f: text_of(f, "reference_height: 1.25\n"
                          "both: [{marker: A, link: arm, along: 0.5}]\n"),
        ("study.yaml", "has marker A on 'arm'", "shank_r"),
    ),
    "an orthosis in degrees": (
        lambda f: text_of(f, "mass: {shank: 0.3, foot: 0.6}\nneutral_angle: -2\nfree_play: 0.01\n"
                          "stiffness_guess: {dorsiflexion: 50, plantarflexion: 5}\n"),
        ("study.yaml", "neutral_angle"),
    ),
    "what is this?": (
        lambda f: text_of(f, "base: mapd-orthosis\n"),
        ("study.yaml: its keys (base) do not tell what it is", "landscape"),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_what_is_wrong_is_said_in_one_sentence(here: Path, name: str) -> None:
    make, parts = BROKEN[name]
    result = run(make(here))
    assert isinstance(result.exception, SystemExit), repr(result.exception)
    assert result.exit_code == 2, result.output
    (line,) = result.output.splitlines()
    assert line.startswith("Error: ")
    for part in parts:
        assert part in line, line


def test_all_failures_are_reported_beside_what_is_in_order(here: Path) -> None:
    first = text_of(here, "a: [1", "first.yaml")
    second = text_of(here, "problem: none\npatient: x\n", "second.yaml")
    result = CliRunner().invoke(cli, ["check", str(first), "mapd-barefoot", str(second)])
    assert result.exit_code == 2
    assert "mapd-barefoot: prediction, in order" in result.stdout
    lines = result.stderr.splitlines()
    assert [line.startswith("Error: ") for line in lines] == [True, True]
    assert "first.yaml" in lines[0]
    assert "second.yaml" in lines[1]


def test_a_problem_that_was_asked_for_must_be_the_configs_own() -> None:
    assert run("mapd-orthosis", "--problem", "mapd-orthosis").exit_code == 0
    result = run("mapd-orthosis", "--problem", "mapd-barefoot")
    assert result.exit_code == 2
    assert "is a config for mapd-orthosis, but mapd-barefoot was asked for" in result.output
    assert "there is no problem 'mapd'" in run("mapd-orthosis", "--problem", "mapd").output


# Notes


@pytest.mark.parametrize(
    ("blocks", "part"),
    [
        ({"bounds": {"dorsiflexion_stiffness": [5.0, 120.0]}}, "real springs end at [5, 92]"),
        ({"start": {"stiffness": {"dorsiflexion_stiffness_left": 120.0}}}, "begins at the nearer"),
        ({"bounds": {"joint_ranges": {"knee_l": [1.5, 1.6]}}}, "all outside its range"),
        ({"cost": {"goals": {"discomfort": 1.0}, "comfort_ranges": {"knee_r": [2.0, 2.5]}}},
         "cost.comfort_ranges.knee_r [2, 2.5] rad lies outside"),
    ],
)  # fmt: skip
def test_what_is_unusual_is_a_note(here: Path, blocks: dict[str, Any], part: str) -> None:
    checked = check_file(str(config_of(here, **blocks)))
    assert [note for note in checked.notes if part in note], checked.notes


def implausible(child: Path, old: str, new: str, file: str = "patient.yaml") -> str:
    """Return the remarks on a child of whom something else is written."""
    return "; ".join(check_file(str(replaced(child / file, old, new))).notes)


def test_unusual_sizes_and_springs_are_notes(child: Path) -> None:
    whole = "; ".join(check_file(str(child)).notes)
    for word in ("body mass index", "times what", "Froude", "lies outside"):
        assert word not in whole
    mass = re.search(r"body_mass: [\d.]+", (child / "patient.yaml").read_text("utf-8"))
    assert mass is not None
    found = implausible(child, mass[0], "body_mass: 10.0")
    assert re.search(r"body_mass 10 kg at height [\d.]+ m is a body mass index of \d\.\d", found)
    assert "11 to 40 is wider than three standard deviations" in found
    found = implausible(child, "stiffness: 5.0}", "stiffness: 4.0}", "orthosis.yaml")
    sentence = "springs.plantarflexion 'softest' of 4 N m/rad lies outside stiffness_range"
    assert sentence in found
    inside = "; ".join(check_file(str(child)).notes)
    assert f"orthosis.{sentence.replace('stiffness_range', 'orthosis.stiffness_range')}" in inside


def test_lengths_far_from_proportions_are_notes() -> None:
    patient = load_patient(PATIENT)
    assert list(odd_patient(patient)) == []
    lengths = patient.segment_lengths.model_copy(update={"shank": 0.4})
    (right, left) = odd_patient(patient.model_copy(update={"segment_lengths": lengths}))
    assert right.startswith("segment_lengths.shank right 0.4 m is 1.30 times what body proportions")
    assert "for 1.25 m of height, 0.307 m (Drillis and Contini (1966), adults)" in right
    assert left.startswith("segment_lengths.shank left")


def test_speeds_at_which_people_run_are_notes(here: Path) -> None:
    leg = load_patient(PATIENT).leg_length
    limit = (0.5 * 9.81 * leg) ** 0.5
    for speed, count in ((limit - 0.01, 0), (limit + 0.01, 1)):
        path = config_of(here, bounds={"least_walking_speed": float(round(speed, 3))})
        notes = [note for note in check_file(str(path)).notes if "Froude" in note]
        assert len(notes) == count
    assert "from the config, is a Froude number v^2/(g leg length) of 0.51" in notes[0]
    assert "people run" in notes[0]
    started = check_file(str(config_of(here, start={"walking_speed": 2.5}))).notes
    assert [note for note in started if note.startswith("start.walking_speed 2.5 m/s is a Froude")]


def test_lengths_from_proportions_are_one_note(here: Path) -> None:
    CliRunner().invoke(cli, ["init", "child"])
    text = " ".join(" ".join(checked_lines(check_file("child"))).split())
    assert text.count("from body proportions") == 1
    assert "segment lengths pelvis, hip_drop, lumbar_height, trunk," in text
