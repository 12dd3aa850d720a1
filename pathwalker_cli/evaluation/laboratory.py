"""Curves as gait laboratories print them: a small panel per quantity, one side over the other.

Right is blue (or green) and round, left is red and square, whatever is worn; the last gait is
solid, those before it are broken lines.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pathwalker_cli.conventions import SIDES, Side, to_degrees
from pathwalker_cli.evaluation.curves import FINE, Trace, recorded_band, toe_off_percent
from pathwalker_cli.evaluation.norms import norms, speed_class
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import ANGLES, FORCES, MOMENTS, POWERS, CycleCurve
from pathwalker_cli.stride.measures import ankle_line

_PELVIS, _HIP, _KNEE, _ANKLE, _TRUNK = ANGLES
ROWS: Final = (
    (_PELVIS, _HIP, _KNEE, _ANKLE),
    (_TRUNK, *MOMENTS),
    (FORCES[0], *POWERS),
    (FORCES[1],),
)
"""Panels of a page: a column each for pelvis and trunk, hip, knee and ankle."""

_HEIGHT: Final = 1.12
"""Height of a panel [in]."""
_ROOM: Final = {"left": 0.19, "right": 0.9, "bottom": 0.16, "top": 0.76}
"""Edges of the axes as shares of the panel, the same for all, so that they stand in line."""
_STYLES: Final = ("-", "--", "-.", ":")
_TYPICAL, _RECORDED = "#d9d9d9", 0.16
"""Colour of typical children's band, opacity of the recorded one."""
_TICK: Final = 0.09
"""Height of a toe-off tick as a share of the panel."""


def cycle_panel(curve: CycleCurve, shown: Sequence[Trace]) -> Figure:
    """Return a quantity of both sides over their own gait cycles.

    Behind it stand typical children at the speed of the last gait, mean and one standard deviation
    to either side, and what was recorded of the last condition that was.
    """
    fig, ax = _panel(curve.name.capitalize(), curve.label)
    if curve.zero:
        style.zero_line(ax)
    typical = norms(speed_class(shown[-1].gait)).get(curve.key)
    if typical is not None:
        percent = np.linspace(0.0, 100.0, typical.mean.size)
        low, high = typical.mean - typical.sd, typical.mean + typical.sd
        ax.fill_between(percent, low, high, color=_TYPICAL, linewidth=0)
    behind = _behind(shown)
    for side in SIDES:
        if band := recorded_band(behind[1] if behind else None, curve, side):
            ax.fill_between(band.percent, band.low, band.high, color=style.LINE_COLOUR[side],
                            alpha=_RECORDED, linewidth=0)  # fmt: skip
    for trace in shown:
        for side in SIDES:
            look = _look(shown, trace, side)
            for line in curve.lines(trace.gait, side, FINE):
                ax.plot(np.linspace(0.0, 100.0, FINE), line, **look)
            at = toe_off_percent(trace.gait, side)
            tick = look | {"marker": "", "linewidth": 1.4}
            ax.plot([at, at], [0.0, _TICK], transform=ax.get_xaxis_transform(), **tick)
    style.percent_axis(ax, "")
    ax.set_xticks([0, 50, 100], ["0", "50", "100 %"])
    ax.locator_params(axis="y", nbins=4)
    return fig


def ankle_panel(shown: Sequence[Trace], side: Side) -> Figure:
    """Return the net torque of an ankle over its dorsiflexion in stance, with slopes.

    Raises:
        NotKnownError: If the torques of a gait are not known.
    """
    fig, ax = _panel(f"{side.capitalize()} ankle in stance", "torque [N m] over angle [deg]")
    style.zero_line(ax)
    behind = _behind(shown)
    for each in behind[1].ankle_profiles(side) if behind else ():
        ax.plot(to_degrees(each[:, 0]), each[:, 1], color=style.LINE_COLOUR[side], linewidth=0.3,
                alpha=0.5)  # fmt: skip
    slopes = []
    for trace in reversed(shown):
        profile = trace.gait.ankle_profile(side, FINE)
        ax.plot(to_degrees(profile[:, 0]), profile[:, 1], **_look(shown, trace, side))
        slopes.append(f"{ankle_line(profile)[0]:.0f}")
    ax.margins(y=0.2)
    ax.text(0.03, 0.99, f"slope {', '.join(slopes)} N m/rad", transform=ax.transAxes, va="top")
    ax.locator_params(nbins=4)
    return fig


def legend_panel(shown: Sequence[Trace]) -> Figure:
    """Return the legend of all panels, as large as one."""
    fig = style.new_figure(_HEIGHT, style.PANEL, laid_out=False)
    right = style.LINE_COLOUR["right"]
    handles: list[Artist] = [
        style.entry(side, color=style.LINE_COLOUR[side], marker=style.MARKER[side], markersize=3)
        for side in SIDES
    ]
    handles += [
        style.entry(trace.label, linestyle=_look(shown, trace, "right")["linestyle"])
        for trace in reversed(shown)
    ]
    behind = _behind(shown)
    if behind is not None:
        label = "recorded range" if len(shown) == 1 else f"recorded, {behind[0]}"
        handles.append(Patch(facecolor=right, alpha=2.0 * _RECORDED, label=label))
    speed = speed_class(shown[-1].gait).replace("_", " ")
    typical = f"typical children,\n{speed} speed, ± 1 SD"
    handles.append(Patch(facecolor=_TYPICAL, label=typical))
    handles.append(style.entry("toe-off", marker=2, markersize=6, linestyle=""))
    fig.legend(handles=handles, loc="center left", frameon=False, handlelength=2.2,
               labelspacing=0.25, borderpad=0.0)  # fmt: skip
    return fig


def _behind(shown: Sequence[Trace]) -> tuple[str, RecordedGait] | None:
    """Return the recordings that stand behind all, with their gait's name: the last there are."""
    found = ((trace.label, trace.recorded) for trace in reversed(shown))
    return next(((label, recorded) for label, recorded in found if recorded is not None), None)


def _panel(name: str, label: str) -> tuple[Figure, Axes]:
    """Return a figure of one panel under its two lines of title."""
    fig = style.new_figure(_HEIGHT, style.PANEL, laid_out=False)
    ax = fig.add_axes(
        (_ROOM["left"], _ROOM["bottom"], _ROOM["right"] - _ROOM["left"],
         _ROOM["top"] - _ROOM["bottom"])
    )  # fmt: skip
    style.dress(ax, "")
    fig.text(0.02, 0.985, name, weight="bold", va="top")
    fig.text(0.02, 0.88, label, va="top")
    return fig, ax


def _look(shown: Sequence[Trace], trace: Trace, side: Side) -> dict[str, Any]:
    """Return colour and mark of a side, and line style of a gait."""
    order = len(shown) - 1 - list(shown).index(trace)
    first = 25 if side == "right" else 62
    return {
        "color": style.LINE_COLOUR[side], "linestyle": _STYLES[order % len(_STYLES)],
        "linewidth": 1.1 if order == 0 else 0.9, "marker": style.MARKER[side], "markersize": 2.2,
        "markevery": (first, 75),
    }  # fmt: skip
