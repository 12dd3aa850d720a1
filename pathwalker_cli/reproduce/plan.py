"""What is solved to reproduce the article, and the folder that it goes to."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Final

from pathwalker_cli.case import Case, load_case
from pathwalker_cli.config import smoke_version
from pathwalker_cli.errors import DataError
from pathwalker_cli.results.run_folder import check_target
from pathwalker_cli.studies.base import check_folder as check_own_folder

__all__ = ["ENTRIES", "ORDER", "SEVERAL", "check_folder", "planned_studies"]

ORDER: Final = (
    "ls-barefoot",
    "mapd-barefoot",
    "mapd-orthosis",
    "mapd-ws-orthosis",
    "mapd-healthy",
)
"""The problems in the order in which they are solved; each has a shipped config of its name."""

SEVERAL: Final = ("mapd-barefoot", "mapd-orthosis")
"""Problems whose optimum is sought from several starts: the article's main results."""

ENTRIES: Final = frozenset({"results.md", "figures", "inverse-dynamics", "runs"})
"""Everything that the folder holds; one with anything else is never written into."""


def planned_studies(starts: int, quick: bool) -> dict[str, Case]:
    """Return the study of every problem, as shipped.

    Args:
        starts: Starts of the problems `SEVERAL`.
        quick: Whether coarse meshes without refinement and one start will do.
    """
    cases = {problem: load_case(problem, problem) for problem in ORDER}
    if quick:
        return {
            name: replace(case, config=smoke_version(case.config)) for name, case in cases.items()
        }
    return {
        problem: case.with_values({"starts": starts}) if problem in SEVERAL else case
        for problem, case in cases.items()
    }


def check_folder(folder: Path) -> None:
    """Refuse a folder that cannot take the results, before anything is computed.

    Raises:
        DataError: If it is a file, cannot be written, or holds something else.
    """
    check_own_folder(folder, ENTRIES, "reproduce")
    for name in ENTRIES - {"results.md"}:
        if (folder / name).exists() and not (folder / name).is_dir():
            raise DataError("is a file, not a folder", where=str(folder / name), mend="remove it")
    for problem in ORDER:
        check_target(folder / "runs" / problem)
