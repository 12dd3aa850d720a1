"""One look for all figures: sizes, colours, line styles and axes of the gait cycle."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, Final, Literal

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pathwalker_cli.conventions import Side
from pathwalker_cli.output.cycle import BOTH_SIDES, OwnCycle

__all__ = [
    "BODY_COLOUR",
    "COLUMN",
    "FORCE_COLOUR",
    "FORCE_LENGTH",
    "LINE_COLOUR",
    "LINE_STYLE",
    "MARKER",
    "NEUTRAL",
    "NORMAL",
    "PAGE",
    "SMALL",
    "STYLE",
    "band_handle",
    "dress",
    "events_handle",
    "legend",
    "new_figure",
    "percent_axis",
    "side_handles",
    "small_labels",
    "toe_off_line",
    "zero_line",
]

PAGE: Final = 7.0
"""Width of a printed page [in]."""
COLUMN: Final = 3.35
"""Width of a printed column [in]: 85 mm."""

LINE_COLOUR: Final[dict[Side, str]] = {"right": "#0072B2", "left": "#D55E00"}
"""Blue and vermilion of the palette by Okabe and Ito, told apart with any colour vision."""
LINE_STYLE: Final[dict[Side, Literal["-", "--"]]] = {"right": "-", "left": "--"}
"""Right solid, left dashed: sides differ without colour too."""
MARKER: Final[dict[Side, Literal["o", "s"]]] = {"right": "o", "left": "s"}
"""Right round, left square, for the same reason."""
BODY_COLOUR: Final[dict[Side, str]] = {"right": "#222222", "left": "#8a8a8a"}
"""Legs of a drawn walker; trunk and head are as dark as the right leg."""
FORCE_COLOUR: Final = "#009E73"
"""Ground reaction forces that are drawn as arrows."""
FORCE_LENGTH: Final = 0.6
"""Length of an arrow of one body weight, as a share of the pelvis height."""
NEUTRAL: Final = "#555555"
"""Grey of everything that belongs to no side."""

SMALL: Final = 7.0
NORMAL: Final = 8.0
"""Font sizes [pt]; nothing is smaller than 7 pt at printed width."""

STYLE: Final[dict[Any, Any]] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Arial", "Helvetica"],
    "font.size": NORMAL,
    "axes.titlesize": NORMAL,
    "axes.labelsize": NORMAL,
    "xtick.labelsize": SMALL,
    "ytick.labelsize": SMALL,
    "legend.fontsize": SMALL,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.4,
    "lines.dashed_pattern": (3.2, 1.4),
    "figure.dpi": 100,
    "svg.hashsalt": "pathwalker",
    "svg.fonttype": "none",
}
"""Settings of Matplotlib under which figures are made and saved."""


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure of this size [in]."""
    return Figure(figsize=(width, height), layout="constrained")


def dress(ax: Axes, title: str = "", x: str = "", y: str = "") -> None:
    """Give axes their title and labels and the common look of spines, ticks and grid."""
    ax.set_title(title)
    ax.set_xlabel(x)
    ax.set_ylabel(y)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=SMALL, width=0.6, length=2.5)
    ax.grid(visible=True, linewidth=0.4, color="#dddddd")
    ax.set_axisbelow(True)


def small_labels(ax: Axes) -> None:
    """Let title and labels be as small as the ticks, for panels that share a column."""
    for text in (ax.title, ax.xaxis.label, ax.yaxis.label):
        text.set_fontsize(SMALL)


def percent_axis(ax: Axes, label: bool = True) -> None:
    """Let the x axis run over a gait cycle that begins with the side's own foot strike."""
    ax.set_xlim(0.0, 100.0)
    ax.set_xticks([0, 25, 50, 75, 100])
    ax.set_xlabel("own gait cycle [%]" if label else "")


def toe_off_line(ax: Axes, cycle: OwnCycle) -> None:
    """Mark the toe-off of a side, thin in the line style of the side."""
    side = cycle.side
    ax.axvline(cycle.toe_off, linewidth=0.6, color=LINE_COLOUR[side], linestyle=LINE_STYLE[side])


def zero_line(ax: Axes) -> None:
    """Draw the line y = 0."""
    ax.axhline(0.0, color=NEUTRAL, linewidth=0.6)


def side_handles() -> list[Artist]:
    """Return the legend entries of the two sides."""
    return [
        Line2D([], [], color=LINE_COLOUR[s], linestyle=LINE_STYLE[s], label=s) for s in BOTH_SIDES
    ]


def events_handle() -> Artist:
    """Return the legend entry of the toe-off marks."""
    return Line2D([], [], color=NEUTRAL, linewidth=0.6, label="upright: toe-off")


def band_handle() -> Artist:
    """Return the legend entry of the recorded range."""
    return Patch(facecolor="#bbbbbb", alpha=0.6, label="recorded: range, thin line: mean")


def legend(fig: Figure, handles: Iterable[Artist], columns: int = 0) -> None:
    """Put one legend above all axes, in a row unless a number of columns is given."""
    entries = list(handles)
    fig.legend(
        handles=entries,
        loc="outside upper center",
        ncols=columns or len(entries),
        frameon=False,
        handlelength=2.6,
    )
