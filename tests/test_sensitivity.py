"""Sensitivities: places, tables, words and refusals; their values are tested in test_kkt."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from pathwalker_cli.cli import cli
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.patient import load_patient
from pathwalker_cli.patient.variation import Variation, varied
from pathwalker_cli.studies.sensitivity import SensitivityStudy, asked_checks, default_places
from pathwalker_cli.studies.sensitivity.figures import save_sensitivity_figure
from pathwalker_cli.studies.sensitivity.result import (
    Check,
    Sensitivities,
    Sensitivity,
    agreement,
    label_of,
    sensitivity_lines,
    write_sensitivities,
)

PATIENT = load_patient("sreenivasa2017-patient")
BASE = {
    "cost": 0.25,
    "walking_speed": 0.636,
    "step_length_right": 0.34,
    "step_length_left": 0.36,
    "min_stance_knee_flexion_right": 0.42,
    "min_stance_knee_flexion_left": 0.43,
    "stride_time": 1.1,
}


def made(difference: float = 0.0) -> Sensitivities:
    """Return the sensitivities of a spring and of all strengths."""
    rows = []
    for place, value, slope in (
        ("dorsiflexion_stiffness_left", 92.0, -0.02),
        ("strengths", None, -0.5),
    ):
        derivatives = {key: slope if key == "cost" else 0.0 for key in BASE}
        rows.append(
            Sensitivity(place, value, derivatives, {k: derivatives[k] / BASE[k] for k in BASE})
        )
    found = {key: -0.5 * (1.0 + difference) if key == "cost" else 0.0 for key in BASE}
    check = Check("strengths", 5e-4, found, 22, 3.0, 0)
    about = ("mapd-orthosis", "someone", 1e-9)
    return Sensitivities(*about, BASE, tuple(rows), (check,), 400, 12, 1.5)


@pytest.mark.parametrize("place", default_places(PATIENT, with_orthosis=True))
def test_every_default_place_is_in_the_file(place: str) -> None:
    assert varied(PATIENT, Variation(scale={place: 1.0001})) is not PATIENT


def test_barefoot_no_orthosis_is_asked_about() -> None:
    places = default_places(PATIENT, with_orthosis=False)
    assert not any(place.startswith("orthosis") for place in places)
    assert {"strengths.knee_extension.left", "body_mass", "segment_lengths.shank"} <= set(places)


@pytest.mark.parametrize("worn", [("right", "left"), ("left",)])
def test_a_check_without_a_side_is_one_of_every_side_that_is_worn(worn: tuple[str, ...]) -> None:
    study = SensitivityStudy(base="", check=("strengths", "plantarflexion_stiffness"))
    springs = [f"plantarflexion_stiffness_{side}" for side in worn]
    places = (*springs, "strengths", "strengths.hip_flexion.left")
    assert asked_checks(study, places) == ("strengths", *springs)
    with pytest.raises(ConfigError, match="names plantarflexion_stiffness"):
        asked_checks(study, places[len(worn) :])


def test_the_terminal_tells_elasticities(made_lines: list[str]) -> None:
    row = next(line for line in made_lines if line.startswith("K_D left"))
    assert "-0.080" in row
    assert row.split()[-1] == "."
    assert any("22 iterations" in line and "the same limits hold" in line for line in made_lines)


@pytest.fixture
def made_lines() -> list[str]:
    return list(sensitivity_lines(made()))


def test_a_check_is_judged_by_the_larger_of_both_scales() -> None:
    result = made(0.02)
    assert agreement(result, result.checks[0]) == pytest.approx(0.02 / 1.02)
    assert agreement(made(), made().checks[0]) == 0.0


def test_files_hold_every_number(tmp_path: Path) -> None:
    write_sensitivities(made(), tmp_path)
    with (tmp_path / "sensitivity.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * len(BASE)
    first = rows[0]
    assert first["number"] == "dorsiflexion_stiffness_left"
    assert float(first["derivative [SI per SI]"]) == pytest.approx(-0.02 / 92.0)
    assert float(first["elasticity [% per %]"]) == pytest.approx(-0.08)
    content = json.loads((tmp_path / "sensitivity.json").read_text(encoding="utf-8"))
    assert content["elasticities"]["strengths"]["cost"] == pytest.approx(-2.0)
    assert (tmp_path / "sensitivity_check.csv").exists()


def test_the_figure_is_written(tmp_path: Path) -> None:
    save_sensitivity_figure(made(), tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"sensitivity.png", "sensitivity.svg"}


def test_labels_are_words() -> None:
    assert label_of("segment_lengths.shank") == "length of shank"
    assert label_of("strengths.hip_flexion.left") == "strengths, hip flexion, left"
    assert label_of("plantarflexion_stiffness_right") == "K_P right"


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (["places=[5]"], "places"),
        (["tolerance=1"], "tolerance"),
        (["chek=[]"], "chek"),
        (["base=nothing"], "no such file"),
        (["check_step=5"], "percent"),
    ],
)
def test_wrong_configs_are_refused(changes: list[str], words: str, tmp_path: Path) -> None:
    options = [part for change in changes for part in ("--set", change)]
    out = tmp_path / "out"
    result = CliRunner().invoke(cli, ["sensitivity", "sensitivity", "--out", str(out), *options])
    assert result.exit_code == 2
    assert words in result.output
    assert not out.exists()


def test_a_folder_with_something_else_is_refused(tmp_path: Path) -> None:
    (tmp_path / "thesis.tex").write_text("x", encoding="utf-8")
    result = CliRunner().invoke(cli, ["sensitivity", "sensitivity", "--out", str(tmp_path)])
    assert result.exit_code == 2
    assert "thesis.tex" in result.output
