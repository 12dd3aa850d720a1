"""One process at a time in a folder; the lock of a process that dies is gone with it."""

from __future__ import annotations

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pathwalker_cli.errors import DataError

__all__ = ["locked"]


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder for this process; it is made if it is not there.

    Raises:
        DataError: If another process holds it, or it cannot be written.
    """
    mend = "choose another --out"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        file = (folder / ".lock").open("a", encoding="utf-8")
    except OSError as problem:
        what = f"cannot be written: {problem.strerror}"
        raise DataError(what, where=str(folder), mend=mend) from None
    with file:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            raise DataError(
                "another `pathwalker batch` is at work there",
                where=str(folder),
                mend=f"wait until it is done, or {mend}",
            ) from None
        except OSError as problem:
            what = f"cannot be locked: {problem.strerror}"
            raise DataError(what, where=str(folder), mend=mend) from None
        yield
