"""Compiled numerical kernels, for the widest vectors that this machine has."""

from __future__ import annotations

import ctypes
import os
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Final

from pathwalker_cli.errors import ConfigError

_LEVELS: Final = ("generic", "x86-64-v3", "x86-64-v4")
"""Vectors that kernels are compiled for, from none to the widest."""

_CHOICE: Final = "PATHWALKER_KERNELS"
"""Variable of the environment that chooses narrower ones, to repeat a run of another machine."""


def _path(level: str) -> Path:
    # In an editable install it stands apart from this file; `resources` looks in both places.
    return Path(str(resources.files(__package__) / f"libkernels-{level}.so"))


@cache
def kernels() -> ctypes.CDLL | None:
    """Return the library for this machine, or None where none was compiled or none loads."""
    path = kernels_path()
    return None if path is None else ctypes.CDLL(str(path))


def kernels_path() -> Path | None:
    """Return where the library for this machine stands, or None where it does not load."""
    level = kernels_level()
    return None if level is None else _path(level)


@cache
def kernels_level() -> str | None:
    """Return the vectors that the kernels use, or None where they do not load.

    Raises:
        ConfigError: If the environment asks for vectors that this machine does not have.
    """
    try:
        generic = ctypes.CDLL(str(_path("generic")))
    except OSError:
        return None
    generic.pathwalker_cpu_level.restype = ctypes.c_char_p
    widest = _LEVELS.index(generic.pathwalker_cpu_level().decode())
    usable = [level for level in _LEVELS[: widest + 1] if _path(level).is_file()]
    chosen = os.environ.get(_CHOICE, usable[-1])
    if chosen not in usable:
        raise ConfigError(f"is '{chosen}'", where=_CHOICE, allowed=", ".join(usable))
    return chosen
