"""One process at a time: a lock that dies with the process that holds it."""

from __future__ import annotations

import errno
import fcntl
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Final

from pathwalker_cli.errors import DataError

__all__ = ["locked"]

_NO_LOCKS: Final = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""What disks say that know no locks: there, nobody can be kept out."""


@contextmanager
def locked(file: Path, where: Path, wait: bool = False) -> Iterator[None]:
    """Hold a file for this process; it is gone afterwards, as are folders made for it alone.

    A process that is killed leaves the file, but no lock.

    Args:
        file: The file, which stands for `where`; its folder is made if it is not there.
        where: What is held, for the messages.
        wait: Whether to wait until nobody else holds it.

    Raises:
        DataError: If another process holds it, or it cannot be made.
    """
    mend = "choose another --out"
    missing = [folder for folder in file.parents if not folder.exists()]
    try:
        held = _held(file, fcntl.LOCK_EX if wait else fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise DataError(
            "another `pathwalker` is at work there",
            where=str(where),
            mend=f"wait until it is done, or {mend}",
        ) from None
    except OSError as problem:
        what = f"cannot be written: {problem.strerror}"
        raise DataError(what, where=str(where), mend=mend) from None
    with held:
        try:
            yield
        finally:
            with suppress(OSError):
                file.unlink()
                for folder in missing:
                    folder.rmdir()  # as far as they are empty


def _held(file: Path, way: int) -> IO[bytes]:
    """Return a file open and locked that still has its name then: its last holder removes it."""
    while True:
        file.parent.mkdir(parents=True, exist_ok=True)
        opened = file.open("ab")
        try:
            try:
                fcntl.flock(opened, way)
            except OSError as problem:
                if problem.errno not in _NO_LOCKS:
                    raise
            with suppress(FileNotFoundError):
                if os.path.samestat(os.fstat(opened.fileno()), file.stat()):
                    return opened
        except BaseException:
            opened.close()
            raise
        opened.close()
