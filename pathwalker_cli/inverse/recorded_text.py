"""Tables of recorded gait for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.inverse.study_tables import ResidualTable, StrengthTable

__all__ = [
    "dynamics_content",
    "residuals_renderable",
    "stance_notes",
    "strengths_renderable",
    "trial_warnings",
    "trials_renderable",
]


def trials_renderable(trials: Iterable[StudyTrial]) -> Table:
    """Return one row per trial: length, cycles, measured stances, distance of the markers."""
    trials = tuple(trials)
    fitted = any(trial.markers for trial in trials)
    table = Table(title="Trials", title_justify="left")
    for name in ("condition", "trial"):
        table.add_column(name)
    for name in ("frames", "strides", "measured stances", *["markers\n[mm]"] * fitted):
        table.add_column(name, justify="right")
    for trial in trials:
        seen = [item.stance.side for item in trial.stances if item.measured]
        counts = [f"{seen.count(side)} {side}" for side in ("right", "left") if side in seen]
        row = [trial.condition, trial.name, str(trial.motion.time.size), str(len(trial.cycles)),
               ", ".join(counts) or "-"]  # fmt: skip
        if fitted:
            row.append(f"{1e3 * trial.markers.mean:.1f}" if trial.markers else "-")
        table.add_row(*row)
    return table


def dynamics_content(
    trials: Iterable[StudyTrial], tables: Iterable[ResidualTable], strengths: StrengthTable
) -> dict[str, Any]:
    """Return trials, mean residuals [N, N, N m] and strengths [N m] as plain values."""
    return {
        "trials": [
            {
                "condition": trial.condition,
                "trial": trial.name,
                "frames": int(trial.motion.time.size),
                "strides": len(trial.cycles),
                "measured_stances": [
                    item.stance.side for item in trial.stances if item.measured
                ],
            }
            for trial in trials
        ],
        "mean_residuals": [
            {
                "condition": table.condition,
                "part": table.part,
                "trials": len(table.trials),
                "forward_up_moment": None if table.range is None else table.range.mean.tolist(),
            }
            for table in tables
        ],
        "strengths": {
            row.generator: {"value": float(row.value), "patient_file": row.given,
                            "remark": row.remark}
            for row in strengths.rows
        },
        "strengths_reason": strengths.reason,
    }  # fmt: skip


def residuals_renderable(tables: Sequence[ResidualTable]) -> Table:
    """Return mean residuals per trial and over trials, these also per kg of body mass."""
    table = Table(title="Pelvis residuals, means over frames", title_justify="left")
    table.add_column("trials and parts of the cycle", no_wrap=True)
    for name in ("frames", "forward\n[N]", "up\n[N]", "moment\n[N m]"):
        table.add_column(name, justify="right")
    for block in tables:
        table.add_row(f"{block.condition}, {block.part}", style="bold")
        for item in block.trials:
            table.add_row(f"  {item.trial}", str(item.frames), *_values(item.mean, 2))
        if block.range is not None:
            found = block.range
            spans = {"mean": found.mean, "min": found.lowest, "max": found.highest}
            for name, values in spans.items():
                table.add_row(f"  {name} over trials", "", *_values(values, 2), style="bold")
            for name, values in spans.items():
                per_kg = _values(values / block.body_mass, 3)
                table.add_row(f"  {name} per kg of body mass", "", *per_kg, style="dim")
        table.add_section()
    return table


def strengths_renderable(found: StrengthTable) -> RenderableType:
    """Return all strengths beside those of the patient's file, or why there are none."""
    if not found.rows:
        return Text(f"No strengths: {found.reason}.")
    title = "Strengths at 90 % activation, beside the patient's file"
    table = Table(title=title, title_justify="left")
    table.add_column("generator", no_wrap=True)
    for name in ("here\n[N m]", "patient\n[N m]", "off by", "stances"):
        table.add_column(name, justify="right", no_wrap=True)
    table.add_column("remark")
    for row in found.rows:
        table.add_row(
            row.generator,
            f"{row.value:.2f}",
            "-" if row.given is None else f"{row.given:.2f}",
            "-" if row.deviation is None else f"{row.deviation:+.0%}",
            "" if row.peak is None else str(row.peak.count),
            row.remark,
        )
    return table


def trial_warnings(trials: Iterable[StudyTrial], height: float, share: float) -> tuple[str, ...]:
    """Return a sentence for everything about the trials that the user should know.

    Args:
        trials: The trials.
        height: Height of the patient [m].
        share: Mean distance of the markers that is a warning, as a share of the height.
    """
    found = []
    for trial in trials:
        if trial.markers is not None and trial.markers.mean > share * height:
            found.append(
                f"{trial.name}: markers lie {1e3 * trial.markers.mean:.0f} mm from the walker on "
                f"average (usual: below {1e3 * share * height:.0f} mm at a height of {height:g} "
                "m): is this the patient's file, and the condition that was recorded?"
            )
        for gap in trial.gaps:
            if not gap.bridged:
                found.append(
                    f"{trial.name}: marker {gap.marker} is not seen in frames {gap.first} to "
                    f"{gap.first + gap.frames - 1}; the others carry the fit there"
                )
        if trial.markers is not None and trial.forces is None:
            found.append(f"{trial.name}: has no force plates, so there are no forces")
        if not trial.cycles:
            found.append(f"{trial.name}: shows no complete gait cycle, so it is in no figure")
    return tuple(found)


def stance_notes(trials: Iterable[StudyTrial]) -> tuple[str, ...]:
    """Return a sentence for every stance that a plate felt but that is not measured."""
    return tuple(
        f"{trial.name}: {item.stance.side} stance from frame {item.stance.strike} is not measured: "
        f"{item.reason}"
        for trial in trials
        for item in trial.stances
        if not item.measured and item.plate is not None
    )


def _values(mean: np.ndarray, digits: int) -> list[str]:
    """Return forward, up and moment as text."""
    return [f"{x:.{digits}f}" for x in mean]
