"""How gaits look over the gait cycle and the stance of a side, one panel per side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes

from pathwalker_cli.conventions import Side, to_degrees
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import Band, CycleCurve
from pathwalker_cli.stride.measures import ankle_line
from pathwalker_cli.stride.stride import POINTS, Stride

FINE: Final = 301
"""Points of computed curves, which are smooth; recorded ones have `POINTS`."""

_COLOURS: Final = ("#000000", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of the palette by Okabe and Ito that stand for no side."""

_STYLES: Final = ("-", (0, (3.2, 1.4)), (0, (5.0, 1.2, 1.0, 1.2)), (0, (1.0, 1.0)))
"""Line styles; as many as share no divisor with the colours, so that 20 gaits differ."""

_BAND, _RECORDED = "#cccccc", "#999999"


@dataclass(frozen=True)
class Trace:
    """A gait in a figure whose panels show one side each.

    Args:
        gait: The gait.
        label: Its name in the legend.
        recorded: Recordings to draw behind it, or None.
        order: Its place among several gaits; None for a gait alone, which takes the look of the
            side.
    """

    gait: Stride
    label: str
    recorded: RecordedGait | None = None
    order: int | None = None

    def look(self, side: Side) -> dict[str, Any]:
        """Return colour and line style of its curve."""
        if self.order is None:
            return {"color": style.LINE_COLOUR[side], "linestyle": style.LINE_STYLE[side]}
        colour = _COLOURS[self.order % len(_COLOURS)]
        return {"color": colour, "linestyle": _STYLES[self.order % len(_STYLES)]}

    @property
    def band(self) -> dict[str, Any]:
        """Return the look of the recorded range."""
        if self.order is None:
            return {"color": _BAND, "linewidth": 0}
        return {"color": self.look("right")["color"], "alpha": 0.14, "linewidth": 0}

    @property
    def edge(self) -> dict[str, Any]:
        """Return the look of the recorded mean, and of the edges of ranges that may overlap."""
        if self.order is None:
            return {"color": style.NEUTRAL, "linewidth": 0.7}
        return {**self.look("right"), "linewidth": 0.6, "alpha": 0.6}


def traces(
    gaits: Sequence[Stride],
    labels: Sequence[str],
    recorded: Sequence[RecordedGait | None] | None = None,
) -> tuple[Trace, ...]:
    """Return several gaits that differ in colour and line style."""
    behind = recorded or [None] * len(gaits)
    rows = zip(gaits, labels, behind, strict=True)
    return tuple(
        Trace(gait, _printable(label), recordings, order=i)
        for i, (gait, label, recordings) in enumerate(rows)
    )


def _printable(label: str) -> str:
    """Return a label that Matplotlib takes as it stands: no formula, no hidden entry.

    Names of folders may hold anything.
    """
    printable = "".join(c if c.isprintable() else "?" for c in label).replace("$", r"\$")
    return f" {printable}" if printable.startswith("_") else printable


def draw_cycle(ax: Axes, curve: CycleCurve, shown: Sequence[Trace], side: Side) -> None:
    """Draw a quantity of one side of every gait over its recorded range, with the toe-offs."""
    if curve.zero:
        style.zero_line(ax)
    for trace in shown:
        if band := recorded_band(trace.recorded, curve, side):
            _draw_range(ax, trace, band)
    percent = np.linspace(0.0, 100.0, FINE)
    for trace in shown:
        look, toe_off = trace.look(side), toe_off_percent(trace.gait, side)
        for line in curve.lines(trace.gait, side, FINE):
            ax.plot(percent, line, **look)
            if curve.least_in_stance:
                row = int(np.argmin(line[: np.searchsorted(percent, toe_off)]))
                ax.plot(percent[row], line[row], "o", color=look["color"], markersize=4.0)
        ax.axvline(toe_off, **(look | {"linewidth": 0.6}))
    style.percent_axis(ax)


def known_curves(curves: Sequence[CycleCurve], shown: Sequence[Trace]) -> tuple[CycleCurve, ...]:
    """Return the quantities that some gait tells."""
    return tuple(
        c for c in curves if any(len(c.lines(trace.gait, "right", FINE)) for trace in shown)
    )


