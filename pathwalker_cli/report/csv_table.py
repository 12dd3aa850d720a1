"""Tables that PathWalker wrote, read back as text by column."""

from __future__ import annotations

import csv
import math
from collections.abc import Mapping, Sequence
from pathlib import Path

from pathwalker_cli.errors import DataError

__all__ = ["number", "read_rows"]


def read_rows(path: Path, columns: Sequence[str]) -> list[dict[str, str]]:
    """Return the rows of a CSV file by heading without unit.

    Args:
        path: The file.
        columns: Headings without unit that it must have.

    Raises:
        DataError: If it cannot be read or lacks a column.
    """
    try:
        with path.open(encoding="utf-8", newline="") as file:
            rows = list(csv.reader(file))
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise DataError(f"cannot be read: {problem}", where=str(path)) from None
    head = [name.partition(" [")[0] for name in rows[0]] if rows else []
    missing = [column for column in columns if column not in head]
    if missing:
        raise DataError(f"lacks the column {missing[0]}", where=str(path), mend="make it again")
    # Of two columns that differ in their units only, the first counts.
    return [dict(reversed([*zip(head, row, strict=False)])) for row in rows[1:]]


def number(row: Mapping[str, str], column: str, form: str, factor: float = 1.0) -> str:
    """Return a number of a row as people read it, "-" where there is none.

    Args:
        row: The row.
        column: Heading without unit.
        form: Format of the number.
        factor: From the unit of the file to that of the page.
    """
    try:
        value = factor * float(row.get(column, ""))
    except ValueError:
        return "-"
    return format(value, form) if math.isfinite(value) else "-"
