"""Runs inside the folder of a study, and whether its table says what they say."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from pathwalker_cli.io.csv_file import read_rows
from pathwalker_cli.studies.batch.ledger import CASES, TABLE, numbers_of, read_metrics
from pathwalker_cli.verification.checks import Check, Verification

_HELD: Final = {TABLE: CASES, "tradeoff.csv": "runs"}
"""Where studies keep runs, by a file that only their folders have."""


def runs_in(folder: Path) -> tuple[Path, ...]:
    """Return the converged runs that the folder of a batch or a trade-off holds; else itself."""
    for table, place in _HELD.items():
        if (folder / table).is_file():
            return tuple(path for path in _entries(folder / place) if _status(path) == "converged")
    return (folder,)


def verify_table(folder: Path) -> Verification | None:
    """Check the table of a batch against the runs beside it; None for any other folder.

    Raises:
        DataError: If the table cannot be read.
    """
    path = folder / TABLE
    if not path.is_file():
        return None
    rows = read_rows(path, ())
    runs = {run.name: run for run in _entries(folder / CASES)}
    wrong = [f"{row.get('case')}" for row in rows if not _as_run(row, runs)]
    note = f"{', '.join(wrong[:3])} not as in its metrics.json" if wrong else ""
    check = Check(TABLE, float(len(wrong)), 0.0, "", note)
    return Verification(folder, f"table of {len(rows)} cases", "", (check,))


def _as_run(row: Mapping[str, str], runs: Mapping[str, Path]) -> bool:
    """Return whether a row says what the run of its case says; a case without a run has none."""
    status, run = row.get("status", ""), runs.get(row.get("case", ""))
    metrics = None if run is None else read_metrics(run)
    if metrics is not None and metrics["status"] != status:
        return False
    if metrics is None and status == "converged":
        return False
    return all(row.get(name) == text for name, text in numbers_of(status, metrics).items())


def _status(run: Path) -> str:
    """Return how a run ended; a damaged one counts as converged, so that it is looked at."""
    if not (run / "metrics.json").is_file():
        return "missing"
    metrics = read_metrics(run)
    return "converged" if metrics is None else str(metrics["status"])


def _entries(folder: Path) -> list[Path]:
    if not folder.is_dir():
        return []
    return sorted(p for p in folder.iterdir() if p.is_dir() and not p.name.startswith("."))
