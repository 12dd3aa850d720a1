"""What if the patient were another: scaled and shifted numbers, and their refusals."""

from __future__ import annotations

import numpy as np
import pytest

from pathwalker_cli.case import load_case
from pathwalker_cli.errors import ConfigError, PatientError
from pathwalker_cli.gait.mesh import uniform
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.collocation import CollocationProgram
from pathwalker_cli.ocp.collocation_blocks import CollocationBlocks
from pathwalker_cli.patient import load_patient
from pathwalker_cli.patient.variation import Variation, varied

PATIENT = load_patient("sreenivasa2017-patient")


def test_no_variation_is_the_patient_itself() -> None:
    assert varied(PATIENT, Variation()) is PATIENT


def test_a_place_changes_all_that_stands_below_it() -> None:
    weak = varied(PATIENT, Variation(scale={"strengths": 0.5}))
    assert np.allclose(weak.max_isometric_torque, 0.5 * np.array(PATIENT.max_isometric_torque))
    one = varied(PATIENT, Variation(scale={"strengths.knee_extension.right": 0.5}))
    changed = np.array(one.max_isometric_torque) / PATIENT.max_isometric_torque
    assert sorted(changed)[0] == pytest.approx(0.5)
    assert sorted(changed)[1] == pytest.approx(1.0)


def test_factors_come_before_shifts_and_merge() -> None:
    first = Variation(scale={"body_mass": 1.1}, shift={"body_mass": 1.0})
    both = first.merged(Variation(scale={"body_mass": 0.9}, shift={"body_mass": 0.5}))
    expected = PATIENT.body_mass * 1.1 * 0.9 + 1.5
    assert varied(PATIENT, both).body_mass == pytest.approx(expected)


def test_lengths_left_to_proportions_are_filled_in_and_scaled() -> None:
    bare = PATIENT.model_copy(
        update={"segment_lengths": PATIENT.segment_lengths.model_copy(update={"thigh": None})}
    )
    longer = varied(bare, Variation(scale={"segment_lengths.thigh": 1.1}))
    assert longer.length("thigh", "left") == pytest.approx(1.1 * bare.length("thigh", "left"))
    (told,) = (note for note in bare.notes if note.startswith("segment length thigh: "))
    assert told in longer.notes, "it still comes from proportions"
    again = varied(longer, Variation(scale={"body_mass": 1.1}))
    assert told in again.notes
    assert again.notes[-2:] == (
        longer.notes[-1],
        "differs from the patient's file: body_mass x 1.1",
    )


def test_the_model_follows_and_the_notes_say_so() -> None:
    heavy = varied(PATIENT, Variation(scale={"body_mass": 1.2}))
    assert build_walker(heavy).total_mass == pytest.approx(1.2 * build_walker(PATIENT).total_mass)
    assert "body_mass x 1.2" in heavy.notes[-1]
    assert heavy.source == PATIENT.source


@pytest.mark.parametrize(
    ("variation", "error", "words"),
    [
        ({"scale": {"strenghts": 0.5}}, ConfigError, "did you mean 'strengths'?"),
        ({"scale": {"body_mass.x": 0.5}}, ConfigError, "which is one number"),
        ({"scale": {"sex": 0.5}}, ConfigError, "has no 'sex'"),
        ({"shift": {"orthosis.neutral_angle": 1.0}}, PatientError, "neutral_angle"),
        ({"scale": {"strengths": 1000.0}}, ConfigError, "variation.scale.strengths"),
    ],
)
def test_what_does_not_fit_is_refused(
    variation: dict[str, dict[str, float]], error: type[Exception], words: str
) -> None:
    with pytest.raises(error, match=words.replace("?", r"\?")):
        _ = load_case("mapd-orthosis").with_values({"variation": variation}).patient


def test_patients_of_one_structure_share_their_blocks() -> None:
    base = load_case("mapd-orthosis")
    heavy = base.with_values({"variation.scale": {"body_mass": 1.2, "strengths": 0.8}})
    first, second = GaitSolver(base), GaitSolver(heavy)
    assert first.blocks is second.blocks
    own = CollocationBlocks(second.gait.build(), base.config.mesh.degree)
    meshes = uniform([1] * 8)
    shared, fresh = (CollocationProgram(b, second.prediction, meshes) for b in (first.blocks, own))
    x = np.random.default_rng(0).normal(0.1, 0.1, shared.layout.size)
    values = [np.asarray(p.functions["nlp"](x, p.parameters)[1]) for p in (shared, fresh)]
    assert np.allclose(*values, rtol=1e-12, atol=1e-12)
