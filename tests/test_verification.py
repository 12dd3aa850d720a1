"""A run folder is checked from its files alone; what was tampered with is found and named."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from conftest import sketch
from pathwalker_cli.cli import cli
from pathwalker_cli.gait.motion_file import read_motion, write_motion
from pathwalker_cli.results.metrics import sha256
from pathwalker_cli.studies.batch.ledger import numbers_of, read_metrics
from pathwalker_cli.verification import checks
from pathwalker_cli.verification.checks import Verification

pytestmark = pytest.mark.usefixtures("sketched")


@pytest.fixture(autouse=True)
def _judged_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Judge the same content in the same place once, whether a test or the command asks."""
    verify_run, known = checks.verify_run, {}

    def once(folder: str | Path) -> Verification:
        files = sorted(path for path in Path(folder).rglob("*") if path.is_file())
        content = (str(folder), *((path, path.read_bytes()) for path in files))
        if content not in known:
            known[content] = verify_run(folder)
        return known[content]

    monkeypatch.setattr(checks, "verify_run", once)


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a run that followed a recording: the quickest that meets its mesh tolerance."""
    folder = tmp_path_factory.mktemp("runs") / "fit"
    words = ["solve", "ls-barefoot", "ls-barefoot", "--out", str(folder), "--quiet"]
    with pytest.MonkeyPatch.context() as patch:
        sketch(patch)
        assert CliRunner().invoke(cli, words).exit_code == 0
    return folder


@pytest.fixture
def run(solved: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(solved, tmp_path / "elsewhere"))


def failed(verification: Verification) -> set[str]:
    return {check.name for check in verification.checks if not check.passed}


def replaced(name: str, old: str, new: str) -> Callable[[Path], None]:
    """Return what replaces text in a file of a run."""

    def tamper(run: Path) -> None:
        text = (run / name).read_text(encoding="utf-8")
        assert old in text
        (run / name).write_text(text.replace(old, new, 1), encoding="utf-8")

    return tamper


def table_cell(name: str) -> Callable[[Path], None]:
    """Return what changes one number of a table by 1 %."""

    def tamper(run: Path) -> None:
        lines = (run / name).read_text(encoding="utf-8").splitlines()
        cells = lines[40].split(",")
        cells[5] = f"{1.01 * float(cells[5]) + 0.01:.9g}"
        lines[40] = ",".join(cells)
        (run / name).write_text("\n".join(lines) + "\n", encoding="utf-8")

    return tamper


def metric(key: str, factor: float) -> Callable[[Path], None]:
    def tamper(run: Path) -> None:
        metrics = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
        metrics[key] *= factor
        (run / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")

    return tamper


def noted(run: Path) -> None:
    """Change what no motion tells."""
    metrics = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    metrics["active_bounds"] = []
    (run / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")


def moved(run: Path) -> None:
    """Change the motion itself, and its hash, tables left as they were."""
    motion = read_motion(run / "motion.npz")
    motion.phases[2].states[1, 5] += 1e-3
    motion.phases[2].inner_states[0, -1, 5] += 1e-3
    write_motion(run / "motion.npz", motion)
    metrics = json.loads((run / "metrics.json").read_text(encoding="utf-8"))
    metrics["motion_hash"] = sha256((run / "motion.npz").read_bytes())
    (run / "metrics.json").write_text(json.dumps(metrics), encoding="utf-8")


def test_a_run_is_in_order_wherever_it_stands(run: Path) -> None:
    found = checks.verify_run(run)
    assert found.passed, failed(found)
    assert len(found.checks) >= 20
    assert all(check.value is not None for check in found.checks)
    done = CliRunner().invoke(cli, ["verify", str(run)])
    assert done.exit_code == 0
    assert "All checks passed." in done.output
    told = json.loads(CliRunner().invoke(cli, ["verify", str(run), "--json"]).stdout)
    assert told["runs"][0]["passed"] is True


@pytest.mark.parametrize(
    ("tamper", "names"),
    [
        (table_cell("states.csv"), {"states.csv"}),
        (table_cell("forces.csv"), {"forces.csv"}),
        (metric("walking_speed", 1.001), {"metrics.json"}),
        (metric("cost", 0.99), {"metrics.json"}),
        (noted, {"metrics.json, all of it"}),
        (replaced("patient.yaml", "height: 1.25", "height: 1.26"), {"patient.yaml"}),
        (replaced("config.resolved.yaml", "friction: 0.8", "friction: 0.7"),
         {"config.resolved.yaml"}),
        (moved, {"states.csv", "numeric Pinocchio", "rows and bounds"}),
    ],
    ids=["table", "forces", "metric", "cost", "note", "patient", "config", "motion"],
)  # fmt: skip
def test_what_was_tampered_with_is_found(
    run: Path, tamper: Callable[[Path], None], names: set[str]
) -> None:
    tamper(run)
    found = checks.verify_run(run)
    assert names <= failed(found)
    done = CliRunner().invoke(cli, ["verify", str(run)])
    assert done.exit_code == 1
    assert "FAILED" in done.output


@pytest.mark.parametrize("name", ["motion.npz", "multipliers.npz", "metrics.json", "states.csv"])
@pytest.mark.parametrize("share", [0.0, 0.99])
def test_a_truncated_file_is_refused_or_found(run: Path, name: str, share: float) -> None:
    content = (run / name).read_bytes()
    (run / name).write_bytes(content[: int(share * len(content))])
    done = CliRunner().invoke(cli, ["verify", str(run)])
    assert done.exit_code in (1, 2)
    assert isinstance(done.exception, SystemExit)
    assert name in done.output


def test_a_run_comes_out_again_to_the_last_bit(run: Path) -> None:
    done = CliRunner().invoke(cli, ["rerun", str(run)])
    assert done.exit_code == 0, done.output
    assert "the same to the last bit" in done.output
    again = run.with_name("elsewhere-again")
    for name in ("states.csv", "controls.csv", "forces.csv", "torques.csv", "motion.npz"):
        assert (again / name).read_bytes() == (run / name).read_bytes(), name
    one, two = (np.load(folder / "multipliers.npz") for folder in (run, again))
    assert all(np.array_equal(one[key], two[key]) for key in one.files)


def cohort(folder: Path, *runs: Path) -> Path:
    """Write the folder of a batch, one case per run."""
    rows = []
    for run in runs:
        shutil.copytree(run, folder / "cases" / run.name)
        metrics = read_metrics(run)
        assert metrics is not None
        cells = {"case": run.name, "patient": metrics["patient"], "status": metrics["status"]}
        rows.append(cells | numbers_of(metrics["status"], metrics))
    rows.append({"case": "lost", "patient": "anna", "status": "failed: memory"})
    with (folder / "cases.csv").open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, list(rows[0]), restval="")
        writer.writeheader()
        writer.writerows(rows)
    return folder


def test_a_batch_stands_for_its_runs_and_its_table_is_checked(run: Path, tmp_path: Path) -> None:
    folder = cohort(tmp_path / "cohort", run)
    told = CliRunner().invoke(cli, ["verify", str(folder), "--json"])
    assert told.exit_code == 0, told.output
    table, case = json.loads(told.stdout)["runs"]
    assert table["problem"] == "table of 2 cases"
    assert Path(case["folder"]).name == run.name
    assert "table of 2 cases\n ok" in CliRunner().invoke(cli, ["verify", str(folder)]).output
    text = (folder / "cases.csv").read_text(encoding="utf-8")
    speed = f"{read_metrics(run)['walking_speed']:.9g}"
    (folder / "cases.csv").write_text(text.replace(speed, "0.7", 1), encoding="utf-8")
    done = CliRunner().invoke(cli, ["verify", str(folder)])
    assert done.exit_code == 1
    assert "FAILED  cases.csv" in done.output
    assert f"{run.name} not as in its metrics.json" in done.output


def test_a_folder_that_cannot_be_read_does_not_hide_the_others(run: Path, tmp_path: Path) -> None:
    done = CliRunner().invoke(cli, ["verify", str(tmp_path / "nothing"), str(run)])
    assert done.exit_code == 2
    assert "no such folder" in done.output
    assert "All checks passed." in done.output
