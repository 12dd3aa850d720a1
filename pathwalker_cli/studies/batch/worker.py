"""What a worker does: one case from its config to its run folder, in any process on any machine."""

from __future__ import annotations

import os
import socket
import threading
import time
import traceback
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, Protocol, TypedDict

from pathwalker_cli.errors import PathwalkerError

if TYPE_CHECKING:
    from pathwalker_cli.case import Case

__all__ = ["LOST", "Pool", "Result", "Task", "Work", "failure", "solve_case"]

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
    """One case, as it travels.

    Args:
        name: Name of the case.
        case: Its config and its patient.
        folder: Full path of its run folder.
        warm_start: Full path of the run to begin with; "" without.
    """

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
