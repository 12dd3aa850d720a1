"""The net torque-angle profile of an ankle over stance, with its mean slope."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes

from pathwalker_cli.conventions import Side, to_degrees
from pathwalker_cli.evaluation.ankle import ankle_line, ankle_profile, recorded_ankle_profiles
from pathwalker_cli.evaluation.cycle_curves import FINE
from pathwalker_cli.evaluation.traces import Trace
from pathwalker_cli.stride.figures.style import NEUTRAL, TEXT, zero_line

__all__ = ["draw_ankle"]

_RECORDED = "#999999"


def draw_ankle(ax: Axes, shown: Sequence[Trace], side: Side) -> None:
    """Draw the profiles of one ankle: recorded ones, each gait's own, the line of its mean slope.

    Dorsiflexion is positive, and so is the plantarflexing torque of muscles and orthosis.

    Args:
        ax: The panel.
        shown: The gaits.
        side: The side.

    Raises:
        ValueError: If the torques of a gait are not known.
    """
    zero_line(ax)
    for trace in shown:
        _draw_recorded(ax, trace, side)
    ax.margins(y=0.08 * (2 + len(shown)))  # room for the slopes above the curves
    for i, trace in enumerate(shown):
        slope, alone = _draw_profile(ax, trace, side), trace.order is None
        text = f"slope {slope:.0f} N m/rad{_recorded_slopes(trace, side)}"
        ax.annotate(
            text if alone else f"{slope:.0f} N m/rad",
            (0.03, 0.97),
            (0, -1.3 * TEXT * i),
            xycoords="axes fraction",
            textcoords="offset points",
            va="top",
            color="black" if alone else trace.look(side)["color"],
        )


def _draw_recorded(ax: Axes, trace: Trace, side: Side) -> None:
    """Draw every recorded stance, and behind a gait alone their mean."""
    if trace.recorded is None:
        return
    found = recorded_ankle_profiles(trace.recorded, side)
    alone = trace.order is None
    look = {"color": _RECORDED, "linewidth": 0.5} if alone else {**trace.edge, "linewidth": 0.35}
    for each in found:
        ax.plot(to_degrees(each[:, 0]), each[:, 1], **look)
    if alone and len(found):
        mean = found.mean(axis=0)
        ax.plot(to_degrees(mean[:, 0]), mean[:, 1], color=NEUTRAL, linewidth=1.1)


def _draw_profile(ax: Axes, trace: Trace, side: Side) -> float:
    """Draw a gait's own profile and the line of its mean slope; return the slope [N m/rad]."""
    profile = ankle_profile(trace.gait, side, FINE.size)
    if profile is None:
        raise ValueError(f"the torques of {trace.gait.name} are not known")
    look = trace.look(side)
    ax.plot(to_degrees(profile[:, 0]), profile[:, 1], **look)
    ax.plot(to_degrees(profile[0, 0]), profile[0, 1], "o", color=look["color"], markersize=4)
    slope, offset = ankle_line(profile)
    ends = np.array([profile[:, 0].min(), profile[:, 0].max()])
    colour = "black" if trace.order is None else look["color"]
    ax.plot(to_degrees(ends), offset + slope * ends, color=colour, linewidth=0.9, linestyle=":")
    return slope


def _recorded_slopes(trace: Trace, side: Side) -> str:
    """Return mean and range of the slopes of recorded stances, "" without any."""
    if trace.recorded is None:
        return ""
    slopes = [ankle_line(each)[0] for each in recorded_ankle_profiles(trace.recorded, side)]
    if not slopes:
        return ""
    return f"\nrecorded {np.mean(slopes):.0f} ({min(slopes):.0f} to {max(slopes):.0f})"
