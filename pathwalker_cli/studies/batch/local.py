"""Workers on this machine: processes, of which each that dies loses only the case in its hands."""

from __future__ import annotations

import signal
from collections.abc import Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from typing import Final

from pebble import ProcessExpired

from pathwalker_cli.io.processes import ended_calls
from pathwalker_cli.nlp.machine import use_one_blas_thread
from pathwalker_cli.studies.batch.worker import LOST, Result, Task, Work, failure

__all__ = ["LocalPool"]

ATTEMPTS: Final = 2
"""How often a case is tried whose worker dies: once more when the others are done, when there is
more memory for it."""

NO_WORKERS: Final = "the workers died before they could begin; did memory run out?"


class LocalPool:
    """Processes on this machine.

    Args:
        workers: Their number.
        time_limit: Longest time of a case [s]; None without.
    """

    def __init__(self, workers: int, time_limit: float | None = None) -> None:
        self.workers: int | None = workers
        self._count = workers
        self._time_limit = time_limit

    def run(self, tasks: Sequence[Task], work: Work) -> Iterator[tuple[str, Result]]:
        """Yield name and result of every task as they end.

        If the caller stops, e.g. by Ctrl-C, all workers are stopped too.
        """
        use_one_blas_thread()
        lost: dict[str, str] = {}
        waiting = list(tasks)
        for _ in range(ATTEMPTS):
            lost.clear()
            calls = [(task.case, task.folder, task.warm_start) for task in waiting]
            with closing(ended_calls(work, calls, self._count, self._time_limit)) as ended:
                for number, future in ended:
                    name = waiting[number].name
                    try:
                        yield name, self._result(future)
                    except (ProcessExpired, BrokenProcessPool) as death:
                        lost[name] = _death(death)
            waiting = [task for task in waiting if task.name in lost]
        for name, detail in lost.items():
            yield name, failure(LOST, detail)

    def _result(self, future: Future[Result]) -> Result:
        """Return what a worker handed back.

        Raises:
            ProcessExpired: If it died.
            BrokenProcessPool: If all did.
        """
        try:
            return future.result()
        except (ProcessExpired, BrokenProcessPool):
            raise
        except TimeoutError:
            return failure(f"took longer than the time limit of {self._time_limit:g} s")
        except Exception as error:
            return failure(f"{type(error).__name__}: {error}")


def _death(error: ProcessExpired | BrokenProcessPool) -> str:
    """Return how a worker died, in words."""
    code = getattr(error, "exitcode", None)
    if not isinstance(code, int):
        return NO_WORKERS
    if code >= 0:
        return f"the worker ended with exit code {code}"
    return f"the worker was ended by {signal.Signals(-code).name}; did memory run out?"
