"""What a worker does, in any process on any machine: one case to its run folder; those here."""

from __future__ import annotations

import os
import signal
import socket
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol, TypedDict

from pebble import ProcessExpired

from pathwalker_cli.errors import PathwalkerError
from pathwalker_cli.io.processes import ended_calls
from pathwalker_cli.nlp.machine import use_one_blas_thread

if TYPE_CHECKING:
    from pathwalker_cli.case import Case

LOST: Final = "its worker died every time it was tried"
"""Reason of a case that took its workers with it."""

_ALONE: Final = threading.Lock()
"""Held during a solve: IPOPT's linear solver is not made for several solves in one process."""


class Result(TypedDict):
    """How the work on a case ended.

    `wrote` says whether there is a run folder, converged or not; if there is none, `reason` says
    why, and `detail` may say more.  `seconds` is wall time [s], `worker` is host and process.
    """

    wrote: bool
    reason: str
    detail: str
    seconds: float
    worker: str


@dataclass(frozen=True)
class Task:
    """One case, as it travels: with full paths of run folder and run to begin with, "" for none."""

    name: str
    case: Case
    folder: str
    warm_start: str = ""


Work = Callable[["Case", str, str], Result]
"""Solves a case: config and patient, run folder, run to begin with."""


class Pool(Protocol):
    """Workers, wherever they are.

    `workers` is their number, or None if it changes.
    """

    workers: int | None

    def run(self, tasks: Sequence[Task], work: Work) -> Iterator[tuple[str, Result]]:
        """Yield name and result of every task as they end."""


def failure(reason: str, detail: str = "") -> Result:
    """Return the result of a case without a run folder."""
    return Result(wrote=False, reason=" ".join(reason.split()), detail=detail, seconds=0.0,
                  worker="")  # fmt: skip


def solve_case(case: Case, folder: str, warm_start: str) -> Result:
    """Solve a case and write its run folder; whatever goes wrong becomes a reason.

    Args:
        case: Config and patient.
        folder: The run folder.
        warm_start: Folder of the run to begin with; "" without.
    """
    with _ALONE:
        began = time.perf_counter()
        result = _solved(case, folder, warm_start)
    result["seconds"] = time.perf_counter() - began
    result["worker"] = f"{socket.gethostname()}:{os.getpid()}"
    return result


def _solved(case: Case, folder: str, warm_start: str) -> Result:
    """Solve a case; heavy libraries are loaded here, where they are needed."""
    try:
        from pathwalker_cli.results.run_folder import claimed_run
        from pathwalker_cli.studies.run import done_run, run_study

        # Dask repeats a task if its result gets lost, and ends none whose caller was killed
        with claimed_run(folder, wait=True):
            if done_run(Path(folder), case) is None:
                run_study(case, Path(folder), Path(warm_start) if warm_start else None)
    except PathwalkerError as error:
        return failure(str(error))
    except Exception as error:
        return failure(f"{type(error).__name__}: {error}", traceback.format_exc())
    return Result(wrote=True, reason="", detail="", seconds=0.0, worker="")


ATTEMPTS: Final = 2
"""How often a case is tried whose worker dies: once more when the others are done, when there is
more memory for it."""

NO_WORKERS: Final = "the workers died before they could begin; did memory run out?"


class LocalPool:
    """Processes on this machine, with the longest time of a case [s]; None without."""

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
