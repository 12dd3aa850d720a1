"""Figures of the walker as stick figures over the stride."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle

from pathwalker_cli.conventions import SIDES, SUFFIX, Side
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import Reference
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import (
    Stride,
    body_points,
    centre_of_pressure,
    loaded,
    stride_of,
)

_ROWS: Final = ((0, 10, 20, 30, 40), (50, 60, 70, 80, 90))
"""Positions in the right gait cycle [%] of the figures in each row."""
_SPACING: Final = 1.05
"""Distance from figure to figure, as a share of the pelvis height."""
_LEG_LOOK: Final[dict[Side, dict[str, Any]]] = {
    "right": style.side_line("right") | {"linewidth": 1.3, "zorder": 3},
    "left": style.side_line("left") | {"linewidth": 1.1, "zorder": 2},
}
_BRACE: Final = {"color": "#b8b8b8", "linewidth": 4.0, "zorder": 1}
"""Look of an orthosis, behind shank and foot."""


def stick_figures(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return ten stick figures over the right gait cycle with their ground reaction forces."""
    fig, stride = style.new_figure(3.5), stride_of(series)
    for ax, row in zip(fig.subplots(2, 1), _ROWS, strict=True):
        slots = _draw_row(ax, stride, row)
        for slot, percent in zip(slots, row, strict=True):
            _draw_forces(ax, series, _instant(stride, percent), slot)
        style.dress(ax, x="right gait cycle [%], figures moved apart", y="height [m]")
        ax.grid(visible=False)
    force = f"ground force; 1 body weight is as\nlong as {style.FORCE_LENGTH:g} pelvis heights"
    force_look = {"color": style.FORCE_COLOUR, "linewidth": 1.4}
    style.legend(fig, [*_leg_entries(), style.entry(force, **force_look), *_brace_entry(stride)])
    return fig


def walks_figure(walks: Sequence[tuple[str, Stride]]) -> Figure:
    """Return a row of stick figures over the right gait cycle for every walk, as wide as a page.

    Args:
        walks: What to call each, and the walk.
    """
    fig = style.new_figure(0.72 + 1.39 * len(walks), style.PAGE)
    panels = fig.subplots(len(walks), 1, squeeze=False)[:, 0]
    for ax, (label, stride) in zip(panels, walks, strict=True):
        _draw_row(ax, stride, sum(_ROWS, ()))
        style.dress(ax, y="height [m]")
        ax.set_title(label, loc="left", weight="bold")
        ax.grid(visible=False)
    panels[-1].set_xlabel("right gait cycle from the right foot strike [%], figures moved apart")
    brace = [entry for _, stride in walks for entry in _brace_entry(stride)]
    style.legend(fig, [*_leg_entries(), *brace[:1]], columns=3)
    return fig


def _brace_entry(stride: Stride) -> list[Any]:
    return [style.entry("orthosis", **_BRACE)] if stride.walker.device.worn else []


def _leg_entries() -> list[Any]:
    return [style.entry(f"{side} leg", **_LEG_LOOK[side]) for side in SIDES]


def _draw_row(ax: Axes, stride: Stride, row: Sequence[int]) -> np.ndarray:
    """Draw the figures of one row side by side; return where their pelves stand [m]."""
    height = float(stride.column("pelvis_tz").mean())
    slots = height * _SPACING * np.arange(len(row))
    for slot, percent in zip(slots, row, strict=True):
        time = _instant(stride, percent)
        q = np.array([np.interp(time, stride.time, column) for column in stride.q.T])
        shift = np.array([slot - q[0], 0.0])
        points = {n: p + shift for n, p in body_points(stride.walker, q).items()}
        _draw_body(ax, points, tuple(stride.walker.device.elements))
    margin = height * _SPACING / 2
    ax.axhline(0.0, color=style.NEUTRAL, linewidth=0.8, zorder=1)
    ax.set_xlim(slots[0] - margin, slots[-1] + margin)
    ax.set_ylim(-0.06 * height, 2.0 * height)
    ax.set_xticks(slots, [f"{percent}" for percent in row])
    ax.set_yticks([0.0, 0.5, 1.0])
    ax.set_aspect("equal")
    return slots


def _instant(stride: Stride, percent: float) -> float:
    """Return the instant of a position in the right gait cycle [s]."""
    return (stride.strike("right") + percent / 100.0 * stride.duration) % stride.duration


def _draw_forces(ax: Axes, series: GaitSeries, time: float, slot: float) -> None:
    """Draw the ground forces of an instant on the walker whose pelvis is above `slot`."""
    height = float(series.column("pelvis_tz").mean())
    x0 = float(np.interp(time, series.time, series.q[:, 0]))
    row = int(np.argmin(np.abs(series.time - time)))
    scale = style.FORCE_LENGTH * height / series.walker.weight
    for side in SIDES:
        if loaded(series, side)[row]:
            x = centre_of_pressure(series, side)[row] - x0 + slot
            force = (series.forward_force(side)[row], series.vertical_force(side)[row])
            ax.quiver([x], [0.0], [scale * force[0]], [scale * force[1]], color=style.FORCE_COLOUR,
                      angles="xy", scale_units="xy", scale=1.0, width=0.006, zorder=5)  # fmt: skip


def _draw_body(ax: Axes, points: dict[str, np.ndarray], braced: Sequence[Side]) -> None:
    """Draw legs, feet, pelvis, trunk and head, and an orthosis on the legs that wear one."""
    for side in SIDES:
        s, look = SUFFIX[side], _LEG_LOOK[side]
        _draw_chain(ax, points, ("lumbar", f"hip_{s}", f"knee_{s}", f"ankle_{s}"), look)
        foot = (f"ankle_{s}", f"heel_{s}", f"toe_{s}", f"ankle_{s}")
        _draw_chain(ax, points, foot, look | {"linewidth": 0.8})
        if f"tip_{s}" in points:
            _draw_chain(ax, points, (f"toe_{s}", f"tip_{s}"), look | {"linewidth": 0.8})
        if side in braced:
            ankle, knee = (
                points.get(f"shell_{n}_{s}", points[f"{n}_{s}"]) for n in ("ankle", "knee")
            )
            shell = {"calf": 0.25 * ankle + 0.75 * knee, "joint": ankle, **points}
            _draw_chain(ax, shell, ("calf", "joint", f"heel_{s}", f"toe_{s}"), _BRACE)
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
