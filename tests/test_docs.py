"""The documentation: generated pages are fresh, examples run, links, names and keys exist."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from textwrap import dedent
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import yaml

from conftest import MadeSolution
from pathwalker_cli import __version__, load_patient
from pathwalker_cli.cli import COMMANDS
from pathwalker_cli.config import StudyConfig, load_config
from pathwalker_cli.conventions import CONTACT_FORCES, COORDINATES, GENERATORS
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.costs import GOALS
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.io.yaml_file import read_mapping, validate
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.patient import OrthosisData
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.results.metrics import RunInputs, run_metrics
from pathwalker_cli.results.text import angle_words

ROOT = Path(__file__).parent.parent
DOCS = ROOT / "docs"
GENERATED = {
    "commands.md": "generate_commands.py",
    "configuration.md": "generate_configuration.py",
    "patient-file.md": "generate_patient_file.py",
    "run-folder.md": "generate_run_folder.py",
}
CONFIGS = sorted(path.stem for path in (ROOT / "configs").glob("*.yaml"))
LINK = re.compile(r"!?\[[^\]]*\]\((?P<target>[^)\s]+)\)")
# Machines, places that only exist while something is made, and how it is made.
FORBIDDEN = re.compile(
    r"/work\b|/tmp\b|/home/|/root/|\bshared/|pypi\.org|pythonhosted|\bissues?\b|\bsessions?\b",
    re.IGNORECASE,
)
TOKEN = re.compile(r"@[A-Z][A-Z0-9_]*@")
# A backticked name below the package, e.g. `model.elements.muscle.activation_rate`.
NAME = re.compile(
    r"`((?:model|nlp|ocp|gait|stride|patient|inverse|io|conventions|config)(?:\.\w+)+)`"
)


def pages() -> list[Path]:
    """Return all Markdown files of the project."""
    found = [path for pattern in ("*.md", "docs/*.md", "patient_data/**/*.md")
             for path in ROOT.glob(pattern)]  # fmt: skip
    return sorted(found)


def page_id(path: Path) -> str:
    """Return the name of a page in test reports."""
    return str(path.relative_to(ROOT))


def script(name: str) -> ModuleType:
    """Import a script of the documentation; pytest has its folder on the path."""
    return import_module(name.removesuffix(".py"))


def text_of(name: str) -> str:
    """Return the text of a page."""
    return (ROOT / name).read_text(encoding="utf-8")


def blocks(page: str, language: str) -> list[str]:
    """Return the code blocks of a page in a language, also those in lists."""
    fence = re.compile(rf"^( *)```{language}\n(.*?)^\1```$", re.MULTILINE | re.DOTALL)
    return [dedent(text) for _, text in fence.findall(text_of(page))]


# Generated pages


@pytest.mark.parametrize("name", GENERATED)
def test_generated_page_is_fresh(name: str) -> None:
    wanted = script(GENERATED[name]).page()
    mend = f"run: python docs/{GENERATED[name]}"
    assert (DOCS / name).read_text(encoding="utf-8") == wanted, mend


@pytest.mark.parametrize("name", CONFIGS)
def test_every_shipped_config_key_is_in_the_reference(name: str) -> None:
    reference = text_of("docs/configuration.md")
    for key in script("generate_configuration.py").reasons(ROOT / "configs" / f"{name}.yaml"):
        parts = key.split(".")
        above = [".".join(parts[: i + 1]) for i in range(len(parts))]
        table = any(f"| `{place}` |" in reference for place in above)
        assert table or f"### {key}\n" in reference, key


def test_every_key_of_the_reference_has_a_meaning() -> None:
    generator = script("generate_configuration.py")
    assert set(generator.NOT_SHIPPED) == {"smoke"}, "all others stand in the shipped files"
    (row,) = re.findall(r"^\| `smoke` .*$", text_of("docs/configuration.md"), re.MULTILINE)
    assert "`solve --smoke` writes" in row
    config = load_config("mapd-barefoot", changes=("smoke=true",))
    assert config.mesh == load_config("mapd-barefoot").mesh, "by hand it only marks"


def test_every_command_is_in_the_reference() -> None:
    assert re.findall(r"^## (.*)$", text_of("docs/commands.md"), re.MULTILINE) == list(COMMANDS)


def test_run_folder_names_every_key_of_the_metrics(made_solution: MadeSolution) -> None:
    page = script("generate_run_folder.py")
    groups = (page.OUTCOME, page.gait_keys(), page.PROOF, page.ORIGIN)
    told = {key for group in groups for name in group for key in page.expanded(name)}
    for problem in PROBLEMS:
        written = set(run_metrics(made_solution(problem), RunInputs({})).content())
        assert told == written | {"verdict", "motion_hash", "multipliers_hash", "metrics_hash"}


@pytest.mark.parametrize("problem", ["mapd-orthosis", "mapd-barefoot"])
def test_complete_shipped_config_holds_the_defaults(problem: str) -> None:
    config = load_config(problem)
    assert config == StudyConfig(problem=problem, patient=config.patient)


@pytest.mark.parametrize("problem", PROBLEMS)
def test_shipped_config_says_what_its_problem_sets_by_default(problem: str) -> None:
    config, bare = load_config(problem), StudyConfig(problem=problem, patient="someone")
    assert (config.cost, config.half_cycle, config.start.gait) == (
        bare.cost, bare.half_cycle, bare.start.gait,
    )  # fmt: skip


def test_shipped_inverse_dynamics_holds_the_defaults() -> None:
    mapping, _ = read_mapping(ROOT / "configs" / "inverse-dynamics.yaml")
    given = validate(mapping, InverseDynamicsConfig)
    assert given == InverseDynamicsConfig(study="inverse-dynamics", patient=given.patient)


def test_comments_become_reasons(tmp_path: Path) -> None:
    path = tmp_path / "study.yaml"
    path.write_text(
        "# head\nouter:\n  a: 1   # first\n         # second\n\n  b: 2\n# alone\nc: 3  # third\n",
        encoding="utf-8",
    )
    assert script("generate_configuration.py").reasons(path) == {
        "outer": "", "outer.a": "first second", "outer.b": "", "c": "third",
    }  # fmt: skip


# README


def test_readme_python_runs() -> None:
    walker_part, solve_part = blocks("README.md", "python")
    names: dict[str, Any] = {}
    exec(walker_part, names)
    assert names["muscle"].shape == (14,)
    assert names["orthosis"].shape == (2,)
    assert names["vdot"].shape == names["tau"].shape == (10,)
    assert names["forces"].shape == (8,)
    assert names["points"].shape == (4, 2)
    assert np.isfinite(names["vdot"]).all()
    imports = [line for line in solve_part.splitlines() if line.startswith("from ")]
    exec("\n".join(imports), names)
    assert "solve_study" in names


def test_readme_patient_and_study_are_accepted(tmp_path: Path) -> None:
    patient, study = blocks("README.md", "yaml")
    (tmp_path / "my-patient.yaml").write_text(patient, encoding="utf-8")
    (tmp_path / "my-study.yaml").write_text(study, encoding="utf-8")
    config = load_config(tmp_path / "my-study.yaml", "mapd-orthosis")
    assert load_patient(config.patient).require_orthosis().free_play.left == 0.01


def test_readme_has_no_unfilled_figure() -> None:
    assert TOKEN.findall(text_of("README.md")) == []


# All pages


@pytest.mark.parametrize("path", pages(), ids=page_id)
def test_relative_links_resolve(path: Path) -> None:
    for match in LINK.finditer(path.read_text(encoding="utf-8")):
        target, _, anchor = match["target"].partition("#")
        if target.startswith(("http://", "https://")):
            continue
        linked = path.parent / target if target else path
        assert linked.exists(), match["target"]
        if anchor:
            headings = re.findall(r"^#+ (.*)$", linked.read_text(encoding="utf-8"), re.MULTILINE)
            slugs = {re.sub(r"[^\w -]", "", text.lower()).replace(" ", "-") for text in headings}
            assert anchor in slugs, match["target"]


@pytest.mark.parametrize("path", pages(), ids=page_id)
def test_no_page_tells_of_the_workshop(path: Path) -> None:
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        assert not FORBIDDEN.search(line), f"line {number}: {line}"


@pytest.mark.parametrize(("page", "least"), [("theory", 40), ("numerics", 25)])
def test_every_name_in_the_theory_exists(page: str, least: int) -> None:
    names = NAME.findall(text_of(f"docs/{page}.md"))
    assert len(names) > least
    assert [name for name in names if not resolves(name)] == []


def resolves(name: str) -> bool:
    """Return whether a dotted name below the package is a module or something in one."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found: Any = import_module(".".join(["pathwalker_cli", *parts[:length]]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            declared = getattr(found, "__annotations__", {})
            if not hasattr(found, part):
                return part in declared
            found = getattr(found, part)
        return True
    return False


