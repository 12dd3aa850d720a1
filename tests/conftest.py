"""What all tests share: figures without a screen, no network, and a run without a solve."""

from __future__ import annotations

import os
import socket
from collections.abc import Callable, Iterator
from dataclasses import replace
from io import StringIO
from pathlib import Path
from typing import Any

os.environ["MPLBACKEND"] = "Agg"

import numpy as np
import pytest
from hypothesis import HealthCheck, settings
from matplotlib.figure import Figure

from figure_measure import complaints
from helpers import stylised_series, walker_of
from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.solution import GaitSolution, StageRecord
from pathwalker_cli.nlp.result import Multipliers, NlpResult
from pathwalker_cli.ocp.violations import ActiveBound, Violation
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.results.run_folder import write_run
from pathwalker_cli.stride.verify import Reintegration

_LENGTHS = {"short": 15, "long": 3000}
"""Examples of each property; the suite tries the same few ones every time."""

for _profile, _examples in _LENGTHS.items():
    settings.register_profile(
        _profile,
        max_examples=_examples,
        derandomize=_profile == "short",
        deadline=None,
        database=None,
        suppress_health_check=tuple(HealthCheck),
    )
settings.load_profile("short")

MadeSolution = Callable[..., GaitSolution]


@pytest.fixture(autouse=True, scope="session")
def _no_network() -> Iterator[None]:
    """Refuse connections to other machines: nothing here needs any."""
    connect = socket.socket.connect

    def refuse(self: socket.socket, address: Any) -> None:
        if self.family != socket.AF_UNIX and address[0] not in ("127.0.0.1", "::1"):
            raise OSError(f"tests must not connect to {address}")
        connect(self, address)

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(socket.socket, "connect", refuse)
        yield


@pytest.fixture(autouse=True, scope="session")
def _own_cache(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Keep derived functions apart from the user's, and share them between tests."""
    with pytest.MonkeyPatch.context() as patch:
        base = tmp_path_factory.getbasetemp()
        shared = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
        patch.setenv("PATHWALKER_CACHE", str(shared / "cache"))
        yield


@pytest.fixture(autouse=True, scope="session")
def _legible_figures() -> Iterator[None]:
    """Let no figure be saved whose text cannot be read when it is printed as wide as a column."""
    save = Figure.savefig

    def checked(self: Figure, *words: Any, **options: Any) -> Any:
        result = save(self, *words, **options)
        if options.get("format") == "svg":  # frames of films are for screens
            found = complaints(self)
            assert not found, found
        return result

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Figure, "savefig", checked)
        yield


_EMPTY = {
    "png": b"\x89PNG\r\n\x1a\n",
    "svg": b'<svg xmlns="http://www.w3.org/2000/svg" width="1" height="1" version="1.1"></svg>',
}


def sketch(patch: pytest.MonkeyPatch) -> None:
    """Lay figures out and judge their texts, but save them empty: drawing is what takes long."""
    judged: list[Figure] = []

    def save(self: Figure, file: Any, *, format: str, **_: Any) -> None:
        if self not in judged:  # its layout is settled when it is saved first
            found = complaints(self)
            assert not found, found
            judged.append(self)
        if isinstance(file, StringIO):
            file.write(_EMPTY[format].decode())
        else:
            Path(file).write_bytes(_EMPTY[format])

    patch.setattr(Figure, "savefig", save)


@pytest.fixture
def sketched(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only sketch figures, but in tests that are marked `drawn`."""
    if not request.node.get_closest_marker("drawn"):
        sketch(monkeypatch)


def made_result() -> NlpResult:
    """Return the end of a nonlinear program of two unknowns and one row."""
    two, one = np.array([0.1, -0.2]), np.array([0.5])
    return NlpResult("converged", two, one, 0.4, Multipliers(two, one), 42, 1.5, 0.5)


@pytest.fixture(scope="session")
def made_solution() -> MadeSolution:
    """Return a function that makes the end of a solve out of the stylised gait."""
    known: dict[str, dict[str, Any]] = {}

    def series_of(solution: GaitSolution) -> dict[str, Any]:
        """Return what follows from motion and walker alone, once for all ends of a problem."""
        condition = solution.walker.condition
        if condition not in known:
            known[condition] = {
                "last_iterate": solution.last_iterate, "second_engine": solution.second_engine,
            }  # fmt: skip
        return known[condition]

    def make(problem: str = "mapd-orthosis", **changes: Any) -> GaitSolution:
        case = changes.get("case") or Case.of(changes.pop("config", None) or load_config(problem))
        walker = walker_of(PROBLEMS[problem].condition)
        errors = (np.array([2e-4, 5e-4]), np.array([3e-4]))
        solution = GaitSolution(
            case=case,
            walker=walker,
            status="converged",
            last_motion=(stylised_series(PROBLEMS[problem].condition).motion),
            nlp=made_result(),
            bounds=gait_bounds(walker, case.config.bounds),
            cost=0.4,
            cost_terms={"effort_per_distance": 0.4},
            violations=(Violation("knee_r rate in right_toe at 50 % of the phase", 2e-9),),
            active=(
                ActiveBound("knee_l", "lower", 0.264, ("left_toe",)),
                ActiveBound("walking_speed", "lower", 0.636, ()),
                ActiveBound("hip_extension_r_activation", "lower", 0.0, ("right_toe",)),
            ),
            reintegration=Reintegration(errors, errors),
            cost_error=-8e-4,
            start="synthetic",
            stages=(StageRecord("fine", "converged", 32, 5000, 42, 1.5, 0.5),),
            seconds={"build": 1.0, "solve": 1.5, "verify": 0.2},
        )
        changed = replace(solution, **changes)
        if changed.last_motion is solution.last_motion and changed.walker is walker:
            changed.__dict__.update(series_of(solution))
        return changed

    return make


@pytest.fixture(scope="session")
def made_runs(made_solution: MadeSolution, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with a barefoot run and one with orthoses, to be read or copied."""
    folder = tmp_path_factory.mktemp("made")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("pathwalker_cli.stride.figures.save.save_figures", lambda *_: ())
        for problem in ("mapd-barefoot", "mapd-orthosis"):
            write_run(folder / problem, made_solution(problem))
    return folder
