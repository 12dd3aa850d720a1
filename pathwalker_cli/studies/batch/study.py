"""A study of many cases from its folder to its table and what the terminal says of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import NotConvergedError
from pathwalker_cli.io.atomic import sweep
from pathwalker_cli.io.lock import locked
from pathwalker_cli.results.run_folder import release_runs
from pathwalker_cli.studies.base import check_folder
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.ledger import CASES, ENTRIES, TABLE, Ended, Ledger
from pathwalker_cli.studies.batch.worker import Pool, Task, Work, solve_case


class Watch:
    """Hears how a study goes on; this one keeps it to itself."""

    def begin(self, total: int, kept: int, workers: int | None) -> None:
        """Take note of the number of cases, of those that were done before, and of workers."""

    def ended(self, case: Ended) -> None:
        """Take note of how a case ended."""


@dataclass(frozen=True)
class Report:
    """How a study ended: its folder, and every case in order."""

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
        tasks = [
            Task(c.name, c.study, str(ledger.run_folder(c)), str(c.warm_start or ""))
            for c in waiting
        ]
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


_SHOWN: Final = 30
"""Cases that the terminal lists; the table lists all."""
_NAMED: Final = 3
"""Failed cases that a sentence names."""


def report_text(report: Report) -> str:
    """Return one line per case, the failed ones with their reasons, and where all that is."""
    good = [case for case in report.ended if case.converged]
    lines = _table([_HEAD, *map(_row, good[:_SHOWN])]) if good else []
    lines += _more(len(good), "cases")
    if report.failed:
        lines += ["", f"failed: {len(report.failed)} of {len(report.ended)}"]
        lines += [f"  {case.case.name}: {_reason(case)}" for case in report.failed[:_SHOWN]]
        lines += _more(len(report.failed), "failed cases")
    return "\n".join([*lines, "", f"Written to {report.folder}"])


def report_content(report: Report) -> dict[str, Any]:
    """Return how every case ended as plain values; `cost` is None where it did not converge."""
    cases = [
        {
            "case": ended.case.name,
            "patient": ended.case.patient,
            "problem": ended.case.problem,
            "status": ended.status,
            "converged": ended.converged,
            "cost": (ended.metrics or {}).get("cost") if ended.converged else None,
            "folder": str(report.folder / CASES / ended.case.name),
            "seconds": ended.seconds,
        }
        for ended in report.ended
    ]
    return {"folder": str(report.folder), "failed": len(report.failed), "cases": cases}


def failure_sentence(report: Report) -> str:
    """Return one sentence on the cases that failed."""
    names = [case.case.name for case in report.failed]
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return (
        f"{len(names)} of {len(report.ended)} cases did not converge: "
        f"{', '.join(names[:_NAMED])}{more}; {report.folder / TABLE} says why, and the same "
        "command tries them again"
    )


_HEAD: Final = ("case", "cost", "speed [m/s]", "K_D right, left [N m/rad]", "K_P right, left")


def _row(ended: Ended) -> tuple[str, ...]:
    metrics = ended.metrics or {}
    pairs = (_pair(metrics, stem) for stem in ("dorsiflexion", "plantarflexion"))
    speed = _shown(metrics.get("walking_speed"), ".3f")
    return (ended.case.name, _shown(metrics.get("cost"), ".4g"), speed, *pairs)


def _pair(metrics: Mapping[str, Any], stem: str) -> str:
    return ", ".join(_shown(metrics.get(f"{stem}_stiffness_{side}"), ".1f") for side in SIDES)


def _shown(value: Any, form: str) -> str:
    return format(value, form) if isinstance(value, int | float) else "-"


def _table(rows: Sequence[tuple[str, ...]]) -> list[str]:
    """Return rows as lines with aligned columns."""
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    lines = ("  ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) for row in rows)
    return [line.rstrip() for line in lines]


def _more(count: int, what: str) -> list[str]:
    return [f"... and {count - _SHOWN} more {what} in {TABLE}"] if count > _SHOWN else []


def _reason(ended: Ended) -> str:
    return ended.status.removeprefix("failed: ")
