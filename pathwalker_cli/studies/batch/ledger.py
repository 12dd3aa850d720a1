"""What is known of every case of a study: the table of all, kept on disk after each of them."""

from __future__ import annotations

import json
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Final, get_args, get_origin

from pydantic import BaseModel

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.csv_file import read_cells, write_table
from pathwalker_cli.io.fields import Quantity, is_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.results.tables import DIGITS
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.worker import Result
from pathwalker_cli.studies.run import done_run

CONVERGED: Final = "converged"
PENDING: Final = "not yet run"
"""Status of a case whose turn has not come."""

_PROOF: Final = {
    "largest_violation": "",
    "reintegration_position_error": "rad or m",
    "reintegration_velocity_error": "rad/s or m/s",
    "intervals": "",
    "iterations": "",
}
"""Metrics of every case that was solved, converged or not."""


class CaseTable:
    """Headers and rows of all cases of one study, in order."""

    def __init__(self, cases: Sequence[BatchCase]) -> None:
        self._named = any(case.variant for case in cases)
        varied = {key: unit_of(key) for case in cases[:1] for key in case.values}
        columns = {"case": "", "patient": "", "problem": "", **varied}
        columns |= {"variant": ""} if self._named else {}
        gait = {m.key: "" if m.unit == "1" else m.unit for m in measures_in("batch")}
        columns |= {"status": "", **gait, **_PROOF}
        self.header = [f"{name} [{unit}]" if unit else name for name, unit in columns.items()]

    def row(
        self, case: BatchCase, status: str, metrics: Mapping[str, Any] | None = None
    ) -> tuple[str, ...]:
        """Return the row of a case."""
        row = [case.name, case.patient, case.problem, *map(_varied, case.values.values())]
        row += [case.variant] if self._named else []
        return (*row, status, *numbers_of(status, metrics).values())


def numbers_of(status: str, metrics: Mapping[str, Any] | None) -> dict[str, str]:
    """Return the numbers in the row of a case, as text by heading without unit.

    Args:
        status: "converged", or why not.
        metrics: Content of the run's `metrics.json`; None if there is no run.
    """
    known = metrics or {}
    gait = known if status == CONVERGED else {}  # a last iterate is no gait
    numbers = {m.key: gait.get(m.key) for m in measures_in("batch")}
    numbers |= {name: known.get(name) for name in _PROOF}
    return {name: _number(value) for name, value in numbers.items()}


def read_metrics(folder: Path) -> dict[str, Any] | None:
    """Return the metrics in a run folder; None if they are not there."""
    try:
        content = json.loads((folder / "metrics.json").read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    return content if isinstance(content, dict) and "status" in content else None


def _varied(value: Any) -> str:
    """Return a varied value as it stands in the table."""
    return value if isinstance(value, str) else json.dumps(value)


def _number(value: Any) -> str:
    """Return a number as text, "" where there is none."""
    return f"{value:.{DIGITS}g}" if isinstance(value, int | float) else ""


def unit_of(key: str) -> str:
    """Return the unit of a config value by its dotted key; "" if it has none or it is not known.

    Args:
        key: E.g. "bounds.least_walking_speed", or "variation.shift." and a place in the patient's
            file.
    """
    block, kind, place = (*key.split(".", 2), "", "")[:3]
    model: type[BaseModel] = StudyConfig
    if block == "variation" and place:
        if kind != "shift":
            return "1"
        model, key = Patient, place
    return next((q.unit or "1" for q in _quantities(model, (), key.split("."))), "")


def _quantities(annotation: Any, metadata: Iterable[Any], path: list[str]) -> Iterator[Quantity]:
    """Yield what is told of numbers at a path below an annotation; both sides have the same."""
    if not path:
        yield from (entry for entry in metadata if isinstance(entry, Quantity))
    origin, parts = get_origin(annotation), get_args(annotation)
    if is_model(annotation):
        name, *rest = path or ["right"]
        if (field := annotation.model_fields.get(name)) is not None:
            yield from _quantities(field.annotation, field.metadata, rest)
    elif origin is Annotated:
        yield from _quantities(parts[0], parts[1:], path)
    else:
        for part in parts:
            yield from _quantities(part, (), path[1:] if origin is dict else path)


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
    """How a case ended: "converged", or why not.

    There are no metrics without a run; the wall time [s] is 0 if it was there already.
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
    """Rows of all cases, in order, in memory and in the folder of the study."""

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
