"""Residual forces on the pelvis: how well motion, forces and body fit together, as in table 3."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal, get_args

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GRAVITY, ROOT, SIDES, Condition, Side
from pathwalker_cli.inverse.cycles import single_support, stances
from pathwalker_cli.inverse.published import EVENT_SHIFT
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.patient import Patient

COMPONENTS: Final[Mapping[str, str]] = {"forward": "N", "up": "N", "moment": "N m"}
"""Components of a residual in order, those of `ROOT`, with their units."""

Part = Literal["whole cycle", "single support"]

_ROOT: Final = [COORDINATES.index(name) for name in ROOT]


@dataclass(frozen=True)
class Residuals:
    """Residuals of one trial by `COMPONENTS`.

    Args:
        trial: Name of the trial.
        mean: Means over the frames, shape (3,).
        rms: Root mean squares over the frames, shape (3,).
        frames: Number of frames in which both feet's forces are known.
    """

    trial: str
    mean: np.ndarray
    rms: np.ndarray
    frames: int


@dataclass(frozen=True)
class ResidualTable:
    """Residuals of one condition in one part of the gait cycle.

    Args:
        condition: The condition.
        part: "whole cycle": frames of complete gait cycles in which all forces are known; "single
            support": those of them in which one foot is in the air.
        trials: Residuals of the trials that show any such frame.
        range: "mean", "min" and "max" of the means of the trials with enough frames, shape (3,)
            each; empty if there are none.
        body_mass: Mass to divide by for N/kg and N m/kg [kg].
    """

    condition: Condition
    part: Part
    trials: tuple[Residuals, ...]
    range: Mapping[str, np.ndarray]
    body_mass: float


def residuals(trial: str, tau: np.ndarray, frames: np.ndarray | None = None) -> Residuals:
    """Return the residuals of a trial over the frames, of all or of those given, that tell them.

    `tau` holds generalised forces [N, N m], NaN where a force is not measured, shape (n, 10).
    """
    root = (tau if frames is None else tau[frames])[:, _ROOT]
    known = root[np.isfinite(root).all(axis=1)]
    if not known.size:
        nothing = np.full(len(ROOT), np.nan)
        return Residuals(trial, nothing, nothing, 0)
    return Residuals(trial, known.mean(axis=0), np.sqrt((known**2).mean(axis=0)), len(known))


def residual_range(trials: Sequence[Residuals], least_frames: int = 1) -> dict[str, np.ndarray]:
    """Return "mean", "min" and "max" of the means of trials with so many frames, if any has."""
    means = np.array([item.mean for item in trials if item.frames >= least_frames])
    if not means.size:
        return {}
    return {"mean": means.mean(axis=0), "min": means.min(axis=0), "max": means.max(axis=0)}


def residual_tables(
    trials: Sequence[Trial], patient: Patient, config: InverseDynamicsConfig
) -> tuple[ResidualTable, ...]:
    """Return the residuals per condition and part of the gait cycle."""
    tables = []
    for condition in config.conditions:
        own = [t for t in trials if t.condition == condition and t.tau is not None]
        for part in get_args(Part):
            rows = tuple(row for trial in own if (row := trial_residuals(trial, part)).frames)
            span = residual_range(rows, config.least_frames)
            tables.append(ResidualTable(condition, part, rows, span, patient.body_mass))
    return tuple(tables)


def trial_residuals(trial: Trial, part: Part) -> Residuals:
    """Return the residuals of one trial over its cycles or the single supports in them.

    The published mean over the whole cycle is that of the cycles' means.
    """
    if trial.tau is None:
        raise ValueError(f"trial {trial.name} has no torques")
    values = trial.tau.values
    alone = _single_supports(trial, len(values))
    chosen = np.zeros(len(values), dtype=bool)
    for cycle in trial.cycles:
        inside = np.zeros(len(values), dtype=bool)
        inside[cycle.rows] = True
        # The published forces of the other foot may belong to a plate that it never touched.
        support = alone[cycle.side] if trial.published else alone["right"] | alone["left"]
        chosen |= inside & support if part == "single support" else inside
    rows = residuals(trial.name, values, np.flatnonzero(chosen))
    if trial.published and part == "whole cycle" and trial.cycles:
        mean = np.mean([values[c.rows][:, _ROOT].mean(axis=0) for c in trial.cycles], axis=0)
        return Residuals(trial.name, mean, rows.rms, rows.frames)
    return rows


def _single_supports(trial: Trial, frames: int) -> dict[Side, np.ndarray]:
    """Return per standing side in which frames the other foot is in the air, shape (frames,)."""
    shift = EVENT_SHIFT if trial.published else 0
    alone = {side: np.zeros(frames, dtype=bool) for side in SIDES}
    for stance in stances(trial.events):
        rows = single_support(stance, trial.events) + shift
        alone[stance.side][rows[(rows >= 0) & (rows < frames)]] = True
    return alone


def study_warnings(
    trials: Sequence[Trial], tables: Sequence[ResidualTable], patient: Patient, share: float
) -> tuple[str, ...]:
    """Return a sentence for every condition whose vertical residual exceeds a share of body weight.

    Trials of the published method carry no warning.
    """
    if any(trial.published for trial in trials):
        return ()
    weight = patient.body_mass * GRAVITY
    return tuple(
        f"{table.condition}: the mean vertical residual in single support is {up:.0f} N, "
        f"{up / weight:.0%} of the body weight (usual: below 10 %): are body_mass "
        f"{patient.body_mass:g} kg and the segment lengths of patient {patient.id} those of this "
        "recording?"
        for table in tables
        if table.part == "single support" and table.range
        if abs(up := table.range["mean"][list(COMPONENTS).index("up")]) > share * weight
    )
