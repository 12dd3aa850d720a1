"""What the terminal says of a study of many cases."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, Final

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.studies.batch.ledger import CASES, TABLE, Ended
from pathwalker_cli.studies.batch.study import Report

__all__ = ["failure_sentence", "report_content", "report_text"]

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
    """Return the cells of a converged case."""
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
