"""What stands on a page, as plain values: every number is text before a template sees it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

NOT_A_DEVICE = (
    "PathWalker is research software. It is not a medical device, and nothing on this page is a "
    "basis for the treatment of a patient."
)

Mark = Literal["", "heading", "failed", "good"]
Shape = Literal["pair", "tall"]


@dataclass(frozen=True)
class Fact:
    """A label and what it says."""

    label: str
    text: str


@dataclass(frozen=True)
class Row:
    """A row of a table.

    Args:
        cells: One text per column; a heading has one for all of them.
        mark: What the reader shall see at once: a heading, a failure, or what to look at.
    """

    cells: tuple[str, ...]
    mark: Mark = ""


@dataclass(frozen=True)
class Table:
    """A table.

    Args:
        head: Headings of the columns.
        rows: Its rows.
        caption: What it shows, with units where they are the same for all.
        notes: What to know about it, one sentence each.
        columns: What each column holds, one letter each: "w" words, "n" numbers, "p" prose that may
            wrap.
        even: Whether columns of prose are equally wide.
    """

    head: tuple[str, ...]
    rows: tuple[Row, ...]
    caption: str = ""
    notes: tuple[str, ...] = ()
    columns: str = ""
    even: bool = False

    def __post_init__(self) -> None:
        """Let all columns but the first hold numbers unless they are named; check the widths."""
        if not self.columns:
            object.__setattr__(self, "columns", "w" + "n" * (len(self.head) - 1))
        widths = {len(row.cells) for row in self.rows if row.mark != "heading"}
        if len(self.columns) != len(self.head) or not widths <= {len(self.head)}:
            raise ValueError(f"a table of {len(self.head)} columns has rows of {widths}")


@dataclass(frozen=True)
class Drawing:
    """A figure as an SVG element that this package drew.

    Args:
        svg: The element.
        shape: "pair" for a row of two panels, "tall" for what is at least twice as high.
    """

    svg: str
    shape: Shape = "pair"


@dataclass(frozen=True)
class Section:
    """A part of a page; what it does not have is left out."""

    title: str
    lines: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    tables: tuple[Table, ...] = ()
    legend: Drawing | None = None
    drawings: tuple[Drawing, ...] = ()


@dataclass(frozen=True)
class Page:
    """A page.

    Args:
        title: Its title.
        facts: What its head says: who, when, what.
        answer: The answer in one sentence.
        warnings: What must be known before the answer is used.
        sections: Its parts in order.
    """

    title: str
    facts: tuple[Fact, ...]
    answer: str
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    notice: str = NOT_A_DEVICE


def fact_table(rows: tuple[tuple[str, ...], ...], head: tuple[str, ...]) -> Table:
    """Return a table of sentences, a column per run.

    Args:
        rows: Label, then a text per run.
        head: Headings of the columns, the first of the labels.
    """
    return Table(head, tuple(map(Row, rows)), columns="w" + "p" * (len(head) - 1), even=True)
