"""Tables of recorded gait for the terminal."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.inverse.residuals import COMPONENTS, ResidualTable
from pathwalker_cli.inverse.strengths import StrengthTable
from pathwalker_cli.inverse.trial import Trial


def trials_renderable(trials: Iterable[Trial]) -> Table:
    """Return one row per trial: length, cycles, measured stances, distance of the markers."""
    trials = tuple(trials)
    fitted = any(trial.markers for trial in trials)
    heads = ("frames", "strides", "measured stances", *["markers\n[mm]"] * fitted)
    table = _table("Trials", ("condition", "trial"), heads)
    for trial in trials:
        measured = _measured_sides(trial)
        counts = [f"{measured.count(side)} {side}" for side in SIDES if side in measured]
        row = [trial.condition, trial.name, str(trial.motion.time.size), str(len(trial.cycles)),
               ", ".join(counts) or "-"]  # fmt: skip
        if fitted:
            row.append(f"{1e3 * trial.markers.mean:.1f}" if trial.markers else "-")
        table.add_row(*row)
    return table


def dynamics_content(
    trials: Iterable[Trial], tables: Iterable[ResidualTable], strengths: StrengthTable
) -> dict[str, Any]:
    """Return trials, mean residuals [N, N, N m] and strengths [N m] as plain values."""
    return {
        "trials": [
            {
                "condition": trial.condition,
                "trial": trial.name,
                "frames": int(trial.motion.time.size),
                "strides": len(trial.cycles),
                "measured_stances": _measured_sides(trial),
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
    heads = (f"{name}\n[{unit}]" for name, unit in COMPONENTS.items())
    title = "Pelvis residuals, means over frames"
    table = _table(title, ("trials and parts of the cycle",), ("frames", *heads))
    for block in tables:
        table.add_row(f"{block.condition}, {block.part}", style="bold")
        for item in block.trials:
            table.add_row(f"  {item.trial}", str(item.frames), *_values(item.mean, 2))
        spans = block.range.items() if block.range else ()
        for name, mean in spans:
            table.add_row(f"  {name} over trials", "", *_values(mean, 2), style="bold")
        for name, mean in spans:
            per_kg = _values(mean / block.body_mass, 3)
            table.add_row(f"  {name} per kg of body mass", "", *per_kg, style="dim")
        table.add_section()
    return table


def strengths_renderable(strengths: StrengthTable) -> RenderableType:
    """Return all strengths beside those of the patient's file, or why there are none."""
    if not strengths.rows:
        return Text(f"No strengths: {strengths.reason}.")
    title = "Strengths at 90 % activation, beside the patient's file"
    heads = ("here\n[N m]", "patient\n[N m]", "off by", "stances")
    table = _table(title, ("generator",), heads, no_wrap=True)
    table.add_column("remark")
    for row in strengths.rows:
        table.add_row(
            row.generator,
            f"{row.value:.2f}",
            "-" if row.given is None else f"{row.given:.2f}",
            "-" if row.deviation is None else f"{row.deviation:+.0%}",
            "" if row.peak is None else str(len(row.peak.single)),
            row.remark,
        )
    return table


def _table(
    title: str, names: Iterable[str], numbers: Iterable[str], no_wrap: bool = False
) -> Table:
    """Return an empty table with columns of names, and of numbers at the right."""
    table = Table(title=title, title_justify="left")
    for head in names:
        table.add_column(head, no_wrap=True)
    for head in numbers:
        table.add_column(head, justify="right", no_wrap=no_wrap)
    return table


def trial_warnings(trials: Iterable[Trial], height: float, share: float) -> tuple[str, ...]:
    """Return a sentence for everything about the trials that the user should know.

    Args:
        trials: The trials.
        height: Height of the patient [m].
        share: Mean distance of the markers that is a warning, as a share of the height.
    """
    warnings = []
    for trial in trials:
        if trial.markers is not None and trial.markers.mean > share * height:
            warnings.append(
                f"{trial.name}: markers lie {1e3 * trial.markers.mean:.0f} mm from the walker on "
                f"average (usual: below {1e3 * share * height:.0f} mm at a height of {height:g} "
                "m): is this the patient's file, and the condition that was recorded?"
            )
        warnings += [f"{trial.name}: {doubt}" for doubt in trial.doubts]
        for gap in trial.gaps:
            if not gap.bridged:
                first = trial.first_frame + gap.first
                warnings.append(
                    f"{trial.name}: marker {gap.marker} is not seen in frames {first} to "
                    f"{first + gap.frames - 1}; the others carry the fit there"
                )
        if trial.markers is not None and trial.forces is None:
            warnings.append(f"{trial.name}: has no force plates, so there are no forces")
        if not trial.cycles:
            warnings.append(f"{trial.name}: shows no complete gait cycle, so it is in no figure")
    return tuple(warnings)


def trial_notes(trials: Iterable[Trial]) -> tuple[str, ...]:
    """Return sentences on how files were read, and why plates that felt a foot do not count.

    Frames are numbered as the recording program shows them.
    """
    notes = []
    for trial in trials:
        notes += [f"{trial.name}: {remark}" for remark in trial.remarks]
        notes += [
            f"{trial.name}: {item.stance.side} stance from frame "
            f"{trial.first_frame + item.stance.strike} is not measured: {item.reason}"
            for item in trial.stances
            if not item.measured and item.plate is not None
        ]
    return tuple(notes)


def _measured_sides(trial: Trial) -> list[Side]:
    """Return the side of each stance with a measured force."""
    return [item.stance.side for item in trial.stances if item.measured]


def _values(mean: np.ndarray, digits: int) -> list[str]:
    """Return forward, up and moment as text."""
    return [f"{x:.{digits}f}" for x in mean]
