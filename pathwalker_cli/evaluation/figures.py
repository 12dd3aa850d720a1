"""Figures of an evaluation: a gait over its recorded bands, each side in panels of its own."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pathwalker_cli.conventions import COORDINATES, SUFFIX, Side, to_degrees
from pathwalker_cli.evaluation.ankle import ankle_line, ankle_profile, recorded_ankle_profiles
from pathwalker_cli.evaluation.evaluate import Evaluation
from pathwalker_cli.inverse.bands import POINTS, resampled
from pathwalker_cli.output.cycle import BOTH_SIDES
from pathwalker_cli.output.figures.curves import CLINICAL_ANGLE, Band
from pathwalker_cli.output.figures.save import save_formats
from pathwalker_cli.output.figures.style import (
    LINE_COLOUR,
    LINE_STYLE,
    NEUTRAL,
    PAGE,
    SMALL,
    STYLE,
    dress,
    legend,
    new_figure,
    percent_axis,
    zero_line,
)

__all__ = ["ankle_figure", "ground_force_figure", "joint_angle_figure", "save_evaluation_figures"]

_PERCENT: Final = np.linspace(0.0, 100.0, POINTS)
_FINE: Final = np.linspace(0.0, 100.0, 501)
"""Positions in the gait cycle [%] of recorded and of computed curves, which are smooth."""

_ANGLES: Final = {
    "pelvis_tilt": ("pelvis", "forward tilt [deg]"),
    "hip": ("hip", "flexion [deg]"),
    "knee": ("knee", "flexion [deg]"),
    "ankle": ("ankle", "dorsiflexion [deg]"),
    "lumbar": ("trunk", "forward lean [deg]"),
}
_FORCES: Final = ("fore-aft force", "vertical force")


def joint_angle_figure(evaluation: Evaluation) -> Figure:
    """Return the joint angles of both sides over their gait cycles and the recorded range.

    Flexion, dorsiflexion and forward lean are positive, as gait laboratories plot them.  A dot
    marks the least knee flexion of stance.
    """
    gait = evaluation.gait
    fig = new_figure(PAGE, 3.8)
    panels = fig.subplots(2, len(_ANGLES), sharex=True, sharey="col")
    for row, side in enumerate(BOTH_SIDES):
        for ax, (joint, (name, label)) in zip(panels[row], _ANGLES.items(), strict=True):
            factor = CLINICAL_ANGLE.get(joint, 1.0) * float(to_degrees(1.0))
            coordinate = f"{joint}_{SUFFIX[side]}" if joint in CLINICAL_ANGLE else joint
            column = COORDINATES.index(coordinate)
            curve = factor * gait.over_cycle(gait.q, side, _FINE.size)[:, column]
            title = f"{side} {name}" if joint in CLINICAL_ANGLE else f"{name}, {side} cycle"
            dress(ax, title.capitalize(), y=label)
            if joint != "knee":  # it is never straight
                zero_line(ax)
            _band(ax, _recorded_angles(evaluation, side, column, factor))
            _line(ax, evaluation, side, curve)
            if joint == "knee":
                _least_knee(ax, evaluation, side)
            percent_axis(ax, label=row == 1)
            ax.set_xticks([0, 50, 100])
    _head(fig, evaluation, "least knee flexion")
    return fig


def ground_force_figure(evaluation: Evaluation) -> Figure:
    """Return the ground reaction forces of both sides over their gait cycles, % body weight.

    Raises:
        ValueError: If the forces of the gait are not known.
    """
    gait, recorded = evaluation.gait, evaluation.recorded
    if gait.force is None:
        raise ValueError(f"the forces of {gait.name} are not known")
    factor = 100.0 / gait.walker.weight
    fig = new_figure(PAGE, 3.8)
    panels = fig.subplots(2, 2, sharex=True, sharey="row")
    for row, axis in enumerate((1, 0)):
        for ax, side in zip(panels[row], BOTH_SIDES, strict=True):
            dress(
                ax,
                f"{side.capitalize()} {_FORCES[axis]}",
                y="[% body weight]" if side == "right" else "",
            )
            zero_line(ax)
            if recorded is not None and len(recorded.cycle_forces(side)):
                curves = factor * recorded.cycle_forces(side)[:, :, axis]
                _band(ax, Band.over(_PERCENT, curves))
            force = gait.over_cycle(gait.force[side], side, _FINE.size)[:, axis]
            _line(ax, evaluation, side, factor * force)
            percent_axis(ax, label=row == 1)
    _head(fig, evaluation)
    return fig


def ankle_figure(evaluation: Evaluation) -> Figure:
    """Return the net torque-angle profile of both ankles over stance with its mean slope.

    Dorsiflexion is positive, and so is the plantarflexing torque of muscles and orthosis.

    Raises:
        ValueError: If the torques of the gait are not known.
    """
    fig = new_figure(PAGE, 3.2)
    for ax, side in zip(fig.subplots(1, 2, sharex=True, sharey=True), BOTH_SIDES, strict=True):
        dress(ax, f"{side.capitalize()} ankle in stance", "dorsiflexion [deg]",
              "net plantarflexing torque [N m]" if side == "right" else "")  # fmt: skip
        zero_line(ax)
        _draw_profile(ax, evaluation, side)
    handles = [
        *_side_handles(evaluation),
        Line2D([], [], color=NEUTRAL, marker="o", markersize=4, linestyle="", label="foot strike"),
        Line2D([], [], color="black", linewidth=0.9, linestyle=":", label="its mean slope"),
    ]
    if evaluation.recorded is not None:
        handles.append(Line2D([], [], color="#999999", linewidth=0.5, label="recorded stances"))
        handles.append(Line2D([], [], color=NEUTRAL, linewidth=1.1, label="their mean"))
    legend(fig, handles)
    return fig


def save_evaluation_figures(evaluation: Evaluation, folder: str | Path) -> tuple[str, ...]:
    """Save the figures that a gait allows as PNG and SVG; return the file names.

    Args:
        evaluation: The gait beside the recordings.
        folder: Where; made if it does not exist.
    """
    makers = {"joint_angles": joint_angle_figure}
    if evaluation.gait.force is not None:
        makers["ground_forces"] = ground_force_figure
    if evaluation.gait.net_torque is not None:
        makers["ankle_torque"] = ankle_figure
    saved: list[str] = []
    for name, make in makers.items():
        with mpl.rc_context(STYLE):
            figure = make(evaluation)
        saved += save_formats(figure, folder, name)
    return tuple(saved)


def _recorded_angles(evaluation: Evaluation, side: Side, column: int, factor: float) -> Band | None:
    """Return the band of one coordinate over the recorded cycles of a side, or None."""
    if evaluation.recorded is None:
        return None
    curves = [
        resampled(trial.motion.values[cycle.start : cycle.end + 1, [column]])[:, 0]
        for trial, cycle in evaluation.recorded.cycles(side)
    ]
    return Band.over(_PERCENT, factor * np.array(curves)) if curves else None


def _band(ax: Axes, band: Band | None) -> None:
    """Draw recorded range and mean in grey."""
    if band is not None:
        ax.fill_between(band.percent, band.low, band.high, color="#cccccc", linewidth=0)
        ax.plot(band.percent, band.mean, color=NEUTRAL, linewidth=0.7)


def _line(ax: Axes, evaluation: Evaluation, side: Side, curve: np.ndarray) -> None:
    """Draw a curve over the gait cycle and mark the toe-off."""
    gait, colour = evaluation.gait, LINE_COLOUR[side]
    off = 100.0 * (gait.toe_off(side) - gait.strike(side)) / gait.duration
    ax.plot(_FINE, curve, color=colour, linestyle=LINE_STYLE[side])
    ax.axvline(off, linewidth=0.6, color=colour, linestyle=LINE_STYLE[side])


def _least_knee(ax: Axes, evaluation: Evaluation, side: Side) -> None:
    """Mark the least knee flexion of stance."""
    gait = evaluation.gait
    rows, knee = gait.stance_rows(side), gait.column(f"knee_{SUFFIX[side]}")
    row = rows[np.argmin(knee[rows])]
    percent = 100.0 * ((gait.time[row] - gait.strike(side)) % gait.duration) / gait.duration
    ax.plot(percent, to_degrees(knee[row]), "o", color=LINE_COLOUR[side], markersize=4.0)


def _draw_profile(ax: Axes, evaluation: Evaluation, side: Side) -> None:
    """Draw recorded profiles, the gait's own and the line of its mean slope."""
    profile = ankle_profile(evaluation.gait, side, _FINE.size)
    if profile is None:
        raise ValueError(f"the torques of {evaluation.gait.name} are not known")
    text = ""
    if evaluation.recorded is not None:
        found = recorded_ankle_profiles(evaluation.recorded, side)
        for each in found:
            ax.plot(to_degrees(each[:, 0]), each[:, 1], color="#999999", linewidth=0.5)
        slopes = [ankle_line(each)[0] for each in found]
        if slopes:
            mean = found.mean(axis=0)
            ax.plot(to_degrees(mean[:, 0]), mean[:, 1], color=NEUTRAL, linewidth=1.1)
            text = f"\nrecorded {np.mean(slopes):.0f} ({min(slopes):.0f} to {max(slopes):.0f})"
    look: dict[str, Any] = {"color": LINE_COLOUR[side], "linestyle": LINE_STYLE[side]}
    ax.plot(to_degrees(profile[:, 0]), profile[:, 1], **look)
    ax.plot(*(to_degrees(profile[0, 0]), profile[0, 1]), "o", color=LINE_COLOUR[side], markersize=4)
    slope, offset = ankle_line(profile)
    ends = np.array([profile[:, 0].min(), profile[:, 0].max()])
    ax.plot(to_degrees(ends), offset + slope * ends, color="black", linewidth=0.9, linestyle=":")
    ax.text(0.03, 0.97, f"mean slope {slope:.0f} N m/rad{text}", transform=ax.transAxes, va="top",
            fontsize=SMALL)  # fmt: skip


def _head(fig: Figure, evaluation: Evaluation, dot: str = "") -> None:
    """Put the legend above all panels."""
    handles: list[Any] = _side_handles(evaluation)
    if dot:
        handles.append(
            Line2D([], [], color=NEUTRAL, marker="o", markersize=4, linestyle="", label=dot)
        )
    handles.append(Line2D([], [], color=NEUTRAL, linewidth=0.6, label="upright: toe-off"))
    if evaluation.recorded is not None:
        handles.append(Patch(facecolor="#cccccc", label="recorded: range, mean"))
    legend(fig, handles)


def _side_handles(evaluation: Evaluation) -> list[Line2D]:
    """Return the legend entries of both sides of the gait."""
    names = {"right": f"{evaluation.gait.problem}: right", "left": "left"}
    return [
        Line2D([], [], color=LINE_COLOUR[side], linestyle=LINE_STYLE[side], label=names[side])
        for side in BOTH_SIDES
    ]
