"""The page that some folders give."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pathwalker_cli.report.cohort_page import cohort_page
from pathwalker_cli.report.content import Page
from pathwalker_cli.report.folders import STUDIES, sorted_folders, studies_near
from pathwalker_cli.report.gait_page import gait_page
from pathwalker_cli.report.recorded_page import recorded_page
from pathwalker_cli.report.runs import read_runs

__all__ = ["page_of"]


def page_of(folders: Sequence[Path]) -> Page:
    """Return the page about runs with their studies, about recorded gait, or about a cohort.

    Args:
        folders: Folders that PathWalker's commands wrote.

    Raises:
        DataError: If a folder cannot be used, or they do not go together.
    """
    found = sorted_folders(folders)
    if "recorded" in found:
        return recorded_page(found["recorded"])
    if "cohort" in found:
        return cohort_page(found["cohort"])
    runs = read_runs(found["run"])
    named = {kind: places for kind, places in found.items() if kind in STUDIES}
    near = studies_near([(run.run.folder, run.run.metrics) for run in runs], named)
    return gait_page(runs, near)
