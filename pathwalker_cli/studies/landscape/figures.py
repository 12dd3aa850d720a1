"""The figure of a landscape: cost over K_D and K_P, and the gait over the same plane."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.ticker import FixedLocator, FuncFormatter, NullFormatter, NullLocator

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.evaluation.paper import PATIENT, paper_number
from pathwalker_cli.patient.blocks import SpringSet
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.landscape.result import Landscape

Chosen = Mapping[Side, tuple[float, float]]
"""K_D and K_P by side [N m/rad]."""

_LEVELS: Final = (0.0, 1.0, 2.0, 5.0, 10.0, 15.0, 20.0, 30.0, 40.0, 60.0, 80.0, 100.0)
"""Limits of the colours [%]; what is above belongs to the last one."""

_COLOURS: Final = "cividis_r"
"""Light where walking is cheap; alike with any colour vision and in grey."""

_LOGARITHMIC: Final = 5.0
"""Ratio of the ends of an axis from which on it is drawn logarithmically."""

_MIDDLE: Final = (0.35, 0.65)
"""Shares of a small axis between which a number stands clear of those at its ends."""

_TITLE: Final = 22
"""Characters of the longest line of a small title."""

_FLAT: Final = 1e-3
"""Relative span of a measure below which it counts as the same everywhere."""


def landscape_figure(landscape: Landscape) -> Figure:
    """Return the figure of a landscape."""
    with mpl.rc_context(style.STYLE):
        fig = style.new_figure(5.9)
        panels = fig.subplot_mosaic([["cost", "cost"], ["a", "b"], ["c", "legend"]],
                                    height_ratios=[2.1, 1.0, 1.0])  # fmt: skip
        _draw_cost(fig, panels["cost"], landscape)
        side = "right" if landscape.side == "both" else landscape.side
        keys = ("walking_speed", f"min_stance_knee_flexion_{side}", f"step_length_{side}")
        for name, key in zip("abc", keys, strict=True):
            _draw_measure(fig, panels[name], landscape, key)
        for artist in (*panels["cost"].lines, *panels["cost"].collections):
            artist.set_in_layout(False)  # marks on the edge would push all axes away from it
        style.legend_panel(panels["legend"], _handles(landscape))
    return fig


def cost_figure(landscape: Landscape, springs: SpringSet | None, chosen: Chosen) -> Figure:
    """Return the cost alone, with the springs that can be bought at the edges of the plane.

    Args:
        landscape: The landscape.
        springs: Springs that exist, or None.
        chosen: K_D and K_P of the real springs to take by side [N m/rad]; empty if nothing chose.
    """
    with mpl.rc_context(style.STYLE):
        fig = style.new_figure(3.5)
        ax = fig.subplots()
        _draw_cost(fig, ax, landscape)
        handles = _handles(landscape)
        if springs is not None:
            _mark_real(ax, springs)
            handles.append(style.entry("real springs", linestyle="none", **_REAL_D))
        for k_d, k_p in chosen.values():
            ax.plot(k_d, k_p, linestyle="none", clip_on=False, zorder=6, **_SQUARE)
        if chosen:
            handles.append(style.entry("to take", linestyle="none", **_SQUARE))
        for artist in (*ax.lines, *ax.collections):
            artist.set_in_layout(False)
        style.legend(fig, handles)
    return fig


def _mark_real(ax: Axes, springs: SpringSet) -> None:
    """Mark the springs that exist: K_D at the upper edge, K_P at the right one."""
    (left, right), (low, high) = ax.get_xlim(), ax.get_ylim()
    look: dict[str, Any] = {"linestyle": "none", "clip_on": False, "zorder": 4}
    k_d = [s.stiffness for s in springs.dorsiflexion if left <= s.stiffness <= right]
    k_p = [s.stiffness for s in springs.plantarflexion if low <= s.stiffness <= high]
    ax.plot(k_d, [high] * len(k_d), **_REAL_D, **look)
    ax.plot([right] * len(k_p), k_p, **_REAL_P, **look)


def save_landscape_figure(landscape: Landscape, folder: Path) -> None:
    """Save the figure of a landscape as PNG and SVG."""
    save_formats(landscape_figure(landscape), folder, "landscape")


def _draw_cost(fig: Figure, ax: Axes, landscape: Landscape) -> None:
    """Draw the cost above the least one, the region, and all marks."""
    percent = np.ma.masked_invalid(100.0 * landscape.increase.T)
    top = next((level for level in _LEVELS[1:] if level >= percent.max()), _LEVELS[-1])
    tolerance = 100.0 * landscape.tolerance
    levels = sorted({*(level for level in _LEVELS if level <= top), tolerance})
    filled = ax.contourf(landscape.k_d, landscape.k_p, percent, levels=levels, cmap=_COLOURS,
                         norm=mpl.colors.BoundaryNorm(levels, 256), extend="max")  # fmt: skip
    inside = percent.min() <= tolerance <= percent.max()
    if inside:
        ax.contour(landscape.k_d, landscape.k_p, percent, levels=[tolerance], colors="black",
                   linewidths=2.0)  # fmt: skip
        ax.contourf(landscape.k_d, landscape.k_p, percent, levels=[-1.0, tolerance], colors="none",
                    hatches=["///"])  # fmt: skip
    bar = fig.colorbar(filled, ax=ax, ticks=levels, pad=0.02, aspect=30)
    bar.set_label("cost above the least [%]")
    _mark(ax, landscape)
    _plane(ax, landscape)
    tied = landscape.side == "both"
    ax.set_title("Springs, both sides tied" if tied else f"Springs of the {landscape.side} side")


def _mark(ax: Axes, landscape: Landscape) -> None:
    """Mark grid points, those with several optima, failures, the best and the article's springs."""
    look: dict[str, Any] = {"linestyle": "none", "clip_on": False}
    for points, marker in ((landscape.bests.values(), _DOT), (landscape.branched, _RING),
                           (landscape.failed, _CROSS)):  # fmt: skip
        ax.plot([p.k_d for p in points], [p.k_p for p in points], **marker, **look)
    ax.plot(landscape.best.k_d, landscape.best.k_p, **_STAR, **look, zorder=5)
    for side, (k_d, k_p) in _article(landscape).items():
        ax.plot(k_d, k_p, **_DIAMOND, **look, zorder=5)
        if landscape.side == "both":
            ax.annotate(side, (k_d, k_p), (4, 4), textcoords="offset points")


