"""Figure of the ground reaction forces over the gait cycle."""

from __future__ import annotations

from typing import Final

from matplotlib.figure import Figure

from pathwalker_cli.conventions import SIDES, SUFFIX
from pathwalker_cli.stride.figures.curves import Reference, draw_band, draw_sides
from pathwalker_cli.stride.figures.style import (
    band_handle,
    dress,
    events_handle,
    legend,
    new_figure,
    percent_axis,
    side_handles,
    zero_line,
)
from pathwalker_cli.stride.series import GaitSeries

_PANELS: Final = {
    "z": ("Vertical, up +", "vertical force [% body weight]"),
    "x": ("Fore-aft, forward +", "fore-aft force [% body weight]"),
}


def ground_forces(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return vertical and fore-aft ground reaction forces on each foot over its gait cycle.

    Args:
        series: The stride.
        reference: Recorded bands to draw behind.
    """
    bands, factor = reference.forces if reference else {}, 100.0 / series.walker.weight
    fig = new_figure(2.1)
    for ax, (axis, (title, label)) in zip(fig.subplots(1, 2), _PANELS.items(), strict=True):
        for side in SIDES:
            draw_band(ax, bands.get(f"foot_{SUFFIX[side]}_{axis}"), side, factor)
        force = series.vertical_force if axis == "z" else series.forward_force
        dress(ax, title, y=label)
        zero_line(ax)
        draw_sides(ax, series, {side: factor * force(side) for side in SIDES})
        percent_axis(ax)
    legend(fig, [*side_handles(), events_handle(), *([band_handle()] if bands else [])])
    return fig
