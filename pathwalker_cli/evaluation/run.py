"""The gait that a run folder holds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path

from pathwalker_cli.errors import DataError
from pathwalker_cli.results.run_folder import Run, load_converged
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import Stride, stride_of


def gaits_of_runs(folders: Sequence[Path]) -> tuple[tuple[Run, Stride], ...]:
    """Return several runs with their gaits under names that differ.

    Raises:
        DataError: If a run is named twice or cannot be used.
    """
    names = run_names(folders)
    return tuple(run_and_gait(folder, name) for folder, name in zip(folders, names, strict=True))


def run_names(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return names of runs that differ: those of their folders, numbered where they are alike.

    Raises:
        DataError: If a folder is named twice.
    """
    places = [folder.resolve() for folder in folders]
    names: list[str] = []
    for place, folder in zip(places, folders, strict=True):
        if places.count(place) > 1:
            raise DataError("is named twice", where=str(folder), allowed="each run once")
        candidates = (place.name if n == 1 else f"{place.name}-{n}" for n in count(1))
        names.append(next(name for name in candidates if name not in names))
    return tuple(names)


def stride_of_run(folder: str | Path) -> tuple[Run, GaitSeries]:
    """Return a converged run and its time series.

    Raises:
        DataError: If it is no run folder, did not converge or holds no full stride.
        PatientError: If the patient that it keeps is damaged.
    """
    run = load_converged(folder, mend="solve it again first")
    return run, gait_series(run.case.walker(), run.motion)


def run_notes(run: Run) -> tuple[str, ...]:
    """Return what to know about a run, one sentence each."""
    return ("a quick check on a coarse mesh: for orientation only",) if run.config.smoke else ()


def gait_of_run(folder: str | Path) -> Stride:
    """Return the gait of a converged run.

    Raises:
        DataError: If it is no run folder, did not converge or holds no full stride.
        PatientError: If the patient that it keeps is damaged.
    """
    return run_and_gait(folder, Path(folder).resolve().name)[1]


def run_and_gait(folder: str | Path, name: str) -> tuple[Run, Stride]:
    """Return a converged run and its gait under a name; see `gait_of_run`."""
    run, series = stride_of_run(folder)
    return run, stride_of(series, name, run.config.problem, run_notes(run))