def _article(landscape: Landscape) -> dict[str, tuple[float, float]]:
    """Return what the article identified for its patient, by side [N m/rad]."""
    identified = {}
    for side in SIDES if landscape.side == "both" else (landscape.side,):
        pair = [paper_number("mapd-orthosis", f"{kind}_stiffness_{side}")
                for kind in ("dorsiflexion", "plantarflexion")]  # fmt: skip
        if landscape.patient == PATIENT and pair[0] is not None and pair[1] is not None:
            identified[side] = (pair[0].value, pair[1].value)
    return identified


def _draw_measure(fig: Figure, ax: Axes, landscape: Landscape, key: str) -> None:
    """Draw one measure of the best local optima over the plane."""
    measure = measure_of(key)
    values = np.ma.masked_invalid(np.vectorize(measure.in_shown_unit)(landscape.values(key)).T)
    if np.ptp(values.compressed()) <= _FLAT * abs(values.mean()):
        ax.set_facecolor("#eeeeee")
        ax.text(0.5, 0.5, f"{values.mean():.3g} {measure.shown_unit}\neverywhere", ha="center",
                va="center", transform=ax.transAxes)  # fmt: skip
    else:
        filled = ax.contourf(landscape.k_d, landscape.k_p, values, levels=7, cmap=_COLOURS)
        fig.colorbar(filled, ax=ax, pad=0.02, aspect=12).locator = mpl.ticker.MaxNLocator(4)
    _plane(ax, landscape, small=True)
    ax.set_title(fill(f"{measure.label} [{measure.shown_unit}]", _TITLE))


