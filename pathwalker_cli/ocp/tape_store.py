"""Tapes of solved structures, kept on disk: a further process derives nothing again.

A file holds the tapes of one problem structure.  Its name is a hash of everything that tapes follow
from: the sources of models and problems, the compiled libraries, the versions of CasADi and NumPy,
and the structure itself.  A change of any of them is another name, so what is read is never stale.
"""

from __future__ import annotations

import contextlib
import hashlib
import os
from collections.abc import Hashable, Iterator, Sequence
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

import casadi as ca
import numpy as np

import pathwalker_cli
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.ocp.tape import Tape

__all__ = ["cache_folder", "keep_tapes", "kept_tapes"]

_SOURCES: Final = ("conventions.py", "model", "ocp")
"""What tapes are made by."""

_MOST_FILES: Final = 20
"""Structures that are kept; one takes some 10 MB."""

BlockTapes = dict[str, Tape]
"""Tapes of one block by kind."""


def cache_folder() -> Path | None:
    """Return where tapes are kept: PATHWALKER_CACHE or the user's cache; None if switched off."""
    chosen = os.environ.get("PATHWALKER_CACHE")
    if chosen is not None:
        return None if chosen in ("", "off") else Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME")
    return (Path(base) if base else Path.home() / ".cache") / "pathwalker"


def kept_tapes(structure: Hashable) -> list[BlockTapes] | None:
    """Return the tapes of all blocks of a structure, or None where they are not kept."""
    path = _path(structure)
    if path is None:
        return None
    try:
        with np.load(path, allow_pickle=False) as content:
            numbers, text, seal = content["numbers"], content["kinds"], content["seal"]
        if seal.tobytes() != _seal(numbers, text):
            return None
        tapes = _unpacked(numbers, str(text))
        os.utime(path)  # the files that are used are the last to go
    except Exception:  # whatever is wrong with the file, it is made again
        return None
    return tapes


def keep_tapes(structure: Hashable, tapes: Sequence[BlockTapes]) -> None:
    """Keep the tapes of all blocks of a structure; where that is not possible, do nothing."""
    path = _path(structure)
    if path is None:
        return
    numbers, kinds = _packed(tapes)
    seal = np.frombuffer(_seal(numbers, kinds), np.uint8)
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True)
        with atomic_open(path, "wb") as file:  # other processes see the whole file or none
            np.savez(file, numbers=numbers, kinds=kinds, seal=seal)
        _tidy(path.parent)


def _tidy(folder: Path) -> None:
    """Remove the files that were not used for longest."""
    files = sorted(folder.glob("*.npz"), key=lambda file: file.stat().st_mtime, reverse=True)
    for file in files[_MOST_FILES:]:
        file.unlink(missing_ok=True)


def _path(structure: Hashable) -> Path | None:
    folder = cache_folder()
    if folder is None:
        return None
    digest = hashlib.sha256(f"{_makers()}\n{structure!r}".encode())
    return folder / f"tapes-{digest.hexdigest()[:32]}.npz"


@cache
def _makers() -> str:
    """Return a hash of the code and the versions that make tapes."""
    digest = hashlib.sha256(f"{ca.CasadiMeta.version()} {np.__version__}".encode())
    for path in _maker_files():
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    return digest.hexdigest()


def _maker_files() -> Iterator[Path]:
    package = Path(pathwalker_cli.__file__).parent
    for name in _SOURCES:
        source = package / name
        yield from sorted(source.rglob("*.py")) if source.is_dir() else [source]
    libraries = {
        "pathwalker_cli.ocp": "libkernels-generic.so",
        "pathwalker_cli.model.backends": "libpinocchio_casadi.so",
    }
    for module, name in libraries.items():
        library = Path(str(resources.files(module) / name))
        if library.is_file():
            yield library


def _seal(numbers: np.ndarray, kinds: object) -> bytes:
    return hashlib.sha256(str(kinds).encode() + numbers.tobytes()).digest()


def _packed(tapes: Sequence[BlockTapes]) -> tuple[np.ndarray, str]:
    """Return all numbers of all tapes in a row, and the kinds by block."""
    parts = []
    for block in tapes:
        for tape in block.values():
            arrays = [tape.code, tape.inputs, tape.outputs, *tape.patterns]
            shapes = [length for array in arrays for length in array.shape]
            parts.append(np.array([tape.registers, len(arrays), *shapes]))
            parts += [array.ravel() for array in arrays]
    numbers = np.concatenate(parts).astype(np.int32)
    return numbers, ";".join(",".join(block) for block in tapes)


def _unpacked(numbers: np.ndarray, kinds: str) -> list[BlockTapes]:
    at, tapes = 0, []

    def take(count: int) -> np.ndarray:
        nonlocal at
        at += count
        return numbers[at - count : at]

    for block in kinds.split(";"):
        found = {}
        for kind in block.split(","):
            registers, count = take(2).tolist()
            shapes = take(2 * count).reshape(count, 2).tolist()
            code, inputs, outputs, *patterns = (
                take(rows * columns).reshape(rows, columns) for rows, columns in shapes
            )
            found[kind] = Tape(code, registers, inputs, outputs, tuple(patterns))
        tapes.append(found)
    return tapes
