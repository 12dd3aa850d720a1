"""Residuals and strengths of a study in the form of the article's tables 3 and 1."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

import numpy as np
from pydantic import ValidationError

from pathwalker_cli.conventions import GENERATORS, GRAVITY, Condition, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.cycles import stances, swings
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.forces import BOTH
from pathwalker_cli.inverse.published import EVENT_SHIFT
from pathwalker_cli.inverse.published_tables import published_residuals, published_strengths
from pathwalker_cli.inverse.residuals import ResidualRange, Residuals, residual_range, residuals
from pathwalker_cli.inverse.strengths import (
    Peak,
    extension_peaks,
    isometric_torque,
    stance_curves,
    strengths_of,
)
from pathwalker_cli.inverse.study import InverseDynamicsConfig
from pathwalker_cli.io.c3d import Event
from pathwalker_cli.model.elements.muscle import generators
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Strengths

__all__ = [
    "PARTS",
    "Part",
    "ResidualTable",
    "StrengthRow",
    "StrengthTable",
    "residual_tables",
    "strength_table",
    "study_warnings",
]

Part = Literal["whole cycle", "single support"]
PARTS: Final[tuple[Part, Part]] = ("whole cycle", "single support")


@dataclass(frozen=True)
class ResidualTable:
    """Residuals of one condition in one part of the gait cycle.

    Args:
        condition: The condition.
        part: "whole cycle": frames of complete gait cycles in which all forces are known; "single
            support": those of them in which one foot is in the air.
        trials: Residuals of the trials that show any such frame.
        range: Mean, lowest and highest over the trials with enough frames, None if there are none.
        body_mass: Mass to divide by for N/kg and N m/kg [kg].
    """

    condition: Condition
    part: Part
    trials: tuple[Residuals, ...]
    range: ResidualRange | None
    body_mass: float


@dataclass(frozen=True)
class StrengthRow:
    """Maximum isometric torque of one generator.

    Args:
        generator: Its name.
        value: Estimated strength [N m].
        given: Strength in the patient's file [N m], or None.
        peak: Where the strength comes from; None for those that follow from others by ratio.
        lowest: Smallest strength that a single stance gives [N m], NaN without a peak.
        highest: Largest strength that a single stance gives [N m], NaN without a peak.
        remark: What to be careful about, in words, "" if nothing.
    """

    generator: str
    value: float
    given: float | None
    peak: Peak | None
    lowest: float
    highest: float
    remark: str

    @property
    def deviation(self) -> float | None:
        """Deviation from the patient's file as a share of it."""
        return None if self.given is None else self.value / self.given - 1.0


@dataclass(frozen=True)
class StrengthTable:
    """All strengths, or why there are none."""

    rows: tuple[StrengthRow, ...]
    strengths: Strengths | None
    reason: str


def residual_tables(
    trials: Sequence[StudyTrial], patient: Patient, config: InverseDynamicsConfig
) -> tuple[ResidualTable, ...]:
    """Return the residuals per condition and part of the gait cycle."""
    tables = []
    for condition in config.conditions:
        own = [t for t in trials if t.condition == condition and t.tau is not None]
        for part in PARTS:
            rows = [_residuals(trial, part) for trial in own]
            found = tuple(row for row in rows if row.frames)
            enough = tuple(row for row in found if row.frames >= config.least_frames)
            span = residual_range(enough) if enough else None
            tables.append(ResidualTable(condition, part, found, span, patient.body_mass))
    return tuple(tables)


def _residuals(trial: StudyTrial, part: Part) -> Residuals:
    """Return the residuals of one trial over its cycles or the single supports in them."""
    if trial.tau is None:
        raise ValueError(f"trial {trial.name} has no torques")
    values = trial.tau.values
    shift = EVENT_SHIFT if trial.published else 0
    alone = {side: _standing_alone(trial.events, len(values), side, shift) for side in BOTH}
    chosen = np.zeros(len(values), dtype=bool)
    for cycle in trial.cycles:
        inside = np.zeros(len(values), dtype=bool)
        inside[cycle.start : cycle.end + 1] = True
        # The published forces of the other foot may belong to a plate that it never touched.
        support = alone[cycle.side] if trial.published else alone["right"] | alone["left"]
        chosen |= inside & support if part == "single support" else inside
    found = residuals(trial.name, values, np.flatnonzero(chosen))
    if trial.published and part == "whole cycle" and trial.cycles:
        mean = published_residuals((trial.published,), 1.0).mean
        return Residuals(trial.name, mean, found.rms, found.frames)
    return found


def _standing_alone(
    events: tuple[Event, ...], frames: int, side: Side, shift: int = 0
) -> np.ndarray:
    """Return in which frames a foot stands while the other is in the air, shape (frames,).

    Args:
        events: Foot strikes and toe-offs.
        frames: Number of frames.
        side: The standing side.
        shift: Frames to move all events by.
    """
    index = np.arange(frames) - shift
    other: Side = "left" if side == "right" else "right"
    stands, swings_by = np.zeros(frames, dtype=bool), np.zeros(frames, dtype=bool)
    for stance in stances(events):
        if stance.side == side:
            stands |= (index >= stance.strike) & (index <= stance.toe_off)
    for off, strike in swings(events, other):
        swings_by |= (index > off) & (index < strike)
    return stands & swings_by


