"""Figures of recorded gait: mean and range over the gait cycles of all trials of a condition."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
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

from pathwalker_cli.conventions import GRAVITY, SIDES, SUFFIX, Condition, Side, to_degrees
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.inverse.cycles import POINTS, CycleBand, cycle_band, gait_cycles
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.model.skeleton import PLANAR_WALKER
from pathwalker_cli.patient import Patient
from pathwalker_cli.stride.figures.curves import CLINICAL_ANGLE, EXTENSION, Band, Reference
from pathwalker_cli.stride.figures.save import save_formats
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

_RANGE: Final = "#9ecae1"
"""Light blue of a range that belongs to no side."""

_PERCENT: Final = np.linspace(0.0, 100.0, POINTS)

Panels = Mapping[str, tuple[str, str, float]]
"""By column, with "{}" for the suffix of a side: title, label of the y axis with unit, and factor
from the column's unit and sign to the panel's."""

_DEGREES: Final = float(to_degrees(1.0))
_ANGLES: Final[Panels] = {
    "pelvis_tilt": ("Pelvis", "forward tilt [deg]", _DEGREES),
    "hip_{}": ("Hip", "flexion [deg]", CLINICAL_ANGLE["hip"] * _DEGREES),
    "knee_{}": ("Knee", "flexion [deg]", CLINICAL_ANGLE["knee"] * _DEGREES),
    "ankle_{}": ("Ankle", "dorsiflexion [deg]", CLINICAL_ANGLE["ankle"] * _DEGREES),
    "lumbar": ("Trunk against pelvis", "forward lean [deg]", _DEGREES),
}
_TORQUES: Final[Panels] = {
    "hip_{}": ("Hip, extension +", "net torque [N m/kg]", EXTENSION["hip"]),
    "knee_{}": ("Knee, extension +", "net torque [N m/kg]", EXTENSION["knee"]),
    "ankle_{}": ("Ankle, plantarflexion +", "net torque [N m/kg]", EXTENSION["ankle"]),
}
_FORCES: Final[Panels] = {
    "force_{}_z": ("Vertical, up +", "vertical force [% body weight]", 100.0 / GRAVITY),
    "force_{}_x": ("Fore-aft, forward +", "fore-aft force [% body weight]", 100.0 / GRAVITY),
}


Bands = Mapping[Side, CycleBand]
"""Bands of the sides that show a gait cycle."""


def joint_angle_figure(trials: Sequence[Trial]) -> Figure:
    """Return pelvis, hip, knee, ankle and lumbar angles over the gait cycle of each side.

    Flexion, dorsiflexion and forward lean are positive, as gait laboratories plot them.
    """
    return _joint_figure(_bands(trials, lambda trial: trial.motion), _ANGLES, 3.9, "stride")


def joint_torque_figure(trials: Sequence[Trial], body_mass: float) -> Figure:
    """Return net joint torques per body mass over the gait cycle of each side.

    Internal torques; extension and plantarflexion are positive.  Only strides whose stance has a
    measured force count.
    """
    bands = _bands(trials, lambda trial: trial.tau, measured=True)
    return _joint_figure(bands, _TORQUES, 2.9, "measured stride", body_mass)


def ground_force_figure(trials: Sequence[Trial], body_mass: float) -> Figure:
    """Return vertical and fore-aft ground reaction forces over the gait cycle of each side."""
    bands = _bands(trials, lambda trial: trial.forces, measured=True)
    fig = new_figure(2.2)
    _draw(fig.subplots(1, 2), bands, _FORCES, body_mass)
    legend(fig, _handles(bands, "force_{}_z", "measured stride"))
    return fig


def marker_figure(trials: Sequence[Trial]) -> Figure:
    """Return the distance between every marker and the walker, mean and range over C3D trials."""
    each = [trial.markers.rms() for trial in trials if trial.markers is not None]
    rms = {name: 1e3 * np.array([trial[name] for trial in each]) for name in each[0]}
    rms = {name: values for name, values in rms.items() if np.isfinite(values).any()}
    names, values = list(rms), np.column_stack(list(rms.values()))
    mean = np.nanmean(values, axis=0)
    fig = new_figure(0.9 + 0.17 * len(names))
    ax = fig.subplots()
    dress(ax, x="distance from the walker,\nroot mean square [mm]")
    ax.grid(visible=False, axis="y")
    rows = np.arange(len(names))
    low, high = np.nanmin(values, axis=0), np.nanmax(values, axis=0)
    ax.hlines(rows, low, high, color=_RANGE, linewidth=5.0)
    ax.plot(mean, rows, "o", color=LINE_COLOUR["right"], markersize=4.0)
    ax.set_yticks(rows, [_plain(name) for name in names])
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlim(left=0.0)
    handles: list[Artist] = [
        Line2D([], [], color=LINE_COLOUR["right"], marker="o", linestyle="", label="mean"),
        Patch(facecolor=_RANGE, label=f"range over {_counted(len(each), 'trial')}"),
    ]
    legend(fig, handles)
    return fig


def save_recorded_figures(
    trials: Sequence[Trial],
    folder: str | Path,
    body_mass: float,
    formats: Sequence[str] = ("png", "svg"),
) -> tuple[str, ...]:
    """Save the figures that the trials of one condition allow; return the file names.

    Torques and forces are shown over `body_mass` [kg].
    """
    makers: dict[str, Callable[[], Figure]] = {}
    if any(trial.cycles for trial in trials):
        makers["joint_angles"] = lambda: joint_angle_figure(trials)
    if any(trial.measured(cycle) for trial in trials if trial.tau for cycle in trial.cycles):
        makers["joint_torques"] = lambda: joint_torque_figure(trials, body_mass)
        makers["ground_forces"] = lambda: ground_force_figure(trials, body_mass)
    if any(trial.markers is not None for trial in trials):
        makers["marker_residuals"] = lambda: marker_figure(trials)
    names: list[str] = []
    for name, make in makers.items():
        with mpl.rc_context(STYLE):
            figure = make()
            name_figure(figure, f"{trials[0].condition}, {_counted(len(trials), 'trial')}")
        names += save_formats(figure, folder, name, formats)
    return tuple(names)


def recorded_reference(patient: Patient, condition: Condition) -> Reference | None:
    """Return recorded joint angles as bands to draw behind those of a prediction.

    None without usable recordings beside the patient's file: a prediction does not need them.
    """
    try:
        names = recording_names(patient, condition)
        recordings = [read_recording(patient, condition, name) for name in names]
        trials = [(each.motion, gait_cycles(each.events)) for each in recordings]
        bands = {side: cycle_band(trials, side) for side in SIDES}
    except InputError:
        return None
    angles = {}
    for side, band in bands.items():
        for joint in PLANAR_WALKER.joints:
            if not joint.slides and joint.side in (None, side):
                name = joint.coordinate
                key = name if joint.side else f"{name}_{SUFFIX[side]}"
                i = band.names.index(name)
                curves = (band.lowest[:, i], band.mean[:, i], band.highest[:, i])
                angles[key] = Band(_PERCENT, *curves)
    return Reference(angles=angles)


def name_figure(figure: Figure, words: str) -> None:
    """Put words above its legend, so that a figure tells what it shows wherever it goes."""
    inside = [box for ax in figure.axes if (box := ax.get_legend())]
    for box in [*figure.legends, *inside]:
        box.set_title(words, prop=FontProperties(size=TEXT, weight="bold"))
        box.set_alignment("left")


def _bands(
    trials: Sequence[Trial], columns: Callable[[Trial], Trajectory | None], measured: bool = False
) -> Bands:
    """Return the bands of the sides of which the trials show a complete gait cycle.

    If `measured`, only cycles count whose stance has a measured force.
    """
    curves = []
    for trial in trials:
        table = columns(trial)
        if table is not None:
            cycles = tuple(c for c in trial.cycles if not measured or trial.measured(c))
            curves.append((table, cycles))
    seen = {cycle.side for _, cycles in curves for cycle in cycles}
    if not seen:
        raise DataError("the trials show no complete gait cycle")
    return {side: cycle_band(curves, side) for side in SIDES if side in seen}


def _joint_figure(
    bands: Bands, panels: Panels, height: float, thing: str, per: float = 1.0
) -> Figure:
    """Return panels in two columns, so high [in], with the legend in the last place."""
    fig = new_figure(height)
    axes = fig.subplots(len(panels) // 2 + 1, 2).ravel()
    _draw(axes, bands, panels, per)
    legend_panel(axes[-1], _handles(bands, "hip_{}", thing))
    return fig


def _draw(axes: Iterable[Axes], bands: Bands, panels: Panels, per: float = 1.0) -> None:
    """Draw mean and range of some quantities of both sides, divided by `per`, a panel each."""
    for ax, (pattern, (title, label, factor)) in zip(axes, panels.items(), strict=False):
        dress(ax, title, y=label)
        zero_line(ax)
        for side, band in bands.items():
            _draw_side(ax, side, band, pattern, factor / per)
        percent_axis(ax)


def _draw_side(ax: Axes, side: Side, band: CycleBand, pattern: str, factor: float) -> None:
    """Draw mean and range of one quantity of one side, and when its foot leaves the ground."""
    column = band.names.index(pattern.format(SUFFIX[side]))
    count = band.count[:, column]
    # Where some cycles have no value, as at the strike of a stance that is not measured, the
    # mean would jump to that of the others.
    low, high, mean = (
        np.where(count == count.max(), factor * curve[:, column], np.nan)
        for curve in (band.lowest, band.highest, band.mean)
    )
    colour, style = LINE_COLOUR[side], LINE_STYLE[side]
    ax.fill_between(_PERCENT, low, high, color=colour, alpha=0.18, linewidth=0)
    for edge in (low, high):  # so that the ranges of both sides differ without colour too
        ax.plot(_PERCENT, edge, color=colour, linestyle=style, linewidth=0.5, alpha=0.7)
    ax.plot(_PERCENT, mean, color=colour, linestyle=style)
    ax.axvline(band.toe_off, linewidth=0.6, color=colour, linestyle=style)


def _handles(bands: Bands, pattern: str, thing: str) -> list[Artist]:
    """Return the legend: sides with their number of strides, the range, the toe-offs."""
    handles: list[Artist] = []
    for side, band in bands.items():
        count = band.count[:, band.names.index(pattern.format(SUFFIX[side]))]
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
