"""The figure of a trade-off: effort over speed, and the springs along the front."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pathwalker_cli.conventions import Side
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.tradeoff.result import FrontPoint, Tradeoff

_MARKER: Final = {"dorsiflexion": "o", "plantarflexion": "s"}
_SPEED: Final = "walking speed [m/s]"
_NEAR: Final = 0.01
"""Difference of speed and effort, as a share of the largest, up to which points share a label."""


def tradeoff_figure(tradeoff: Tradeoff) -> Figure:
    """Return the figure of a trade-off with at least one solution."""
    with mpl.rc_context(style.STYLE):
        rows = 2 if tradeoff.springs else 1
        fig = style.new_figure(0.5 + 2.0 * rows)
        panels = fig.subplots(rows, 1, squeeze=False)[:, 0]
        _draw_front(panels[0], tradeoff)
        style.dress(panels[0], "What speed costs", _SPEED, "effort per distance [s/m]")
        if tradeoff.springs:
            _draw_springs(panels[1], tradeoff)
            style.dress(panels[1], "Springs along the front", _SPEED, "stiffness [N m/rad]")
        style.legend(fig, _handles(tradeoff))
    return fig


def save_tradeoff_figure(tradeoff: Tradeoff, folder: Path) -> None:
    """Save the figure of a trade-off as PNG and SVG."""
    save_formats(tradeoff_figure(tradeoff), folder, "tradeoff")


def _draw_front(ax: Axes, tradeoff: Tradeoff) -> None:
    """Draw the front with its weights, points off it, and the recorded speeds."""
    if tradeoff.recorded_walking_speed is not None:
        ax.axvspan(*tradeoff.recorded_walking_speed, color="#bbbbbb", alpha=0.5, linewidth=0.0)
    beaten = [point for point in tradeoff.solved if point.dominated]
    for points, look in ((tradeoff.front_points, _FRONT), (beaten, _BEATEN),
                         (tradeoff.coarse, _COARSE)):  # fmt: skip
        ax.plot([p.speed for p in points], [p.effort for p in points], **look)
    # in turn below and above, since points may be near one another
    for i, (point, text) in enumerate(labels(tradeoff.solved)):
        place: dict[str, Any] = {"ha": ("left", "right")[i % 2], "va": ("top", "bottom")[i % 2]}
        ax.annotate(text, (point.speed, point.effort), ((3, -3), (-3, 3))[i % 2],
                    textcoords="offset points", **place)  # fmt: skip
    ax.margins(x=0.08, y=0.15)


def labels(points: Sequence[FrontPoint]) -> list[tuple[FrontPoint, str]]:
    """Return where to write which weights, which rise: points in one place share a label."""
    groups: list[list[FrontPoint]] = []
    for point in points:
        last = groups[-1][0] if groups else None
        near = last is not None and (
            abs(point.speed - last.speed) <= _NEAR * last.speed
            and abs(point.effort - last.effort) <= _NEAR * last.effort
        )
        groups[-1].append(point) if near else groups.append([point])
    return [
        (group[0], " to ".join(f"{p.walking_speed_weight:g}" for p in (group[0], *group[1:][-1:])))
        for group in groups
    ]


def _draw_springs(ax: Axes, tradeoff: Tradeoff) -> None:
    front = tradeoff.front_points
    for name in tradeoff.springs:
        stiffness = [point.measures[name] for point in front]
        ax.plot([point.speed for point in front], stiffness, **_spring(name))
    ax.set_ylim(bottom=0.0)


def _spring(name: str) -> dict[str, Any]:
    """Return the look of a spring: colour and line by side, marker by kind."""
    side: Side = "right" if name.endswith("right") else "left"
    return {
        **style.side_line(side),
        "marker": _MARKER[name.split("_")[0]],
        "markersize": 3.5 if side == "right" else 6.5,  # both are seen where they agree
        "fillstyle": "full" if side == "right" else "none",
        "linewidth": 1.0,
    }


_FRONT: Final[dict[str, Any]] = {"color": "black", "marker": "o", "markersize": 4.0}
_BEATEN: Final[dict[str, Any]] = {
    "linestyle": "none", "marker": "o", "markersize": 4.0, "color": style.NEUTRAL,
    "fillstyle": "none",
}  # fmt: skip
_COARSE: Final[dict[str, Any]] = {
    "linestyle": "none", "marker": "x", "markersize": 7.0, "color": "#D55E00",
}  # fmt: skip


def _handles(tradeoff: Tradeoff) -> list[Artist]:
    handles = [style.entry("front, with weight of speed", **_FRONT)]
    if len(tradeoff.front) < len(tradeoff.solved):
        handles.append(style.entry("dominated", **_BEATEN))
    if tradeoff.coarse:
        handles.append(style.entry("mesh too coarse", **_COARSE))
    if tradeoff.recorded_walking_speed is not None:
        handles.append(Patch(facecolor="#bbbbbb", alpha=0.5, label="recorded speeds"))
    springs = (style.entry(measure_of(n).label, **_spring(n)) for n in tradeoff.springs)
    return [*handles, *springs]
