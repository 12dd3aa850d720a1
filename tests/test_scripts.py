"""PathWalker from scripts: what is registered, pickled, told in a line, and drawn."""

from __future__ import annotations

import json
import os
import pickle
import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pytest
from matplotlib.figure import Figure

import pathwalker_cli
from conftest import MadeSolution
from pathwalker_cli import build_walker, load_case, load_patient
from pathwalker_cli.errors import ConfigError, InputError, NotConvergedError
from pathwalker_cli.extensions import (
    register_elements,
    register_goal,
    register_measure,
    register_use,
)
from pathwalker_cli.gait import costs
from pathwalker_cli.gait.costs import GOALS
from pathwalker_cli.gait.problem import GaitProblem
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.installed import load_installed
from pathwalker_cli.model import elements
from pathwalker_cli.model.contact import USES
from pathwalker_cli.model.elements import plain
from pathwalker_cli.model.numbers import Number
from pathwalker_cli.results.run_folder import load_run, write_run
from pathwalker_cli.stride import measures
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in, metrics_of
from pathwalker_cli.stride.series import gait_series
from pathwalker_cli.stride.stride import stride_of

PAGE = Path(__file__).parents[1] / "docs" / "python.md"


@pytest.fixture(autouse=True)
def _forget(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let what a test registers be gone after it."""
    for home, name in ((costs, "GOALS"), (elements, "REGISTERED")):
        known = getattr(home, name)
        for key, value in list(known.items()):
            monkeypatch.setitem(known, key, value)
    monkeypatch.setattr(measures, "REGISTRY", measures.REGISTRY)


def known(mapping: dict[str, Any], monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    """Let names that will be put into a mapping be gone after a test."""
    for name in names:
        monkeypatch.setitem(mapping, name, None)
        del mapping[name]


@dataclass(frozen=True)
class Brake:
    """A damper at the left knee."""

    name = "brake"
    coordinates = ("knee_l",)
    numbers = (Number("brake.damping", "brake_damping", "brake", "N m s/rad", default=0.5),)

    def forces(self, state: Any, numbers: Any, curve: Any = plain) -> tuple[Any, ...]:
        return (-numbers["brake.damping"] * state.v["knee_l"],)


def script() -> str:
    (found,) = re.findall(r'```python\n("""Calm knees.*?)```', PAGE.read_text(), re.DOTALL)
    return found


def test_the_script_of_the_page_runs_and_its_runs_are_read_without_it(tmp_path: Path) -> None:
    text = script()
    assert sum(bool(line.strip()) for line in text.splitlines()) <= 40
    (tmp_path / "calm.py").write_text(text, encoding="utf-8")
    environment = {**os.environ, "PYTHONPATH": str(Path(pathwalker_cli.__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, "calm.py"], cwd=tmp_path, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    usual, calm = (line.split() for line in done.stdout.splitlines())
    assert float(calm[1]) < float(usual[1]), "the knees are calmer"
    assert (tmp_path / "calm.png").stat().st_size > 1000
    assert "calm_knees" not in GOALS
    run = load_run(tmp_path / "calm")
    assert run.config.cost.goals == {"calm_knees": 0.01}
    assert run.metrics["knee_swing"] == pytest.approx(float(calm[2]))
    with pytest.raises(ConfigError, match="'calm_knees', which nothing has registered"):
        GaitSolver(run.case)
    content = json.loads((tmp_path / "calm" / "metrics.json").read_text())
    terms = content["cost_terms"]
    assert terms["calm_knees"] == pytest.approx(0.01 * content["goals"]["calm_knees"], rel=1e-6)


def test_a_goal_is_weighed_once_it_is_registered(monkeypatch: pytest.MonkeyPatch) -> None:
    known(GOALS, monkeypatch, "stillness")
    change = ("cost.goals={stillness: 0.1}",)
    with pytest.raises(ConfigError, match="names 'stillness'"):
        load_case("mapd-barefoot", changes=change)
    term = replace(GOALS["steady_trunk"], integrals=("stillness",))
    register_goal("stillness", term)
    config = load_case("mapd-barefoot", changes=change).config
    assert config.cost.wanted.names == ("stillness",)
    walker = build_walker(load_patient("sreenivasa2017-patient"))
    assert not GaitProblem(walker, costs=config.cost.wanted).shipped, "its derivatives are not kept"
    assert GaitProblem(walker).shipped


@pytest.mark.parametrize(
    ("name", "integral", "sentence"),
    [
        ("crouch", "own", "there is a goal 'crouch' already"),
        ("Two words", "own", "no name of a goal"),
        ("other", "effort", "has a running cost 'effort'"),
    ],
)
def test_names_that_are_taken_are_refused(name: str, integral: str, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        register_goal(name, replace(GOALS["crouch"], integrals=(integral,)))


def test_a_measure_is_in_every_table(made_solution: MadeSolution) -> None:
    register_measure(Measure("age", "age", "1", "of the child", lambda s: s.walker.patient.age))
    with pytest.raises(InputError, match="already"):
        register_measure(Measure("age", "age", "1", "again", None))
    assert metrics_of(stride_of(made_solution().series))["age"] == 7.0
    assert measures_in("studies")[-1].key == "age"


def test_an_element_counts_where_a_config_names_it(monkeypatch: pytest.MonkeyPatch) -> None:
    known(elements.REGISTERED, monkeypatch, "brake")
    change = ("model.elements=[brake]", "free={brake.damping: [0.1, 2.0]}")
    case = load_case("mapd-barefoot", changes=change)
    with pytest.raises(ConfigError, match="'brake', which nothing has registered"):
        case.walker()
    register_elements("brake", [Brake()])
    walker = case.walker()
    assert [unknown.name for unknown in walker.unknowns] == ["brake_damping"]
    plain_walker = load_case("mapd-barefoot").walker()
    assert len(walker.elements) == len(plain_walker.elements) + 1
    assert not GaitProblem(walker).shipped
    q, v = walker.skeleton.size * [0.0], walker.skeleton.size * [1.0]
    import numpy as np

    forces = walker.element_forces(np.array([q]), np.array([v]), np.zeros((1, 14)))
    assert forces[0, walker.columns([Brake()])] == pytest.approx([-0.5])


def test_a_use_of_the_feet_is_solved_and_its_run_read_without_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known(USES, monkeypatch, "toe_first")
    with pytest.raises(ConfigError, match="is 'toe_first'; allowed: heel_toe, flat, toe"):
        load_case("mapd-barefoot", changes=("model.contact=toe_first",))
    register_use("toe_first", single=("flat", "toe"), landing=("toe", "flat"))
    case = load_case("mapd-barefoot", changes=("model.contact={right: toe_first, left: heel_toe}",))
    coarse = {"mesh.intervals": 16, "mesh.refinements": 0, "solver.tolerance": 1e-3}
    solution = GaitSolver(case.with_values(coarse)).solve()
    assert solution.converged
    names = solution.walker.pattern.names
    assert names[-2:] == ("left_toe_right_toe", "left_toe_right_flat")
    monkeypatch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
    write_run(tmp_path / "run", solution)
    del USES["toe_first"]
    run = load_run(tmp_path / "run")
    assert (run.config.model.contact.right.landing, run.config.model.contact.left) == (
        ("toe", "flat"), USES["heel_toe"],
    )  # fmt: skip
    assert gait_series(run.case.walker(), run.motion).phase == solution.series.phase
    text = (tmp_path / "run" / "config.resolved.yaml").read_text()
    assert "toe_first" not in text
    assert "left: heel_toe" in text


@pytest.mark.parametrize(
    ("single", "landing", "sentence"),
    [
        (("flat", "toe"), ("heel", "toe"), "from heel to toe"),
        (("toe",), ("heel",), "without standing flat"),
        ((), ("heel",), "without any posture"),
        (("flat", "toe", "flat"), ("flat",), "comes back"),
        (("flat", "tip"), ("flat",), "names 'tip'"),
    ],
)
def test_uses_that_no_foot_can_have_are_refused(
    single: tuple[Any, ...], landing: tuple[Any, ...], sentence: str
) -> None:
    with pytest.raises(InputError, match=sentence):
        register_use("own", single, landing)
    change = f"model.contact={{single: {list(single)}, landing: {list(landing)}}}"
    with pytest.raises(ConfigError):
        load_case("mapd-barefoot", changes=(change,))
    with pytest.raises(InputError, match="there is a use 'flat' already"):
        register_use("flat", ("flat",), ("flat",))


def test_installed_packages_register_what_they_have(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known(GOALS, monkeypatch, "from_a_package")
    (tmp_path / "walking_extras.py").write_text(
        "from dataclasses import replace\n"
        "from pathwalker_cli import register_goal\n"
        "from pathwalker_cli.gait.costs import GOALS\n"
        "def register():\n"
        "    term = replace(GOALS['crouch'], integrals=('packed',))\n"
        "    register_goal('from_a_package', term)\n"
    )
    info = tmp_path / "walking_extras-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: walking-extras\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[pathwalker]\nextras = walking_extras:register\n")
    monkeypatch.syspath_prepend(str(tmp_path))
    load_installed.cache_clear()
    case = load_case("mapd-barefoot", changes=("cost.goals={from_a_package: 1.0}",))
    assert case.config.cost.wanted.names == ("from_a_package",)
    load_installed.cache_clear()


def test_what_travels_is_pickled_and_told_in_a_line(made_solution: MadeSolution) -> None:
    solution = made_solution()
    for thing in (solution, solution.case, solution.walker, solution.walker.patient,
                  solution.series):  # fmt: skip
        assert len(repr(thing)) < 160, repr(thing)
        again = pickle.loads(pickle.dumps(thing))  # noqa: S301 - made just now
        assert repr(again) == repr(thing)
    again = pickle.loads(pickle.dumps(solution))  # noqa: S301
    assert again.series.q == pytest.approx(solution.series.q)
    assert again.walker.weight == pytest.approx(solution.walker.weight)


def test_a_solution_is_drawn_unless_it_is_none(made_solution: MadeSolution) -> None:
    solution = made_solution()
    assert isinstance(solution.plot(), Figure)
    with pytest.raises(InputError, match="allowed: stick_figures"):
        solution.plot("nonsense")
    with pytest.raises(NotConvergedError):
        replace(solution, status="iteration limit").plot()


def test_the_package_lists_what_it_offers() -> None:
    assert set(dir(pathwalker_cli)) == set(pathwalker_cli.__all__)
    for name in pathwalker_cli.__all__:
        assert getattr(pathwalker_cli, name)
    assert (Path(pathwalker_cli.__file__).parent / "py.typed").is_file()
