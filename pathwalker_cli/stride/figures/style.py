"""One look for all figures: sizes, colours, line styles and axes of the gait cycle."""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any, Final, Literal

from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.stride.stride import OwnCycle

COLUMN: Final = 3.35
"""Width of a figure [in], unless it is one of a page: a column of a journal, 85 mm."""
PAGE: Final = 7.4
"""Width of a figure across a page [in]: A4 between its margins, 188 mm."""
PANEL: Final = PAGE / 4.0
"""Width of one of four figures side by side on a page [in]."""
TEXT: Final = 7.0
"""Size of all text [pt]; figures are printed as wide as they are drawn."""

_BLUE, _GREEN = "#0072B2", "#009E73"


def _right_and_forces() -> tuple[str, str]:
    """Return the colours of the right side, blue or green as laboratories have it, and of forces.

    Raises:
        ConfigError: If PATHWALKER_RIGHT is neither.
    """
    choices = {"blue": (_BLUE, _GREEN), "green": (_GREEN, _BLUE)}
    chosen = os.environ.get("PATHWALKER_RIGHT") or "blue"
    if chosen not in choices:
        raise ConfigError(
            f"there is no colour '{chosen}' for the right side", where="PATHWALKER_RIGHT",
            allowed="blue or green",
        )  # fmt: skip
    return choices[chosen]


_RIGHT, FORCE_COLOUR = _right_and_forces()
"""Right side, and ground reaction forces that are drawn as arrows."""
LINE_COLOUR: Final[dict[Side, str]] = {"right": _RIGHT, "left": "#D55E00"}
"""With vermilion, of the palette by Okabe and Ito: told apart with any colour vision."""
LINE_STYLE: Final[dict[Side, Literal["-", "--"]]] = {"right": "-", "left": "--"}
"""Right solid, left dashed: sides differ without colour too."""
MARKER: Final[dict[Side, Literal["o", "s"]]] = {"right": "o", "left": "s"}
"""Right round, left square, for the same reason."""
BODY_COLOUR: Final[dict[Side, str]] = {"right": "#222222", "left": "#8a8a8a"}
"""Legs of a drawn walker; trunk and head are as dark as the right leg."""
FORCE_LENGTH: Final = 0.6
"""Length of an arrow of one body weight, as a share of the pelvis height."""
NEUTRAL: Final = "#555555"
"""Grey of everything that belongs to no side."""

STYLE: Final[dict[Any, Any]] = {
    "font.family": "sans-serif",
    "font.sans-serif": ["DejaVu Sans", "Arial", "Helvetica"],
    "font.size": TEXT,
    "axes.titlesize": TEXT,
    "axes.labelsize": TEXT,
    "xtick.labelsize": TEXT,
    "ytick.labelsize": TEXT,
    "legend.fontsize": TEXT,
    "axes.linewidth": 0.6,
    "lines.linewidth": 1.2,
    "lines.dashed_pattern": (3.2, 1.4),
    "figure.dpi": 100,
    "svg.hashsalt": "pathwalker",
    "svg.fonttype": "none",
}
"""Settings of Matplotlib under which figures are made and saved."""


def new_figure(height: float, width: float = COLUMN, laid_out: bool = True) -> Figure:
    """Return an empty figure of this height and width [in], whose panels Matplotlib lays out."""
    return Figure(figsize=(width, height), layout="constrained" if laid_out else None)


def dress(ax: Axes, title: str = "", x: str = "", y: str = "") -> None:
    """Give axes their title and labels and the common look of spines, ticks and grid.

    The unit of y stands in a line of its own, since panels are low.
    """
    ax.set_title(title)
    ax.set_xlabel(x)
    ax.set_ylabel(y.replace(" [", "\n["))
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(width=0.6, length=2.5)
    ax.grid(visible=True, linewidth=0.4, color="#dddddd")
    ax.set_axisbelow(True)


def percent_axis(ax: Axes, label: str = "own gait cycle [%]") -> None:
    """Let the x axis run over a gait cycle that begins with the side's own foot strike."""
    ax.set_xlim(0.0, 100.0)
    ax.set_xticks([0, 50, 100])
    ax.set_xlabel(label)


def side_line(side: Side) -> dict[str, Any]:
    """Return colour and style of the lines of a side."""
    return {"color": LINE_COLOUR[side], "linestyle": LINE_STYLE[side]}


def toe_off_line(ax: Axes, cycle: OwnCycle) -> None:
    """Mark the toe-off of a side, thin in the line style of the side."""
    ax.axvline(cycle.toe_off, linewidth=0.6, **side_line(cycle.side))


def zero_line(ax: Axes) -> None:
    """Draw the line y = 0."""
    ax.axhline(0.0, color=NEUTRAL, linewidth=0.6)


def entry(label: str, **look: Any) -> Artist:
    """Return the legend entry of a line or a mark, grey if its look does not say otherwise."""
    return Line2D([], [], label=label, **{"color": NEUTRAL, **look})


def side_handles() -> list[Artist]:
    """Return the legend entries of the two sides."""
    return [entry(side, **side_line(side)) for side in SIDES]


def events_handle() -> Artist:
    """Return the legend entry of the toe-off marks."""
    return entry("upright: toe-off", linewidth=0.6)


def side_look(name: str) -> tuple[str, str]:
    """Return colour and marker of the side that a name tells of; grey triangles for none."""
    side = next((side for side in SIDES if side in name), None)
    return (LINE_COLOUR[side], MARKER[side]) if side else (NEUTRAL, "^")


def band_handle() -> Artist:
    """Return the legend entry of the recorded range."""
    return Patch(facecolor="#bbbbbb", alpha=0.6, label="recorded:\nrange, mean")


def legend(fig: Figure, handles: Iterable[Artist], columns: int = 2) -> None:
    """Put one legend above all axes."""
    fig.legend(handles=list(handles), loc="outside upper center", ncols=columns, **_LEGEND)


def legend_panel(ax: Axes, handles: Iterable[Artist]) -> None:
    """Let a panel that is not needed hold the legend of the figure."""
    ax.axis("off")
    place = (-0.35, 1.0)  # room that labels of an axis would have
    box = ax.legend(handles=list(handles), loc="upper left", bbox_to_anchor=place, **_LEGEND)
    box.set_in_layout(False)  # else all panels shrink with it


_LEGEND: Final[dict[str, Any]] = {
    "frameon": False, "handlelength": 2.0, "handletextpad": 0.6, "columnspacing": 1.2,
}  # fmt: skip
