"""Patient files: what is read, what is filled in, and how wrong input is refused."""

from __future__ import annotations

import copy
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from pathwalker_cli.conventions import GENERATORS
from pathwalker_cli.errors import PatientError
from pathwalker_cli.io.yaml_file import load_yaml, read_mapping, validate
from pathwalker_cli.patient import Patient, load_patient, shipped_patients

MINIMAL: dict[str, Any] = {
    "id": "someone",
    "sex": "female",
    "age": 8,
    "body_mass": 26.0,
    "height": 1.3,
}


def changed(key: str, value: Any) -> dict[str, Any]:
    """Return the shipped patient's mapping with one dotted key replaced."""
    path = load_patient("sreenivasa2017-patient").source
    assert path is not None
    mapping = copy.deepcopy(read_mapping(path)[0])
    inner: Any = mapping
    *parents, last = key.split(".")
    for parent in parents:
        inner = inner[parent]
    inner[last] = value
    return mapping


def refusal(mapping: dict[str, Any]) -> str:
    """Return the message with which a mapping is refused."""
    with pytest.raises(PatientError) as caught:
        validate(mapping, Patient, where="p.yaml", error=PatientError)
    return str(caught.value)


def test_shipped_patient_is_read() -> None:
    patient = load_patient("sreenivasa2017-patient")
    assert patient.source is not None
    assert patient.source.name == "patient.yaml"
    assert patient.recordings == (patient.source.parent / "recordings",)
    assert (patient.age, patient.regression_age) == (7.0, 6.0)
    assert patient.length("thigh", "left") == 0.2607
    assert patient.length("hand", "right") == patient.length("hand", "left") == 0.09328
    strength = dict(zip(GENERATORS, patient.max_isometric_torque, strict=True))
    assert strength["hip_extension_r"] == 18.63684
    assert strength["ankle_flexion_l"] == 5.85053
    assert strength["lumbar_flexion"] == 17.19329
    assert patient.require_orthosis().dorsiflexion_stop["right"] == -0.13
    assert patient.require_orthosis().stiffness_range.dorsiflexion.left == (5.0, 92.0)
    assert len(patient.notes) == 1


def test_all_shipped_patients_load() -> None:
    assert shipped_patients() == ("sreenivasa2017-healthy", "sreenivasa2017-patient")
    for name in shipped_patients():
        assert load_patient(name).id == name


def test_folder_and_file_are_accepted(tmp_path: Path) -> None:
    file = tmp_path / "patient.yaml"
    file.write_text(yaml.safe_dump(MINIMAL), encoding="utf-8")
    assert load_patient(tmp_path) == load_patient(str(file))


def test_missing_lengths_come_from_proportions_and_are_noted() -> None:
    patient = validate(MINIMAL, Patient)
    assert patient.length("thigh", "right") == pytest.approx(0.245 * 1.3, abs=1e-3)
    assert patient.contacts("barefoot")["left"].heel[1] == pytest.approx(-0.039 * 1.3, abs=1e-3)
    assert any("segment length thigh: 0.319 m" in note and "1966" in note for note in patient.notes)
    assert any("contact points" in note for note in patient.notes)


def test_default_contact_points_follow_the_foot() -> None:
    mapping = changed("contact_points.barefoot", None)
    points = validate(mapping, Patient).contacts("barefoot")["right"]
    assert points.heel == pytest.approx((-0.05075, -0.049), abs=1e-9)
    assert points.toe == pytest.approx((0.09425, -0.049), abs=1e-9)


def test_what_is_not_given_is_asked_for() -> None:
    patient = validate(MINIMAL, Patient)
    with pytest.raises(PatientError, match=r"patient someone: strengths is not given"):
        _ = patient.max_isometric_torque
    with pytest.raises(PatientError, match="orthosis is not given"):
        patient.require_orthosis()


def test_unknown_patient_lists_the_shipped_ones() -> None:
    with pytest.raises(PatientError, match=r"'nobody'.*sreenivasa2017-healthy, sreenivasa2017-pat"):
        load_patient("nobody")


