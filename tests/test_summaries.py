"""Spoilt `metrics.json` and summaries of studies: a page as before, or one sentence."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Final

import pytest

from conftest import MadeSolution
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.report.folders import STUDIES, Kind, studies_near
from pathwalker_cli.report.page import page_of
from pathwalker_cli.report.runs import read_runs
from pathwalker_cli.report.study_tables import study_section
from pathwalker_cli.results import run_folder
from pathwalker_cli.results.metrics import RunMetrics
from pathwalker_cli.studies.verdict import verdict_of_metrics
from pathwalker_cli.studies.verdict.words import verdict_lines
from report_runs import write_made_run
from test_report import write_studies

JUNK: Final = (None, "x", -1, [], {}, [None], {"a": "b"}, 1e308, True)
DELETED: Final = object()

Place = tuple[str | int, ...]


def spoilt(content: Any) -> Iterator[tuple[str, Any]]:
    """Yield plain values with one of them replaced or gone, and which; of lists the first."""
    for place in places(content):
        for junk in (*JUNK, DELETED):
            copy = json.loads(json.dumps(content))
            inner = copy
            for key in place[:-1]:
                inner = inner[key]
            if junk is DELETED:
                del inner[place[-1]]
            else:
                inner[place[-1]] = junk
            yield f"{'.'.join(map(str, place))}: {junk!r}", copy


def places(content: Any, prefix: Place = ()) -> Iterator[Place]:
    """Yield where values stand."""
    items = content.items() if isinstance(content, dict) else [*enumerate(content)][:1]
    for key, value in items:
        yield (*prefix, key)
        if isinstance(value, dict | list):
            yield from places(value, (*prefix, key))


def tried(file: Path, contents: Iterator[tuple[str, Any]], read: Callable[[], Any]) -> int:
    """Read a file with every content; return how many were refused."""
    refused = 0
    for name, content in contents:
        file.write_text(json.dumps(content), encoding="utf-8")
        try:
            read()
        except InputError:
            refused += 1
        except Exception as problem:
            raise AssertionError(name) from problem
    return refused


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory, made_solution: MadeSolution) -> Path:
    """Return the folder of a run with a verdict."""
    folder = tmp_path_factory.mktemp("runs")
    return write_made_run(folder, made_solution, "mapd-orthosis")


@pytest.mark.parametrize("kind", STUDIES)
def test_any_value_in_a_summary_of_a_study(
    kind: Kind, run: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_studies(tmp_path, run)
    (shown,) = read_runs([run])
    metrics = shown.run.metrics
    file = tmp_path / kind / STUDIES[kind]

    def read() -> None:
        for study in studies_near([(run, metrics)], {kind: [file.parent]}):
            study_section(study, shown)

    read()
    contents = [*spoilt(json.loads(file.read_text(encoding="utf-8")))]
    assert tried(file, iter(contents), read) > len(contents) / 3


def test_any_value_in_the_metrics_of_a_run(run: Path, tmp_path: Path) -> None:
    file = run / "metrics.json"
    before = file.read_text(encoding="utf-8")

    def read() -> None:
        verdict = verdict_of_metrics(run_folder._read_metrics(run))
        if verdict is not None:
            list(verdict_lines(verdict))

    content = json.loads(before)
    kept = {"run_format": content["run_format"]}
    kept |= {key: content[key] for key in RunMetrics.model_fields if key in content}
    try:
        assert tried(file, spoilt(kept), read) > 100
    finally:
        file.write_text(before, encoding="utf-8")


@pytest.mark.parametrize(
    "change",
    [
        {"reintegration_position_error": {}},
        {"bound_sources": {"hip_r": None}},
        {"active_bounds": [1]},
        {"notes": "x"},
        {"effort": "x"},
        {"date": []},
        {"intervals": "x"},
    ],
)
def test_pages_of_spoilt_metrics_are_refused(run: Path, change: dict[str, Any]) -> None:
    file = run / "metrics.json"
    before = file.read_text(encoding="utf-8")
    file.write_text(json.dumps({**json.loads(before), **change}), encoding="utf-8")
    try:
        with pytest.raises(DataError, match=rf"metrics.json: {next(iter(change))}.* is "):
            page_of([run])
    finally:
        file.write_text(before, encoding="utf-8")
