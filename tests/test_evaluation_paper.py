"""What the article prints: complete, of known quantities, and compared as it truncates."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from pathwalker_cli.conventions import GENERATORS
from pathwalker_cli.evaluation.differences import DIFFERENCES
from pathwalker_cli.evaluation.evaluate import compared
from pathwalker_cli.evaluation.norms import PROFILE
from pathwalker_cli.evaluation.paper import (
    CLAIMS,
    NUMBERS,
    PATIENT,
    PaperNumber,
    paper_claim,
    paper_number,
)
from pathwalker_cli.patient import load_patient
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.stride.measures import REGISTRY, TABLES, expanded, measure_of

DOCUMENTATION = Path(__file__).parent.parent / "docs" / "evaluation.md"


def printed(text: str, unit: str = "m", upper: str = "") -> PaperNumber:
    """Return a number as if the article printed it."""
    return PaperNumber("x", "y", text, unit, "table 0", upper)


@pytest.mark.parametrize("value", [0.60, 0.6098, 0.595, 0.6049])
def test_truncated_and_rounded_values_agree(value: float) -> None:
    assert printed("0.60").agrees(value)


@pytest.mark.parametrize("value", [0.5949, 0.61, 0.7, -0.6])
def test_other_values_do_not(value: float) -> None:
    assert not printed("0.60").agrees(value)


def test_negative_numbers_are_truncated_towards_zero() -> None:
    assert printed("-9.26", "deg").agrees(np.deg2rad(-9.269))
    assert not printed("-9.26", "deg").agrees(np.deg2rad(-9.254))
    assert printed("0.0").agrees(-0.05)


def test_values_are_si_and_digits_as_printed() -> None:
    angle = printed("12.95", "deg")
    assert angle.value == pytest.approx(np.deg2rad(12.95))
    assert angle.step == pytest.approx(np.deg2rad(0.01))
    assert printed("7", "h").value == 25200.0
    span = printed("0.30", "m", "0.43")
    assert (span.bounds, span.value, str(span)) == ((0.30, 0.43), 0.365, "0.30-0.43")
    assert [span.agrees(x) for x in (0.29, 0.30, 0.439, 0.45)] == [False, True, True, False]


def test_no_number_stands_twice() -> None:
    keys = [(number.subject, number.quantity) for number in NUMBERS]
    assert len(set(keys)) == len(keys)
    assert all(number.place.startswith(("table", "section")) for number in NUMBERS)


def test_tables_are_complete() -> None:
    places = [number.place for number in NUMBERS]
    assert {f"table {n}": places.count(f"table {n}") for n in (1, 3, 4, 5)} == {
        "table 1": 28, "table 3": 18, "table 4": 12, "table 5": 24,
    }  # fmt: skip
    for who in ("patient", "healthy"):
        for name in GENERATORS:
            assert paper_number(who, f"max_isometric_torque_{name}") is not None


def test_the_shipped_patient_has_the_strengths_of_table_1() -> None:
    strengths = load_patient(PATIENT).max_isometric_torque
    for name, strength in zip(GENERATORS, strengths, strict=True):
        number = paper_number("patient", f"max_isometric_torque_{name}")
        assert number is not None
        assert number.agrees(strength), name


def test_numbers_of_gaits_are_quantities_of_the_evaluation() -> None:
    keys = {measure.key for measure in compared()}
    beside = ("_after_-5%", "seconds_solve", "walking_speed_weight")
    for number in NUMBERS:
        if number.subject in PROBLEMS and not any(word in number.quantity for word in beside):
            assert number.quantity in keys, number
    for claim in CLAIMS:
        assert any(key.startswith(claim.quantity) for key in keys)


def test_claims_hold_for_both_sides_or_one() -> None:
    assert str(paper_claim("min_stance_knee_flexion_left")) == "falls"
    assert str(paper_claim("step_length_right")) == "rises"
    assert paper_claim("step_length_left") is None
    assert paper_number("mapd-barefoot", "colour") is None


def test_quantities_have_different_keys() -> None:
    keys = [measure.key for measure in compared()]
    assert len(set(keys)) == len(keys)
    assert measure_of("walking_speed").unit == "m/s"


def test_the_documentation_names_every_quantity_and_its_python_imports() -> None:
    text = DOCUMENTATION.read_text(encoding="utf-8")
    named = {key for name in TABLES["evaluate"] for key in expanded(name)}
    shipped = [m for m in REGISTRY if m.key in named]  # what is added later is on a page of its own
    for measure in (
        *(replace(m, key=m.compared_as or m.key) for m in shipped),
        *DIFFERENCES,
        *PROFILE,
    ):
        stems = {measure.key, f"{measure.key.rpartition('_')[0]}_*"}
        assert any(f"`{stem}`" in text for stem in stems), measure.key
    code = text.partition("```python\n")[2].partition("```")[0]
    imports = [line for line in code.splitlines() if line.startswith("from ")]
    names: dict[str, object] = {}
    exec("\n".join(imports), names)
    assert {"gait_of_run", "evaluate_gait", "gait_changes"} <= names.keys()