@pytest.mark.parametrize(
    ("key", "value", "parts"),
    [
        ("height", 125, ("height: is 125 m", "0.5 to 2.2 m", "centimetres?")),
        ("body_mass", 24700, ("body_mass: is 24700 kg", "grams?")),
        ("body_mass", -24.7, ("is -24.7 kg", "allowed: 5 to 150 kg")),
        ("body_mass", "24.7 kg", ("'24.7 kg', which is not a number in kg", "write the number")),
        ("body_mass", True, ("True, which is not a number in kg",)),
        ("height", float("nan"), ("height: is not a finite number",)),
        ("age", 84, ("age_for_regressions",)),
        ("id", "../evil", ("not safe as the name of a folder",)),
        ("sex", "m", ("sex: is 'm'", "'male' or 'female'")),
        ("orthosis.dorsiflexion_stop.left", 0.12, ("is 0.12 rad", "minus sign")),
        ("orthosis.neutral_angle", 12, ("is 12 rad", "degrees?")),
        ("orthosis.stiffness_range.dorsiflexion", [92, 5], ("upside down",)),
        ("orthosis.stiffness_guess.plantarflexion", 200, ("outside its range", "5 to 92 N m/rad")),
        ("orthosis.stiffness_guess.dorsiflexion", 0.7, ("per degree?",)),
        ("orthosis.neutral_angle", 0.2, ("not between the right stops",)),
        ("strengths.hip_flexion.right", 0, ("strengths.hip_flexion.right: is 0 N m",)),
        ("segment_lengths.thigh", 264.7, ("is 264.7 m", "millimetres?")),
        ("contact_points.orthosis", None, ("no contact_points.orthosis",)),
        ("contact_points.barefoot.left.toe", [-0.06, -0.05], ("behind its heel",)),
        ("contact_points.barefoot.left.toe", [0.08, 0.05], ("below the ankle",)),
        ("age_for_regressions_reason", "", ("without age_for_regressions_reason",)),
    ],
)
def test_wrong_values_are_explained(key: str, value: Any, parts: tuple[str, ...]) -> None:
    mapping = changed(key, value)
    if key == "age":
        del mapping["age_for_regressions"]
        parts = ("is 84 years", "in months?")
    message = refusal(mapping)
    assert message.startswith("p.yaml: ")
    for part in parts:
        assert part in message


def test_unknown_key_gets_the_closest_and_the_allowed_ones() -> None:
    message = refusal(MINIMAL | {"bodymass": 26.0})
    assert "unknown key" in message
    assert "did you mean 'body_mass'?" in message
    nested = refusal(changed("segment_lengths.tigh", 0.2))
    assert "segment_lengths.tigh: unknown key" in nested
    assert "did you mean 'thigh'?" in nested
    assert "shoulder_height" in nested


def test_missing_key_is_named() -> None:
    mapping = {key: value for key, value in MINIMAL.items() if key != "height"}
    assert "height: this key is missing" in refusal(mapping)


def test_line_of_a_wrong_value_is_given(tmp_path: Path) -> None:
    file = tmp_path / "patient.yaml"
    file.write_text(yaml.safe_dump(MINIMAL | {"height": 130}, sort_keys=False), encoding="utf-8")
    with pytest.raises(PatientError, match=r"patient.yaml, line 5: height: is 130 m"):
        load_patient(file)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("a: 1\nb: 2\na: 3\n", r"line 3: key a stands twice, first in line 1"),
        ("a: [1\n", "not valid YAML"),
        ("- 1\n", "holds a list; allowed: keys"),
        ("", "holds nothing"),
        ("a: !!python/object:os.system {}\n", "not valid YAML"),
    ],
)
def test_bad_files_are_refused(tmp_path: Path, text: str, message: str) -> None:
    file = tmp_path / "bad.yaml"
    file.write_text(text, encoding="utf-8")
    with pytest.raises(PatientError, match=message):
        load_yaml(file, Patient, PatientError)


