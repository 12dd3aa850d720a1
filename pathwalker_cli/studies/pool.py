"""Neighbours of one run on many processes: each process builds its solver once and keeps it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from pathwalker_cli.case import Case
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.io.processes import results_of_calls
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import resolver_of
from pathwalker_cli.studies.journal import STOPPED, Journal
from pathwalker_cli.studies.measures import measures

__all__ = ["Job", "Solved", "solve_jobs"]


@dataclass(frozen=True)
class Job:
    """A neighbour to solve.

    Args:
        name: Its name in the journal.
        case: Its case.
    """

    name: str
    case: Case


@dataclass(frozen=True)
class Solved:
    """Where the solve of a neighbour ended.

    Args:
        name: Its name in the journal.
        status: "converged" or the reason why not.
        values: Its measures, SI units; empty if it did not converge.
        iterations: Iterations of the last attempt.
        seconds: Wall seconds of the last attempt.
        kept: Whether it was read and not solved now.
    """

    name: str
    status: str
    values: Mapping[str, float]
    iterations: int
    seconds: float
    kept: bool


def solve_jobs(
    jobs: Sequence[Job],
    run: Run,
    folder: Path,
    tolerance: float,
    workers: int,
    told: Callable[[Solved], None] | None = None,
) -> Iterator[Solved]:
    """Yield solved neighbours as they come; every one starts from the run itself.

    So it does not matter how many processes there are, and which one solves what.

    Args:
        jobs: What to solve.
        run: The run.
        folder: Folder of the journal.
        tolerance: Optimality tolerance.
        workers: Processes; with one, this process does it.
        told: Is told of every one.

    Raises:
        NotConvergedError: If the user stopped it, or a process was ended from outside.
    """
    source = _solved_here if min(workers, len(jobs)) == 1 else _solved_elsewhere
    for solved in source(jobs, (run, folder, tolerance), workers):
        if told is not None:
            told(solved)
        yield solved


_Origin = tuple[Run, Path, float]
"""Run, folder of the journal, and the tolerance."""


def _journal(origin: _Origin) -> Journal:
    run, folder, tolerance = origin
    return Journal(folder, run, resolver_of(run, tolerance))


def _solved(journal: Journal, job: Job) -> Solved:
    """Solve one neighbour."""
    before = journal.solved
    optimum = journal.resolve(job.name, job.case)
    values = measures(optimum) if optimum.converged else {}
    result = optimum.result
    kept = journal.solved == before
    return Solved(job.name, result.status, values, result.iterations, result.seconds, kept)


def _solved_here(jobs: Sequence[Job], origin: _Origin, workers: int) -> Iterator[Solved]:
    journal = _journal(origin)
    for job in jobs:
        yield _solved(journal, job)


def _solved_elsewhere(jobs: Sequence[Job], origin: _Origin, workers: int) -> Iterator[Solved]:
    """Yield what other processes solve."""
    try:
        yield from results_of_calls(_in_worker, [(origin, job) for job in jobs], workers)
    except KeyboardInterrupt:
        raise NotConvergedError(STOPPED) from None


_JOURNALS: Final[dict[Path, Journal]] = {}
"""The journal of a worker process by its folder, built once."""


def _in_worker(origin: _Origin, job: Job) -> Solved:
    if origin[1] not in _JOURNALS:
        _JOURNALS[origin[1]] = _journal(origin)
    return _solved(_JOURNALS[origin[1]], job)
