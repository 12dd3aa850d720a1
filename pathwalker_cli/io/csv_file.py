"""CSV tables: numbers out with nine significant digits, cells back as text by column."""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from pathwalker_cli.errors import DataError
from pathwalker_cli.io.atomic import atomic_open


def write_table(path: str | Path, header: Sequence[str], rows: Iterable[Sequence[Any]]) -> None:
    """Write a table in one stroke; None becomes an empty cell."""
    with atomic_open(path) as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(header)
        for row in rows:
            writer.writerow([f"{v:.9g}" if isinstance(v, float) else v for v in row])


def as_text(value: float | None, digits: int = 6) -> str:
    """Return a number with that many significant digits, "" for None and NaN."""
    return "" if value is None or math.isnan(value) else f"{value:.{digits}g}"


def read_cells(path: Path, mend: str = "", encoding: str = "utf-8") -> list[list[str]]:
    """Return the rows of a file, its header among them.

    With "utf-8-sig" a byte order mark may stand before the header.

    Raises:
        DataError: If it cannot be read.
    """
    try:
        with path.open(encoding=encoding, newline="") as file:
            return list(csv.reader(file))
    except FileNotFoundError:
        raise DataError("no such file", where=str(path), mend=mend) from None
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise DataError(f"cannot be read: {problem}", where=str(path), mend=mend) from None


def read_rows(path: Path, columns: Sequence[str]) -> list[dict[str, str]]:
    """Return the rows of a file by heading without unit.

    Raises:
        DataError: If it cannot be read or lacks a column.
    """
    cells = read_cells(path, "make it again")
    head = [name.partition(" [")[0] for name in cells[0]] if cells else []
    missing = [column for column in columns if column not in head]
    if missing:
        raise DataError(f"lacks the column {missing[0]}", where=str(path), mend="make it again")
    # Of two columns that differ in their units only, the first counts.
    return [dict(reversed([*zip(head, row, strict=False)])) for row in cells[1:]]


def number(row: Mapping[str, str], column: str, form: str, factor: float = 1.0) -> str:
    """Return a number of a row as people read it, "-" where there is none.

    The factor leads from the unit of the file to that of the page.
    """
    try:
        value = factor * float(row.get(column, ""))
    except ValueError:
        return "-"
    return format(value, form) if math.isfinite(value) else "-"
