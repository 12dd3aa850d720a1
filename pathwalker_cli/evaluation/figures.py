"""Figures of one gait or several over their recorded ranges, each side in panels of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import matplotlib as mpl
from matplotlib.artist import Artist
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.evaluation.curves import (
    Trace,
    draw_ankle,
    draw_cycle,
    dress_cycle,
    known_curves,
)
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import ACTIVATIONS, ANGLES, FORCES, MOMENTS, CycleCurve
from pathwalker_cli.stride.figures.save import save_formats

PAIR_HEIGHT: Final = 1.15
"""Height of a row of two panels in a column [in]."""
ANKLE_HEIGHT: Final = 2.0 * PAIR_HEIGHT
"""The same of torque over angle, whose slopes shall be seen [in]."""


def cycle_figure(trace: Trace, curves: Sequence[CycleCurve]) -> Figure:
    """Return quantities of both sides over their gait cycles and the recorded range.

    A dot marks the least knee flexion of stance.
    """
    handles = _trace_handles([trace])
    if any(curve.least_in_stance for curve in curves):
        handles.append(_dot("least knee flexion"))
    handles.append(style.events_handle())
    if trace.recorded is not None:
        handles.append(Patch(facecolor="#cccccc", label="recorded: range, mean"))
    fig = cycle_pairs(curves, [trace], _head(len(handles)))
    style.legend(fig, handles)
    return fig


def ankle_figure(trace: Trace) -> Figure:
    """Return the net torque-angle profile of both ankles over stance with its slope over stance.

    Raises:
        NotKnownError: If the torques of the gait are not known.
    """
    handles = [*_trace_handles([trace]), *_ankle_handles()]
    if trace.recorded is not None:
        handles.append(style.entry("recorded stances", color="#999999", linewidth=0.5))
        handles.append(style.entry("their mean", linewidth=1.1))
    fig = ankle_pair([trace], _head(len(handles)))
    style.legend(fig, handles)
    return fig


def cycle_pairs(curves: Sequence[CycleCurve], shown: Sequence[Trace], head: float = 0.0) -> Figure:
    """Return a row of right and left side per quantity, below `head` [in] for a legend."""
    fig = style.new_figure(head + PAIR_HEIGHT * len(curves))
    panels = fig.subplots(len(curves), 2, sharey="row", squeeze=False)
    for row, curve in zip(panels, curves, strict=True):
        for ax, side in zip(row, SIDES, strict=True):
            draw_cycle(ax, curve, shown, side)
            dress_cycle(ax, curve, side, label=side == "right")
    return fig


def ankle_pair(shown: Sequence[Trace], head: float = 0.0) -> Figure:
    """Return the net torque-angle profiles of both ankles, below `head` [in] for a legend."""
    fig = style.new_figure(head + ANKLE_HEIGHT)
    panels = fig.subplots(1, 2, sharex=True, sharey=True)
    for ax, side in zip(panels, SIDES, strict=True):
        draw_ankle(ax, shown, side)
        label = "net plantarflexing torque [N m]" if side == "right" else ""
        style.dress(ax, f"{side.capitalize()} ankle in stance", "dorsiflexion [deg]", label)
    return fig


def save_evaluation_figures(trace: Trace, folder: str | Path) -> tuple[str, ...]:
    """Save the figures that a gait allows as PNG and SVG; return the file names."""
    makers: dict[str, Callable[[], Figure]] = {
        name: partial(cycle_figure, trace, curves)
        for name, curves in {"joint_angles": ANGLES, "ground_forces": FORCES}.items()
        if known_curves(curves, [trace])
    }
    if trace.gait.net_torque is not None:
        makers["ankle_torque"] = partial(ankle_figure, trace)
    return _saved(makers, folder)


def save_overlays(shown: Sequence[Trace], folder: str | Path) -> tuple[str, ...]:
    """Save figures of several gaits over one another as PNG and SVG; return the file names."""
    head = 0.18 * len(shown) + 0.1
    groups = {
        "joint_angles": ANGLES,
        "ground_forces": FORCES,
        "joint_moments": MOMENTS,
        "activations": ACTIVATIONS,
    }
    makers: dict[str, Callable[[], Figure]] = {
        name: partial(cycle_pairs, known, shown, head)
        for name, curves in groups.items()
        if (known := known_curves(curves, shown))
    }
    if all(trace.gait.net_torque is not None for trace in shown):
        makers["ankle_torque"] = partial(ankle_pair, shown, head)

    def dressed(name: str) -> Figure:
        figure = makers[name]()
        extra = _ankle_handles()[:1] if name == "ankle_torque" else []
        style.legend(figure, [*_trace_handles(shown), *extra], columns=1 + (len(shown) > 3))
        return figure

    return _saved({name: partial(dressed, name) for name in makers}, folder)


def _saved(makers: Mapping[str, Callable[[], Figure]], folder: str | Path) -> tuple[str, ...]:
    """Save figures as PNG and SVG; return the file names."""
    saved: list[str] = []
    for name, make in makers.items():
        with mpl.rc_context(style.STYLE):
            figure = make()
        saved += save_formats(figure, folder, name)
    return tuple(saved)


def _head(entries: int) -> float:
    """Return the height that a legend of two columns needs [in]."""
    return 0.15 * ((entries + 1) // 2) + 0.1


def _trace_handles(shown: Sequence[Trace]) -> list[Artist]:
    """Return the entries of the gaits: of one both sides, of several one each."""
    if len(shown) > 1 or shown[0].order is not None:
        return [style.entry(trace.label, **trace.look("right")) for trace in shown]
    names: dict[Side, str] = {"right": f"{shown[0].label}: right", "left": "left"}
    return [style.entry(names[side], **shown[0].look(side)) for side in SIDES]


def _ankle_handles() -> list[Artist]:
    """Return the entries of what only the ankle's profile shows."""
    slope = style.entry("its slope over stance", color="black", linewidth=0.9, linestyle=":")
    return [_dot("foot strike"), slope]


def _dot(label: str) -> Artist:
    return style.entry(label, marker="o", markersize=4, linestyle="")
