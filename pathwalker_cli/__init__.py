"""PathWalker predicts gait and identifies ankle-foot orthosis stiffness by optimal control."""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from pathwalker_cli.paths import source_stamps

if TYPE_CHECKING:
    from pathwalker_cli.case import load_case
    from pathwalker_cli.extensions import (
        register_elements,
        register_goal,
        register_measure,
        register_use,
    )
    from pathwalker_cli.gait.solve import solve_study
    from pathwalker_cli.model.walker import build_walker
    from pathwalker_cli.patient import load_patient
    from pathwalker_cli.results.run_folder import load_run
    from pathwalker_cli.studies.run import run_study

__all__ = [
    "__version__",
    "build_walker",
    "load_case",
    "load_patient",
    "load_run",
    "register_elements",
    "register_goal",
    "register_measure",
    "register_use",
    "run_study",
    "solve_study",
]

SOURCES = source_stamps()
"""What the sources were when this process began to read them."""

_HOMES = {
    "build_walker": "pathwalker_cli.model.walker",
    "load_case": "pathwalker_cli.case",
    "load_patient": "pathwalker_cli.patient",
    "load_run": "pathwalker_cli.results.run_folder",
    "register_elements": "pathwalker_cli.extensions",
    "register_goal": "pathwalker_cli.extensions",
    "register_measure": "pathwalker_cli.extensions",
    "register_use": "pathwalker_cli.extensions",
    "run_study": "pathwalker_cli.studies.run",
    "solve_study": "pathwalker_cli.gait.solve",
}

try:
    __version__ = version("pathwalker-cli")
except PackageNotFoundError:  # used from a checkout that is not installed
    __version__ = "0+unknown"


def __getattr__(name: str) -> Any:
    """Import the public functions when they are first used: the command line must start fast."""
    if name in _HOMES:
        return getattr(import_module(_HOMES[name]), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")


def __dir__() -> list[str]:
    """Return the public names alone."""
    return __all__
