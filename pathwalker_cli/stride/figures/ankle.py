"""Figures over the ankle angle: the orthosis curve and the net ankle torque."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Side, to_degrees
from pathwalker_cli.errors import InputError
from pathwalker_cli.model.elements.orthosis import OrthosisSide, orthosis_torque
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import Reference
from pathwalker_cli.stride.measures import ankle_torque_line
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import stride_of, toe_bearing

_ANGLE = "dorsiflexion [deg]"
_TORQUE = "plantarflexing torque [N m]"


def orthosis_curves(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return the torque-angle curve of each orthosis with the part of it that was walked.

    Dorsiflexion is positive, and so is the torque with which the orthosis resists it.

    Raises:
        InputError: If the walker wears no orthoses.
    """
    worn = series.walker.orthosis
    if not worn:
        raise InputError("a barefoot walker has no orthosis curve", allowed="condition orthosis")
    fig = style.new_figure(2.4)
    panels = fig.subplots(1, len(worn), sharex=True, sharey=True, squeeze=False)[0]
    for ax, (side, orthosis) in zip(panels, worn.items(), strict=True):
        _draw_orthosis(ax, series, side, orthosis)
        style.dress(ax, _title(series, side), _ANGLE, _TORQUE if ax is panels[0] else "")
    curve, stop = style.entry("curve", linewidth=0.8), {"linewidth": 0.8, "linestyle": "-."}
    walked = style.entry("part that was walked", linewidth=3.0, alpha=0.5)
    style.legend(fig, [curve, walked, style.entry("stop", **stop)])
    return fig


def _draw_orthosis(ax: Axes, series: GaitSeries, side: Side, orthosis: OrthosisSide) -> None:
    """Draw curve, walked part, stops and stiffness of one orthosis."""
    i, colour = SIDES.index(side), style.LINE_COLOUR[side]
    k_d, k_p = float(series.stiffness[i]), float(series.stiffness[i + 2])
    angle = series.column(*series.walker.device.elements[side].coordinates)
    stops = (orthosis.dorsiflexion_stop, orthosis.plantarflexion_stop)
    low, high = min(*stops, angle.min()) - 0.03, max(*stops, angle.max()) + 0.03
    style.zero_line(ax)
    for ends, look in (
        ((low, high), {"linewidth": 0.8, "linestyle": style.LINE_STYLE[side]}),
        ((angle.min(), angle.max()), {"linewidth": 3.5, "alpha": 0.4}),
    ):
        span = np.linspace(*ends, 300)
        torque = np.asarray(orthosis_torque(orthosis, span, k_d, k_p)).ravel()
        ax.plot(-to_degrees(span), torque, color=colour, **look)
    for stop in stops:
        ax.axvline(-float(to_degrees(stop)), color=style.NEUTRAL, linewidth=0.8, linestyle="-.")


def _title(series: GaitSeries, side: Side) -> str:
    """Return the side with its stiffnesses in both units."""
    i = SIDES.index(side)
    k_d, k_p = (float(series.stiffness[row]) for row in (i, i + 2))
    return (
        f"{side.capitalize()} orthosis\nK_D {k_d:.1f}, K_P {k_p:.1f} N m/rad\n"
        f"({np.deg2rad(k_d):.2f}, {np.deg2rad(k_p):.2f} N m/deg)"
    )


def ankle_torque(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return the net ankle torque over the ankle angle of each side, with its slope under load.

    Dorsiflexion is positive, and so is the plantarflexing torque of muscles and orthosis.  The
    slope is that of `stride.measures.ankle_torque_line`, over the thick part of the path.
    """
    fig = style.new_figure(2.4)
    panels = fig.subplots(1, 2, sharex=True, sharey=True)
    for i, (ax, side) in enumerate(zip(panels, SIDES, strict=True)):
        _draw_profile(ax, series, side)
        style.dress(ax, f"{side.capitalize()} ankle", _ANGLE, _TORQUE if i == 0 else "")
    bearing = style.entry("foot flat or on its toe", linewidth=1.6)
    other = style.entry("swing and heel contact", linewidth=0.6)
    slope = style.entry("slope of the thick part", color="black", linewidth=0.8, linestyle=":")
    style.legend(fig, [bearing, other, slope])
    return fig


def _draw_profile(ax: Axes, series: GaitSeries, side: Side) -> None:
    """Draw the torque-angle path of one ankle and its slope under load."""
    name = f"ankle_{SUFFIX[side]}"
    angle = -series.column(name)
    torque = series.joint_torque[:, COORDINATES.index(name)]
    stride = stride_of(series)
    bearing = toe_bearing(stride, side)
    look = style.side_line(side)
    slope, offset = ankle_torque_line(stride, side)
    style.zero_line(ax)
    ax.plot(to_degrees(angle), torque, linewidth=0.6, **look)
    thick = np.where(bearing, torque, np.nan)
    ax.plot(to_degrees(angle), thick, linewidth=1.6, **look)
    ends = np.array([angle[bearing].min(), angle[bearing].max()])
    ax.plot(to_degrees(ends), offset + slope * ends, color="black", linewidth=0.8, linestyle=":")
    text = f"{slope:.0f} N m/rad\n({np.deg2rad(slope):.2f} N m/deg)"
    ax.text(0.03, 0.97, text, transform=ax.transAxes, va="top")
