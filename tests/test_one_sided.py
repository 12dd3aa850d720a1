"""A child with an orthosis on one leg: the other one has nothing of it, anywhere."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from conftest import sketch
from helpers import walker_of
from pathwalker_cli.animation.drawing import drawing
from pathwalker_cli.animation.frames import gait_frames
from pathwalker_cli.animation.look import who
from pathwalker_cli.animation.viewer import walker_geometry
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, smoke_version, with_values
from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.errors import ConfigError, InputError, PatientError
from pathwalker_cli.explore.dials import dials_of
from pathwalker_cli.gait.bounds import gait_bounds, held
from pathwalker_cli.gait.resolve import Resolver
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.gait.solve import GaitSolver, solve_study
from pathwalker_cli.model.walker import Walker, build_walker
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.report.gait_page import gait_page
from pathwalker_cli.report.page import page_html
from pathwalker_cli.report.runs import read_runs
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.stride.figures.save import make_figure
from pathwalker_cli.stride.measures import metrics_of
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.studies.landscape import LandscapeStudy, on_worn_side
from pathwalker_cli.studies.measures import COMPARED
from pathwalker_cli.studies.sensitivity import default_places
from pathwalker_cli.studies.verdict import LOADED, STIFFER, verdict_of_metrics
from pathwalker_cli.studies.verdict.judge import _Judge, _stops, verdict_of

SHIPPED = "sreenivasa2017-patient"
LEFT = {"dorsiflexion_stop": {"left": -0.12}, "plantarflexion_stop": 0.09, "sides": ["left"]}


def content_of(**orthosis: Any) -> dict[str, Any]:
    """Return the shipped patient's file with other keys of the orthosis."""
    source = load_patient(SHIPPED).source
    assert source is not None
    content: dict[str, Any] = yaml.safe_load(source.read_text(encoding="utf-8"))
    content["orthosis"] |= orthosis
    return content


