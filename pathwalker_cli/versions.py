"""Versions of what a result depends on, and its date."""

from __future__ import annotations

import platform
from datetime import UTC, datetime
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Final

from pathwalker_cli import __version__

MISSING: Final = "missing"
"""Stands for the version of a package that is not installed."""

_PACKAGES: Final = {
    "pin": "pinocchio",
    "casadi": "casadi",
    "numpy": "numpy",
    "scipy": "scipy",
}
"""Distributions and the modules that they install."""


def today() -> str:
    """Return the date of today, UTC."""
    return datetime.now(UTC).date().isoformat()


def versions() -> dict[str, str]:
    """Return the versions of PathWalker, Python and the numerical libraries."""
    found = {"pathwalker": __version__, "python": platform.python_version()}
    return found | {name: _version(name, module) for name, module in _PACKAGES.items()}


def _version(distribution: str, module: str) -> str:
    """Return the version of a distribution, which conda may have installed under another name."""
    try:
        return version(distribution)
    except PackageNotFoundError:
        try:
            return str(getattr(import_module(module), "__version__", "unknown"))
        except ImportError:
            return MISSING
