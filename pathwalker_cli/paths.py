"""Where the shipped configs, patients and URDF files are, and the state of the sources."""

from __future__ import annotations

import os
from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def shipped(folder: str) -> Path:
    """Return the folder of shipped data ("configs", "patient_data" or "urdf").

    In an installed package it stands inside the package, in a checkout beside it.
    """
    installed = _PACKAGE / "data" / folder
    return installed if installed.is_dir() else _PACKAGE.parent / folder


def source_stamps(folder: str = str(_PACKAGE)) -> dict[str, tuple[int, int, int]]:
    """Return what changes with every source and library of the package, by its path.

    It is told by the disk alone, whose times are only compared for being the same: clocks may jump.
    """
    found: dict[str, tuple[int, int, int]] = {}
    with os.scandir(folder) as entries:
        for entry in entries:
            if entry.name.endswith((".py", ".so")):
                status = entry.stat()
                found[entry.path] = (status.st_ino, status.st_size, status.st_ctime_ns)
            elif "." not in entry.name and entry.name != "__pycache__" and entry.is_dir():
                found |= source_stamps(entry.path)
    return found