def dress_cycle(ax: Axes, curve: CycleCurve, side: Side, label: bool) -> None:
    """Give a low panel its title and, if wanted, the label of its y axis in two lines."""
    style.dress(ax, curve.title(side), y=curve.label if label else "")
    ax.set_xlabel(f"{side} gait cycle [%]")
    ax.locator_params(axis="y", nbins=4)


def recorded_band(recorded: RecordedGait | None, curve: CycleCurve, side: Side) -> Band | None:
    """Return mean and range of the recorded cycles of a side, None without any."""
    cycles = recorded.of("stride", side) if recorded else ()
    lines = [line for each in cycles for line in curve.lines(each, side, POINTS)]
    return Band.over(np.linspace(0.0, 100.0, POINTS), np.array(lines)) if lines else None


def _draw_range(ax: Axes, trace: Trace, band: Band) -> None:
    """Draw recorded range and mean."""
    ax.fill_between(band.percent, band.low, band.high, **trace.band)
    for line in (band.mean,) if trace.order is None else (band.low, band.high):
        ax.plot(band.percent, line, **trace.edge)


def toe_off_percent(gait: Stride, side: Side) -> float:
    """Return the position of the toe-off in the gait cycle [%]."""
    strike, toe_off = gait.stance(side)
    return 100.0 * (toe_off - strike) / gait.duration


def draw_ankle(ax: Axes, shown: Sequence[Trace], side: Side) -> None:
    """Draw the profiles of one ankle: recorded ones, each gait's own, the line of its slope.

    Dorsiflexion is positive, and so is the plantarflexing torque of muscles and orthosis.

    Raises:
        NotKnownError: If the torques of a gait are not known.
    """
    style.zero_line(ax)
    for trace in shown:
        _draw_recorded_profiles(ax, trace, side)
    ax.margins(y=0.08 * (2 + len(shown)))  # room for the slopes above the curves
    for i, trace in enumerate(shown):
        slope, alone = _draw_profile(ax, trace, side), trace.order is None
        text = f"slope {slope:.0f} N m/rad{_recorded_slopes(trace, side)}"
        ax.annotate(
            text if alone else f"{slope:.0f} N m/rad",
            (0.03, 0.97),
            (0, -1.3 * style.TEXT * i),
            xycoords="axes fraction",
            textcoords="offset points",
            va="top",
            color="black" if alone else trace.look(side)["color"],
        )


def _draw_recorded_profiles(ax: Axes, trace: Trace, side: Side) -> None:
    """Draw every recorded stance, and behind a gait alone their mean."""
    if trace.recorded is None:
        return
    profiles, alone = trace.recorded.ankle_profiles(side), trace.order is None
    look = {"color": _RECORDED, "linewidth": 0.5} if alone else {**trace.edge, "linewidth": 0.35}
    for each in profiles:
        ax.plot(to_degrees(each[:, 0]), each[:, 1], **look)
    if alone and len(profiles):
        mean = profiles.mean(axis=0)
        ax.plot(to_degrees(mean[:, 0]), mean[:, 1], color=style.NEUTRAL, linewidth=1.1)


def _draw_profile(ax: Axes, trace: Trace, side: Side) -> float:
    """Draw a gait's own profile and the line of its slope; return the slope [N m/rad]."""
    profile, look = trace.gait.ankle_profile(side, FINE), trace.look(side)
    ax.plot(to_degrees(profile[:, 0]), profile[:, 1], **look)
    ax.plot(to_degrees(profile[0, 0]), profile[0, 1], "o", color=look["color"], markersize=4)
    slope, offset = ankle_line(profile)
    ends = np.array([profile[:, 0].min(), profile[:, 0].max()])
    colour = "black" if trace.order is None else look["color"]
    ax.plot(to_degrees(ends), offset + slope * ends, color=colour, linewidth=0.9, linestyle=":")
    return slope


def _recorded_slopes(trace: Trace, side: Side) -> str:
    """Return mean and range of the slopes of recorded stances, "" without any."""
    profiles = () if trace.recorded is None else trace.recorded.ankle_profiles(side)
    slopes = [ankle_line(each)[0] for each in profiles]
    if not slopes:
        return ""
    return f"\nrecorded {np.mean(slopes):.0f} ({min(slopes):.0f} to {max(slopes):.0f})"
