"""Pipes and devices in the place of files: reading one may never end."""

from __future__ import annotations

from pathlib import Path

from pathwalker_cli.errors import DataError, InputError

__all__ = ["refuse_special"]


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
