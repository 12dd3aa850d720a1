"""Workers on this machine: processes, of which each that dies loses only the case in its hands."""

from __future__ import annotations

import multiprocessing
import signal
from collections import deque
from collections.abc import Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from typing import Final

from pebble import ProcessExpired, ProcessPool

from pathwalker_cli.io.processes import deaf, prepare_worker
from pathwalker_cli.nlp.machine import use_one_blas_thread
from pathwalker_cli.studies.batch.worker import LOST, Result, Task, Work, failure

__all__ = ["LocalPool"]

ATTEMPTS: Final = 2
"""How often a case is tried whose worker dies: once more when the others are done, when there is
more memory for it."""

GLANCE: Final = 1.0
"""Time after which it is noticed that no worker can begin at all [s]."""

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
            if waiting:
                yield from self._round(waiting, work, lost)
            waiting = [task for task in waiting if task.name in lost]
        for name, detail in lost.items():
            yield name, failure(LOST, detail)

    def _round(
        self, tasks: Sequence[Task], work: Work, lost: dict[str, str]
    ) -> Iterator[tuple[str, Result]]:
        """Try every task once; note the ones whose worker died in `lost`, with the reason."""
        waiting, running = deque(tasks), dict[Future[Result], str]()
        count = min(self._count, len(tasks))
        context = multiprocessing.get_context("spawn")
        pool = ProcessPool(max_workers=count, initializer=prepare_worker, context=context)
        try:
            while (waiting or running) and pool.active:
                while waiting and len(running) < count:
                    task = waiting.popleft()
                    running[self._submit(pool, task, work)] = task.name
                for future in wait(running, GLANCE, FIRST_COMPLETED).done:
                    name = running.pop(future)
                    try:
                        result = self._result(future)
                    except (ProcessExpired, BrokenProcessPool) as death:
                        lost[name] = _death(death)
                    else:
                        yield name, result
        finally:
            with deaf():  # within the pool it could leave a lock held, and the pool never end
                pool.stop()
                pool.join()
        lost |= dict.fromkeys([*running.values(), *(task.name for task in waiting)], NO_WORKERS)

    def _submit(self, pool: ProcessPool, task: Task, work: Work) -> Future[Result]:
        arguments = (task.case, task.folder, task.warm_start)
        with deaf():
            return pool.schedule(work, args=arguments, timeout=self._time_limit)

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
