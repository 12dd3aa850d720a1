"""Files that are there in full or not at all: written beside their place, then moved into it."""

from __future__ import annotations

import ctypes
import os
import re
import shutil
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Final, Literal

from pathwalker_cli.errors import DataError, InputError

_LEAST_ROOM: Final = 10_000_000
"""Free bytes of a disk below which nothing long is begun; a run takes some 2 MB."""
_TEMPORARY: Final = re.compile(r"\..+\.\w{8}\.tmp")
"""Names of what is being written."""


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path that takes the place of `path` when the block ends without an error.

    After an error the temporary file is gone and an older file at `path` is untouched; an error of
    the disk tells `path`, whose folder must exist.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.tmp")
    try:
        yield temporary
        os.replace(temporary, target)
    except OSError as problem:
        # a full disk is noticed by a write, which knows no name
        if problem.errno is not None and problem.filename in (None, str(temporary)):
            problem.filename, problem.filename2 = str(target), None
        raise
    finally:
        temporary.unlink(missing_ok=True)


def check_room(folder: Path) -> None:
    """Refuse a full disk before the work whose results it would take; the folder may be missing."""
    above = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    free = shutil.disk_usage(above).free
    if free < _LEAST_ROOM:
        raise DataError(
            f"is on a full disk: {free / 1e6:.1f} MB are free",
            where=str(folder),
            allowed=f"{_LEAST_ROOM / 1e6:g} MB or more",
            mend="make room or choose another --out",
        )


def sweep(folder: Path, name: str = "", deep: bool = False) -> None:
    """Take away what killed processes had begun to write; nobody may be at work there.

    Of one `name` or of any; if `deep`, in its folders too.
    """
    for left in folder.rglob(".*.tmp") if deep else folder.glob(".*.tmp"):
        if _TEMPORARY.fullmatch(left.name) and name in ("", left.name[1:-13]):
            if left.is_dir() and not left.is_symlink():
                shutil.rmtree(left, ignore_errors=True)
            else:
                left.unlink(missing_ok=True)


def swapped(one: Path, other: Path) -> bool:
    """Return whether two files or folders took each other's place, in one stroke.

    Where system or disk cannot do that, nothing is done.
    """
    exchange = getattr(ctypes.CDLL(None), "renameat2", None)
    here, both = -100, 2  # AT_FDCWD, RENAME_EXCHANGE
    return exchange is not None and exchange(
        here, os.fsencode(one), here, os.fsencode(other), both
    ) == 0  # fmt: skip


@contextmanager
def atomic_open(path: str | Path, mode: Literal["w", "wb"] = "w") -> Iterator[IO[Any]]:
    """Yield an open file that appears at `path` when the block ends without an error.

    Text is UTF-8 with line ends as they are written; the folder must exist.
    """
    text = {"encoding": "utf-8", "newline": ""} if mode == "w" else {}
    with atomic_path(path) as temporary, temporary.open(mode, **text) as file:  # type: ignore[call-overload]
        yield file


@contextmanager
def staged_folder(target: str | Path) -> Iterator[Path]:
    """Yield an empty folder whose files move into `target` when the block ends without an error.

    After an error nothing is there that was not before; else files of the same name are replaced.

    Raises:
        DataError: If the target is a file or cannot be written.
    """
    target = Path(target)
    above = next(folder for folder in (target, *target.parents) if folder.exists())
    if not above.is_dir():
        raise DataError("is a file", where=str(above), mend="choose a folder for the output")
    if not os.access(above, os.W_OK):
        raise DataError("cannot be written", where=str(above), mend="choose another folder")
    beside = target.parent if target.exists() else above
    if not os.access(beside, os.W_OK):
        beside = above
    staging = None
    try:
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".tmp", dir=beside))
        yield staging
        for source in sorted(path for path in staging.rglob("*") if path.is_file()):
            place = target / source.relative_to(staging)
            place.parent.mkdir(parents=True, exist_ok=True)
            os.replace(source, place)
    except OSError as problem:
        raise DataError(f"cannot be written: {problem.strerror}", where=str(target)) from None
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)


def check_output(path: str | Path) -> None:
    """Refuse a place where no file can be put, before the work that would fill it.

    Raises:
        DataError: If a folder stands there, or its folder is missing or must not be written.
    """
    target = Path(path)
    if target.is_dir():
        raise DataError("is a folder", where=str(path), mend="name a file in it")
    if not target.absolute().parent.is_dir():
        what = f"cannot be written: there is no folder {target.parent}"
        raise DataError(what, where=str(path), mend="make it first, or choose another file")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        what = "cannot be written: its folder is protected"
        raise DataError(what, where=str(path), mend="choose another folder")


@contextmanager
def output_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path as `atomic_path` does, for a file that the user named.

    Raises:
        DataError: If it cannot be written.
    """
    check_output(path)
    try:
        with atomic_path(path) as temporary:
            yield temporary
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise DataError(
            f"cannot be written: {reason}", where=str(path), mend="choose another file"
        ) from None


def write_text(path: Path, text: str) -> None:
    """Write a file that the user named in one stroke.

    Raises:
        DataError: If it cannot be written.
    """
    with output_path(path) as file:
        file.write_text(text, encoding="utf-8", newline="")


def refuse_special(path: Path, error: type[InputError] = DataError) -> None:
    """Refuse a pipe or a device; whether there is anything at all, who reads will tell.

    Raises:
        InputError: Of class `error`.
    """
    try:
        special = path.exists() and not path.is_file() and not path.is_dir()
    except (OSError, ValueError):
        return
    if special:
        raise error("is a pipe or a device", where=str(path), allowed="a file")
