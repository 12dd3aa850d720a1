"""Figures of an uncertainty study: where springs and gait end up, and what they follow."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import fill
from typing import Any, Final

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pathwalker_cli.conventions import SIDES, STIFFNESSES
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.studies.measures import Ranges
from pathwalker_cli.studies.uncertainty.result import Spread, Uncertainty, chance_level

_STRIP: Final = 0.22
"""Half the height over which points of a row are scattered, so that equal ones can be told."""

_LABEL: Final = 20
"""Characters of the longest line of the name of a row."""

_SEED: Final = 0

_TICKS: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)
"""Marks on the axis of stiffness [N m/rad]."""


def save_uncertainty_figures(result: Uncertainty, folder: Path) -> None:
    """Save all figures as PNG and SVG; none without draws that converged."""
    if not result.converged:
        return
    values = {measure.key: result.values(measure.key) for measure in result.measures}
    save_formats(spread_figure(values, result.ranges, result.spreads), folder, "uncertainty")
    save_formats(correlation_figure(result), folder, "correlations")


def spread_figure(
    values: Mapping[str, np.ndarray], ranges: Ranges, spreads_of: Sequence[Spread]
) -> Figure:
    """Return the springs of all draws in their ranges, and cost and gait around the base.

    Args:
        values: Every measure of all converged draws, SI units, each of shape (n,).
        ranges: Allowed range by spring, and further number [SI].
        spreads_of: How the measures spread.
    """
    springs = [spread for spread in spreads_of if spread.measure.key in STIFFNESSES]
    others = [spread for spread in spreads_of if spread not in springs and spread.base]
    with mpl.rc_context(style.STYLE):
        rows = (len(springs) + 1, len(others))
        fig = style.new_figure(1.6 + 0.27 * sum(rows))
        left, right = fig.subplots(2, 1, height_ratios=rows)
        for y, spread in enumerate(springs):
            low, high = ranges[spread.measure.key]
            left.plot([low, high], [y, y], color="#cccccc", linewidth=7.0, solid_capstyle="butt")
            _draw(left, y, values[spread.measure.key], spread, 1.0)
            left.text(high, y - 0.3, _limits(spread), ha="right", va="bottom")
        _rows(left, [spread.measure.label for spread in springs], -0.95)
        style.dress(left, "Identified springs", "stiffness [N m/rad], logarithmic")
        _stiffness_axis(left)
        for y, spread in enumerate(others):
            shares = 100.0 * (values[spread.measure.key] / spread.base - 1.0)
            _draw(right, y, shares, spread, 100.0)
        _rows(right, [fill(spread.measure.label, _LABEL) for spread in others], -0.6)
        right.axvline(0.0, color=style.NEUTRAL, linewidth=0.6)
        style.dress(right, "Cost and gait", "deviation from the base [%]")
        for ax in (left, right):
            ax.grid(visible=False, axis="y")
        style.legend(fig, _handles(len(values[spreads_of[0].measure.key])))
        return fig


def _draw(ax: Axes, y: int, values: np.ndarray, spread: Spread, unit: float) -> None:
    """Draw the draws of one measure, their median and range, and the base."""
    colour, marker = style.side_look(spread.measure.key)
    heights = y + np.random.default_rng(_SEED).uniform(-_STRIP, _STRIP, len(values))
    ax.plot(values, heights, marker, color=colour, markersize=2.6, alpha=0.45, mew=0.0)
    low, middle, high = np.quantile(values, (0.05, 0.5, 0.95))
    ax.plot([low, high], [y, y], color=colour, linewidth=1.6)
    ax.plot(middle, y, marker, color=colour, markersize=5.5, mec="white", mew=0.6)
    base = spread.base if unit == 1.0 else 0.0  # 100: deviations in %, around the base
    ax.plot(base, y, "|", color="black", markersize=13.0, mew=1.0)


def _stiffness_axis(ax: Axes) -> None:
    """Let soft springs have as much room as stiff ones."""
    ax.set_xscale("log")
    ax.minorticks_off()
    low, high = ax.get_xlim()
    ticks = [tick for tick in _TICKS if low <= tick <= high]
    ax.set_xticks(ticks, [f"{tick:g}" for tick in ticks])


def _limits(spread: Spread) -> str:
    if spread.lower is None or spread.upper is None:
        return "prescribed"
    return f"softest {100.0 * spread.lower:.0f} %, stiffest {100.0 * spread.upper:.0f} %"


def _rows(ax: Axes, labels: list[str], top: float) -> None:
    ax.set_yticks(range(len(labels)), labels)
    ax.set_ylim(len(labels) - 0.5, top)


def _handles(count: int) -> list[Artist]:
    sides = [
        style.entry(s, color=style.LINE_COLOUR[s], marker=style.MARKER[s], linewidth=0,
                    markersize=4.5)
        for s in reversed(SIDES)
    ]  # fmt: skip
    return [
        *sides,
        style.entry(f"{count} draws", marker="^", markersize=2.6, alpha=0.45, linewidth=0),
        style.entry("median, 90 % of draws", marker="^", markersize=5.5),
        style.entry("base", color="black", marker="|", markersize=9.0, linewidth=0),
        Patch(facecolor="#cccccc", label="range of real springs"),
    ]


def correlation_figure(result: Uncertainty) -> Figure:
    """Return the rank correlation of every input with every measure as a coloured table."""
    inputs = [entry.place for entry in result.draws.inputs]
    table = np.array([spread.correlations for spread in result.spreads]).T
    level = chance_level(len(result.converged), len(inputs))
    with mpl.rc_context(style.STYLE):
        fig = style.new_figure(1.5 + 0.13 * len(inputs))
        ax = fig.subplots()
        # blue and orange with white between: signs differ for any colour vision
        image = ax.imshow(table, cmap="PuOr_r", vmin=-1.0, vmax=1.0, aspect="auto")
        for (y, x), value in np.ndenumerate(table):
            if np.isfinite(value) and abs(value) > level:
                colour = "white" if abs(value) > 0.6 else "black"
                ax.text(x, y, _digit(value), color=colour, **_CELL)
            elif not np.isfinite(value):
                ax.text(x, y, "-", color=style.NEUTRAL, **_CELL)
        ax.set_yticks(range(len(inputs)), [_input(place) for place in inputs])
        names = [measure.short for measure in result.measures]
        ax.set_xticks(range(len(names)), names, rotation=90)
        ax.tick_params(length=0.0)
        words = (
            f"rank correlation [1]; numbers where chance\n(up to {level:.2f}) does not explain it"
        )
        fig.colorbar(image, ax=ax, location="bottom", aspect=40, pad=0.01, label=words)
        return fig


_CELL: Final[dict[str, Any]] = {"ha": "center", "va": "center", "fontsize": 6.5}


def _digit(value: float) -> str:
    """Return a correlation as a narrow cell holds it: "+.7", "-1"."""
    return f"{value:+.1f}".replace("0.", ".").replace("1.0", "1")


def _input(place: str) -> str:
    """Return the name of an input beside a table: what its group is called is left out."""
    group, _, name = place.partition(".")
    if group == "recorded":
        name = name.partition(".")[2].replace("joint_ranges.", "range of ")
    words = {"segment_lengths": f"length of {name}"}.get(group, name or group)
    return words.replace("_", " ").replace(".", ", ")
