"""A comparison of runs: lines of the terminal, 80 columns wide; CSV and JSON in SI units."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

from pathwalker_cli.evaluation.text import number_text, unit_text
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.report.compare import Comparison

__all__ = ["comparison_content", "comparison_lines", "write_comparison_csv"]

_WIDTH: Final = 80
_NAME: Final = 11
"""Columns of the terminal, and of the name of a run above its values."""


def comparison_lines(found: Comparison) -> Iterator[str]:
    """Yield a table for every run beside the first, then what differs in the configs."""
    for i in range(1, len(found.gaits)):
        yield from _against_base(found, i)
        yield ""
    if not found.config:
        yield "The configs are the same."
        return
    yield "Config values that differ"
    for key, values in found.config.items():
        yield from _config_lines(key, found.names, values)


def _config_lines(key: str, names: Sequence[str], values: Sequence[str]) -> Iterator[str]:
    """Yield a key with the value of every run, in one line if it is short enough."""
    pairs = list(zip(names, values, strict=True))
    line = f" {key}: {', '.join(f'{value} ({name})' for name, value in pairs)}"
    if len(line) <= _WIDTH:
        yield line
        return
    yield f" {key}"
    for name, value in pairs:
        yield from wrap(f"{name}: {value}", _WIDTH, initial_indent=" " * 3,
                        subsequent_indent=" " * 5)  # fmt: skip


def _against_base(found: Comparison, which: int) -> Iterator[str]:
    """Yield the table of one run beside the first."""
    base, other = found.names[0], found.names[which]
    yield f"{other} compared with {base}"
    yield _line("", _cut(base), _cut(other), "change", "[%]", "unit")
    for section, rows in groupby(found.rows, lambda row: row.quantity.section):
        yield section
        for row in rows:
            if not row.values[0] and not row.values[which]:  # orthoses that nobody wears
                continue
            quantity, share = row.quantity, row.shares[which]
            yield _line(
                quantity.label,
                number_text(row.values[0], quantity),
                number_text(row.values[which], quantity),
                number_text(row.differences[which], quantity, sign=True),
                "-" if share is None else f"{round(100.0 * share, 1) + 0.0:+.1f}",
                unit_text(quantity),
            )


def _line(label: str, base: str, other: str, change: str, share: str, unit: str) -> str:
    return f" {label:<26}{base:>11} {other:>11}{change:>10}{share:>9}  {unit}".rstrip()


def _cut(name: str) -> str:
    """Return the end of a name as a heading of a narrow column."""
    return name if len(name) <= _NAME else f"..{name[2 - _NAME :]}"


def write_comparison_csv(path: Path, found: Comparison) -> None:
    """Write a row per metric: value of every run, differences to the first, those also in %."""
    names = found.names
    header = ["metric", "unit", *names]
    header += [f"{name} - {names[0]}" for name in names[1:]]
    header += [f"{name} - {names[0]} [%]" for name in names[1:]]
    rows = (
        [
            row.quantity.key,
            row.quantity.unit,
            *row.values,
            *row.differences[1:],
            *(None if share is None else 100.0 * share for share in row.shares[1:]),
        ]
        for row in found.rows
    )
    write_table(path, header, rows)


def comparison_content(found: Comparison) -> dict[str, Any]:
    """Return everything that was compared, ready for JSON; SI units, shares of 1."""
    return {
        "runs": [
            {
                "name": gait.name,
                "problem": gait.problem,
                "patient": gait.walker.patient.id,
                "condition": gait.walker.condition,
            }
            for gait in found.gaits
        ],
        "base": found.names[0],
        "metrics": {
            row.quantity.key: {
                "unit": row.quantity.unit,
                "values": dict(zip(found.names, row.values, strict=True)),
                "differences": dict(zip(found.names[1:], row.differences[1:], strict=True)),
                "shares": dict(zip(found.names[1:], row.shares[1:], strict=True)),
            }
            for row in found.rows
        },
        "config": {
            key: dict(zip(found.names, values, strict=True)) for key, values in found.config.items()
        },
        "notes": list(found.notes),
    }