# Single pages


def test_theory_has_the_equation_of_every_goal() -> None:
    section = text_of("docs/theory.md").split("### 2.4 ")[1].split("### 2.5 ")[0]
    assert re.findall(r"^\| `(\w+)` \|.*\$", section, re.MULTILINE) == list(GOALS)


def test_theory_states_the_phases_as_they_are() -> None:
    section = text_of("docs/theory.md").split("### 2.1 ")[1].split("### 2.2 ")[0]
    rows = re.findall(r"^\| `(\w+)` \|(.*)\|$", section, re.MULTILINE)
    assert [name for name, _ in rows] == [phase.name for phase in PHASES]
    following = PHASES[1:] + PHASES[:1]
    for (_, cells), phase, after in zip(rows, PHASES, following, strict=True):
        parts = (phase.forces, phase.touched_down(after), phase.lifted_off(after))
        wanted = tuple(tuple(force.name for force in part) for part in parts)
        for cell, forces in zip(cells.split("|"), wanted, strict=True):
            assert spelled_out(cell) == set(forces)


def spelled_out(cell: str) -> set[str]:
    """Return the forces of a cell such as "right heel x z, toe z"."""
    found, side = set(), ""
    for part in cell.strip(" -").split(","):
        words = part.split()
        if words and words[0] in ("right", "left"):
            side = words.pop(0)[0]
        found |= {f"{words[0]}_{side}_{axis}" for axis in words[1:]}
    return found


