"""Worker processes of every kind of pool: they end with their parent, who alone hears Ctrl-C."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing.process import BaseProcess
from typing import Any, Final, TypeVar

from pathwalker_cli.errors import NotConvergedError

__all__ = ["called_elsewhere", "deaf", "prepare_worker"]

LOST: Final = (
    "a process was ended from outside (out of memory?); call again, with fewer processes if need be"
)
"""What to know if a worker dies."""

Result = TypeVar("Result")


@contextmanager
def deaf() -> Iterator[None]:
    """Put Ctrl-C off; processes that are begun meanwhile are deaf until they say otherwise."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def prepare_worker() -> None:
    """Make a worker deaf to Ctrl-C, which is for the parent, and end it with its parent.

    A killed parent cannot tell its workers: they would wait for work forever.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_wait_and_end, args=(parent,), daemon=True).start()


def _wait_and_end(parent: BaseProcess) -> None:
    parent.join()
    os._exit(1)


def called_elsewhere(
    call: Callable[..., Result],
    calls: Sequence[tuple[Any, ...]],
    workers: int,
    begin: Callable[..., None] = prepare_worker,
    arguments: tuple[Any, ...] = (),
) -> Iterator[Result]:
    """Yield the results of calls in worker processes as they come.

    If the caller stops, e.g. by Ctrl-C, all workers are ended at once.

    Args:
        call: What is called.
        calls: Its arguments, a tuple for every call.
        workers: Most processes.
        begin: Called first in every process; begins with `prepare_worker`.
        arguments: Arguments of `begin`.

    Raises:
        NotConvergedError: If a worker died.
    """
    others = multiprocessing.active_children()
    context = multiprocessing.get_context("spawn")
    count = min(workers, len(calls))
    pool = ProcessPoolExecutor(count, context, initializer=begin, initargs=arguments)
    try:
        with deaf():
            futures = [pool.submit(call, *each) for each in calls]
        for future in as_completed(futures):
            yield future.result()
    except BrokenProcessPool:
        raise NotConvergedError(LOST) from None
    except BaseException:
        for worker in multiprocessing.active_children():
            if worker not in others:
                worker.kill()
        raise
    finally:
        pool.shutdown(cancel_futures=True)
