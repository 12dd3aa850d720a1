"""The page that folders ask for: about a patient, about recorded gait, or about a cohort."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from pathwalker_cli.report.cohort_page import cohort_page
from pathwalker_cli.report.content import Page
from pathwalker_cli.report.folders import STUDIES, sorted_folders, studies_near
from pathwalker_cli.report.gait_page import gait_page
from pathwalker_cli.report.recorded_page import recorded_page
from pathwalker_cli.report.runs import read_runs


def page_of(folders: Sequence[Path]) -> Page:
    """Return the page about runs with their studies, about recorded gait, or about a cohort.

    Raises:
        DataError: If a folder cannot be used, or they do not go together.
    """
    by_kind = sorted_folders(folders)
    if "recorded" in by_kind:
        return recorded_page(by_kind["recorded"])
    if "cohort" in by_kind:
        return cohort_page(by_kind["cohort"])
    runs = read_runs(by_kind["run"])
    named = {kind: places for kind, places in by_kind.items() if kind in STUDIES}
    near = studies_near([(run.run.folder, run.run.metrics) for run in runs], named)
    return gait_page(runs, near)