def patient_of(folder: Path, **orthosis: Any) -> Patient:
    """Return it read from a file."""
    file = folder / "patient.yaml"
    file.write_text(yaml.safe_dump(content_of(**orthosis)), encoding="utf-8")
    return load_patient(file)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a child whose left leg alone wears an orthosis."""
    folder = tmp_path_factory.mktemp("left")
    patient_of(folder, **LEFT)
    return folder


@pytest.fixture(scope="module")
def walker(folder: Path) -> Walker:
    return build_walker(load_patient(folder), "orthosis")


@pytest.fixture(scope="module")
def solution(folder: Path) -> GaitSolution:
    """Return its walk on a coarse mesh."""
    config = smoke_version(load_config("mapd-orthosis"))
    solution = solve_study(with_values(config, {"patient": str(folder)}))
    assert solution.converged
    return solution


@pytest.mark.parametrize(
    ("orthosis", "sentence"),
    [
        ({"sides": ["left"]}, r"dorsiflexion_stop\.right, but is worn on the left only"),
        ({**LEFT, "sides": []}, "sides"),
        ({**LEFT, "sides": ["left", "left"]}, "names a side twice"),
        ({"neutral_angle": {"right": 0.0}}, "neutral_angle without left"),
        ({**LEFT, "mass": {"shank": {"right": 0.3}, "foot": 0.6}}, r"mass\.shank\.right"),
        ({"stiffness_range": {"dorsiflexion": {"right": [5, 92], "left": [92, 5]},
                              "plantarflexion": [5, 92], "source": "x"}}, "upside down"),
        ({"stiffness_guess": {"dorsiflexion": {"right": 55, "left": 99}, "plantarflexion": 5}},
         "99 N m/rad outside its range"),
    ],
)  # fmt: skip
def test_what_contradicts_the_sides_is_refused(
    tmp_path: Path, orthosis: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(PatientError, match=sentence):
        patient_of(tmp_path, **orthosis)


def test_every_number_may_differ_by_side(tmp_path: Path) -> None:
    shared = walker_of("orthosis")
    names = [n for n in shared.numbers if n.address.startswith("orthosis.") and n.side == "left"]
    assert len(names) == 9 + 2 + 1
    content = load_patient(SHIPPED).model_dump(mode="json", exclude_none=True)
    heights = {side: shared.patient.cuff_height(side) for side in ("right", "left")}
    content["orthosis"]["cuff_height"] = heights
    for number in names:
        *parents, last = number.place.split(".")
        holder = content
        for part in parents:
            holder = holder[part]
        holder[last]["left"] *= 1.05
    (tmp_path / "patient.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    walker = build_walker(load_patient(tmp_path), "orthosis")
    for address, value in shared.values.items():
        factor = 1.05 if address in {number.address for number in names} else 1.0
        assert walker.values[address] == pytest.approx(factor * value), address
    mass = sum(0.05 * shared.values[f"orthosis.mass.{part}.left"] for part in ("shank", "foot"))
    assert walker.total_mass - shared.total_mass == pytest.approx(mass, rel=1e-5)


def test_the_other_leg_is_bare(walker: Walker) -> None:
    both, bare = walker_of("orthosis"), walker_of("barefoot")
    numbers = [n for n in walker.numbers if n.address.startswith("orthosis.")]
    assert {number.side for number in numbers} == {"left"}
    assert [unknown.name for unknown in walker.unknowns] == [
        "dorsiflexion_stiffness_left", "plantarflexion_stiffness_left",
    ]  # fmt: skip
    for joint in ("knee", "ankle"):
        for side, like in (("r", bare), ("l", both)):
            mine, other = (
                w.model.inertias[w.model.getJointId(f"{joint}_{side}")] for w in (walker, like)
            )
            assert mine.isApprox(other, 1e-9), (joint, side)
    zero = np.zeros(len(COORDINATES))
    points = [w.foot_points(zero) for w in (walker, bare, both)]
    assert points[0][:2] == pytest.approx(points[1][:2])
    assert points[0][2:] == pytest.approx(points[2][2:])
    q = np.where([name.startswith("ankle") for name in COORDINATES], -0.1, 0.0)
    torques = walker.orthosis_torques(q, (40.0, 50.0), (10.0, 20.0))
    whole = both.orthosis_torques(q, (40.0, 50.0), (10.0, 20.0))
    assert torques.tolist() == [0.0, pytest.approx(whole[1])]
    assert whole[0] > 1.0
    assert np.isnan(walker.stiffness).tolist() == [True, False, True, False]


def test_its_mirror_image_wears_the_right_one(walker: Walker, tmp_path: Path) -> None:
    right = build_walker(
        patient_of(tmp_path, **LEFT | {"sides": ["right"], "dorsiflexion_stop": -0.12}), "orthosis"
    )
    assert vars(right.orthosis["right"]) == vars(walker.orthosis["left"])
    assert right.total_mass == pytest.approx(walker.total_mass)


def test_the_shoe_of_the_other_foot_may_be_given(tmp_path: Path) -> None:
    content = content_of(**LEFT)
    sole = content["contact_points"]["orthosis"]
    content["contact_points"]["orthosis"] = {"right": {"heel": [-0.05, -0.08], "toe": [0.1, -0.07]},
                                             "left": sole}  # fmt: skip
    (tmp_path / "patient.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    assert load_patient(tmp_path).contacts("orthosis")["right"].heel == (-0.05, -0.08)
    del content["contact_points"]["orthosis"]["left"]
    (tmp_path / "patient.yaml").write_text(yaml.safe_dump(content), encoding="utf-8")
    with pytest.raises(PatientError, match=r"no contact_points\.orthosis\.left"):
        load_patient(tmp_path)


@pytest.mark.parametrize(
    ("values", "sentence"),
    [
        ({"bounds.stiffness": {"dorsiflexion_stiffness_right": (20.0, 40.0)}},
         r"^bounds\.stiffness\.dorsiflexion_stiffness_right: names a spring of the right side"),
        ({"start.stiffness": {"plantarflexion_stiffness_right": 9.0}}, r"^start\.stiffness"),
        ({"free": {"orthosis.neutral_angle.right": (-0.1, 0.0)}},
         r"'orthosis\.neutral_angle\.right', but the right side has none"),
        ({"variation.shift": {"orthosis.free_play.right": 0.01}}, "is not given for this patient"),
        ({"numbers": {"orthosis.preload_torque.right": 1.0}}, "worn on the left only"),
        ({"half_cycle": True}, "frees one side alone"),
    ],
)  # fmt: skip
def test_a_config_that_names_the_other_side_is_refused(
    folder: Path, values: dict[str, Any], sentence: str
) -> None:
    config = with_values(load_config("mapd-orthosis"), {"patient": str(folder), **values})
    with pytest.raises(InputError, match=sentence):
        GaitSolver(Case.of(config))


def test_an_address_without_side_is_the_only_one_there_is(folder: Path) -> None:
    free = {"orthosis.neutral_angle": (-0.03, 0.01), "orthosis.mass.foot": (0.3, 0.9)}
    config = with_values(load_config("mapd-orthosis"), {"patient": str(folder), "free": free})
    walker = Case.of(config).walker()
    ranges = gait_bounds(walker, config.bounds, config.free).ranges
    assert {unknown.name: ranges[unknown.name] for unknown in walker.unknowns[2:]} == {
        "neutral_angle_left": (-0.03, 0.01), "foot_mass_left": (0.3, 0.9),
    }  # fmt: skip
    assert held(config, {walker.unknowns[2]: 0.0})["free"]["orthosis.neutral_angle"] == (0.0, 0.0)


def test_studies_ask_about_the_side_that_is_worn(walker: Walker) -> None:
    both = LandscapeStudy(base="")
    assert on_worn_side(both, walker).side == "left"
    assert on_worn_side(both, walker_of("orthosis")).side == "both"
    with pytest.raises(ConfigError, match="right, a side that wears no orthosis"):
        on_worn_side(LandscapeStudy(base="", side="right"), walker)
    places = default_places(walker.patient, True)
    assert "orthosis.dorsiflexion_stop.left" in places
    assert "orthosis.dorsiflexion_stop.right" not in places


def test_a_run_speaks_of_the_side_that_is_worn(solution: GaitSolution, tmp_path: Path) -> None:
    metrics = metrics_of(stride_of(solution.series))
    for name in ("dorsiflexion_stiffness", "peak_shin_force", "peak_cuff_pressure"):
        assert metrics[f"{name}_right"] is None
        assert metrics[f"{name}_left"] > 0.0
    assert not solution.series.orthosis_torque[:, 0].any()
    verdict = verdict_of(solution)
    assert verdict is not None
    assert {s.name.rpartition("_")[2] for s in verdict.springs} == {"left"}
    assert {stop.side for stop in verdict.stops} == {"left"}
    assert verdict.snapped is None or all(n.endswith("left") for n in verdict.snapped.names)
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        patch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
        write_run(tmp_path / "run", solution, more={"verdict": verdict.as_dict()})
    (run,) = runs = read_runs([tmp_path / "run"])
    assert run.verdict == verdict_of_metrics(run.run.metrics)
    assert all(name.endswith("left") for name in run.springs)
    page = gait_page(runs, ())
    assert "with an orthosis on the left" in page.title
    (fitting,) = [s for s in page.sections if s.title.startswith("Springs to fit")]
    assert [row.cells[0] for row in fitting.tables[0].rows] == ["K_D left", "K_P left"]
    html = page_html(page)
    assert "K_D right" not in html
    assert "nan" not in html.lower().replace("dominan", "")


def test_a_stiffer_stop_changes_what_solves_say(solution: GaitSolution) -> None:
    resolver = Resolver(solution.case, solution.last_motion, solution.nlp.multipliers, 1e-8)
    judge = _Judge(resolver)
    found = {stop.stop: stop for stop in map(judge.stop, _stops(judge.optimum.series))}
    stop = found["dorsiflexion"]
    assert stop.carried > LOADED
    place, step = "orthosis.stop_stiffness.dorsiflexion.left", 2e-3
    ends = [
        resolver.resolve(solution.case.with_values({"variation.scale": {place: 1.0 + sign * step}}))
        for sign in (-1, 1)
    ]
    assert all(end.converged for end in ends)
    slope = (ends[1].cost - ends[0].cost) / (2.0 * step * abs(judge.optimum.cost))
    assert stop.stiffer["cost"] == pytest.approx(STIFFER * slope, rel=0.02)
    assert stop.stiffer.keys() == {
        "cost", *(unknown.name for unknown in judge.around.free), *COMPARED[1:]
    }  # fmt: skip
    stiffer = judge.stiffer_stops(tuple(found.values()))
    assert stiffer is not None
    assert stiffer.changes.keys() == stop.stiffer.keys()
    assert judge.stiffer_stops(()) is None


def test_figures_draw_the_side_that_is_worn(solution: GaitSolution) -> None:
    series = solution.series
    assert len(make_figure("orthosis_curves", series).axes) == 1
    frames = gait_frames(series, "run", "mapd-orthosis", 8)
    shapes = [shape for shape in drawing(frames).shapes if shape.kind in ("shell", "spring")]
    assert {shape.side for shape in shapes} == {"left"}
    assert "with an orthosis on the left" in who(frames)
    names = [part.name for part in walker_geometry(series.walker).geometryObjects]
    assert [name for name in names if name.startswith("shell")] == ["shell_l"]


def test_dials_are_those_of_the_side_that_is_worn(solution: GaitSolution) -> None:
    resolver = Resolver(solution.case, solution.last_motion, solution.nlp.multipliers)
    dials = [d for d in dials_of(resolver.optimum) if d.key.startswith("orthosis.")]
    assert {dial.side for dial in dials} == {"left"}
    assert {"orthosis.mass.foot.left", "orthosis.neutral_angle.left"} <= {d.key for d in dials}
