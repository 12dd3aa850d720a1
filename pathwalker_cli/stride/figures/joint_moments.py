"""Figure of the net joint moments over the gait cycle."""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Side
from pathwalker_cli.stride.figures.curves import EXTENSION, Reference, draw_band, draw_sides
from pathwalker_cli.stride.figures.style import (
    LINE_COLOUR,
    LINE_STYLE,
    NEUTRAL,
    band_handle,
    dress,
    events_handle,
    legend_panel,
    new_figure,
    percent_axis,
    side_handles,
    zero_line,
)
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import own_cycle

_TITLES: Final = {
    "hip": "Hip, extension +",
    "knee": "Knee, extension +",
    "ankle": "Ankle, plantarflexion +",
}


def joint_moments(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return net moments at hip, knee and ankle over the gait cycle of each side.

    Internal moments, of muscles, tissue and orthosis on the joint, over mass with the orthosis;
    extension and plantarflexion are positive.  Thin lines at the ankle are the part of the
    orthosis, dotted ones that of passive tissue.

    Args:
        series: The stride.
        reference: Recorded bands to draw behind.
    """
    bands, mass = reference.moments if reference else {}, series.walker.total_mass
    fig = new_figure(2.9)
    panels = fig.subplots(2, 2).ravel()
    for ax, (joint, title) in zip(panels, _TITLES.items(), strict=False):
        factor, values = EXTENSION[joint] / mass, {}
        for side in SIDES:
            name = f"{joint}_{SUFFIX[side]}"
            draw_band(ax, bands.get(name), side, factor)
            values[side] = factor * series.net_torque[:, COORDINATES.index(name)]
        dress(ax, title, y="net moment [N m/kg]")
        zero_line(ax)
        draw_sides(ax, series, values)
        percent_axis(ax)
        for side in SIDES:
            name, look = f"{joint}_{SUFFIX[side]}", {"linewidth": 0.9, "linestyle": ":"}
            if name in series.passive_torque:
                _draw_part(ax, series, side, factor * series.passive_torque[name], look)
            if joint == "ankle" and series.walker.orthosis:
                worn = factor * series.orthosis_torque[:, SIDES.index(side)]
                _draw_part(ax, series, side, worn, {"linewidth": 0.7})
    handles = [*side_handles(), events_handle(), *([band_handle()] if bands else [])]
    if series.walker.orthosis:
        handles.append(Line2D([], [], color=NEUTRAL, linewidth=0.7, label="thin: orthosis alone"))
    if series.passive_torque:
        handles.append(Line2D([], [], color=NEUTRAL, linestyle=":", linewidth=0.9,
                              label="dotted: tissue alone"))  # fmt: skip
    legend_panel(panels[-1], handles)
    return fig


def _draw_part(
    ax: Axes, series: GaitSeries, side: Side, moment: np.ndarray, look: dict[str, Any]
) -> None:
    """Draw a part of the net moment of a side, shape (n,)."""
    cycle, own = (
        own_cycle(series, side),
        {"color": LINE_COLOUR[side], "linestyle": LINE_STYLE[side]},
    )
    ax.plot(cycle.percent, moment[cycle.index], **(own | look))