def _plane(ax: Axes, landscape: Landscape, small: bool = False) -> None:
    """Let the axes be K_D and K_P, with ticks at the values that were solved."""
    entries = ((ax.xaxis, landscape.k_d, "D"), (ax.yaxis, landscape.k_p, "P"))
    for (axis, values, name), set_scale in zip(
        entries, (ax.set_xscale, ax.set_yscale), strict=True
    ):
        logarithmic = values[0] > 0.0 and values[-1] / values[0] >= _LOGARITHMIC
        set_scale("log" if logarithmic else "linear")
        places = np.log(values) if logarithmic else values
        shares = (places - places[0]) / (places[-1] - places[0])
        # in a small panel there is room for one number between the ends
        middle = values[(shares >= _MIDDLE[0]) & (shares <= _MIDDLE[1])][:1]
        ticks = np.array([values[0], *middle, values[-1]]) if small else values
        axis.set_major_locator(FixedLocator(ticks.tolist()))
        axis.set_minor_locator(NullLocator())
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
        axis.set_minor_formatter(NullFormatter())
        axis.set_label_text(f"K_{name} [N m/rad]")
    ax.set(xlim=landscape.k_d[[0, -1]], ylim=landscape.k_p[[0, -1]])
    ax.tick_params(width=0.6, length=2.5)


_DOT: Final[dict[str, Any]] = {
    "marker": "o", "color": "white", "markersize": 2.6, "markeredgecolor": "black",
    "markeredgewidth": 0.5,
}  # fmt: skip
_RING: Final[dict[str, Any]] = {
    "marker": "o", "color": "black", "markersize": 7.0, "fillstyle": "none",
    "markeredgewidth": 0.8,
}  # fmt: skip
_CROSS: Final[dict[str, Any]] = {
    "marker": "x",
    "color": "#D55E00",
    "markersize": 6.0,
    "markeredgewidth": 1.5,
}
_REAL_D: Final[dict[str, Any]] = {
    "marker": 7, "color": "#009E73", "markersize": 6.0, "markeredgecolor": "black",
    "markeredgewidth": 0.5,
}  # fmt: skip
_REAL_P: Final[dict[str, Any]] = {**_REAL_D, "marker": 4}
_SQUARE: Final[dict[str, Any]] = {
    "marker": "s", "color": "#009E73", "markersize": 10.0, "fillstyle": "none",
    "markeredgewidth": 1.6,
}  # fmt: skip
_STAR: Final[dict[str, Any]] = {
    "marker": "*", "color": "#D55E00", "markersize": 13.0, "markeredgecolor": "white",
}  # fmt: skip
_DIAMOND: Final[dict[str, Any]] = {
    "marker": "D", "color": "white", "markersize": 6.5, "markeredgecolor": "black",
}  # fmt: skip


def _handles(landscape: Landscape) -> list[Artist]:
    """Return the legend entries of what is in the figure."""
    entries: list[tuple[dict[str, Any], str, bool]] = [
        (_STAR, "least cost found", True),
        (_DIAMOND, "identified\nin the article", bool(_article(landscape))),
        (_DOT, "solved", True),
        (_RING, "several local optima,\nbest shown", bool(landscape.branched)),
        (_CROSS, "no solution", bool(landscape.failed)),
    ]
    handles = [
        style.entry(label, linestyle="none", **marker) for marker, label, there in entries if there
    ]
    text = f"at most {100 * landscape.tolerance:g} % above\nthe least"
    return [Patch(facecolor="none", edgecolor="black", hatch="///", linewidth=1.5, label=text),
            *handles]  # fmt: skip
