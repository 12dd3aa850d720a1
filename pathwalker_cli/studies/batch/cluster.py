"""Workers on other machines, by Dask: a scheduler that runs already, or jobs of Slurm."""

from __future__ import annotations

import logging
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import CancelledError
from contextlib import contextmanager, suppress
from typing import Any, Final

from pathwalker_cli.errors import BackendError, ConfigError
from pathwalker_cli.studies.batch.worker import LOST, Result, Task, Work, failure

INSTALL: Final = 'pip install "pathwalker-cli[cluster]"'

PATIENCE: Final = 10.0
"""Time in which a scheduler must answer [s]."""

GLANCE: Final = 1.0
"""Time after which new workers are noticed [s]."""

_DISCONNECTED: Final = "the connection to the scheduler was lost"


class DaskPool:
    """Workers of a Dask scheduler; Dask hands the case of a lost worker to another one.

    Their number is None if it changes.
    """

    def __init__(self, client: Any, workers: int | None = None) -> None:
        self.workers = workers
        self._client = client

    def run(self, tasks: Sequence[Task], work: Work) -> Iterator[tuple[str, Result]]:
        """Yield name and result of every task as they end.

        No more tasks are handed out than there are workers: a worker that dies takes everything
        along that it was handed.  If the caller stops, tasks that have begun may still end.
        """
        waiting = deque(tasks)
        running: dict[Any, str] = {}
        try:
            while waiting or running:
                if self._client.status != "running":
                    break
                free = self._threads() - len(running)
                for task in (waiting.popleft() for _ in range(min(free, len(waiting)))):
                    arguments = (task.case, task.folder, task.warm_start)
                    running[self._client.submit(work, *arguments, pure=False)] = task.name
                for future in _ended(running):
                    yield running.pop(future), _result(future)
                    future.release()
        finally:
            if self._client.status == "running":
                self._client.cancel(list(running))
        for name in (*running.values(), *(task.name for task in waiting)):
            yield name, failure(_DISCONNECTED)

    def _threads(self) -> int:
        """Return how many tasks can run at a time; one before the first worker is there."""
        try:
            return max(1, sum(self._client.nthreads().values()))
        except OSError:
            return 1


def _ended(running: Iterable[Any]) -> list[Any]:
    """Return the futures that ended within a moment."""
    from distributed import wait

    with suppress(TimeoutError, CancelledError):
        wait(list(running), timeout=GLANCE, return_when="FIRST_COMPLETED")
    return [future for future in running if future.status != "pending"]


def _result(future: Any) -> Result:
    """Return what a worker handed back, or why there is nothing."""
    if future.status == "finished":
        result: Result = future.result()
        return result
    if future.status != "error":
        return failure(_DISCONNECTED)
    error = future.exception()
    if type(error).__name__ == "KilledWorker":
        return failure(LOST, " ".join(str(error).split()))
    return failure(f"{type(error).__name__}: {error}")


@contextmanager
def connected(address: str) -> Iterator[DaskPool]:
    """Yield the workers of a scheduler that runs already.

    Args:
        address: Its address, e.g. "tcp://10.0.0.1:8786".

    Raises:
        ConfigError: If it does not answer.
        BackendError: If Dask is not installed.
    """
    _require("distributed")
    from distributed.comm.addressing import get_address_host_port

    try:
        get_address_host_port(address)
        client = _client(address)
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(
            f"no Dask scheduler answers there: {' '.join(str(error).split())}",
            where=f"--scheduler {address}",
            allowed="slurm, or the address that `dask scheduler` prints, e.g. tcp://10.0.0.1:8786",
            mend="check that it runs and can be reached from here",
        ) from None
    with client:
        yield DaskPool(client)


@contextmanager
def slurm_jobs(jobs: int) -> Iterator[DaskPool]:
    """Yield workers in jobs of Slurm, as Dask's own configuration `jobqueue.slurm` describes them.

    Args:
        jobs: Number of jobs; they are ended with the study.

    Raises:
        ConfigError: If Dask's configuration of a job is not complete.
        BackendError: If Dask is not installed.
    """
    _require("dask_jobqueue")
    from dask_jobqueue.slurm import SLURMCluster

    try:
        cluster = SLURMCluster()
    except (OSError, ValueError, TypeError) as error:
        raise ConfigError(
            f"a job cannot be described: {' '.join(str(error).split())}",
            where="--scheduler slurm",
            mend="give cores and memory of a job under jobqueue.slurm in Dask's configuration",
        ) from None
    with cluster, _client(cluster.scheduler_address) as client:
        cluster.scale(jobs=jobs)
        yield DaskPool(client, jobs)


def _client(address: str) -> Any:
    """Return a connection to a scheduler; what it would log of a loss, the study says."""
    from distributed import Client

    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    return Client(address, timeout=PATIENCE)


def _require(library: str) -> None:
    """Refuse to go on without a library of the extra."""
    from importlib.util import find_spec

    if find_spec(library) is None:
        raise BackendError(f"--scheduler needs {library}, which is not installed: {INSTALL}")
