"""A key of a YAML file below the comment that explains it, at most 80 columns wide."""

from __future__ import annotations

from textwrap import wrap
from typing import Final

__all__ = ["WIDTH", "comment", "commented", "unbroken"]

WIDTH: Final = 80
"""Columns of a terminal."""

_TIE: Final = "\u2060"
"""Stands for a space at which no line ends."""


def comment(text: str, depth: int = 0) -> str:
    """Return text as lines of comment, so many levels further in."""
    mark = "  " * depth + "# "
    lines = wrap(text, WIDTH - len(mark), break_on_hyphens=False)
    return "\n".join(mark + line for line in lines).replace(_TIE, " ")


def unbroken(text: str) -> str:
    """Return text that `comment` keeps on one line."""
    return text.replace(" ", _TIE)


def commented(key: str, value: str, text: str, depth: int = 0, given: bool = True) -> str:
    """Return a key with its value below its comment.

    Args:
        key: The key.
        value: Its value; "" for a block.
        text: The comment; "" for none.
        depth: How many blocks it stands in.
        given: Whether the value counts; otherwise the line is a comment, too.
    """
    mark = "  " * depth + ("" if given else "# ")
    line = f"{mark}{key}: {value}".replace(": \n", ":\n").rstrip()
    return f"{comment(text, depth)}\n{line}" if text else line
