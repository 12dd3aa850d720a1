"""What installed packages add: they name what registers it as entry points of `pathwalker`."""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points
from typing import Final

GROUP: Final = "pathwalker"


@cache
def load_installed() -> None:
    """Let installed packages register what they have, once: modules are imported."""
    for entry in entry_points(group=GROUP):
        made = entry.load()
        if callable(made):
            made()
