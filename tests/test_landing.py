"""The pattern of contact that recordings show: made-up strides with known foot strikes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from pathwalker_cli.case import Case, config_text, load_case
from pathwalker_cli.cli import cli
from pathwalker_cli.config.schema import plain_use
from pathwalker_cli.conventions import COORDINATES, coordinate_unit
from pathwalker_cli.io.c3d_events import Event
from pathwalker_cli.io.recordings import CompactRecording, write_recording
from pathwalker_cli.model.landing import TOE_FIRST
from pathwalker_cli.studies.batch.cases import load_cases
from pathwalker_cli.trajectory import Trajectory

FRAMES = 60


def child(folder: Path, strike: tuple[float, float], later: tuple[float, float]) -> str:
    """Return a copy of the shipped child in a folder, with one made-up barefoot trial.

    Args:
        folder: Where.
        strike: Pitch of the right and the left sole when they strike the ground [deg], toe up.
        later: The same from a tenth of a second after it on.
    """
    case = load_case("mapd-barefoot")
    walker, source = case.walker(), case.unvaried.source
    assert source is not None
    text = Path(source).read_text(encoding="utf-8").replace(case.patient.id, folder.name)
    folder.mkdir(exist_ok=True)
    (folder / "patient.yaml").write_text(text, encoding="utf-8")
    values = np.zeros((FRAMES, len(COORDINATES)))
    soles = walker.foot_points(values[0])
    for i, ankle in enumerate(("ankle_r", "ankle_l")):
        forward, up = soles[2 * i + 1] - soles[2 * i]
        level = np.arctan2(up, forward)  # the ankle turns the toe down
        pitch = np.where(np.arange(FRAMES) < 20, strike[i], later[i])
        values[:, COORDINATES.index(ankle)] = level - np.deg2rad(pitch)
    motion = Trajectory(
        np.arange(FRAMES) / 100.0, COORDINATES, values, tuple(map(coordinate_unit, COORDINATES))
    )
    events = [Event(side, kind, frame) for side in ("right", "left")
              for kind, frame in (("foot_strike", 10), ("toe_off", 50))]  # fmt: skip
    recording = CompactRecording("made", motion, tuple(events), None)
    write_recording(folder / "recordings" / "barefoot", recording)
    return str(folder / "patient.yaml")


def recorded(patient: str, changes: tuple[str, ...] = ()) -> Case:
    """Return a case whose feet land as recorded."""
    return load_case(
        "mapd-barefoot", changes=(f"patient={patient}", "model.contact=recorded", *changes)
    )


@pytest.mark.parametrize(
    ("strike", "later", "uses"),
    [
        ((15.0, 3.0), (0.0, -5.0), ("heel_toe", "flat")),
        ((-12.0, -12.0), (0.0, -12.0), (TOE_FIRST, "toe")),
        ((9.0, 7.0), (0.0, 0.0), ("heel_toe", "flat")),
        ((-1.0, -2.0), (0.0, 0.0), ("flat", TOE_FIRST)),
    ],
)
def test_feet_land_as_recorded(
    strike: tuple[float, float], later: tuple[float, float], uses: tuple[str, str], tmp_path: Path
) -> None:
    case = recorded(child(tmp_path, strike, later))
    names = [use.name or use for use in case.config.model.uses]
    assert names == list(uses)
    assert case.walker().pattern == case.config.model.pattern
    # a run keeps the postures: it is read where there are no recordings
    assert "recorded" not in config_text(case.config).partition("contact")[2][:80]
    assert case.with_values({"cost.activation_power": 3}).config.model == case.config.model


def test_one_side_may_be_given_and_the_mesh_suits_what_is_found(tmp_path: Path) -> None:
    patient = child(tmp_path, (15.0, -12.0), (0.0, -12.0))
    case = load_case("mapd-barefoot", changes=(
        f"patient={patient}", "model.contact={right: toe, left: recorded}",
        "mesh.intervals=[4, 4, 4, 4]",
    ))  # fmt: skip
    assert [plain_use(use) for use in case.config.model.uses] == ["toe", "toe"]
    result = CliRunner().invoke(cli, [
        "check", "mapd-barefoot", "--set", f"patient={patient}", "--set", "model.contact=recorded",
        "--set", "mesh.intervals=[4, 4, 4, 4]",
    ])  # fmt: skip
    assert result.exit_code == 2
    assert "has 4 entries in mesh.intervals" in result.output


def test_a_batch_takes_the_pattern_of_each_child(tmp_path: Path) -> None:
    child(tmp_path / "anna", (15.0, 15.0), (0.0, 0.0))
    child(tmp_path / "ben", (-12.0, -12.0), (-12.0, -12.0))
    study = "patients: [anna, ben]\nproblems: [mapd-barefoot]\nset: {model.contact: recorded}\n"
    (tmp_path / "both.yaml").write_text(study, encoding="utf-8")
    cases = load_cases(tmp_path / "both.yaml").cases
    uses = [[use.name for use in case.study.config.model.uses] for case in cases]
    assert uses == [["heel_toe"] * 2, ["toe"] * 2]


@pytest.mark.parametrize("config", ["mapd-healthy", "predict-orthosis"])
def test_without_recordings_or_with_soles_it_is_refused(config: str) -> None:
    changes = ["--set", "model.contact=recorded", "--set", "half_cycle=false"]
    result = CliRunner().invoke(cli, ["check", config, *changes])
    assert result.exit_code == 2
    assert "Traceback" not in result.output
    said = {"mapd-healthy": "nothing tells how it lands", "predict-orthosis": "roll over whatever"}
    assert said[config] in " ".join(result.output.split())
