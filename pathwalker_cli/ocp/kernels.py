"""Compiled numerical kernels, for the widest vectors that this machine has."""

from __future__ import annotations

import ctypes
from functools import cache
from importlib import resources
from pathlib import Path

__all__ = ["kernels", "kernels_path"]


def _path(level: str) -> Path:
    # In an editable install it stands apart from this file; `resources` looks in both places.
    return Path(str(resources.files(__package__) / f"libkernels-{level}.so"))


@cache
def kernels() -> ctypes.CDLL | None:
    """Return the library for this machine, or None where none was compiled or none loads."""
    path = kernels_path()
    return None if path is None else ctypes.CDLL(str(path))


@cache
def kernels_path() -> Path | None:
    """Return where the library for this machine stands, or None where it does not load."""
    try:
        generic = ctypes.CDLL(str(_path("generic")))
    except OSError:
        return None
    generic.pathwalker_cpu_level.restype = ctypes.c_char_p
    best = _path(generic.pathwalker_cpu_level().decode())
    return best if best.is_file() else _path("generic")