def study_warnings(
    trials: Sequence[StudyTrial], tables: Sequence[ResidualTable], patient: Patient, share: float
) -> tuple[str, ...]:
    """Return a sentence for every condition whose vertical residual is far off.

    Args:
        trials: The trials.
        tables: Their residuals.
        patient: The patient.
        share: Share of body weight from which a residual is far off.
    """
    if any(trial.published for trial in trials):
        return ()
    weight = patient.body_mass * GRAVITY
    return tuple(
        f"{table.condition}: the mean vertical residual in single support is "
        f"{table.range.mean[1]:.0f} N, {table.range.mean[1] / weight:.0%} of the body weight "
        f"(usual: below 10 %): are body_mass {patient.body_mass:g} kg and the segment lengths of "
        f"patient {patient.id} those of this recording?"
        for table in tables
        if table.part == "single support"
        and table.range is not None
        and abs(table.range.mean[1]) > share * weight
    )


def strength_table(
    trials: Sequence[StudyTrial], patient: Patient, config: InverseDynamicsConfig
) -> StrengthTable:
    """Return all strengths beside those of the patient's file.

    Args:
        trials: Trials of any condition; those with an orthosis are left out.
        patient: The patient.
        config: What counts as uncertain.
    """
    barefoot = [t for t in trials if t.condition == "barefoot" and t.tau is not None]
    peaks, single = _peaks(barefoot, config.motion_cutoff)
    try:
        found = strengths_of(peaks)
    except DataError as problem:
        return StrengthTable((), None, str(problem) if barefoot else "no barefoot trials")
    except ValidationError:
        worst = min(peaks, key=lambda peak: peak.strength)
        return StrengthTable((), None, f"{worst.generator} comes out as {worst.strength:.3g} N m")
    by_name = {peak.generator: peak for peak in peaks}
    given = patient.strengths.vector() if patient.strengths else (None,) * len(GENERATORS)
    rows = []
    for name, value, known in zip(GENERATORS, found.vector(), given, strict=True):
        peak, others = by_name.get(name), single.get(name, [])
        low, high = (min(others), max(others)) if others else (np.nan, np.nan)
        remark = _remark(peak, low, high, config) if peak else _origin(name)
        rows.append(StrengthRow(name, value, known, peak, low, high, remark))
    return StrengthTable(tuple(rows), found, "")


def _peaks(
    trials: Sequence[StudyTrial], cutoff: float
) -> tuple[tuple[Peak, ...], Mapping[str, list[float]]]:
    """Return the peaks of the mean curves, and per generator the strengths of single stances."""
    single: dict[str, list[float]] = {}
    published = tuple(t.published for t in trials if t.published and t.cycles)
    if published:
        for one in published:
            for peak in published_strengths((one,)):
                single.setdefault(peak.generator, []).append(peak.strength)
        return published_strengths(published), single
    curves = stance_curves(trials, cutoff)
    for name, found in curves.items():
        for curve in found:
            for peak in extension_peaks({name: curve}, {name: 1}):
                single.setdefault(peak.generator, []).append(peak.strength)
    means = {name: np.mean(found, axis=0) for name, found in curves.items()}
    return extension_peaks(means, {name: len(found) for name, found in curves.items()}), single


def _origin(generator: str) -> str:
    """Return where a strength without a peak of its own comes from."""
    if generator == "lumbar_extension":
        return "mean of both hips"
    return "ratio to extension"


def _remark(peak: Peak, low: float, high: float, config: InverseDynamicsConfig) -> str:
    """Return in words why a strength is uncertain."""
    remarks = []
    if peak.count < config.least_stances:
        remarks.append(f"only {peak.count} stance{'s' if peak.count > 1 else ''}")
    changes = _changes(peak, config)
    worst = max(changes, key=lambda name: abs(changes[name]))
    if abs(changes[worst]) > config.largest_sensitivity:
        remarks.append(f"ill-conditioned: {worst} changes it by {changes[worst]:+.0%}")
    if np.isfinite(low) and high > 1.5 * low:
        remarks.append(f"single stances give {low:.0f} to {high:.0f} N m")
    return "; ".join(remarks)


def _changes(peak: Peak, config: InverseDynamicsConfig) -> dict[str, float]:
    """Return by which share of itself the strength changes with errors of angle and speed."""
    generator = next(g for g in generators() if g.name == peak.generator)
    changes = {}
    for sign in (1.0, -1.0):
        angle, speed = sign * config.angle_error, sign * config.speed_error
        for name, da, dv in ((f"{angle:+g} rad", angle, 0.0), (f"{speed:+g} rad/s", 0.0, speed)):
            value = isometric_torque(generator, peak.torque, peak.angle + da, peak.speed + dv)
            changes[name] = value / peak.strength - 1.0
    return changes
