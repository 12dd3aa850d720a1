"""The command `report`: content, self-contained and valid HTML, escaping, refusals, cohorts."""

from __future__ import annotations

import json
import re
import shutil
import xml.etree.ElementTree as ET
from collections import Counter
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result

from conftest import MadeSolution, sketch
from pathwalker_cli.cli import cli
from pathwalker_cli.config import load_config
from pathwalker_cli.config.values import changed_values, differing_values
from pathwalker_cli.conventions import SIDES, STIFFNESSES
from pathwalker_cli.evaluation.recorded import Spread
from pathwalker_cli.inverse.study import load_inverse_dynamics
from pathwalker_cli.patient import load_patient
from pathwalker_cli.report import figures
from pathwalker_cli.report.answer import answer
from pathwalker_cli.report.changes import Outcome, outcomes
from pathwalker_cli.report.content import Drawing, Fact, Page, Row, Section, Table
from pathwalker_cli.report.folders import Study
from pathwalker_cli.report.gait_page import gait_page
from pathwalker_cli.report.page import page_html, page_of
from pathwalker_cli.report.pdf import page_pdf
from pathwalker_cli.report.runs import read_runs
from pathwalker_cli.report.springs import recommended, spring_section, verdict_words
from pathwalker_cli.report.summaries import UncertaintySummary
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.stride.figures.inline import inline_svg
from pathwalker_cli.stride.figures.style import new_figure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.landscape.result import ROOT, Landscape, Point
from pathwalker_cli.studies.landscape.text import write_tables as write_landscape
from pathwalker_cli.studies.neighbours import Solved
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff, front_of, judged
from pathwalker_cli.studies.tradeoff.result import write_tables as write_tradeoff
from pathwalker_cli.studies.uncertainty.draws import Distribution, Draws, Input
from pathwalker_cli.studies.uncertainty.files import write_tables as write_uncertainty
from pathwalker_cli.studies.uncertainty.result import Uncertainty
from pathwalker_cli.studies.verdict import StifferStops, StopVerdict, verdict_of_metrics
from report_runs import HOSTILE, made_verdict, write_made_run

pytestmark = pytest.mark.usefixtures("sketched")

VOID = frozenset({"meta", "link", "br", "hr", "img", "input", "col"})
CHILD = Path(__file__).parent / "data" / "child-10y" / "patient.yaml"


