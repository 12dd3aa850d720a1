"""Where the shipped configs, patients and URDF files are."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parent


def shipped(folder: str) -> Path:
    """Return the folder of shipped data ("configs", "patient_data" or "urdf").

    In an installed package it stands inside the package, in a checkout beside it.
    """
    installed = _PACKAGE / "data" / folder
    return installed if installed.is_dir() else _PACKAGE.parent / folder
