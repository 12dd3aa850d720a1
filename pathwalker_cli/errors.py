"""The exception tree: every error says what is wrong, where, what is allowed and how to mend it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Self


class PathwalkerError(Exception):
    """Root of all errors that PathWalker raises on purpose."""


class InputError(PathwalkerError):
    """Something the user handed in is wrong; the command line exits with code 2.

    Args:
        what: What is wrong, one clause.
        where: File, key, trial or frame at which it is wrong.
        allowed: What would be accepted.
        mend: What to do about it.
    """

    def __init__(self, what: str, *, where: str = "", allowed: str = "", mend: str = "") -> None:
        self.what = what
        self.where = where
        self.allowed = allowed
        self.mend = mend
        parts = [f"{where}: {what}" if where else what]
        if allowed:
            parts.append(f"allowed: {allowed}")
        if mend:
            parts.append(mend)
        super().__init__(_one_line("; ".join(parts)))

    def at(self, where: str) -> Self:
        """Return the same error at another place."""
        return type(self)(self.what, where=where, allowed=self.allowed, mend=self.mend)


def _one_line(text: str) -> str:
    """Return a text with line ends and control characters, e.g. from a file, as their codes."""
    return "".join(c if c.isprintable() else repr(c)[1:-1] for c in text)


def did_you_mean(word: str, known: Iterable[str], otherwise: str = "") -> str:
    """Return the question after the known word that is nearest to a misspelt one.

    Args:
        word: What was written.
        known: What may have been meant.
        otherwise: What to say if nothing is near.
    """
    near = difflib.get_close_matches(word, list(known), n=1, cutoff=0.5)
    return f"did you mean '{near[0]}'?" if near else otherwise


@contextmanager
def placed(where: str) -> Iterator[None]:
    """Put the place of something before the places of all errors about it."""
    try:
        yield
    except InputError as error:
        inner = error.where
        place = inner if inner.startswith(where) else f"{where}: {inner}" if inner else where
        raise error.at(place) from None


class ConfigError(InputError):
    """A study's YAML file or a command-line override is wrong."""


class PatientError(InputError):
    """A patient's file is wrong or lacks what the task needs."""


class DataError(InputError):
    """A recording, a table or a run folder cannot be used."""


class NotConvergedError(PathwalkerError):
    """A solution that did not converge was asked for its numbers; the command line exits with 1."""


class BackendError(PathwalkerError):
    """A dynamics back end is missing or does not fit the installed libraries."""