class Balanced(HTMLParser):
    """Checks that every element is closed where it should be, and counts ids."""

    def __init__(self) -> None:
        super().__init__(convert_charrefs=True)
        self.open: list[str] = []
        self.ids: Counter[str] = Counter()
        self.tags: Counter[str] = Counter()
        self.text = ""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._note(tag, attrs)
        if tag not in VOID:
            self.open.append(tag)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self._note(tag, attrs)

    def handle_endtag(self, tag: str) -> None:
        assert self.open, f"</{tag}> closes nothing"
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if "style" not in self.open:
            self.text += data

    def _note(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(names) == len(set(names)), f"<{tag}> has an attribute twice"
        assert not any(name.startswith("on") for name in names), f"<{tag}> runs something"
        self.tags[tag] += 1
        self.ids.update(value or "" for name, value in attrs if name == "id")


def checked(text: str) -> Balanced:
    """Return what a page holds after checking that it is valid and needs nothing else."""
    parser = Balanced()
    parser.feed(text)
    parser.close()
    assert parser.open == []
    assert [name for name, count in parser.ids.items() if count > 1] == []
    assert text.startswith("<!DOCTYPE html>")
    assert not parser.tags.keys() & {"script", "link", "img", "iframe", "object"}
    assert set(re.findall(r"https?://[^\"'\s<>)]+", text)) <= {"http://www.w3.org/2000/svg"}
    assert "@import" not in text
    for target in re.findall(r"url\(#([^)]+)\)|href=\"#([^\"]+)\"", text):
        assert "".join(target) in parser.ids, target
    return parser


def report(*words: object) -> Result:
    """Run the command."""
    return CliRunner().invoke(cli, ["report", *map(str, words)])


def refusal(*words: object) -> str:
    """Return the one sentence with which the command refuses."""
    result = report(*words)
    assert result.exit_code == 2, result.output
    assert result.output.count("\n") == 1
    assert "Traceback" not in result.output
    return result.output


@pytest.fixture(scope="module")
def written(made_solution: MadeSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a barefoot run and of one with orthoses."""
    folder = tmp_path_factory.mktemp("report")
    for problem in ("mapd-barefoot", "mapd-orthosis"):
        write_made_run(folder / problem, made_solution, problem)
    return folder


@pytest.fixture
def runs(written: Path, tmp_path: Path) -> Path:
    """Return a folder with copies of both runs that may be changed."""
    return Path(shutil.copytree(written, tmp_path / "made"))


@pytest.fixture
def no_curves(monkeypatch: pytest.MonkeyPatch) -> None:
    """Leave the curves out, which take most of the time."""
    monkeypatch.setattr(
        "pathwalker_cli.report.gait_page.curve_section", lambda runs: Section("Curves")
    )


def section(page: Page, title: str) -> Section:
    """Return the section whose title begins so."""
    return next(each for each in page.sections if each.title.startswith(title))


def svg_of(part: Section) -> str:
    """Return the one figure of a section as it stands on a page."""
    (drawing,) = part.drawings
    return inline_svg(drawing.figure, drawing.name, drawing.title)


def words_of(page: Page) -> str:
    """Return all words of a page."""
    return checked(page_html(page)).text


# The page of one patient


@pytest.mark.drawn
def test_a_page_is_self_contained_and_valid(runs: Path, tmp_path: Path) -> None:
    out = tmp_path / "page.html"
    result = report(runs / "mapd-orthosis", runs / "mapd-barefoot", "-o", out)
    assert result.exit_code == 0, result.output
    text = out.read_text(encoding="utf-8")
    assert out.stat().st_size < 2_000_000
    page = checked(text)
    for words in (
        "sreenivasa2017-patient",
        "24.7 kg",
        "1.25 m",
        "not a medical device",
        "set by its limit",
        "at the limit of what can be bought",
    ):
        assert words in page.text.replace("\N{NO-BREAK SPACE}", " "), words
    drawings = re.findall(r"<svg.*?</svg>", text, re.DOTALL)
    assert len(drawings) == 17, (
        "walk, five angles, two forces, three moments, three powers, two ankles, legend"
    )
    for drawing in drawings:
        root = ET.fromstring(drawing)
        assert root.get("aria-label")
        assert root.get("viewBox")
        assert root.get("role") == "img"
        assert root.find("{http://www.w3.org/2000/svg}title").text == root.get("aria-label")  # type: ignore[union-attr]
        assert "<text" in drawing, "text stays text"
        assert "sans-serif" in drawing


@pytest.mark.drawn
def test_a_pair_of_runs_is_two_pages_of_pdf(runs: Path, tmp_path: Path) -> None:
    out, page = tmp_path / "report.pdf", tmp_path / "report.html"
    result = report(runs / "mapd-orthosis", runs / "mapd-barefoot", "-o", page, "--pdf", out)
    assert result.exit_code == 0, result.output
    content = out.read_bytes()
    assert content.startswith(b"%PDF-")
    assert content.count(b"/Type /Page\n") == 2
    assert out.stat().st_size < 1_000_000
    assert page.is_file()


@pytest.mark.drawn
def test_stops_that_carry_much_leave_it_two_pages(
    made_solution: MadeSolution, runs: Path, tmp_path: Path
) -> None:
    moved = {"cost": -0.11, **dict.fromkeys(("step_length_left", "step_length_right"), 0.017)}
    moved |= dict.fromkeys(("min_stance_knee_flexion_left", STIFFNESSES[0]), -4.04)
    stops = tuple(
        StopVerdict(side, kind, 0.13, 0.05, 0.4, 30.0, 0.6, 200.0, moved)
        for side in SIDES
        for kind in ("dorsiflexion", "plantarflexion")
    )
    verdict = made_verdict(stops=stops, stiffer_stops=StifferStops(2.0, "converged", moved))
    write_run(tmp_path / "worn", made_solution(), more={"verdict": verdict.as_dict()})
    result = report(tmp_path / "worn", runs / "mapd-barefoot", "--pdf", tmp_path / "report.pdf")
    assert result.exit_code == 0, result.output
    assert (tmp_path / "report.pdf").read_bytes().count(b"/Type /Page\n") == 2


def test_a_pdf_holds_whatever_stands_in_files() -> None:
    names = f"{HOSTILE} \u4e2d **x** \x07 {'y' * 300}"
    table = Table((names, "b"), (Row((names, names)), Row((names,), "heading")), names, (names,))
    part = Section(names, (names,), (Fact(names, names),), (table,), (names,))
    page = Page(names, (Fact(names, names),), (names,), (names,), (part,))
    assert page_pdf(page).startswith(b"%PDF-")


@pytest.mark.usefixtures("no_curves")
def test_numbers_of_the_page_are_those_of_the_runs(runs: Path) -> None:
    found = read_runs([runs / "mapd-orthosis", runs / "mapd-barefoot"])
    assert [run.label for run in found] == ["barefoot", "orthosis"]
    page = gait_page(found)
    table = section(page, "Times and forces").tables[0]
    assert table.head == (
        "", "unit", "barefoot", "recorded range", "is", "orthosis", "recorded range", "is",
    )  # fmt: skip
    rows = {row.cells[0]: row.cells for row in table.rows}
    metrics = [run.run.metrics for run in found]
    shares = [metrics[0][f"stance_share_{side}"] for side in ("right", "left")]
    assert rows["stance share"][2] == ", ".join(f"{100 * share:.1f}" for share in shares)
    assert rows["double support share"][2] == f"{100 * (sum(shares) - 1):.1f}"
    assert rows["cadence"][2::3] == tuple(f"{each['cadence']:.1f}" for each in metrics)
    peaks = [found[1].evaluation.find(f"peak_vertical_force_{side}") for side in ("right", "left")]
    assert rows["peak vertical force"][5] == ", ".join(p.measure.text(p.value) for p in peaks)
    assert rows["peak vertical force"][7] == ", ".join(p.position or "" for p in peaks)
    changes = section(page, "What changes").tables[0]
    assert changes.head[:5] == ("", "unit", "barefoot", "orthosis", "against barefoot")
    speed = {row.cells[0]: row.cells for row in changes.rows}["walking speed"]
    assert speed[2].rstrip("*") == f"{metrics[0]['walking_speed']:.2f}"
    assert speed[3].rstrip("*") == f"{metrics[1]['walking_speed']:.2f}"


@pytest.mark.parametrize(
    ("more_is_better", "change", "judged"),
    [(True, 0.3, "better"), (True, -0.3, "worse"), (True, 0.09, "same"), (True, -0.1, "same"),
     (False, 0.3, "worse"), (False, -0.3, "better")],
)  # fmt: skip
def test_a_change_counts_beyond_the_childs_own_variation(
    more_is_better: bool, change: float, judged: str
) -> None:
    own = {"barefoot": Spread(1.0, 0.8, 1.2, 9, 0.1)}
    values = (1.0, 1.0 + change)
    speed = Outcome(measures_in("report")[0], more_is_better, values, own, (False, False))
    assert speed.judged(1, 0) == judged
    unknown = replace(speed, recorded={"barefoot": Spread(1.0, 0.8, 1.2, 2, 0.1)})
    assert unknown.varies_by is None, "two strides do not tell how much a child varies"
    assert replace(unknown, values=(1.0, 1.04)).judged(1, 0) == "same"
    assert replace(unknown, values=(1.0, 1.06)).judged(1, 0) != "same"


@pytest.mark.usefixtures("no_curves")
def test_the_answer_is_three_plain_sentences(runs: Path) -> None:
    found = read_runs([runs / "mapd-barefoot", runs / "mapd-orthosis"])
    walk, springs, sure = gait_page(found).answer
    assert walk.startswith("With orthoses, the child ")
    assert walk.endswith("than barefoot.")
    assert "(K_D) 91.7 N m/rad right and left; for the spring against the foot" in springs
    assert springs.endswith("any of the drawer: choose by fitting.")
    assert "calculated, not measured" in sure
    alone = gait_page(found[:1]).answer
    assert alone[0].startswith("Barefoot, the child is made to walk at 0.60 m/s in steps of")
    assert alone[1] == "No orthosis is worn, so nothing is said about springs."


@pytest.mark.usefixtures("no_curves")
def test_what_a_bound_sets_is_not_called_predicted(runs: Path) -> None:
    for problem in ("mapd-barefoot", "mapd-orthosis"):
        path = runs / problem / "metrics.json"
        bounds = [
            {"name": "walking_speed", "side": "lower", "value": 0.6, "places": []},
            {"name": "knee_l", "side": "lower", "value": 0.3, "places": ["left_flat"]},
        ]
        path.write_text(json.dumps(json.loads(path.read_text()) | {"active": bounds}))
    page = page_of([runs / "mapd-barefoot", runs / "mapd-orthosis"])
    rows = {row.cells[0]: row.cells for row in section(page, "What changes").tables[0].rows}
    assert rows["walking speed"][2].endswith("*")
    assert rows["crouch: least knee flexion in stance, left"][3].endswith("*")
    assert not rows["crouch: least knee flexion in stance, right"][3].endswith("*")
    assert "is made to walk at the same" in page.answer[0]
    hinges = " ".join(section(page, "What the answer hangs on").points)
    assert "not predicted, hold the walk: walking speed, left knee" in hinges


@pytest.mark.usefixtures("no_curves")
def test_springs_are_real_ones_in_both_units_with_range_and_verdict(runs: Path) -> None:
    (run,) = read_runs([runs / "mapd-orthosis"])
    found = spring_section(run)
    cells = {row.cells[0]: row.cells for row in found.tables[0].rows}
    assert cells["K_D left"][1:4] == ("stiff: 91.7 (1.60)", "60.0 to 92.0 (1.05 to 1.61)", "60.0")
    assert cells["K_D left"][4].endswith("at the limit of what can be bought (stiffest)")
    assert cells["K_P right"][1] == "any of the drawer: choose by fitting"
    assert cells["K_P right"][4] == "not determined"
    facts = {fact.label: fact.text for fact in found.facts}
    assert "K_P left softest: cost +0.1 %, 0.636 m/s" in facts["Real springs"]
    assert "exceeded by 2.9 deg" in facts["Hard stops"]
    assert "K_D left: it sits at the upper limit" in facts["Limits and doubts"]
    assert recommended(run)["plantarflexion_stiffness_left"] == 5.0


@pytest.mark.usefixtures("no_curves")
def test_springs_of_learnt_numbers_come_with_their_spread(runs: Path) -> None:
    (found,) = read_runs([runs / "mapd-orthosis"])
    config = found.run.config.model_copy(update={"learnt": load_config("predict-orthosis").learnt})
    case = replace(found.run.case, config=config)
    run = replace(found, run=replace(found.run, case=case))
    alone = " ".join(gait_page([run]).answer)
    assert (
        "how far they spread was not examined: pathwalker uncertainty uncertainty-learnt" in alone
    )
    metrics = run.run.metrics
    about = {key: metrics[key] for key in ("problem", "patient")}
    spread = {"quantiles": {"0.05": 5.2, "0.5": 30.0, "0.95": 92.0}, "share_at_lower_limit": 0.0,
              "share_at_upper_limit": 0.1, "strongest_input": None,
              "rank_correlation": None}  # fmt: skip
    content = about | {
        "draws": 21, "failed": ["draw-00003"], "stiffness_ranges": {},
        "base": {key: metrics[key] for key in ("cost", "walking_speed")},
        "spreads": dict.fromkeys(STIFFNESSES, spread), "advice": ["K_D right: not determined"],
        "measure_first": {"place": "tissue.damping", "share": 0.3, "chance": False},
    }  # fmt: skip
    study = Study(runs, "uncertainty", content, UncertaintySummary.model_validate(content))
    said = " ".join(answer([run], outcomes([run]), [study]))
    assert "Over 20 sets of numbers that explain the child's strides about as well, 90 %" in said
    assert "90 % give K_D right 5 to 92, K_D left 5 to 92, " in said
    assert "The measurement that would narrow K_D most: tissue, damping." in said
    few = Study(runs, "uncertainty", content, UncertaintySummary(**content | {"draws": 9}))
    assert "nearly all give K_D right 5 to 92, " in " ".join(answer([run], outcomes([run]), [few]))
    assert "not examined" not in said
    elsewhere = replace(study, content=content | {"base": {"cost": 9.0, "walking_speed": 1.0}})
    assert answer([run], outcomes([run]), [elsewhere]) == gait_page([run]).answer


def test_without_a_verdict_the_page_says_so(made_solution: MadeSolution, tmp_path: Path) -> None:
    folder = write_made_run(tmp_path / "run", made_solution, "mapd-ws-orthosis")
    (run,) = read_runs([folder])
    found = spring_section(run)
    assert "were not judged" in found.lines[0]
    assert {row.cells[4] for row in found.tables[0].rows} == {"not judged"}
    assert found.tables[0].rows[0].cells[1] == "50.0 (0.87)"
    assert gait_page([run]).answer[1].startswith("How sure the springs are was not examined")


@pytest.mark.usefixtures("no_curves")
@pytest.mark.parametrize("judged", [True, False])
def test_prescribed_springs_are_said_to_be_prescribed(
    made_solution: MadeSolution, tmp_path: Path, judged: bool
) -> None:
    folder = write_made_run(tmp_path / "run", made_solution, "mapd-orthosis")
    metrics = json.loads((folder / "metrics.json").read_text())
    metrics["stiffness_ranges"] = {name: [50.0, 50.0] for name in STIFFNESSES}
    metrics["verdict"] = None
    if judged:
        springs = tuple(
            replace(spring, range=(50.0, 50.0), limit="upper") for spring in made_verdict().springs
        )
        metrics["verdict"] = made_verdict(springs=springs, snapped=None).as_dict()
    (folder / "metrics.json").write_text(json.dumps(metrics))
    (run,) = read_runs([folder])
    table = spring_section(run).tables[0]
    assert {row.cells[-1] for row in table.rows} == {"prescribed by the config, not identified"}
    assert {row.cells[2] for row in table.rows} == {"-"}
    assert gait_page([run]).answer[1].startswith("The springs were given, not searched for: ")
    if not judged:
        assert spring_section(run).lines == (
            "The config prescribes all springs: nothing was identified.",
        )


@pytest.mark.usefixtures("no_curves")
def test_one_spring_may_be_prescribed(made_solution: MadeSolution, tmp_path: Path) -> None:
    folder = write_made_run(tmp_path / "run", made_solution, "mapd-orthosis")
    verdict = made_verdict()
    snapped = verdict.snapped
    assert snapped is not None
    names = {k: v for k, v in snapped.names.items() if k != STIFFNESSES[0]}
    kept = {name: snapped.stiffness[name] for name in names}
    springs = tuple(
        replace(s, range=(60.0, 60.0), region=(60.0, 60.0)) if s.name == STIFFNESSES[0] else s
        for s in verdict.springs
    )
    given = replace(verdict, springs=springs, snapped=replace(snapped, names=names, stiffness=kept))
    metrics = json.loads((folder / "metrics.json").read_text())
    metrics |= {"verdict": given.as_dict(), "stiffness_ranges": {STIFFNESSES[0]: [60.0, 60.0]}}
    (folder / "metrics.json").write_text(json.dumps(metrics))
    (run,) = read_runs([folder])
    rows = {row.cells[0]: row.cells for row in spring_section(run).tables[0].rows}
    assert rows["K_D right"][4] == "prescribed by the config, not identified"
    assert "(K_D) 91.7 N m/rad left;" in gait_page([run]).answer[1]


def test_a_verdict_comes_back_from_the_metrics() -> None:
    verdict = made_verdict()
    plain = json.loads(json.dumps(verdict.as_dict()))
    assert verdict_of_metrics({"verdict": plain}) == verdict
    assert verdict_of_metrics({}) is None
    again = made_verdict(snapped=None)
    assert verdict_of_metrics({"verdict": json.loads(json.dumps(again.as_dict()))}) == again
    assert verdict_words(verdict.springs[2]) == "not determined"


@pytest.mark.usefixtures("no_curves")
def test_assumptions_name_sources_proof_and_changed_values(
    made_solution: MadeSolution, tmp_path: Path
) -> None:
    config = made_solution().config
    bounds = config.bounds.model_copy(update={"friction": 0.6})
    config = config.model_copy(update={"bounds": bounds})
    folder = write_made_run(tmp_path / "run", made_solution, "mapd-orthosis", config=config)
    page = page_of([folder])
    rows = {row.cells[0]: row.cells[1] for row in section(page, "What was").tables[0].rows}
    assert rows["Config"] == "bounds.friction = 0.6"
    assert "left knee at its lower bound 15.1 deg in left toe" in rows["Active bounds"]
    assert "walking speed at its lower bound 0.636 m/s" in rows["Active bounds"]
    assert "1 more of muscles" in rows["Active bounds"]
    assert "reached: largest violation 2.0e-09 (right knee rate" in rows["Tolerances"]
    assert "asked for: 0.001, 0.01" in rows["Re-integration"]
    assert "age for Jensen" in rows["Mass, strengths"]
    assert "pathwalker 0.1.0" in rows["Versions"]
    assert "42 iterations" in rows["Mesh, iterations"]


def test_values_that_are_no_defaults_are_those_of_the_problem(made_solution: MadeSolution) -> None:
    config = made_solution("mapd-barefoot").config
    assert changed_values(config) == {}
    other = config.model_copy(update={"starts": 3})
    assert changed_values(other) == {"starts": (3, 1)}
    assert differing_values([config, other]) == {"starts": ("1", "3")}
    assert differing_values([config, config]) == {}


@pytest.mark.usefixtures("no_curves")
def test_a_changed_patient_and_a_quick_check_are_told(
    made_solution: MadeSolution, tmp_path: Path
) -> None:
    file = tmp_path / "child.yaml"
    content = load_patient("sreenivasa2017-patient").model_dump(mode="json", exclude_none=True)
    file.write_text(yaml.safe_dump(content))
    changes = {"smoke": True, "patient": str(file)}
    config = made_solution().config.model_copy(update=changes)
    folder = write_made_run(tmp_path / "run", made_solution, "mapd-orthosis", config=config)
    file.write_text(yaml.safe_dump({**content, "body_mass": 60.0}))
    metrics = json.loads((folder / "metrics.json").read_text())
    metrics["reintegration_velocity_error"] = 0.02
    (folder / "metrics.json").write_text(json.dumps(metrics))
    warnings = page_of([folder]).warnings
    assert "a quick check on a coarse mesh" in warnings[0]
    assert "the mesh is too coarse" in warnings[1]
    assert "no longer that of the run" in warnings[2]
    assert (
        page_of([write_made_run(tmp_path / "fine", made_solution, "mapd-orthosis")]).warnings == ()
    )


@pytest.mark.usefixtures("no_curves")
@pytest.mark.parametrize(
    ("changes", "told"),
    [
        ({"orthosis": {"mass": {"shank": 0.4, "foot": 0.7}}}, {"mapd-orthosis"}),
        ({"orthosis": None}, {"mapd-orthosis"}),
        ({"description": "another word"}, set()),
        ({"body_mass": 25.5}, {"mapd-barefoot", "mapd-orthosis"}),
        ({"recorded": None}, {"mapd-barefoot", "mapd-orthosis"}),
    ],
)
def test_a_changed_patient_is_told_where_it_matters(
    made_solution: MadeSolution, tmp_path: Path, changes: dict[str, Any], told: set[str]
) -> None:
    content = load_patient("sreenivasa2017-patient").model_dump(mode="json", exclude_none=True)
    file = tmp_path / "patient.yaml"
    file.write_text(yaml.safe_dump(content))
    found = {}
    for problem in ("mapd-barefoot", "mapd-orthosis"):
        config = made_solution(problem).config.model_copy(update={"patient": str(file)})
        folder = write_made_run(tmp_path / problem, made_solution, problem, config=config)
        (found[problem],) = read_runs([folder])
    for key, value in changes.items():
        if value is None:
            del content[key]
        elif isinstance(value, dict):
            content[key] |= value
        else:
            content[key] = value
    file.write_text(yaml.safe_dump(content))
    assert {name for name, run in found.items() if run.patient_changed} == told


@pytest.mark.usefixtures("no_curves")
def test_runs_of_one_condition_go_by_their_folders(
    runs: Path, made_solution: MadeSolution, tmp_path: Path
) -> None:
    other = write_made_run(tmp_path / HOSTILE.replace("/", "|"), made_solution, "mapd-orthosis")
    page = page_of([runs / "mapd-orthosis", other])
    assert [s.title for s in page.sections][:2] == [
        "Springs to fit, mapd-orthosis",
        f"Springs to fit, {other.name}",
    ]
    text = page_html(page)
    checked(text)
    assert "&lt;script&gt;" in text


@pytest.mark.drawn
def test_a_name_cannot_be_more_than_text_in_a_figure(
    made_solution: MadeSolution, runs: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(figures, "ROWS", figures.ROWS[-1:])
    names = [f"<b>&{chr(1)}$\\foo$", "_hidden"]
    folders = [write_made_run(tmp_path / n, made_solution, "mapd-orthosis") for n in names]
    text = page_html(page_of([runs / "mapd-orthosis", *folders]))
    page = checked(text)
    assert "<b>" not in text
    assert "_hidden" in page.text
    assert "<b>&?$\\foo$" in page.text


# Escaping


def test_everything_from_files_is_escaped() -> None:
    table = Table((HOSTILE, "b"), (Row((HOSTILE, HOSTILE)),), HOSTILE, (HOSTILE,))
    part = Section(HOSTILE, (HOSTILE,), (Fact(HOSTILE, HOSTILE),), (table,), (HOSTILE,))
    page = Page(HOSTILE, (Fact(HOSTILE, f'" onload="{HOSTILE}'),), (HOSTILE,), (HOSTILE,), (part,))
    text = page_html(page)
    assert checked(text).text.count(HOSTILE) == 16
    assert "<script" not in text


def test_only_drawings_are_taken_as_they_are() -> None:
    drawing = Drawing(new_figure(1.0), "a", HOSTILE)
    text = page_html(Page("a", (), ("b",), (), (Section("c", drawings=(drawing,)),)))
    assert '<figure class="pair"><svg ' in text
    assert HOSTILE not in text


def test_a_table_with_rows_of_another_width_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="2 columns"):
        Table(("a", "b"), (Row(("1",)),))


@pytest.mark.drawn
@pytest.mark.usefixtures("no_curves")
def test_hostile_notes_and_names_of_a_run_stay_text(runs: Path) -> None:
    path = runs / "mapd-orthosis" / "metrics.json"
    metrics = json.loads(path.read_text())
    metrics["notes"] = [HOSTILE]
    metrics["start"] = metrics["largest_violation_name"] = metrics["date"] = HOSTILE
    metrics["active_bounds"] = [HOSTILE]
    metrics["verdict"]["snapped"]["names"]["dorsiflexion_stiffness_left"] = HOSTILE
    path.write_text(json.dumps(metrics))
    assert words_of(page_of([runs / "mapd-orthosis"])).count(HOSTILE) == 6


# Refusals


@pytest.mark.usefixtures("no_curves")
def test_bad_input_gets_one_sentence(
    runs: Path, made_solution: MadeSolution, tmp_path: Path
) -> None:
    run, out = runs / "mapd-orthosis", tmp_path / "page.html"
    assert "no such folder" in refusal("nowhere", "-o", out)
    assert "holds nothing to report" in refusal(tmp_path, "-o", out)
    assert "is named twice" in refusal(run, f"{run}/.", "-o", out)
    assert "is no name of such a page" in refusal(run, "-o", tmp_path / "page.txt")
    assert "is no name of such a page" in refusal(run, "-o", out, "--pdf", tmp_path / "page.html")
    assert "names no file" in refusal(run)
    assert "there is no folder" in refusal(run, "-o", tmp_path / "no" / "page.html")
    bad = made_solution(status="maximum number of iterations")
    folder = write_made_run(tmp_path / "bad", lambda *_, **__: bad, "mapd-orthosis")
    assert "did not converge" in refusal(run, folder, "-o", out)
    (tmp_path / "folder.html").mkdir()
    assert "is a folder" in refusal(run, "-o", tmp_path / "folder.html")
    assert not out.exists()


@pytest.mark.usefixtures("no_curves")
def test_runs_of_different_patients_are_refused(
    runs: Path, made_solution: MadeSolution, tmp_path: Path
) -> None:
    from pathwalker_cli.model.walker import build_walker

    config = made_solution().config.model_copy(update={"patient": str(CHILD)})
    walker = build_walker(load_patient(CHILD), "orthosis")
    child = write_made_run(
        tmp_path / "child", made_solution, "mapd-orthosis", config=config, walker=walker
    )
    sentence = refusal(runs / "mapd-orthosis", child, "-o", tmp_path / "page.html")
    assert "is a run of patient child-10y" in sentence
    text = words_of(page_of([child]))
    assert "patient child-10y has no orthosis recordings" in text
    assert "recorded, mean" not in text


# Studies


def write_studies(folder: Path, run: Path, note: str = "") -> None:
    """Write studies of every kind around a run beside it."""
    metrics = json.loads((run / "metrics.json").read_text())
    base = {key: metrics[key] for key in ("problem", "patient")}
    optimum = {key: metrics[key] for key in ("cost", "walking_speed", *STIFFNESSES)}
    row = {
        "spring": STIFFNESSES[0], "factor": 0.95, "stiffness": 47.5, "status": "converged",
        "changes": {"cost": 0.0123, "walking_speed": 0.0}, "note": note,
    }  # fmt: skip
    failed = row | {"spring": STIFFNESSES[1], "status": "failed", "changes": {}}
    elasticities = {
        "body_mass": {"cost": 1.5, "walking_speed": 0.0, "stride_time": None},
        "segment_lengths.head": {"cost": 1e-9, "walking_speed": 0.0},
    }
    contents = {
        "perturb/perturbation.json": base | {"optimum": optimum, "rows": [row, failed]},
        "sensitivity/sensitivity.json": base | {"optimum": optimum, "elasticities": elasticities},
    }  # fmt: skip
    learnt = {
        "learnt": 0.24,
        "prior": 0.2,
        "unit": "N m s/rad",
        "interval": [0.1, 0.5],
        "told": 0.3,
    }
    contents["learn/learn.json"] = base | {
        "condition": "barefoot", "rms_mean_cycle": {"knee": 0.15}, "rms_own_cycles": {"knee": 0.09},
        "numbers": {"tissue.damping": learnt}, "active_bounds": [],
    }  # fmt: skip
    for name, content in contents.items():
        (folder / name).parent.mkdir(parents=True)
        (folder / name).write_text(json.dumps(content))
    numbers = {measure.key: float(metrics[measure.key]) for measure in measures_in("studies")}
    for name in ("landscape", "tradeoff", "uncertainty"):
        (folder / name).mkdir()
    write_landscape(made_landscape(metrics, numbers), folder / "landscape")
    write_tradeoff(made_tradeoff(metrics, numbers), folder / "tradeoff")
    write_uncertainty(made_uncertainty(metrics, numbers), folder / "uncertainty")


@pytest.fixture
def studies(written_studies: Path, tmp_path: Path) -> Path:
    """Return a folder with a study of every kind that may be changed."""
    return Path(shutil.copytree(written_studies, tmp_path / "studies"))


@pytest.fixture(scope="module")
def written_studies(written: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("studies")
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        write_studies(folder, written / "mapd-orthosis")
    return folder


def made_landscape(metrics: dict[str, Any], numbers: dict[str, float]) -> Landscape:
    """Return a landscape of four points, one with two local optima and one without a solution."""
    ends = np.array([5.0, 92.0])

    def point(name: str, k_d: float, k_p: float, branch: int, share: float) -> Point:
        measures = {**numbers, "cost": numbers["cost"] * (1.0 + share)} if branch else {}
        return Point(name, k_d, k_p, branch, "converged" if branch else "failed", 1, 0.1, measures)

    best = point(ROOT, 91.7, 5.0, 1, 0.0)
    points = (
        best, point("d1-p1", 5.0, 5.0, 1, 0.148), point("d2-p1", 92.0, 5.0, 1, 0.002),
        point("d2-p1", 92.0, 5.0, 2, 0.3), point("d1-p2", 5.0, 92.0, 1, 0.2),
        point("d2-p2", 92.0, 92.0, 0, 0.0),
    )  # fmt: skip
    return Landscape(
        metrics["patient"], metrics["problem"], "right", ends, ends, points, best, None, {},
        (1e-3, 1e-2), 0.05, 5, 1, (12,), 3.0, 2, True,
    )  # fmt: skip


def made_tradeoff(metrics: dict[str, Any], numbers: dict[str, float]) -> Tradeoff:
    """Return a trade-off of a front of two points, one that is dominated and one that failed."""

    def point(weight: float, speed: float, effort: float, mesh: str = "base") -> FrontPoint:
        measures = {**numbers, "walking_speed": speed, "effort_per_distance": effort}
        return FrontPoint(weight, "converged", mesh, None, measures, (1e-4, 1e-3), 90,
                          0.2, 1, 12)  # fmt: skip

    failed = replace(point(3.0, 0.0, 0.0), status="failed", measures={}, errors=(np.nan, np.nan))
    solved = (point(0.0, 0.6, 0.25), point(1.0, 0.9, 0.4), point(2.0, 0.8, 0.5, "inaccurate"))
    points = judged((*solved, failed))
    return Tradeoff(
        metrics["problem"], metrics["patient"], "orthosis", points, 0.0, numbers, front_of(points),
        (0.7, 0.9), (1e-3, 1e-2), 9, 1, 12.0, 3.0, 1.0, 2, True,
    )  # fmt: skip


def made_uncertainty(metrics: dict[str, Any], numbers: dict[str, float]) -> Uncertainty:
    """Return twenty draws: K_D right is stiffest in 15 of them, one draw fails."""
    ranges = dict.fromkeys(STIFFNESSES, (5.0, 92.0)) | {STIFFNESSES[1]: (50.0, 50.0)}
    found = [
        {**numbers, "cost": 1.0 + i, STIFFNESSES[0]: 92.0 if i > 4 else 60.0} if i else {}
        for i in range(20)
    ]
    solved = tuple(
        Solved(f"draw-{i:05d}", "converged" if values else "failed", values, 12, 0.1, False)
        for i, values in enumerate(found)
    )
    factors = np.linspace(0.9, 1.1, 20)[:, None]
    draws = Draws((Input("body_mass", Distribution(relative=0.1)),), factors)
    config = load_config(metrics["problem"])
    about = (config, metrics["patient"], 90, numbers, ranges, measures_in("studies"), {})
    return Uncertainty(*about, draws, solved, 3.0, 1)


@pytest.mark.usefixtures("no_curves")
def test_studies_beside_a_run_add_their_tables(runs: Path) -> None:
    write_studies(runs, runs / "mapd-orthosis", HOSTILE)
    page = page_of([runs / "mapd-orthosis"])
    rows = section(page, "Perturbation").tables[0].rows
    assert rows[0].cells[:3] == ("K_D right -5 %", "47.5", "+1.23")
    assert rows[1].mark == "failed"
    assert "no solution" in rows[1].cells
    (row,) = section(page, "Sensitivity").tables[0].rows
    assert row.cells == ("body mass", "1.500")
    assert section(page, "Sensitivity").points == ("Body mass: 10 % more changes cost by +15.0 %",)
    hinges = " ".join(section(page, "What the answer hangs on").points)
    assert "that it follows most: body mass (1.5 % of the cost per %)" in hinges
    assert HOSTILE in words_of(page)
    barefoot = page_of([runs / "mapd-barefoot"])
    assert not any(s.title.startswith("Sensitivity") for s in barefoot.sections)


@pytest.mark.drawn
@pytest.mark.usefixtures("no_curves")
def test_maps_fronts_and_spreads_are_drawn(runs: Path, written_studies: Path) -> None:
    shutil.copytree(written_studies, runs, dirs_exist_ok=True)
    page = page_of([runs / "mapd-orthosis"])
    landscape = section(page, "Landscape")
    assert landscape.lines[0] == "Least cost at K_D 91.7, K_P 5.0 N m/rad (right side)."
    assert "K_D 63.4 to 92.0" in landscape.lines[1]
    assert "20.0 % more than the best" in landscape.lines[2]
    assert landscape.lines[3:] == (
        "Several local optima at 1 of 4 points.", "No solution at 1 of 4 points.",
    )  # fmt: skip
    for words in ("least cost found", "real springs", "to take", "no solution", "best shown"):
        assert words in svg_of(landscape)
    front = section(page, "Trade-off")
    rows = front.tables[0].rows
    assert [row.cells[0] for row in rows] == ["0", "1", "2", "3"]
    assert rows[0].cells[1:3] == ("0.600", "0.250")
    assert rows[2].cells[-1] == "dominated; mesh too coarse: rough numbers"
    assert rows[3].mark == "failed"
    assert "recorded speeds" in svg_of(front)
    spread = section(page, "Uncertainty")
    cost = spread.tables[0].rows[0]
    assert cost.cells[0] == "cost"
    assert cost.cells[3:] == ("11.0000", "2.0000 to 20.0000", "body mass")
    assert spread.lines[:3] == (
        "20 draws of the uncertain numbers, 19 converged.",
        "K_D right: least effort takes the stiffest (92 N m/rad) in 79 %, one between in 21 % of "
        "the draws.",
        "K_D left is prescribed: 50 N m/rad.",
    )
    assert "median, 90 % of draws" in svg_of(spread)


@pytest.mark.parametrize(
    ("file", "wrong", "told"),
    [
        (
            "landscape/landscape.json",
            {"dorsiflexion_stiffness": ["a"]},
            ": dorsiflexion_stiffness[0]: is 'a'",
        ),
        (
            "landscape/landscape.json",
            {"solves": "a"},
            "does not hold what `pathwalker landscape` writes",
        ),
        ("tradeoff/tradeoff.json", {"points": [{}]}, ": points[0].walking_speed_weight"),
        ("uncertainty/uncertainty.json", {"spreads": {"cost": {}}}, ": spreads.cost.quantiles"),
    ],
)
@pytest.mark.usefixtures("no_curves")
def test_broken_studies_are_refused(
    runs: Path, studies: Path, tmp_path: Path, file: str, wrong: dict[str, Any], told: str
) -> None:
    path = studies / file
    path.write_text(json.dumps(json.loads(path.read_text()) | wrong))
    sentence = refusal(runs / "mapd-orthosis", path.parent, "-o", tmp_path / "page.html")
    assert told in sentence


@pytest.mark.usefixtures("no_curves")
def test_studies_that_do_not_fit_are_refused_when_named(
    runs: Path, studies: Path, tmp_path: Path
) -> None:
    out = tmp_path / "page.html"
    named = page_of([runs / "mapd-orthosis", studies / "sensitivity"])
    assert section(named, "Sensitivity").tables
    assert "stands on another optimum" in refusal(
        runs / "mapd-barefoot", studies / "sensitivity", "-o", out
    )
    assert "a run that was not named" in refusal(studies / "perturb", "-o", out)
    path = studies / "sensitivity" / "sensitivity.json"
    content = json.loads(path.read_text())
    path.write_text(json.dumps(content | {"elasticities": {"a": {"cost": "b"}}}))
    sentence = refusal(runs / "mapd-orthosis", studies / "sensitivity", "-o", out)
    assert "sensitivity.json: elasticities.a.cost: is 'b'; allowed: a number" in sentence
    broken = Path(shutil.copytree(studies / "sensitivity", runs / "broken"))
    (broken / "sensitivity.json").write_text("{")
    assert page_of([runs / "mapd-orthosis"]).sections, "a study that nobody named does not matter"
    path.write_text("[]")
    assert "holds no keys with values" in refusal(
        runs / "mapd-orthosis", studies / "sensitivity", "-o", out
    )


# Cohorts


CASES = (
    "case,patient,problem,status,walking_speed [m/s],dorsiflexion_stiffness_right [N m/rad],"
    "dorsiflexion_stiffness_left [N m/rad],effort_per_distance [s/m],"
    "reintegration_position_error [rad or m]\n"
    "anna--mapd-orthosis,anna,mapd-orthosis,converged,0.7,91.96,60.04,0.25,2e-4\n"
    f"ben--mapd-orthosis,ben,mapd-orthosis,failed: {HOSTILE},,,,\n"
    "ben--mapd-barefoot--x,ben,mapd-barefoot,not yet run,,,,\n"
)


def test_a_cohort_shows_failures(tmp_path: Path) -> None:
    (tmp_path / "cohort").mkdir()
    (tmp_path / "cohort" / "cases.csv").write_text(CASES)
    page = page_of([tmp_path / "cohort"])
    assert page.answer == ("1 of 3 cases of 2 patients converged.",)
    assert page.warnings == (
        "1 cases failed: they have no gait and no springs",
        "1 cases have not been run yet",
    )
    good, failed, waiting = page.sections[0].tables[0].rows
    assert good.cells == (
        "anna", "mapd-orthosis", "-", "converged", "0.700", "-", "-", "92.0, 60.0", "-", "0.250",
        "2.0e-04",
    )  # fmt: skip
    assert failed.mark == waiting.mark == "failed"
    assert HOSTILE in failed.cells[3]
    assert waiting.cells[2] == "x"
    assert HOSTILE in words_of(page)


def test_quick_checks_of_a_cohort_are_told(made_solution: MadeSolution, tmp_path: Path) -> None:
    (tmp_path / "cases.csv").write_text(CASES)
    config = made_solution().config.model_copy(update={"smoke": True})
    write_made_run(
        tmp_path / "cases" / "anna--mapd-orthosis", made_solution, "mapd-orthosis", config=config
    )
    assert "1 cases are quick checks" in page_of([tmp_path]).warnings[-1]


def test_a_broken_table_of_a_cohort_is_refused(tmp_path: Path) -> None:
    (tmp_path / "cases.csv").write_text("case,patient\n")
    assert "lacks the column problem" in refusal(tmp_path, "-o", tmp_path / "page.html")


def test_kinds_of_pages_do_not_mix(runs: Path, tmp_path: Path) -> None:
    (tmp_path / "cases.csv").write_text(CASES)
    sentence = refusal(runs / "mapd-barefoot", tmp_path, "-o", tmp_path / "page.html")
    assert "do not go on one page" in sentence


# Recorded gait


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of a study of four recorded trials."""
    from pathwalker_cli.inverse import files
    from pathwalker_cli.inverse.residuals import residual_tables
    from pathwalker_cli.inverse.strengths import strength_table
    from pathwalker_cli.inverse.trials import dynamics_trials

    folder = tmp_path_factory.mktemp("recorded")
    study = load_inverse_dynamics("inverse-dynamics", ("conditions=[barefoot]",))
    patient = load_patient(study.patient)
    trials = dynamics_trials(study, patient, lambda _: None)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(files, "save_recorded_figures", lambda *_: ())
        files.write_dynamics(
            folder, trials, residual_tables(trials, patient, study),
            strength_table(trials, patient, study), patient, study,
        )  # fmt: skip
    return folder


@pytest.mark.drawn
def test_recorded_gait_shows_stances_torques_and_strengths(recorded: Path, tmp_path: Path) -> None:
    page = page_of([recorded])
    stances = section(page, "Recorded stances").tables[0].rows
    assert [row.cells[:5] for row in stances] == [
        ("barefoot", "right", "13", "13", "4"),
        ("barefoot", "left", "13", "14", "5"),
    ]
    (drawing,) = section(page, "Net joint torques").drawings
    assert drawing.shape == "tall"
    assert "barefoot, 13 trials" in svg_of(section(page, "Net joint torques"))
    strengths = {row.cells[0]: row.cells for row in section(page, "Muscle").tables[0].rows}
    assert strengths["hip extension, right"][1:3] == ("27.2", "18.6")
    assert strengths["hip flexion, right"][5] == "-"
    assert "9 of 27 recorded stances" in page.answer[0]
    words_of(page)

    copied = Path(shutil.copytree(recorded, tmp_path / "other"))
    beside = {"quantity": "knee angle", "side": "left", "unit": "deg"}
    beside |= {"rms": 3.0, "offset": -2.5, "offset_free": 1.5}
    reading = {"condition": "barefoot", "trial": "walk", "notes": ["plate 2 is left out"]}
    reading |= {"warnings": ["its path bends"], "laboratory": [beside, beside | {"rms": 4.0}]}
    (copied / "barefoot" / "walk_reading.json").write_text(json.dumps(reading))
    page = page_of([copied])
    (row,) = section(page, "Beside the laboratory's own model").tables[0].rows
    assert row.cells == ("barefoot, knee angle [deg]", "-", "3.5", "-", "-2.5", "-", "1.5")
    assert section(page, "How the files were read").lines == (
        "barefoot, walk: plate 2 is left out.", "barefoot, walk: its path bends.",
    )  # fmt: skip
    (copied / "barefoot" / "walk_reading.json").write_text(
        '{"condition": "barefoot", "laboratory": [1]}'
    )
    assert "_reading.json that cannot be used" in refusal(copied, "-o", tmp_path / "page.html")
    (copied / "barefoot" / "walk_reading.json").unlink()
    origin = json.loads((copied / "study.json").read_text())
    origin |= {"patient": HOSTILE, "notes": [HOSTILE], "method": HOSTILE}
    (copied / "study.json").write_text(json.dumps(origin))
    both = page_of([recorded, copied])
    assert both.facts[0].label == "Patients"
    assert HOSTILE in words_of(both)
    (copied / "study.json").unlink()
    assert "lacks study.json" in refusal(copied, "-o", tmp_path / "page.html")


def test_a_broken_stance_is_refused(recorded: Path, tmp_path: Path) -> None:
    copied = Path(shutil.copytree(recorded, tmp_path / "other"))
    path = copied / "stances.csv"
    path.write_text(path.read_text().replace("172,245", "x,245"))
    assert "cannot be used" in refusal(copied, "-o", tmp_path / "page.html")
