"""The table of a study, one row per case: the same bytes whoever solved the cases."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.results.tables import DIGITS
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.batch.cases import BatchCase
from pathwalker_cli.studies.batch.units import unit_of

__all__ = ["CONVERGED", "PENDING", "CaseTable", "numbers_of", "read_metrics"]

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
    """Headers and rows of the cases of one study.

    Args:
        cases: All cases in order.
    """

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
        """Return the row of a case.

        Args:
            case: The case.
            status: "converged", or why not.
            metrics: Content of the run's `metrics.json`; None if there is no run.
        """
        row = [case.name, case.patient, case.problem, *map(_varied, case.values.values())]
        row += [case.variant] if self._named else []
        return (*row, status, *numbers_of(status, metrics).values())


def numbers_of(status: str, metrics: Mapping[str, Any] | None) -> dict[str, str]:
    """Return the numbers in the row of a case, as text by heading without unit.

    Args:
        status: "converged", or why not.
        metrics: Content of the run's `metrics.json`; None if there is no run.
    """
    found = metrics or {}
    gait = found if status == CONVERGED else {}  # a last iterate is no gait
    numbers = {m.key: gait.get(m.key) for m in measures_in("batch")}
    numbers |= {name: found.get(name) for name in _PROOF}
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
