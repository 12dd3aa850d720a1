"""What stands on a page, as plain values: every number is text before it is set.

The page in HTML and the one in PDF are set from the same values.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any, Final, Literal

NOT_A_DEVICE = (
    "PathWalker is research software. It is not a medical device, and nothing on this page is a "
    "basis for the treatment of a patient."
)

Mark = Literal["", "heading", "shared", "failed", "good"]
Shape = Literal["pair", "tall", "panel", "page"]


@dataclass(frozen=True)
class Fact:
    """A label and what it says."""

    label: str
    text: str


@dataclass(frozen=True)
class Row:
    """A row of a table, one text per column; a mark says what the reader shall see at once.

    A heading has one text for all columns, a shared row one for all but the first.
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
        spanning = ("heading", "shared")
        widths = {len(row.cells) for row in self.rows if row.mark not in spanning}
        if len(self.columns) != len(self.head) or not widths <= {len(self.head)}:
            raise ValueError(f"a table of {len(self.head)} columns has rows of {widths}")


@dataclass(frozen=True)
class Drawing:
    """A figure.

    Args:
        figure: The Matplotlib figure, made under `stride.figures.style.STYLE`.
        name: A name that no other figure of the page has; letters, digits and "-".
        title: What it shows, in words.
        shape: "pair" for a row of two panels, "tall" for what is at least twice as high, "panel"
            for one of four that stand side by side, "page" for one across the page.
    """

    figure: Any
    name: str
    title: str
    shape: Shape = "pair"


@dataclass(frozen=True)
class Section:
    """A part of a page; what it does not have is left out.

    `lines` and `points` are sentences, the latter a list; `new_page` is about print.
    """

    title: str
    lines: tuple[str, ...] = ()
    facts: tuple[Fact, ...] = ()
    tables: tuple[Table, ...] = ()
    points: tuple[str, ...] = ()
    drawings: tuple[Drawing, ...] = ()
    new_page: bool = False


@dataclass(frozen=True)
class Page:
    """A page: what its head says (who, when, what), the answer, and its parts in order.

    `warnings` is what must be known before the answer is used.
    """

    title: str
    facts: tuple[Fact, ...]
    answer: tuple[str, ...]
    warnings: tuple[str, ...]
    sections: tuple[Section, ...]
    notice: str = NOT_A_DEVICE


_UNIT: Final = re.compile(r"(?<=\d) (?=%|N m|m/s|s/m|deg\b|kg\b)|(?<=\bN) (?=m\b)")
"""Spaces before and within units."""


def tight(text: str) -> str:
    """Return a text whose units do not part from their numbers at the end of a line."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", text)


def fact_table(rows: tuple[tuple[str, ...], ...], head: tuple[str, ...]) -> Table:
    """Return a table of sentences, a column per run; what all runs share is said once.

    A row is a label, then a text per run.
    """
    shared = (Row(row[:2], "shared") if len(set(row[1:])) == 1 else Row(row) for row in rows)
    return Table(head, tuple(shared), columns="w" + "p" * (len(head) - 1), even=True)
