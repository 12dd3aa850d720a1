"""The gait that a run folder holds."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import count
from pathlib import Path

import numpy as np

from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.stride.cycle import BOTH_SIDES
from pathwalker_cli.stride.series import GaitSeries, gait_series

__all__ = [
    "gait_of_run",
    "gait_of_series",
    "gaits_of_runs",
    "run_and_gait",
    "run_names",
    "run_notes",
    "stride_of_run",
]


def gaits_of_runs(folders: Sequence[Path]) -> tuple[tuple[Run, Gait], ...]:
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
    """Return a converged run and its stride.

    Args:
        folder: The folder that `pathwalker solve` wrote.

    Raises:
        DataError: If it is no run folder, did not converge or holds no full stride.
        PatientError: If the patient that it keeps is damaged.
    """
    try:
        run = load_run(folder)
    except NotConvergedError as error:
        raise DataError(
            str(error), allowed="a converged run", mend="solve it again first"
        ) from None
    names = tuple(phase.name for phase in run.motion.phases)
    if names != PHASE_NAMES:
        raise DataError(
            f"holds the phases {', '.join(names)}",
            where=str(folder),
            allowed="a stride of both legs in eight phases",
        )
    return run, gait_series(run.case.walker(), run.motion)


def run_notes(run: Run) -> tuple[str, ...]:
    """Return what to know about a run, one sentence each."""
    return ("a quick check on a coarse mesh: for orientation only",) if run.config.smoke else ()


def gait_of_run(folder: str | Path) -> Gait:
    """Return the gait of a converged run.

    Args:
        folder: The folder that `pathwalker solve` wrote.

    Raises:
        DataError: If it is no run folder, did not converge or holds no full stride.
        PatientError: If the patient that it keeps is damaged.
    """
    return run_and_gait(folder, Path(folder).resolve().name)[1]


def run_and_gait(folder: str | Path, name: str) -> tuple[Run, Gait]:
    """Return a converged run and its gait under a name; see `gait_of_run`."""
    run, series = stride_of_run(folder)
    told = (run.config.problem, run.metrics["effort"], run_notes(run))
    return run, gait_of_series(series, name, *told)


def gait_of_series(
    series: GaitSeries,
    name: str,
    problem: str,
    effort: float | None = None,
    notes: tuple[str, ...] = (),
) -> Gait:
    """Return a stride of the solver as a plain gait.

    Args:
        series: The stride.
        name: What to call it.
        problem: The problem that it solves.
        effort: Integral of the sum of squared activations [s].
        notes: What to know about it.

    Raises:
        ValueError: If it is no stride in the eight phases.
    """
    force = {
        side: np.stack([series.forward_force(side), series.vertical_force(side)], axis=1)
        for side in BOTH_SIDES
    }
    return Gait(
        name=name,
        problem=problem,
        walker=series.walker,
        time=series.time,
        phase=series.phase,
        phase_durations=series.motion.durations,
        q=series.q,
        force=force,
        net_torque=series.net_torque,
        muscle_torque=series.muscle_torque,
        activation=series.activation,
        effort=effort,
        stiffness=series.stiffness if series.stiffness.size else None,
        notes=notes,
    )
