"""Figure of the walker as stick figures over the stride."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from pathwalker_cli.conventions import SIDES, SUFFIX, Side
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import Reference
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import body_points, centre_of_pressure, loaded, stride_of

_ROWS: Final = ((0, 10, 20, 30, 40), (50, 60, 70, 80, 90))
"""Positions in the right gait cycle [%] of the figures in each row."""
_SPACING: Final = 1.05
"""Distance from figure to figure, as a share of the pelvis height."""
_LEG_LOOK: Final[dict[Side, dict[str, Any]]] = {
    "right": {"color": style.BODY_COLOUR["right"], "linestyle": "-", "linewidth": 1.3, "zorder": 3},
    "left": {"color": style.BODY_COLOUR["left"], "linestyle": "--", "linewidth": 1.1, "zorder": 2},
}


def stick_figures(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return ten stick figures over the right gait cycle with their ground reaction forces."""
    fig = style.new_figure(3.5)
    for ax, row in zip(fig.subplots(2, 1), _ROWS, strict=True):
        _draw_row(ax, series, row)
    force = f"ground force; 1 body weight is as\nlong as {style.FORCE_LENGTH:g} pelvis heights"
    legs = (style.entry(f"{side} leg", **_LEG_LOOK[side]) for side in SIDES)
    style.legend(fig, [*legs, style.entry(force, color=style.FORCE_COLOUR, linewidth=1.4)])
    return fig


def _draw_row(ax: Axes, series: GaitSeries, row: tuple[int, ...]) -> None:
    """Draw the figures of one row side by side."""
    height = float(series.column("pelvis_tz").mean())
    slots = height * _SPACING * np.arange(len(row))
    for slot, percent in zip(slots, row, strict=True):
        _draw_instant(ax, series, percent, slot, height)
    margin = height * _SPACING / 2
    ax.axhline(0.0, color=style.NEUTRAL, linewidth=0.8, zorder=1)
    style.dress(ax, x="right gait cycle [%], figures moved apart", y="height [m]")
    ax.set_xlim(slots[0] - margin, slots[-1] + margin)
    ax.set_ylim(-0.06 * height, 2.0 * height)
    ax.set_xticks(slots, [f"{percent}" for percent in row])
    ax.grid(visible=False)
    ax.set_aspect("equal")


def _draw_instant(ax: Axes, series: GaitSeries, percent: float, slot: float, height: float) -> None:
    """Draw the walker at one position of the right gait cycle with its pelvis above `slot`."""
    start = stride_of(series).strike("right")
    time = (start + percent / 100.0 * series.duration) % series.duration
    q = np.array([np.interp(time, series.time, column) for column in series.q.T])
    shift = np.array([slot - q[0], 0.0])
    _draw_body(ax, {n: p + shift for n, p in body_points(series.walker, q).items()})
    row = int(np.argmin(np.abs(series.time - time)))
    scale = style.FORCE_LENGTH * height / series.walker.weight
    for side in SIDES:
        if loaded(series, side)[row]:
            x = centre_of_pressure(series, side)[row] - series.q[row, 0] + slot
            force = (series.forward_force(side)[row], series.vertical_force(side)[row])
            ax.quiver([x], [0.0], [scale * force[0]], [scale * force[1]], color=style.FORCE_COLOUR,
                      angles="xy", scale_units="xy", scale=1.0, width=0.006, zorder=5)  # fmt: skip


def _draw_body(ax: Axes, points: dict[str, np.ndarray]) -> None:
    """Draw legs, feet, pelvis, trunk and head."""
    for side in SIDES:
        s, look = SUFFIX[side], _LEG_LOOK[side]
        _draw_chain(ax, points, ("lumbar", f"hip_{s}", f"knee_{s}", f"ankle_{s}"), look)
        foot = (f"ankle_{s}", f"heel_{s}", f"toe_{s}", f"ankle_{s}")
        _draw_chain(ax, points, foot, look | {"linewidth": 0.8})
    trunk = {"color": style.BODY_COLOUR["right"], "linewidth": 1.6, "zorder": 4}
    _draw_chain(ax, points, ("lumbar", "neck"), trunk)
    radius = float(np.linalg.norm(points["head"] - points["neck"]))
    outline = {"fill": False, "color": style.BODY_COLOUR["right"], "linewidth": 0.9}
    ax.add_patch(Circle(tuple(points["head"]), radius, **outline))


def _draw_chain(
    ax: Axes, points: dict[str, np.ndarray], names: tuple[str, ...], look: dict[str, Any]
) -> None:
    """Draw a line from point to point."""
    x, z = np.array([points[name] for name in names]).T
    ax.plot(x, z, **look)
