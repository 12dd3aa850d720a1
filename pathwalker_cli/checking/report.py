"""The outcome of a check, as rows for the terminal and as plain values."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from textwrap import wrap
from typing import Any, Final

_WIDTH: Final = 80
_COLUMN: Final = 20

Row = tuple[str, str]
Changes = tuple[str, ...]
"""Overrides "dotted.key=value", as from the command line."""


@dataclass(frozen=True)
class Checked:
    """A file that is in order: all there is to know, as rows and as plain values.

    `notes` says what may be meant but is unusual, a sentence each.
    """

    path: str
    kind: str
    rows: tuple[Row, ...]
    content: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            "config": self.path,
            "kind": self.kind,
            "ok": True,
            **self.content,
            "notes": list(self.notes),
        }


def checked_lines(checked: Checked) -> Iterator[str]:
    """Yield what a check says, on 80 columns."""
    yield f"{checked.path}: {checked.kind}, in order"
    label_before = ""
    for label, text in (*checked.rows, *(("note", note) for note in checked.notes)):
        shown = "" if label == label_before else label
        label_before = label
        begin = f"  {shown:<{_COLUMN}}"
        yield from wrap(
            text,
            _WIDTH,
            initial_indent=begin,
            subsequent_indent=" " * (_COLUMN + 2),
            break_on_hyphens=False,
            break_long_words=False,
        ) or [begin.rstrip()]
