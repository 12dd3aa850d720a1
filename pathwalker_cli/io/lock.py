"""One process at a time: a lock that dies with the process that holds it."""

from __future__ import annotations

import errno
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Final

from filelock import FileLock, Timeout

from pathwalker_cli.errors import DataError

_NO_LOCKS: Final = (errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP)
"""What disks say that know no locks: there, nobody can be kept out."""


@contextmanager
def locked(file: Path, where: Path, wait: bool = False) -> Iterator[None]:
    """Hold a file, which stands for `where`; after it the folders made for it alone are gone too.

    A process that is killed leaves the file, but no lock.

    Raises:
        DataError: If another process holds it, or it cannot be made.
    """
    mend = "choose another --out"
    missing = [folder for folder in file.parents if not folder.exists()]
    # a soft lock would outlive a holder that is killed
    lock = FileLock(file, timeout=-1 if wait else 0, fallback_to_soft=False)
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        lock.acquire()
    except Timeout:
        what = "another `pathwalker` is at work there"
        raise DataError(what, where=str(where), mend=f"wait until it is done, or {mend}") from None
    except OSError as problem:
        if problem.errno not in _NO_LOCKS:
            what = f"cannot be written: {problem.strerror}"
            raise DataError(what, where=str(where), mend=mend) from None
    try:
        yield
    finally:
        with suppress(OSError):
            file.unlink()  # while it is held: whoever waits for it then makes it anew
            for folder in missing:
                folder.rmdir()  # as far as they are empty
        lock.release()
