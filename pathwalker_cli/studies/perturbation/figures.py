"""The figure of a perturbation: how each number answers each spring, beside the article's."""

from __future__ import annotations

from pathlib import Path
from textwrap import fill
from typing import Final

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.measures import COMPARED
from pathwalker_cli.studies.perturbation.result import Perturbation, Perturbed

_TITLE: Final = 20
"""Characters of the longest line of a title."""
_LEAST_SPAN: Final = 0.02
"""Least width of an axis [%]: smaller changes are none."""


def save_perturbation_figure(result: Perturbation, folder: Path) -> None:
    """Save the figure as PNG and SVG."""
    save_formats(perturbation_figure(result), folder, "perturbation")


def perturbation_figure(result: Perturbation) -> Figure:
    """Return one panel per measure with the change [%] for every spring that was moved."""
    with mpl.rc_context(style.STYLE):
        fig = style.new_figure(2.4 + 0.95 * len(result.rows))
        panels = fig.subplots(3, 2, sharey=True)
        for ax, key in zip(panels.flat, COMPARED, strict=True):
            _draw(ax, result, key)
            style.dress(ax, fill(measure_of(key).label, _TITLE), "change [%]")
            ax.grid(visible=False, axis="y")
        ax = panels[0, 0]
        ax.set_yticks(range(len(result.rows)), [_label(result, row) for row in result.rows])
        ax.set_ylim(len(result.rows) - 0.5, -0.5)
        style.legend(fig, _handles(result))
        return fig


def _label(result: Perturbation, row: Perturbed) -> str:
    """Return the name of a number with both its values."""
    name = f"{row.label}, {100.0 * (row.factor - 1.0):+.3g} %"
    return f"{name}\n{result.optimum[row.name]:.3g} to {row.value:.3g} {row.unit}"


def _draw(ax: Axes, result: Perturbation, key: str) -> None:
    """Draw the changes of one measure, from zero to each mark."""
    ax.axvline(0.0, color=style.NEUTRAL, linewidth=0.6)
    shown = [0.0]
    for y, row in enumerate(result.rows):
        colour, marker = style.side_look(row.name)
        if key in row.changes:
            x = 100.0 * row.changes[key]
            ax.plot([0.0, x], [y, y], color=colour, linewidth=1.4, solid_capstyle="butt")
            ax.plot(x, y, marker, color=colour, markersize=4.5)
            shown.append(x)
        if key in row.changes_article:
            x = 100.0 * row.changes_article[key]
            ax.plot(x, y, "D", markersize=4.5, mfc="none", mec="black", mew=0.8)
            shown.append(x)
    room = max(max(shown) - min(shown), _LEAST_SPAN)
    ax.set_xlim(min(shown) - 0.1 * room, max(shown) + 0.1 * room)
    ax.locator_params(axis="x", nbins=3)


def _handles(result: Perturbation) -> list[Artist]:
    handles = [
        style.entry(f"{side} {result.noun} moved", color=style.LINE_COLOUR[side],
                    marker=style.MARKER[side], markersize=4.5)
        for side in reversed(SIDES)
    ]  # fmt: skip
    if any(row.changes_article for row in result.rows):
        handles.append(
            style.entry("article, table 5\n(another optimum)", color="black", marker="D",
                        markersize=4.5, mfc="none", linewidth=0)
        )  # fmt: skip
    return handles
