"""Recorded gait in words: tables for the terminal, notes, warnings, plain values."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict
from typing import Any

import numpy as np
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.inverse.laboratory import SHOWN, differences, laboratory_rows
from pathwalker_cli.inverse.residuals import COMPONENTS, ResidualTable
from pathwalker_cli.inverse.strengths import StrengthTable
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.patient import Patient


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


def trial_content(trial: Trial, patient: Patient, limit: float) -> dict[str, Any]:
    """Return what is known of a trial, as plain values; see `warnings` for the limit."""
    return {
        "condition": trial.condition,
        "trial": trial.name,
        "first_frame": trial.first_frame,
        "frames": int(trial.motion.time.size),
        "strides": len(trial.cycles),
        "measured_stances": _measured_sides(trial),
        "notes": list(trial.remarks),
        "stances_not_measured": list(stance_notes(trial)),
        "warnings": list(warnings(trial, patient.height, limit)),
        "laboratory": [asdict(each) for each in differences(trial, patient.body_mass)],
    }


def laboratory_renderable(trials: Sequence[Trial], body_mass: float) -> Table | None:
    """Return ours beside what files store of their laboratory's own model, None without any."""
    heads = [f"{what}\n{side}" for what in SHOWN.values() for side in SIDES]
    table = _table("Ours minus the angles and moments in the files", ("quantity",), heads)
    for condition in dict.fromkeys(trial.condition for trial in trials):
        own = (trial for trial in trials if trial.condition == condition)
        for name, cells in laboratory_rows(d for t in own for d in differences(t, body_mass)):
            table.add_row(Text(f"{condition}, {name}"), *cells)
    return table if table.row_count else None


def dynamics_content(tables: Iterable[ResidualTable], strengths: StrengthTable) -> dict[str, Any]:
    """Return mean residuals [N, N, N m] and strengths [N m] as plain values."""
    return {
        "mean_residuals": [
            {
                "condition": table.condition,
                "part": table.part,
                "trials": len(table.trials),
                "forward_up_moment": table.range["mean"].tolist() if table.range else None,
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
        for name, mean in block.range.items():
            table.add_row(f"  {name} over trials", "", *_values(mean, 2), style="bold")
        for name, mean in block.range.items():
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
        table.add_column(Text(head), no_wrap=True)
    for head in numbers:  # as text: Table would take [mm] for a style
        table.add_column(Text(head), justify="right", no_wrap=no_wrap)
    return table


def warnings(trial: Trial, height: float, share: float) -> tuple[str, ...]:
    """Return a sentence for everything about a trial that may be wrong.

    Markers are too far away from a share of the patient's height [m] on, on average.
    """
    found = list(trial.doubts)
    if trial.markers is not None and trial.markers.mean > share * height:
        found.insert(
            0,
            f"markers lie {1e3 * trial.markers.mean:.0f} mm from the walker on average (usual: "
            f"below {1e3 * share * height:.0f} mm at a height of {height:g} m): is this the "
            "patient's file, and the condition that was recorded?",
        )
    found += [
        f"marker {gap.marker} is not seen in frames {trial.first_frame + gap.first} to "
        f"{trial.first_frame + gap.first + gap.frames - 1}; the others carry the fit there"
        for gap in trial.gaps
        if not gap.bridged
    ]
    if trial.markers is not None and trial.forces is None:
        found.append("has no force plates, so there are no forces")
    if not trial.cycles:
        found.append("shows no complete gait cycle, so it is in no figure")
    return tuple(found)


def stance_notes(trial: Trial) -> tuple[str, ...]:
    """Return why stances do not count whose foot a plate felt, a sentence each.

    Frames are numbered as the recording program shows them.
    """
    return tuple(
        f"{item.stance.side} stance from frame {trial.first_frame + item.stance.strike} is not "
        f"measured: {item.reason}"
        for item in trial.stances
        if not item.measured and item.plate is not None
    )


def _measured_sides(trial: Trial) -> list[Side]:
    """Return the side of each stance with a measured force."""
    return [item.stance.side for item in trial.stances if item.measured]


def _values(mean: np.ndarray, digits: int) -> list[str]:
    """Return forward, up and moment as text."""
    return [f"{x:.{digits}f}" for x in mean]