def test_conventions_name_every_coordinate_and_force() -> None:
    text = text_of("docs/conventions.md")
    for name in (*COORDINATES, *GENERATORS, *CONTACT_FORCES):
        assert f"`{name}`" in text, name


def test_own_cost_tells_of_every_goal() -> None:
    found = re.findall(
        r"^\| `goals: \{(\w+): \.\.\.\}` \|", text_of("docs/own-cost.md"), re.MULTILINE
    )
    assert found == list(GOALS)


def test_own_patient_and_orthosis_are_accepted(tmp_path: Path) -> None:
    child, barefoot, torques = blocks("docs/own-patient.md", "yaml")
    hinge, today = blocks("docs/own-orthosis.md", "yaml")
    shoe = "contact_points: {orthosis: {heel: [-0.055, -0.10], toe: [0.14, -0.08]}}\n"
    (tmp_path / "anna").mkdir()
    (tmp_path / "anna.yaml").write_text(child, encoding="utf-8")
    worn = f"{child}{shoe}orthosis: hinge.yaml\n"
    (tmp_path / "anna" / "patient.yaml").write_text(worn, encoding="utf-8")
    (tmp_path / "anna" / "hinge.yaml").write_text(hinge, encoding="utf-8")
    for name, text, problem in (("b", barefoot, "mapd-barefoot"), ("t", today, "mapd-orthosis")):
        path = tmp_path / f"{name}.yaml"
        path.write_text(text, encoding="utf-8")
        config = load_config(path, problem)
        assert load_patient(config.patient).id == "anna"
    assert len(config.bounds.stiffness) == 4
    page = text_of("docs/own-orthosis.md")
    orthosis = load_patient(config.patient).require_orthosis()
    middle = angle_words(orthosis.neutral_angle["right"])
    assert f"`neutral angle {middle}`" in page
    guessed = yaml.safe_load(hinge) | {"free_play": 0.01, "preload_torque": 0.0}
    assert validate(guessed, OrthosisData).preload_torque.left == 0.0
    with pytest.raises(ConfigError, match="free_play"):
        validate(guessed | {"free_play": 0.0}, OrthosisData)
    assert validate(yaml.safe_load(torques), InverseDynamicsConfig).patient == "anna/"


def test_python_page_runs() -> None:
    first, *others = blocks("docs/python.md", "python")
    names: dict[str, Any] = {}
    exec(first, names)
    imports = [line for text in others for line in text.splitlines() if line.startswith("from ")]
    exec("\n".join(imports), names)
    exec(others[-1], names)
    assert {"solve_study", "run_study", "load_run"} <= names.keys()


def test_numerics_page_solves_its_example() -> None:
    solve, follow = blocks("docs/numerics.md", "python")
    names: dict[str, Any] = {}
    exec(solve, names)
    assert names["result"].converged
    assert names["result"].objective == pytest.approx(12.0, rel=1e-9)
    wanted = 6.0 - 12.0 * np.linspace(0.0, 1.0, 5)
    assert names["motion"].phases[0].smooth[:, 0] == pytest.approx(wanted, abs=1e-8)
    exec(follow, names)
    answer = names["KktSystem"](names["program"], names["result"]).answer(
        names["below"], names["above"], 1e-4
    )
    assert answer.cost == pytest.approx(24.0, rel=1e-6)


def test_citation_is_complete_and_of_this_version() -> None:
    citation = yaml.safe_load(text_of("CITATION.cff"))
    assert {"cff-version", "message", "title", "authors"} <= citation.keys()
    assert citation["version"] == __version__
    assert f"## [{__version__}] - {citation['date-released']}" in text_of("CHANGELOG.md")
    assert citation["license"] == "BSD-3-Clause"
    assert text_of("LICENSE").startswith("BSD 3-Clause License")