def test_missing_file_is_refused(tmp_path: Path) -> None:
    with pytest.raises(PatientError, match="no such file"):
        load_yaml(tmp_path / "none.yaml", Patient, PatientError)


def test_exponents_without_a_point_are_numbers(tmp_path: Path) -> None:
    file = tmp_path / "numbers.yaml"
    file.write_text("a: 1e-4\nb: 2.5E3\nc: 7\nd: .5\ne: 2020-01-01\nf: 1.\n", encoding="utf-8")
    assert read_mapping(file)[0] == {
        "a": 1e-4, "b": 2500.0, "c": 7, "d": 0.5, "e": "2020-01-01", "f": 1.0,
    }  # fmt: skip


def test_an_orthosis_may_have_a_file_of_its_own(tmp_path: Path) -> None:
    shipped = load_patient("sreenivasa2017-patient")
    assert shipped.source is not None
    content = yaml.safe_load(shipped.source.read_text(encoding="utf-8"))
    worn = content["orthosis"]
    (tmp_path / "spring.yaml").write_text(yaml.safe_dump(worn), encoding="utf-8")
    content["orthosis"] = "spring.yaml"
    child = tmp_path / "child.yaml"
    child.write_text(yaml.safe_dump(content), encoding="utf-8")
    patient = load_patient(child)
    assert patient.orthosis == shipped.orthosis
    before = patient.content
    (tmp_path / "spring.yaml").write_text(
        yaml.safe_dump({**worn, "neutral_angle": 5.0}), encoding="utf-8"
    )
    with pytest.raises(PatientError, match=r"spring\.yaml, line \d+: neutral_angle"):
        load_patient(child)
    (tmp_path / "spring.yaml").write_text(
        yaml.safe_dump({**worn, "neutral_angle": 0.0}), encoding="utf-8"
    )
    assert load_patient(child).content != before


def test_a_number_stands_at_its_key_then_in_numbers_then_is_the_default() -> None:
    patient = load_patient("sreenivasa2017-patient")
    assert patient.number("orthosis.neutral_angle.right", 0.5) == -0.02
    assert patient.number("tissue.knee.right", 3.0) == 3.0
    own = patient.model_copy(update={"numbers": {"tissue.knee": 4.0, "tissue.knee.left": 5.0}})
    assert own.number("tissue.knee.right", 3.0) == 4.0
    assert own.number("tissue.knee.left", 3.0) == 5.0
    bare = patient.model_copy(update={"orthosis": None})
    assert bare.number("orthosis.damping.left", 0.1) == 0.1
    with pytest.raises(PatientError, match="strengths is not given"):
        patient.model_copy(update={"strengths": None}).number("strengths.hip_flexion.left")


def test_angles_may_be_written_in_degrees_where_they_say_so(tmp_path: Path) -> None:
    content = load_patient("sreenivasa2017-patient").model_dump(mode="json", exclude_none=True)
    orthosis = content["orthosis"]
    orthosis["neutral_angle"] = "-2 deg"
    orthosis["dorsiflexion_stop"] = {"right": "-7.5deg", "left": -0.13}
    orthosis["stiffness_guess"]["dorsiflexion"] = "1.6 N m/deg"
    content["examination"] = {"popliteal_angle": "55 deg"}
    file = tmp_path / "patient.yaml"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    patient = load_patient(file)
    assert patient.orthosis is not None
    assert patient.orthosis.neutral_angle.right == pytest.approx(np.deg2rad(-2.0))
    assert patient.orthosis.dorsiflexion_stop.right == pytest.approx(np.deg2rad(-7.5))
    assert patient.orthosis.stiffness_guess.dorsiflexion.right == pytest.approx(np.rad2deg(1.6))
    assert patient.examination.popliteal_angle.left == 55.0  # type: ignore[union-attr]
    orthosis["neutral_angle"] = "2 degrees"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(PatientError, match="or a number with deg"):
        load_patient(file)
    orthosis["neutral_angle"] = "-50 deg"
    file.write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(PatientError, match=r"is -0.872665 rad"):
        load_patient(file)
