"""The steps from the shipped data to the page of results; what is done is not done again."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

from pathwalker_cli.case import Case, load_case
from pathwalker_cli.config import smoke_version
from pathwalker_cli.errors import DataError
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.reproduce.figures import save_paper_figures
from pathwalker_cli.reproduce.page import page_text
from pathwalker_cli.reproduce.results import (
    METHODS,
    NO_C3D,
    InverseResult,
    Results,
    evaluated,
    inverse_config,
    inverse_result,
    recordings,
)
from pathwalker_cli.results.run_folder import check_target
from pathwalker_cli.studies.run import done_run
from pathwalker_cli.versions import versions

ORDER: Final = ("ls-barefoot", "mapd-barefoot", "mapd-orthosis", "mapd-ws-orthosis", "mapd-healthy")
"""The problems in the order in which they are solved; each has a shipped config of its name."""

SEVERAL: Final = ("mapd-barefoot", "mapd-orthosis")
"""Problems whose optimum is sought from several starts: the article's main results."""

PAGE: Final = "results.md"
"""File of the page."""

ENTRIES: Final = frozenset({PAGE, "figures", "inverse-dynamics", "runs"})
"""Everything that the folder holds; one with anything else is never written into."""

Solve = Callable[[Case, Path], None]
"""Solves a study and writes its run folder, converged or not."""
Say = Callable[[str], None]
"""Called with one line per step."""


def planned_studies(starts: int, quick: bool) -> dict[str, Case]:
    """Return the study of every problem, as shipped.

    Args:
        starts: Starts of the problems `SEVERAL`.
        quick: Whether coarse meshes without refinement and one start will do.
    """
    cases = {problem: load_case(problem, problem) for problem in ORDER}
    if quick:
        return {p: replace(case, config=smoke_version(case.config)) for p, case in cases.items()}
    return cases | {problem: cases[problem].with_values({"starts": starts}) for problem in SEVERAL}


def reproduce(
    folder: Path, solve: Solve, say: Say, starts: int = 8, quick: bool = False,
    c3d: Path | None = None,
) -> Results:  # fmt: skip
    """Compute whatever is not there yet, and write figures and page.

    Args:
        folder: Where everything goes.
        solve: Solves one study.
        say: Called for every step, with its seconds.
        starts: Starts of the article's main problems.
        quick: Whether coarse meshes without refinement and one start will do.
        c3d: Folder of the article's C3D files, for the published method of inverse dynamics.

    Raises:
        InputError: If the folder holds something else, or an input cannot be used.
    """
    _check(folder)
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


def _check(folder: Path) -> None:
    """Refuse a claimed folder that cannot take the results, before anything is computed."""
    for place in (folder / name for name in ENTRIES - {PAGE}):
        if place.exists() and not place.is_dir():
            raise DataError("is a file, not a folder", where=str(place), mend="remove it")
    for problem in ORDER:
        check_target(folder / "runs" / problem)


def _inverse(folder: Path, c3d: Path | None, say: Say) -> dict[str, InverseResult | str]:
    """Return the inverse dynamics study by method."""
    results: dict[str, InverseResult | str] = {}
    for method in METHODS:
        began, state = time.perf_counter(), "left out, no --c3d"
        config = inverse_config(method, c3d)
        if config is None:
            results[method] = NO_C3D
        else:
            results[method], kept = inverse_result(config, folder / f"{method}.json")
            state = "was there" if kept else "done"
        say(_line(f"inverse dynamics, {method}", state, began))
    return results


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
    return f"{name:<28}{state:<20}{time.perf_counter() - began:8.1f} s"
