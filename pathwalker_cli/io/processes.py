"""Worker processes: they end with their parent, who alone hears Ctrl-C."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing, contextmanager, suppress
from multiprocessing import Pipe
from multiprocessing.connection import Connection
from multiprocessing.context import SpawnContext, SpawnProcess
from multiprocessing.resource_tracker import ensure_running
from multiprocessing.synchronize import RLock
from typing import Any, Final, TypeVar

from pebble import ProcessExpired, ProcessPool

from pathwalker_cli.errors import NotConvergedError

LOST: Final = (
    "a process was ended from outside (out of memory?); call again, with fewer processes if need be"
)
"""What to know if a worker dies."""

GLANCE: Final = 1.0
"""Time after which it is noticed that no worker can begin at all [s]."""

Result = TypeVar("Result")


@contextmanager
def _blocked_sigint() -> Iterator[None]:
    """Put Ctrl-C off; processes and threads that are begun meanwhile never hear it."""
    ensure_running()  # multiprocessing's own process, whose begin would let Ctrl-C in again
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def prepare_worker() -> None:
    """End a worker with its parent, and at once when it is asked to.

    A killed parent cannot tell its workers: they would wait for work forever.
    """
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    parent = multiprocessing.parent_process()
    assert parent is not None  # noqa: S101 - workers have one

    def wait_and_end() -> None:
        parent.join()
        os._exit(1)

    threading.Thread(target=wait_and_end, daemon=True).start()


def begun_process(work: Callable[..., None], *arguments: Any) -> tuple[SpawnProcess, Connection]:
    """Return a process that does some work, and what to talk to it with.

    The work is handed its end of that, then the arguments; it ends with this process.
    """
    here, there = Pipe()
    process = multiprocessing.get_context("spawn").Process(
        target=work, args=(there, *arguments), daemon=True
    )
    with _blocked_sigint():
        process.start()
    there.close()
    return process, here


class _KeptLocks(SpawnContext):
    """A context whose locks last as long as itself.

    The pool forgets its locks before it ends its workers; one that has only begun by then would
    miss them with a traceback.
    """

    def __init__(self) -> None:
        super().__init__()
        self.locks: list[RLock] = []

    def RLock(self) -> RLock:  # noqa: N802 - the name of the base class
        """Return a new lock, and keep it."""
        self.locks.append(super().RLock())
        return self.locks[-1]


def ended_calls(
    call: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    workers: int,
    time_limit: float | None = None,
) -> Generator[tuple[int, Future[Result]]]:
    """Yield number and future of every call as it ends in a worker process.

    A worker that dies takes along the one call in its hands, whose future raises `ProcessExpired`;
    if no worker can begin, all futures raise `BrokenProcessPool`.  If the caller stops, e.g. by
    Ctrl-C, all workers are ended at once.
    After the time limit [s] a call's future raises `TimeoutError`.
    """
    waiting, running = deque(enumerate(calls)), dict[Future[Result], int]()
    count, context = min(workers, len(calls)), _KeptLocks()
    pool = ProcessPool(count, initializer=prepare_worker, context=context)
    try:
        while waiting or running:
            with _blocked_sigint():  # asking whether a new pool is active makes it begin
                if not pool.active:
                    break
                with suppress(RuntimeError):  # it broke since it was asked
                    while waiting and len(running) < count:
                        scheduled = pool.schedule(call, waiting[0][1], timeout=time_limit)
                        running[scheduled] = waiting.popleft()[0]
            for future in wait(running, GLANCE, FIRST_COMPLETED).done:
                yield running.pop(future), future
    finally:
        with _blocked_sigint():  # within the pool it could leave a lock held, and it never end
            pool.stop()
            pool.join()
    broken: Future[Result] = Future()
    broken.set_exception(BrokenProcessPool())
    yield from ((number, broken) for number in (*running.values(), *(n for n, _ in waiting)))


def results_of_calls(
    call: Callable[..., Result], calls: Sequence[tuple[Any, ...]], workers: int
) -> Iterator[Result]:
    """Yield the results of calls in worker processes as they come; see `ended_calls`.

    Raises:
        NotConvergedError: If a worker died.
    """
    try:
        with closing(ended_calls(call, calls, workers)) as ended:
            for _, future in ended:
                yield future.result()
    except (ProcessExpired, BrokenProcessPool):
        raise NotConvergedError(LOST) from None
