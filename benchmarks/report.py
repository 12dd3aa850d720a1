"""Tables of figures: for the terminal, for Markdown and for JSON."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal

from measure import PartFailedError, Sample
from rich.console import Console
from rich.table import Table as RichTable
from rich.text import Text

__all__ = ["Cell", "Report", "Table", "shown"]

Cell = str | float | int | Sample | None


@dataclass
class Table:
    """Figures in rows and columns.

    Args:
        title: What it shows.
        columns: Headings, with units.
        notes: What must be known to read it.
        rows: One list of cells per row; a failed part has its message after the labels.
    """

    title: str
    columns: Sequence[str]
    notes: Sequence[str] = ()
    rows: list[list[Cell]] = field(default_factory=list)

    def add(self, labels: Sequence[Cell], cells: Callable[[], Sequence[Cell]]) -> None:
        """Add a row; if measuring it fails, it says what failed."""
        try:
            self.rows.append([*labels, *cells()])
        except PartFailedError as failure:
            self.rows.append([*labels, f"failed: {failure}"])

    def padded(self) -> list[list[str]]:
        """Return all cells as text, every row as long as the headings."""
        return [
            [*map(shown, row), *[""] * (len(self.columns) - len(row))][: len(self.columns)]
            for row in self.rows
        ]

    def markdown(self) -> str:
        """Return it as Markdown."""
        lines = [f"**{self.title}**", ""]
        lines += [_line(self.columns), _line(["---"] * len(self.columns))]
        lines += [_line(row) for row in self.padded()]
        return "\n".join([*lines, "", *(f"{note}\n" for note in self.notes)])

    def print(self, console: Console) -> None:
        """Print it to a terminal."""
        table = RichTable(title=Text(self.title), title_justify="left", header_style="bold")
        for k, column in enumerate(self.columns):
            side: Literal["left", "right"] = "left" if k == 0 else "right"
            table.add_column(Text(column), justify=side, overflow="fold")
        for row in self.padded():
            table.add_row(*map(Text, row))
        console.print(table)
        for note in self.notes:
            console.print(Text(note, style="dim"))
        console.print()

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON knows it, with all repetitions."""
        rows = [[_plain(cell) for cell in row] for row in self.rows]
        return {"title": self.title, "columns": list(self.columns), "rows": rows,
                "notes": list(self.notes)}  # fmt: skip


@dataclass
class Report:
    """What a section found.

    Args:
        tables: Its tables.
        reached: What it reached by key of a goal, see `gait/goals.py`.
        peaks: Peak memory [MB] by what took it.
        failure: Why the section as a whole came to nothing; "" if it did not.
    """

    tables: list[Table] = field(default_factory=list)
    reached: dict[str, float] = field(default_factory=dict)
    peaks: dict[str, float] = field(default_factory=dict)
    failure: str = ""

    def table(self, title: str, columns: Sequence[str], *notes: str) -> Table:
        """Return a new table of the section."""
        self.tables.append(Table(title, columns, notes))
        return self.tables[-1]

    def as_json(self) -> dict[str, Any]:
        """Return it as JSON knows it."""
        tables = [table.as_json() for table in self.tables]
        return {"tables": tables, "reached": self.reached, "peak_mb": self.peaks,
                "failure": self.failure}  # fmt: skip


def shown(cell: Cell) -> str:
    """Return a cell as text: three digits, and the range of several measurements."""
    if cell is None:
        return "-"
    if isinstance(cell, str):
        return cell
    if isinstance(cell, Sample):
        middle, ends = _number(cell.median), (min(cell.values), max(cell.values))
        spread = len(cell.values) > 1 and ends[0] != ends[1]
        return f"{middle} ({_number(ends[0])}-{_number(ends[1])})" if spread else middle
    return _number(cell)


def _number(value: float) -> str:
    if isinstance(value, int) or (abs(value) >= 100 and abs(value) < 1e9):
        return f"{value:,.0f}"
    return f"{value:.3g}"


def _plain(cell: Cell) -> Any:
    return list(cell.values) if isinstance(cell, Sample) else cell


def _line(cells: Sequence[str]) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
