"""Figures of recorded gait: mean and range over the gait cycles of all trials of a condition."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.font_manager import FontProperties
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pathwalker_cli.conventions import GRAVITY, SIDES, SUFFIX, Side, to_degrees
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.bands import POINTS, CycleBand, cycle_band
from pathwalker_cli.inverse.cycles import GaitCycle
from pathwalker_cli.inverse.evaluate import StudyTrial
from pathwalker_cli.io.atomic import atomic_path
from pathwalker_cli.stride.figures.curves import CLINICAL_ANGLE, EXTENSION
from pathwalker_cli.stride.figures.style import (
    LINE_COLOUR,
    LINE_STYLE,
    NEUTRAL,
    STYLE,
    TEXT,
    dress,
    legend,
    legend_panel,
    new_figure,
    percent_axis,
    zero_line,
)
from pathwalker_cli.trajectory import Trajectory

__all__ = [
    "ground_force_figure",
    "joint_angle_figure",
    "joint_torque_figure",
    "marker_figure",
    "name_figure",
    "save_recorded_figures",
]

DPI: Final = 200

_ANGLES: Final = {
    "pelvis_tilt": ("Pelvis", "forward tilt [deg]"),
    "hip": ("Hip", "flexion [deg]"),
    "knee": ("Knee", "flexion [deg]"),
    "ankle": ("Ankle", "dorsiflexion [deg]"),
    "lumbar": ("Trunk against pelvis", "forward lean [deg]"),
}
_TORQUES: Final = {
    "hip": "Hip, extension +",
    "knee": "Knee, extension +",
    "ankle": "Ankle, plantarflexion +",
}
_FORCES: Final = {
    "z": ("Vertical, up +", "vertical force [% body weight]"),
    "x": ("Fore-aft, forward +", "fore-aft force [% body weight]"),
}


@dataclass(frozen=True)
class _Bands:
    """Bands of both sides and when their feet leave the ground [%]."""

    sides: Mapping[Side, CycleBand]
    toe_off: Mapping[Side, float]


def joint_angle_figure(trials: Sequence[StudyTrial]) -> Figure:
    """Return pelvis, hip, knee, ankle and lumbar angles over the gait cycle of each side.

    Flexion, dorsiflexion and forward lean are positive, as gait laboratories plot them.

    Args:
        trials: Trials of one condition.
    """
    bands = _bands(trials, lambda trial: trial.motion)
    fig = new_figure(3.9)
    panels = fig.subplots(3, 2).ravel()
    for ax, (joint, (title, label)) in zip(panels, _ANGLES.items(), strict=False):
        factor = CLINICAL_ANGLE.get(joint, 1.0) * float(to_degrees(1.0))
        pattern = f"{joint}_{{}}" if joint in CLINICAL_ANGLE else joint
        _panel(ax, bands, pattern, factor, title, label)
    legend_panel(panels[-1], _handles(bands, "hip_{}"))
    return fig


def joint_torque_figure(trials: Sequence[StudyTrial], body_mass: float) -> Figure:
    """Return net joint torques per body mass over the gait cycle of each side.

    Internal torques; extension and plantarflexion are positive.  Only strides whose stance has a
    measured force count.

    Args:
        trials: Trials of one condition.
        body_mass: Mass of the patient [kg].
    """
    bands = _bands(trials, lambda trial: trial.tau, measured=True)
    fig = new_figure(2.9)
    panels = fig.subplots(2, 2).ravel()
    for ax, (joint, title) in zip(panels, _TORQUES.items(), strict=False):
        factor = EXTENSION[joint] / body_mass
        _panel(ax, bands, f"{joint}_{{}}", factor, title, "net torque [N m/kg]")
    legend_panel(panels[-1], _handles(bands, "hip_{}", measured=True))
    return fig


def ground_force_figure(trials: Sequence[StudyTrial], body_mass: float) -> Figure:
    """Return vertical and fore-aft ground reaction forces over the gait cycle of each side.

    Args:
        trials: Trials of one condition.
        body_mass: Mass of the patient [kg].
    """
    bands = _bands(trials, lambda trial: trial.forces, measured=True)
    fig = new_figure(2.2)
    for ax, (axis, (title, label)) in zip(fig.subplots(1, 2), _FORCES.items(), strict=True):
        _panel(ax, bands, f"force_{{}}_{axis}", 100.0 / (body_mass * GRAVITY), title, label)
    legend(fig, _handles(bands, "force_{}_z", measured=True))
    return fig


def marker_figure(trials: Sequence[StudyTrial]) -> Figure:
    """Return the distance between every marker and the walker, mean and range over trials.

    Args:
        trials: Trials of one condition from C3D files.
    """
    found = [trial.markers.rms() for trial in trials if trial.markers is not None]
    names = list(found[0])
    values = 1e3 * np.array([[rms[name] for name in names] for rms in found])
    known: np.ndarray = np.any(np.isfinite(values), axis=0)
    names = [names[i] for i in np.flatnonzero(known)]
    values = values[:, known]
    mean = np.nanmean(values, axis=0)
    fig = new_figure(0.9 + 0.17 * len(names))
    ax = fig.subplots()
    dress(ax, x="distance from the walker,\nroot mean square [mm]")
    ax.grid(visible=False, axis="y")
    rows = np.arange(len(names))
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    ax.hlines(rows, low, high, color="#9ecae1", linewidth=5.0)
    ax.plot(mean, rows, "o", color=LINE_COLOUR["right"], markersize=4.0)
    ax.set_yticks(rows, [_plain(name) for name in names])
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(left=0.0)
    handles: list[Artist] = [
        Line2D([], [], color=LINE_COLOUR["right"], marker="o", linestyle="", label="mean"),
        Patch(facecolor="#9ecae1", label=f"range over {_counted(len(found), 'trial')}"),
    ]
    legend(fig, handles)
    return fig


def save_recorded_figures(
    trials: Sequence[StudyTrial],
    folder: str | Path,
    body_mass: float,
    formats: Sequence[str] = ("png", "svg"),
) -> tuple[str, ...]:
    """Save the figures that the trials of one condition allow; return the file names.

    Args:
        trials: Trials of one condition.
        folder: Where; it must exist.
        body_mass: Mass of the patient [kg].
        formats: "png", "svg" or both.
    """
    makers: dict[str, Callable[[], Figure]] = {}
    if any(trial.cycles for trial in trials):
        makers["joint_angles"] = lambda: joint_angle_figure(trials)
    if any(_measured(trial, cycle) for trial in trials if trial.tau for cycle in trial.cycles):
        makers["joint_torques"] = lambda: joint_torque_figure(trials, body_mass)
        makers["ground_forces"] = lambda: ground_force_figure(trials, body_mass)
    if any(trial.markers is not None for trial in trials):
        makers["marker_residuals"] = lambda: marker_figure(trials)
    names = []
    with mpl.rc_context(STYLE):
        for name, maker in makers.items():
            figure = maker()
            name_figure(figure, f"{trials[0].condition}, {_counted(len(trials), 'trial')}")
            for extension in formats:
                names.append(f"{name}.{extension}")
                metadata = {"Software": None} if extension == "png" else {"Date": None}
                with atomic_path(Path(folder) / names[-1]) as temporary:
                    figure.savefig(temporary, format=extension, dpi=DPI, metadata=metadata)
    return tuple(names)


def name_figure(figure: Figure, words: str) -> None:
    """Put words above its legend, so that a figure tells what it shows wherever it goes."""
    inside = [box for ax in figure.axes if (box := ax.get_legend())]
    for box in [*figure.legends, *inside]:
        box.set_title(words, prop=FontProperties(size=TEXT, weight="bold"))
        box.set_alignment("left")


def _bands(
    trials: Sequence[StudyTrial],
    columns: Callable[[StudyTrial], Trajectory | None],
    measured: bool = False,
) -> _Bands:
    """Return the bands of the sides of which the trials show a complete gait cycle.

    Args:
        trials: The trials.
        columns: What to draw of a trial.
        measured: Whether only cycles count whose stance has a measured force.
    """
    curves = []
    for trial in trials:
        table = columns(trial)
        if table is not None:
            cycles = tuple(c for c in trial.cycles if not measured or _measured(trial, c))
            curves.append((table, cycles))
    sides: dict[Side, CycleBand] = {}
    toe_off: dict[Side, float] = {}
    for side in SIDES:
        own = [cycle for _, cycles in curves for cycle in cycles if cycle.side == side]
        if own:
            sides[side] = cycle_band(curves, side)
            share = [(cycle.toe_off - cycle.start) / (cycle.end - cycle.start) for cycle in own]
            toe_off[side] = 100.0 * float(np.mean(share))
    if not sides:
        raise DataError("the trials show no complete gait cycle")
    return _Bands(sides, toe_off)


def _measured(trial: StudyTrial, cycle: GaitCycle) -> bool:
    """Return whether the force of the stance that begins a cycle is known."""
    if trial.published is not None:
        return True
    return any(
        item.measured and (item.stance.side, item.stance.strike) == (cycle.side, cycle.start)
        for item in trial.stances
    )


def _panel(ax: Axes, bands: _Bands, pattern: str, factor: float, title: str, label: str) -> None:
    """Draw mean and range of one quantity of both sides.

    Args:
        ax: The panel.
        bands: The bands.
        pattern: Column with "{}" for the side's suffix.
        factor: From the column's unit and sign to the panel's.
        title: Title of the panel.
        label: Label of its y axis, with unit.
    """
    dress(ax, title, y=label)
    zero_line(ax)
    percent = np.linspace(0.0, 100.0, POINTS)
    for side, band in bands.sides.items():
        column = band.names.index(pattern.format(SUFFIX[side]))
        count = band.count[:, column]
        curves = (band.lowest, band.highest, band.mean)
        # Where some cycles have no value, as at the strike of a stance that is not measured, the
        # mean would jump to that of the others.
        low, high, mean = (
            np.where(count == count.max(), factor * curve[:, column], np.nan) for curve in curves
        )
        colour, style = LINE_COLOUR[side], LINE_STYLE[side]
        ax.fill_between(percent, low, high, color=colour, alpha=0.18, linewidth=0)
        for edge in (low, high):  # so that the ranges of both sides differ without colour too
            ax.plot(percent, edge, color=colour, linestyle=style, linewidth=0.5, alpha=0.7)
        ax.plot(percent, mean, color=colour, linestyle=style)
        ax.axvline(bands.toe_off[side], linewidth=0.6, color=colour, linestyle=style)
    percent_axis(ax)


def _handles(bands: _Bands, pattern: str, measured: bool = False) -> list[Artist]:
    """Return the legend: sides with their number of strides, the range, the toe-offs."""
    handles: list[Artist] = []
    for side, band in bands.sides.items():
        count = band.count[:, band.names.index(pattern.format(SUFFIX[side]))]
        thing = "measured stride" if measured else "stride"
        label = f"{side}, mean of\n{_counted(int(count.max()), thing)}"
        style = LINE_STYLE[side]
        handles.append(Line2D([], [], color=LINE_COLOUR[side], linestyle=style, label=label))
    handles.append(Patch(facecolor="#bbbbbb", alpha=0.6, label="range"))
    handles.append(Line2D([], [], color=NEUTRAL, linewidth=0.6, label="mean toe-off"))
    return handles


def _plain(point: str) -> str:
    """Return "RKNE on right thigh" for "RKNE on thigh_r"."""
    marker, _, link = point.partition(" on ")
    name, _, suffix = link.partition("_")
    side = {"r": "right ", "l": "left "}.get(suffix, "")
    return f"{marker} on {side}{name}"


def _counted(count: int, thing: str) -> str:
    """Return "3 strides"."""
    return f"{count} {thing}{'' if count == 1 else 's'}"
