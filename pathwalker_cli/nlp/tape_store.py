"""Tapes of problem structures, kept on disk: a further process derives nothing again.

A file holds the tapes of one structure.  Its name is a hash of all that tapes follow from: the
sources of this package and its compiled kernels, byte by byte, the versions of CasADi and NumPy,
what else the caller says makes expressions, and the structure itself.  Whatever changes, the name
changes, so what is found is never stale.  That needs the sources on disk to be those that run:
where one changed after the package was imported, nothing is read or kept.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
import tempfile
from collections.abc import Hashable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, Final

import casadi as ca
import numpy as np

import pathwalker_cli
from pathwalker_cli.nlp.kernels import kernels_path
from pathwalker_cli.nlp.tape import Tape
from pathwalker_cli.paths import source_stamps

_MOST_FILES: Final = 15
"""Structures that are kept; one takes some 10 MB."""
_SUFFIX: Final = ".tapes"
_ABANDONED: Final = 3600.0
"""Age at which an unfinished file is sure to belong to no process any more [s]."""
_SEAL: Final = hashlib.sha256().digest_size
"""Bytes of the hash at the beginning of a file."""

Makers = tuple[str | Path, ...]
"""What else makes expressions: versions of libraries, and compiled libraries."""

KeptTapes = Mapping[str, tuple[int, dict[str, Tape]]]
"""Number of rows, and tapes by kind, of every block that matters, by its name."""


def cache_folder() -> Path | None:
    """Return where tapes are kept: PATHWALKER_CACHE or the user's cache; None if switched off."""
    chosen = os.environ.get("PATHWALKER_CACHE")
    if chosen is not None:
        return None if chosen in ("", "off") else Path(os.path.expanduser(chosen))
    base = os.environ.get("XDG_CACHE_HOME", "")
    base = base if os.path.isabs(base) else os.path.expanduser("~/.cache")
    return Path(base) / "pathwalker" if os.path.isabs(base) else None


def kept_files(folder: Path) -> list[Path]:
    """Return the files of tapes in a folder, the one used last first."""
    used = []
    with contextlib.suppress(OSError):
        for file in folder.glob(f"*{_SUFFIX}"):
            with contextlib.suppress(OSError):  # another process may remove it meanwhile
                used.append((file.stat().st_mtime, file))
    return [file for _, file in sorted(used, reverse=True)]


def kept_tapes(
    structure: Hashable, makers: Makers = ()
) -> dict[str, tuple[int, dict[str, Tape]]] | None:
    """Return the tapes of all blocks of a structure, or None where they are not kept."""
    path = _path(structure, makers)
    if path is None or not path.is_file():  # a pipe would never end
        return None
    try:
        content = path.read_bytes()
        if content[:_SEAL] != _seal(path, memoryview(content)[_SEAL:]):
            return None
    except OSError:
        return None
    with contextlib.suppress(OSError):  # it may be somebody else's
        os.utime(path)  # the files that are used are the last to go
    return _unpacked(content)


def keep_tapes(structure: Hashable, tapes: KeptTapes, makers: Makers = ()) -> None:
    """Keep the tapes of all blocks of a structure; where that is not possible, do nothing."""
    path = _path(structure, makers)
    if path is None:
        return
    content = _packed(tapes)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        # other processes see the whole file or none
        with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".part", delete=False) as file:
            try:
                file.write(_seal(path, content) + content)
                file.close()
                os.replace(file.name, path)
            except BaseException:
                Path(file.name).unlink(missing_ok=True)
                raise
        _tidy(path)


def _tidy(newest: Path) -> None:
    """Remove the files that were not used for longest, and what dying processes left."""
    oldest = newest.stat().st_mtime - _ABANDONED
    left = [file for file in newest.parent.glob("*.part") if file.stat().st_mtime < oldest]
    for file in [*kept_files(newest.parent)[_MOST_FILES:], *left]:
        file.unlink(missing_ok=True)


def _path(structure: Hashable, makers: Makers = ()) -> Path | None:
    """Return where the tapes of a structure belong; None where nothing may be read or kept."""
    folder, made_by = cache_folder(), _made_by(makers)
    if folder is None or made_by is None:
        return None
    digest = hashlib.sha256(f"{made_by}\n{structure!r}".encode())
    return folder / f"{digest.hexdigest()}{_SUFFIX}"


@cache
def _made_by(makers: Makers = ()) -> str | None:
    """Return a hash of the code and the versions that make tapes.

    It is None where files changed since the import of the package: other code may be running.
    """
    versions = [ca.CasadiMeta.version(), ca.CasadiMeta.git_revision(), np.__version__]
    versions += [maker for maker in makers if isinstance(maker, str)]
    digest = hashlib.sha256(" ".join(versions).encode())
    package = Path(pathwalker_cli.__file__).parent
    try:
        if source_stamps() != pathwalker_cli.SOURCES:
            return None
        files = [(path, path.read_bytes()) for path in _maker_files(package, makers)]
    except OSError:
        return None
    for path, content in files:
        digest.update(f"{os.path.relpath(path, package)} {len(content)}\n".encode() + content)
    return digest.hexdigest() if files else None


def _maker_files(package: Path, makers: Makers) -> Iterator[Path]:
    for folder, _, names in sorted(os.walk(package)):
        yield from (Path(folder, name) for name in sorted(names) if name.endswith(".py"))
    for library in (*makers, kernels_path()):
        if isinstance(library, Path) and library.is_file():
            yield library


def _seal(path: Path, content: bytes | memoryview) -> bytes:
    """Return a hash of the content of a file and its name: nothing unsealed is ever parsed."""
    digest = hashlib.sha256(path.name.encode())
    digest.update(content)
    return digest.digest()


def _arrays(tape: Tape) -> tuple[np.ndarray, ...]:
    return tape.code, tape.inputs, tape.outputs, *tape.patterns


def _packed(tapes: KeptTapes) -> bytes:
    """Return a table of contents and the numbers of all tapes in a row."""
    contents = {
        name: [rows, {k: [t.registers, [a.shape for a in _arrays(t)]] for k, t in block.items()}]
        for name, (rows, block) in tapes.items()
    }
    numbers = [
        np.ascontiguousarray(array, np.int32).tobytes()
        for _, block in tapes.values()
        for tape in block.values()
        for array in _arrays(tape)
    ]
    text = json.dumps(contents).encode()
    return len(text).to_bytes(8, "little") + b"".join((text, *numbers))


def _unpacked(sealed: bytes) -> dict[str, tuple[int, dict[str, Tape]]]:
    """Return the tapes of a sealed content; their arrays are parts of it."""
    begin = _SEAL + 8
    at = begin + int.from_bytes(sealed[_SEAL:begin], "little")
    contents: dict[str, Any] = json.loads(sealed[begin:at])

    def take(shape: list[int]) -> np.ndarray:
        nonlocal at
        size = shape[0] * shape[1]
        at += 4 * size
        return np.frombuffer(sealed, np.int32, size, at - 4 * size).reshape(shape)

    found = {}
    for name, (rows, block) in contents.items():
        tapes = {}
        for kind, (registers, shapes) in block.items():
            code, inputs, outputs, *patterns = map(take, shapes)
            tapes[kind] = Tape(code, registers, inputs, outputs, tuple(patterns))
        found[name] = (rows, tapes)
    return found
