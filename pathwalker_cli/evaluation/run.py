"""The gait that a run folder holds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np

from pathwalker_cli.config import study_patient
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.ocp.series import GaitSeries, gait_series
from pathwalker_cli.output.cycle import BOTH_SIDES
from pathwalker_cli.output.run_folder import load_run

__all__ = ["gait_of_run", "gait_of_series", "gaits_of_runs"]


def gaits_of_runs(folders: Sequence[Path]) -> tuple[Gait, ...]:
    """Return the gaits of several runs under names that differ.

    Raises:
        DataError: If a run is named twice or cannot be used.
    """
    places = [folder.resolve() for folder in folders]
    for place, folder in zip(places, folders, strict=True):
        if places.count(place) > 1:
            raise DataError("is named twice", where=str(folder), allowed="each run once")
    gaits: list[Gait] = []
    for folder in folders:
        gait = gait_of_run(folder)
        known = {each.name for each in gaits}
        names = (gait.name if n == 1 else f"{gait.name}-{n}" for n in count(1))
        gaits.append(replace(gait, name=next(name for name in names if name not in known)))
    return tuple(gaits)


def gait_of_run(folder: str | Path) -> Gait:
    """Return the gait of a converged run.

    Args:
        folder: The folder that `pathwalker solve` wrote.

    Raises:
        DataError: If it is no run folder, did not converge or holds no full stride.
        PatientError: If the patient is no longer there.
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
    config = run.config
    patient = study_patient(config)
    walker = build_walker(patient, config.condition, config.model.published)
    notes = ("a quick check on a coarse mesh: for orientation only",) if config.smoke else ()
    series = gait_series(walker, run.motion)
    name = Path(folder).resolve().name
    return gait_of_series(series, name, config.problem, run.metrics["effort"], notes)


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
