"""Files that are there in full or not at all: written beside their place, then moved into it."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any, Literal

from pathwalker_cli.errors import DataError

__all__ = ["atomic_open", "atomic_path", "check_output", "output_path", "write_text"]


@contextmanager
def atomic_path(path: str | Path) -> Iterator[Path]:
    """Yield a temporary path that takes the place of `path` when the block ends without an error.

    After an error the temporary file is gone and an older file at `path` is untouched.

    Args:
        path: Where the file shall be; its folder must exist.
    """
    target = Path(path)
    temporary = target.with_name(f".{target.name}.{uuid.uuid4().hex[:8]}.tmp")
    try:
        yield temporary
        os.replace(temporary, target)
    finally:
        temporary.unlink(missing_ok=True)


@contextmanager
def atomic_open(path: str | Path, mode: Literal["w", "wb"] = "w") -> Iterator[IO[Any]]:
    """Yield an open file that appears at `path` when the block ends without an error.

    Args:
        path: Where the file shall be; its folder must exist.
        mode: "w" for UTF-8 text with line ends as they are written, "wb" for bytes.
    """
    text = {"encoding": "utf-8", "newline": ""} if mode == "w" else {}
    with atomic_path(path) as temporary, temporary.open(mode, **text) as file:  # type: ignore[call-overload]
        yield file


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
