"""A study of many cases from its folder to its table; what is done is not done again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.io.atomic import sweep
from pathwalker_cli.io.lock import locked
from pathwalker_cli.results.run_folder import release_runs
from pathwalker_cli.studies.base import check_folder
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.ledger import CASES, ENTRIES, Ended, Ledger
from pathwalker_cli.studies.batch.worker import Pool, Task, Work, solve_case

__all__ = ["Report", "Watch", "run_batch"]


class Watch:
    """Is told how a study goes on; this one keeps it to itself."""

    def begin(self, total: int, kept: int, workers: int | None) -> None:
        """Take note of the number of cases, of those that were done before, and of workers."""

    def ended(self, case: Ended) -> None:
        """Take note of how a case ended."""


@dataclass(frozen=True)
class Report:
    """How a study ended.

    Args:
        folder: Its folder.
        ended: How every case ended, in order.
    """

    folder: Path
    ended: tuple[Ended, ...]

    @property
    def failed(self) -> tuple[Ended, ...]:
        """The cases that did not converge."""
        return tuple(case for case in self.ended if not case.converged)


def run_batch(
    cases: Sequence[BatchCase], folder: Path, pool: Pool, watch: Watch, work: Work = solve_case
) -> Report:
    """Solve all cases that are not solved yet, each into its run folder, and keep the table.

    Args:
        cases: The cases in order.
        folder: Folder of the study.
        pool: Who solves them.
        watch: Is told of every case.
        work: Solves one case.

    Raises:
        DataError: If the folder holds something else, or another process is at work there.
        NotConvergedError: If the user stopped it.
    """
    check_folder(folder, ENTRIES, "batch")
    with locked(folder / ".lock", folder):
        place = folder.resolve()
        ledger = Ledger(cases, place)
        sweep(place)
        release_runs(place / CASES)
        waiting = ledger.recall()
        watch.begin(len(cases), len(cases) - len(waiting), pool.workers)
        tasks = [_task(case, ledger.run_folder(case)) for case in waiting]
        try:
            for name, result in pool.run(tasks, work) if tasks else ():
                watch.ended(ledger.record(name, result))
        except KeyboardInterrupt:
            done = sum(case.converged for case in ledger.ended)
            raise NotConvergedError(
                f"stopped by the user with {done} of {len(cases)} cases done; the same command "
                "goes on from there"
            ) from None
        finally:
            release_runs(place / CASES)
    return Report(folder, ledger.ended)


def _task(case: BatchCase, folder: Path) -> Task:
    """Return a case as it travels."""
    start = "" if case.warm_start is None else str(case.warm_start)
    return Task(case.name, case.study, str(folder), start)
