"""Overrides from the command line: where their paths count from, and what is said of wrong ones."""

from __future__ import annotations

from pathlib import Path

import pytest

from pathwalker_cli.config import load_config
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.inverse.study import load_inverse_dynamics
from pathwalker_cli.paths import shipped
from pathwalker_cli.studies.base import load_study
from pathwalker_cli.studies.batch.cases import load_cases
from pathwalker_cli.studies.landscape import LandscapeStudy

PATIENT = "sreenivasa2017-patient"


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Work in a folder with a patient, and a config that names another of the same name."""
    monkeypatch.chdir(tmp_path)
    text = (shipped("patient_data") / PATIENT / "patient.yaml").read_text(encoding="utf-8")
    for folder in ("anna", "configs-of-mine/anna"):
        (tmp_path / folder).mkdir(parents=True)
        (tmp_path / folder / "patient.yaml").write_text(text, encoding="utf-8")
    config = "problem: mapd-barefoot\npatient: anna/\n"
    (tmp_path / "configs-of-mine" / "study.yaml").write_text(config, encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(config, encoding="utf-8")
    return tmp_path


def test_a_patient_of_an_override_counts_from_here(here: Path) -> None:
    for config in ("mapd-barefoot", "configs-of-mine/study.yaml"):
        given = load_config(config, changes=("patient=anna/",)).patient
        assert given == str((here / "anna").resolve())
    beside = load_config("configs-of-mine/study.yaml").patient
    assert beside == str((here / "configs-of-mine" / "anna").resolve())
    assert load_config("mapd-barefoot", changes=(f"patient={PATIENT}",)).patient == PATIENT
    recorded = load_inverse_dynamics("inverse-dynamics", ("patient=anna/",)).patient
    assert recorded == str((here / "anna").resolve())


def test_other_paths_of_overrides_count_from_here_too(here: Path) -> None:
    study = load_study("landscape", LandscapeStudy, ("base=mine.yaml",))
    assert study.base == str(here / "mine.yaml")
    (case,) = load_cases("cohort", ("patients=[anna/]", "problems=[mine.yaml]", "grid={}")).cases
    assert case.study.config.patient == str(here / "anna" / "patient.yaml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ("mesh.degre=3", "--set mesh.degre=3: unknown key"),
        ("mesh.degree=9", "--set mesh.degree=9: is 9"),
        ("starts=.nan", "--set starts=.nan: is not a finite number"),
        ("bounds.stiffness={dorsiflexion_stiffness_left: [9, 5]}",
         "[9, 5]}: bounds.stiffness.dorsiflexion_stiffness_left: is [9, 5], upside down"),
    ],
)  # fmt: skip
def test_wrong_overrides_are_named_instead_of_lines_of_the_file(change: str, message: str) -> None:
    with pytest.raises(ConfigError) as caught:
        load_config("mapd-orthosis", changes=(change,))
    assert message in str(caught.value)
    assert ", line" not in str(caught.value)


def test_what_the_file_says_wrongly_still_has_its_line(here: Path) -> None:
    path = here / "mine.yaml"
    path.write_text("problem: mapd-barefoot\nmesh:\n  degree: 9\npatient: anna/\n", "utf-8")
    with pytest.raises(ConfigError, match=r"mine.yaml, line 3: mesh.degree: is 9"):
        load_config(path, changes=("mesh.refinements=2",))
    assert load_config(path, changes=("mesh.degree=4",)).mesh.degree == 4


@pytest.mark.parametrize(
    ("change", "where", "place", "value"),
    [
        ("variation.scale.strengths.knee_extension.left=0.9", "scale",
         "strengths.knee_extension.left", 0.9),
        ("variation.shift.orthosis.neutral_angle=0.01", "shift", "orthosis.neutral_angle", 0.01),
    ],
)  # fmt: skip
def test_dots_go_on_into_names_that_have_dots(
    change: str, where: str, place: str, value: float
) -> None:
    config = load_config("mapd-barefoot", changes=(change, "variation.scale.body_mass=1.1"))
    assert getattr(config.variation, where)[place] == value
    assert config.variation.scale["body_mass"] == 1.1


def test_a_mapping_instead_of_a_number_is_told_the_form_that_works() -> None:
    with pytest.raises(ConfigError, match=r"which is not a number.*KEY=\{name.with.dots: 1\}"):
        load_config("mapd-barefoot", changes=("cost.goals.steady_trunk.left=1",))
