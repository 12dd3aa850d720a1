"""The steps from the shipped data to the page of results; what is done is not done again."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from pathwalker_cli.case import Case
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.reproduce.figures import save_paper_figures
from pathwalker_cli.reproduce.inverse_study import (
    METHODS,
    NO_C3D,
    InverseResult,
    inverse_config,
    inverse_result,
)
from pathwalker_cli.reproduce.page import page_text
from pathwalker_cli.reproduce.plan import check_folder, planned_studies
from pathwalker_cli.reproduce.results import Results, evaluated, recordings
from pathwalker_cli.studies.run import done_run
from pathwalker_cli.versions import versions

__all__ = ["PAGE", "Say", "Solve", "reproduce"]

PAGE = "results.md"
"""File of the page."""

Solve = Callable[[Case, Path], None]
"""Solves a study and writes its run folder, converged or not."""
Say = Callable[[str], None]
"""Called with one line per step."""


def reproduce(
    folder: Path, solve: Solve, say: Say, starts: int = 8, quick: bool = False,
    c3d: Path | None = None,
) -> Results:  # fmt: skip
    """Compute whatever is not there yet, and write figures and page.

    Args:
        folder: Where everything goes.
        solve: Solves one study.
        say: Told of every step with its seconds.
        starts: Starts of the article's main problems.
        quick: Whether coarse meshes without refinement and one start will do.
        c3d: Folder of the article's C3D files, for the published method of inverse dynamics.

    Raises:
        InputError: If the folder holds something else, or an input cannot be used.
    """
    check_folder(folder)
    studies = planned_studies(starts, quick)
    inverse = _inverse(folder / "inverse-dynamics", c3d, say)
    kept = _solved(folder / "runs", studies, solve, say)
    began = time.perf_counter()
    recorded = recordings()
    problems = {name: evaluated(folder / "runs" / name, kept[name], recorded) for name in studies}
    results = Results(problems, inverse, recorded, quick)
    figures = save_paper_figures(results, folder / "figures")
    say(_line("evaluation and figures", f"{len(figures)} figures", began))
    date = datetime.now(UTC).strftime("%Y-%m-%d, %H:%M UTC")
    shown = [(f"figures/{file}", caption) for file, caption in figures]
    with atomic_open(folder / PAGE) as file:
        file.write(page_text(results, versions(), date, shown))
    return results


def _inverse(folder: Path, c3d: Path | None, say: Say) -> dict[str, InverseResult | str]:
    """Return the inverse dynamics study by method."""
    found: dict[str, InverseResult | str] = {}
    for method in METHODS:
        began = time.perf_counter()
        config = inverse_config(method, c3d)
        name = f"inverse dynamics, {method}"
        if config is None:
            found[method] = NO_C3D
            say(_line(name, "left out, no --c3d", began))
            continue
        found[method], kept = inverse_result(config, folder / f"{method}.json", lambda _: None)
        say(_line(name, "was there" if kept else "done", began))
    return found


def _solved(folder: Path, studies: Mapping[str, Case], solve: Solve, say: Say) -> dict[str, bool]:
    """Solve the problems that are not solved yet; return which were."""
    kept = {}
    for name, study in studies.items():
        began, place = time.perf_counter(), folder / name
        kept[name] = done_run(place, study) is not None
        if not kept[name]:
            solve(study, place)
        done = kept[name] or done_run(place, study) is not None
        state = "was there" if kept[name] else "converged" if done else "did not converge"
        say(_line(name, state, began))
    return kept


def _line(name: str, state: str, began: float) -> str:
    """Return the line of a step."""
    return f"{name:<28}{state:<20}{time.perf_counter() - began:8.1f} s"
