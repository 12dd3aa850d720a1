"""The figure of a trade-off: effort over speed, and the springs along the front."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pathwalker_cli.conventions import STIFFNESSES, Side
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.figures.style import (
    LINE_COLOUR,
    LINE_STYLE,
    NEUTRAL,
    STYLE,
    dress,
    legend,
    new_figure,
)
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff

__all__ = ["save_tradeoff_figure", "tradeoff_figure"]

_MARKER: Final = {"dorsiflexion": "o", "plantarflexion": "s"}
_SPEED: Final = "walking speed [m/s]"
_NEAR: Final = 0.01
"""Difference of speed and effort, as a share of the largest, up to which points share a label."""


def tradeoff_figure(tradeoff: Tradeoff) -> Figure:
    """Return the figure of a trade-off.

    Args:
        tradeoff: The trade-off, with at least one solution.
    """
    springs = tradeoff.condition == "orthosis"
    with mpl.rc_context(STYLE):
        rows = 2 if springs else 1
        fig = new_figure(0.5 + 2.0 * rows)
        panels = fig.subplots(rows, 1, squeeze=False)[:, 0]
        _draw_front(panels[0], tradeoff)
        dress(panels[0], "What speed costs", _SPEED, "effort per distance [s/m]")
        if springs:
            _draw_springs(panels[1], tradeoff.front)
            dress(panels[1], "Springs along the front", _SPEED, "stiffness [N m/rad]")
        legend(fig, _handles(tradeoff))
    return fig


def save_tradeoff_figure(folder: Path, tradeoff: Tradeoff) -> None:
    """Save the figure of a trade-off as PNG and SVG.

    Args:
        folder: Where.
        tradeoff: The trade-off.
    """
    save_formats(tradeoff_figure(tradeoff), folder, "tradeoff")


def _draw_front(ax: Axes, tradeoff: Tradeoff) -> None:
    """Draw the front with its weights, points off it, and the recorded speeds."""
    if tradeoff.recorded is not None:
        ax.axvspan(*tradeoff.recorded, color="#bbbbbb", alpha=0.5, linewidth=0.0)
    front = tradeoff.front
    ax.plot([p.speed for p in front], [p.effort for p in front], color="black", marker="o",
            markersize=4.0)  # fmt: skip
    beaten = [p for p in tradeoff.solved if p not in front]
    ax.plot([p.speed for p in beaten], [p.effort for p in beaten], **_BEATEN)
    coarse = [p for p in tradeoff.solved if p.mesh_status == "inaccurate"]
    ax.plot([p.speed for p in coarse], [p.effort for p in coarse], **_COARSE)
    # in turn below and above, since points may be near one another
    for i, (point, text) in enumerate(labels(tradeoff.solved)):
        place: dict[str, Any] = {"ha": ("left", "right")[i % 2], "va": ("top", "bottom")[i % 2]}
        ax.annotate(text, (point.speed, point.effort), ((3, -3), (-3, 3))[i % 2],
                    textcoords="offset points", **place)  # fmt: skip
    ax.margins(x=0.08, y=0.15)


def labels(points: Sequence[FrontPoint]) -> list[tuple[FrontPoint, str]]:
    """Return where to write which weights: points in one place share a label.

    Args:
        points: The points, by rising weight.
    """
    groups: list[list[FrontPoint]] = []
    for point in points:
        last = groups[-1][0] if groups else None
        near = last is not None and (
            abs(point.speed - last.speed) <= _NEAR * last.speed
            and abs(point.effort - last.effort) <= _NEAR * last.effort
        )
        groups[-1].append(point) if near else groups.append([point])
    return [
        (group[0], f"{group[0].weight:g}" + (f" to {group[-1].weight:g}" if group[1:] else ""))
        for group in groups
    ]


def _draw_springs(ax: Axes, front: Sequence[FrontPoint]) -> None:
    """Draw the four stiffnesses over speed."""
    speed = [point.speed for point in front]
    for name in STIFFNESSES:
        ax.plot(speed, [point.measures[name] for point in front], **_spring(name))
    ax.set_ylim(bottom=0.0)


def _spring(name: str) -> dict[str, Any]:
    """Return the look of a spring: colour and line by side, marker by kind."""
    side: Side = "right" if name.endswith("right") else "left"
    return {
        "color": LINE_COLOUR[side],
        "linestyle": LINE_STYLE[side],
        "marker": _MARKER[name.split("_")[0]],
        "markersize": 3.5 if side == "right" else 6.5,  # both are seen where they agree
        "fillstyle": "full" if side == "right" else "none",
        "linewidth": 1.0,
    }


_BEATEN: Final[dict[str, Any]] = {
    "linestyle": "none", "marker": "o", "markersize": 4.0, "color": NEUTRAL, "fillstyle": "none",
}  # fmt: skip
_COARSE: Final[dict[str, Any]] = {
    "linestyle": "none", "marker": "x", "markersize": 7.0, "color": "#D55E00",
}  # fmt: skip


def _handles(tradeoff: Tradeoff) -> list[Artist]:
    """Return the legend entries of what is in the figure."""
    found: list[Artist] = [Line2D([], [], color="black", marker="o", markersize=4.0,
                                  label="front, with weight of speed")]  # fmt: skip
    if len(tradeoff.front) < len(tradeoff.solved):
        found.append(Line2D([], [], label="dominated", **_BEATEN))
    if any(point.mesh_status == "inaccurate" for point in tradeoff.solved):
        found.append(Line2D([], [], label="mesh too coarse", **_COARSE))
    if tradeoff.recorded is not None:
        found.append(Patch(facecolor="#bbbbbb", alpha=0.5, label="recorded speeds"))
    if tradeoff.condition == "orthosis":
        for name in STIFFNESSES:
            label = f"K_{name[0].upper()} {name.split('_')[2]}"
            found.append(Line2D([], [], **_spring(name), label=label))
    return found
