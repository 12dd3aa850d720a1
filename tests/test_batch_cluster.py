"""Studies of many cases on Dask: a real cluster on this machine, with workers that are killed."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Iterator
from importlib import util
from pathlib import Path
from threading import Timer
from typing import Any

import dask
import pytest
from distributed import Client, LocalCluster

from fake_work import fake_work
from pathwalker_cli.case import load_case
from pathwalker_cli.errors import BackendError, ConfigError
from pathwalker_cli.studies.batch import cluster as module
from pathwalker_cli.studies.batch.cluster import DaskPool, connected, slurm_jobs
from pathwalker_cli.studies.batch.study import Watch, run_batch
from pathwalker_cli.studies.batch.worker import LocalPool, Task
from test_batch import awaited, kinds, table_of


@pytest.fixture(scope="module")
def cluster() -> Iterator[LocalCluster]:
    """Return two worker processes of one thread each; a case may lose two of them."""
    with (
        dask.config.set({"distributed.scheduler.allowed-failures": 1}),
        LocalCluster(
            n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0"
        ) as made,
    ):
        yield made


def test_the_table_is_that_of_local_workers_though_one_is_killed(
    tmp_path: Path, cluster: LocalCluster
) -> None:
    cases = kinds(tmp_path, "is_fine", "dies_once", "fails", "is_hard", "is_good", "dies")
    run_batch(cases, tmp_path / "local", LocalPool(2), Watch(), fake_work)
    with connected(cluster.scheduler_address) as pool:
        run_batch(cases, tmp_path / "dask", pool, Watch(), fake_work)
    ours, theirs = ((tmp_path / name / "cases.csv").read_bytes() for name in ("local", "dask"))
    assert theirs == ours
    assert table_of(tmp_path / "dask")["dies_once"]["status"] == "converged"


def test_what_has_not_begun_is_taken_back_when_the_caller_stops(
    tmp_path: Path, cluster: LocalCluster
) -> None:
    case = load_case("mapd-barefoot")
    tasks = [Task(str(i), case, str(tmp_path / "cases" / str(i))) for i in range(30)]
    with Client(cluster.scheduler_address) as client:
        results = DaskPool(client).run(tasks, fake_work)
        next(results)
        results.close()  # type: ignore[attr-defined]
    assert len(list((tmp_path / "cases").iterdir())) < 30


def test_a_lost_scheduler_is_the_reason_of_all_cases_that_are_left(tmp_path: Path) -> None:
    cases, facts = kinds(tmp_path, "is_fine", "is_good"), tmp_path / "scheduler.json"
    words = ["scheduler", "--host", "127.0.0.1", "--port", "0", "--dashboard-address", ":0"]
    command = [sys.executable, "-m", "dask", *words, "--scheduler-file", facts]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parent)}
    with subprocess.Popen(command, stderr=subprocess.DEVNULL, env=environment) as scheduler:
        address = awaited(lambda: facts.exists() and json.loads(facts.read_text()))["address"]
        with connected(address) as pool:
            Timer(0.5, scheduler.kill).start()
            report = run_batch(cases, tmp_path / "out", pool, Watch(), fake_work)
    reason = "failed: the connection to the scheduler was lost"
    assert [case.status for case in report.failed] == [reason, reason]


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nonsense", "foo://127.0.0.1:1"])
def test_a_scheduler_that_does_not_answer_is_refused(
    address: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "PATIENCE", 1.0)
    with pytest.raises(ConfigError, match=f"--scheduler {address}: no Dask scheduler answers"):
        connected(address).__enter__()


def test_a_missing_extra_names_its_install_command(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(util, "find_spec", lambda _: None)
    for enter in (connected("tcp://127.0.0.1:1"), slurm_jobs(2)):
        with pytest.raises(BackendError, match=r'pip install "pathwalker-cli\[cluster\]"'):
            enter.__enter__()


def test_slurm_starts_jobs_as_dask_describes_them(
    cluster: LocalCluster, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[Any] = []

    class Jobs:
        scheduler_address = cluster.scheduler_address

        def __enter__(self) -> Jobs:
            return self

        def __exit__(self, *_: object) -> None:
            calls.append("ended")

        def scale(self, jobs: int) -> None:
            calls.append(jobs)

    monkeypatch.setattr("dask_jobqueue.slurm.SLURMCluster", Jobs)
    with slurm_jobs(3) as pool:
        assert pool.workers == 3
        assert calls == [3]
    assert calls == [3, "ended"]


def test_slurm_without_a_description_of_a_job_is_refused() -> None:
    with pytest.raises(ConfigError, match=r"cores and memory.*jobqueue\.slurm"):
        slurm_jobs(2).__enter__()
