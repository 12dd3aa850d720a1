"""Figure of muscle activations and neural excitations over the gait cycle."""

from __future__ import annotations

from itertools import product

from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pathwalker_cli.conventions import GENERATORS, LEG_JOINTS, SIDES, SUFFIX, Side
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import Reference
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import own_cycle

_DIRECTIONS = ("extension", "flexion")


def activations(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return activation and excitation of every generator over the gait cycle of its side."""
    fig = style.new_figure(4.6)
    grid = fig.subplots(4, 4, sharex=True, sharey=True)
    columns = tuple(product(SIDES, _DIRECTIONS))
    for row, joint in zip(grid, LEG_JOINTS, strict=False):
        for ax, (side, direction) in zip(row, columns, strict=True):
            name = f"{joint}_{direction}_{SUFFIX[side]}"
            _draw(ax, series, name, side, f"{side.capitalize()} {joint}\n{direction}")
    for ax, title, name in zip(
        grid[-1],
        ("Trunk\nforward", "Trunk\nbackward"),
        ("lumbar_extension", "lumbar_flexion"),
        strict=False,
    ):
        _draw(ax, series, name, "right", title)
    _label(grid)
    style.legend(
        fig,
        [
            *style.side_handles(),
            style.entry("thin: excitation", linewidth=0.6),
            style.events_handle(),
        ],
    )
    return fig


def _draw(ax: Axes, series: GaitSeries, name: str, side: Side, title: str) -> None:
    """Draw one generator."""
    cycle, column = own_cycle(series, side), GENERATORS.index(name)
    colour = style.LINE_COLOUR[side]
    style.dress(ax, title)
    ax.plot(cycle.percent, series.excitation[cycle.index, column], color=colour, linewidth=0.6)
    ax.plot(
        cycle.percent,
        series.activation[cycle.index, column],
        color=colour,
        linestyle=style.LINE_STYLE[side],
    )
    style.toe_off_line(ax, cycle)


def _label(grid: list[list[Axes]]) -> None:
    """Label the outer axes and clear the two panels without a generator."""
    for row in grid:
        row[0].set_ylabel("activation [1]", labelpad=2.0)
    for top, ax in zip(grid[-2][2:], grid[-1][2:], strict=True):
        ax.axis("off")
        style.percent_axis(top, "own cycle\n[%]")
        top.xaxis.set_tick_params(labelbottom=True)
    for ax in grid[-1][:2]:
        style.percent_axis(ax, "right cycle\n[%]")
    grid[0][0].set_ylim(-0.03, 1.05)
    grid[0][0].set_yticks([0.0, 0.5, 1.0])
