"""What is known of every case of a study, kept on disk after each of them."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.csv_file import read_cells, write_table
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.table import (
    CONVERGED,
    PENDING,
    CaseTable,
    read_metrics,
)
from pathwalker_cli.studies.batch.worker import Result
from pathwalker_cli.studies.run import done_run

__all__ = ["CASES", "ENTRIES", "TABLE", "Ended", "Ledger"]

CASES: Final = "cases"
TABLE: Final = "cases.csv"
TIMES: Final = "times.csv"
DETAILS: Final = "failures"

ENTRIES: Final = frozenset({CASES, TABLE, TIMES, DETAILS})
"""Everything that the folder of a study holds."""

_SECONDS: Final = ("seconds_build", "seconds_solve", "seconds_verify")
_TIMES_HEADER: Final = ("case", "seconds [s]", *(f"{key} [s]" for key in _SECONDS), "worker")

SIGHT: Final = 10.0
"""Time after which a run folder that another machine wrote must be seen here [s]."""


@dataclass(frozen=True)
class Ended:
    """How a case ended.

    Args:
        case: The case.
        status: "converged", or why not.
        metrics: Content of its `metrics.json`; None if there is no run.
        seconds: Wall time [s]; 0 if it was there already.
    """

    case: BatchCase
    status: str
    metrics: Mapping[str, Any] | None = None
    seconds: float = 0.0

    @property
    def converged(self) -> bool:
        """Whether its constraints are met."""
        return self.status == CONVERGED


class Ledger:
    """Rows of all cases, in memory and in the folder of the study.

    Args:
        cases: All cases in order.
        folder: Full path of the study's folder.
    """

    def __init__(self, cases: Sequence[BatchCase], folder: Path) -> None:
        self._cases = {case.name: case for case in cases}
        self._folder = folder
        self._table = CaseTable(cases)
        self._ended: dict[str, Ended] = {}
        self._rows = {case.name: self._table.row(case, PENDING) for case in cases}
        self._times: dict[str, tuple[str, ...]] = {}

    @property
    def ended(self) -> tuple[Ended, ...]:
        """All cases that have ended, in order of the study."""
        return tuple(self._ended[name] for name in self._cases if name in self._ended)

    def run_folder(self, case: BatchCase) -> Path:
        """Return the run folder of a case."""
        return self._folder / CASES / case.name

    def recall(self) -> list[BatchCase]:
        """Take note of the cases that are done already; return the others."""
        (self._folder / CASES).mkdir(exist_ok=True)
        times = _read_times(self._folder / TIMES)
        for name, case in self._cases.items():
            folder = self.run_folder(case)
            if done_run(folder, case.study) is not None:
                self._note(Ended(case, CONVERGED, read_metrics(folder)), times.get(name))
        self._write()
        return [case for name, case in self._cases.items() if name not in self._ended]

    def record(self, name: str, result: Result) -> Ended:
        """Take note of how a case ended, and bring the files up to date."""
        case = self._cases[name]
        folder = self.run_folder(case)
        metrics = _awaited_metrics(folder) if result["wrote"] else None
        status = f"failed: {result['reason']}"
        if metrics is not None:
            status = str(metrics["status"])
        elif result["wrote"]:
            status = "failed: its run folder is not seen here: do all workers share this disk?"
        ended = Ended(case, status, metrics, result["seconds"])
        parts = ["" if metrics is None else _seconds(metrics.get(key)) for key in _SECONDS]
        self._note(ended, (name, _seconds(result["seconds"]), *parts, result["worker"]))
        self._write_detail(name, result["detail"])
        self._write()
        return ended

    def _note(self, ended: Ended, times: tuple[str, ...] | None) -> None:
        name = ended.case.name
        self._ended[name] = ended
        self._rows[name] = self._table.row(ended.case, ended.status, ended.metrics)
        if times is not None:
            self._times[name] = times

    def _write(self) -> None:
        write_table(self._folder / TABLE, self._table.header, self._rows.values())
        known = [self._times[name] for name in self._cases if name in self._times]
        write_table(self._folder / TIMES, _TIMES_HEADER, known)

    def _write_detail(self, name: str, detail: str) -> None:
        """Keep what a programmer wants to know of a failure; take away what is over."""
        path = self._folder / DETAILS / f"{name}.txt"
        if detail:
            path.parent.mkdir(exist_ok=True)
            path.write_text(f"{detail.rstrip()}\n", encoding="utf-8")
        else:
            path.unlink(missing_ok=True)


def _awaited_metrics(folder: Path) -> dict[str, Any] | None:
    """Return the metrics of a run that was just written, perhaps by another machine."""
    end = time.monotonic() + SIGHT
    while (metrics := read_metrics(folder)) is None and time.monotonic() < end:
        time.sleep(0.5)
    return metrics


def _read_times(path: Path) -> dict[str, tuple[str, ...]]:
    """Return the rows of an earlier table of times by case; none if it cannot be read."""
    try:
        rows = read_cells(path)[1:]
    except DataError:
        return {}
    return {row[0]: tuple(row) for row in rows if len(row) == len(_TIMES_HEADER)}


def _seconds(value: Any) -> str:
    return f"{value:.1f}" if isinstance(value, int | float) and value else ""
