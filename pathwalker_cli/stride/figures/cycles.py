"""Figures of angles, moments, ground forces and activations over the gait cycle of each side."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from itertools import product
from typing import Any, Final

import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.markers import TICKDOWN

from pathwalker_cli.conventions import GENERATORS, LEG_JOINTS, SIDES, SUFFIX, Side, to_degrees
from pathwalker_cli.errors import InputError
from pathwalker_cli.model.contact import TIPS
from pathwalker_cli.stride.figures import style
from pathwalker_cli.stride.figures.curves import (
    ANGLES,
    FORCES,
    MOMENTS,
    Band,
    CycleCurve,
    Reference,
)
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import Stride, own_cycle, stride_of

_ANGLES: Final = {"pelvis_tilt_*": "Pelvis", "hip_*": "Hip", "knee_*": "Knee", "ankle_*": "Ankle",
                  "lumbar_*": "Trunk against pelvis"}  # fmt: skip
_MOMENTS: Final = {"hip_*": "Hip, extension +", "knee_*": "Knee, extension +",
                   "ankle_*": "Ankle, plantarflexion +"}  # fmt: skip
_FORCES: Final = {"foot_*_z": "Vertical, up +", "foot_*_x": "Fore-aft, forward +"}
"""Names of bands, with a star for the side, and titles of the panels."""


def joint_angles(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return pelvis, hip, knee, ankle and lumbar angles over the gait cycle of each side.

    Flexion, dorsiflexion and forward lean are positive, as gait laboratories plot them.
    """
    bands, fig = reference.angles if reference else {}, style.new_figure(3.9)
    panels = fig.subplots(3, 2).ravel()
    handles = _draw(panels, series, ANGLES, _ANGLES, bands, lambda curve: curve.label)
    style.legend_panel(panels[-1], handles)
    return fig


def joint_moments(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return net moments at hip, knee and ankle over the gait cycle of each side.

    Internal moments, of muscles, tissue and orthosis on the joint, over mass with the orthosis;
    extension and plantarflexion are positive.  Thin lines at the ankle are the part of the
    orthosis, dotted ones that of passive tissue.  Ticks above mark where heel or toe of the own
    foot comes down or leaves the ground: a rigid foot changes its support at once, and moments
    have their teeth there on any mesh.
    """
    bands, fig = reference.moments if reference else {}, style.new_figure(2.9)
    panels = fig.subplots(2, 2).ravel()
    handles = _draw(panels, series, MOMENTS, _MOMENTS, bands, lambda curve: "net moment [N m/kg]")
    if series.walker.device.worn:
        torques = MOMENTS[-1].factor(series.walker) * series.orthosis_torque
        for side, torque in zip(SIDES, torques.T, strict=True):
            if side not in series.walker.device.elements:
                continue
            _draw_side(panels[2], series, side, torque, linewidth=0.7)
        handles.append(style.entry("thin: orthosis alone", linewidth=0.7))
    stride = stride_of(series)
    for ax in panels[: len(MOMENTS)]:
        for side in SIDES:
            ticks = {"marker": TICKDOWN, "markersize": 3.5, "linestyle": ""}
            at = support_changes(stride, side)
            look = style.side_line(side) | ticks
            ax.plot(at, np.ones_like(at), transform=ax.get_xaxis_transform(), **look)
    handles.append(style.entry("ticks: new support", marker=TICKDOWN, linestyle=""))
    dotted = {"linewidth": 0.9, "linestyle": ":"}
    for ax, curve, joint in zip(panels, MOMENTS, LEG_JOINTS, strict=False):
        for side in SIDES:
            if (torque := series.passive_torque.get(f"{joint}_{SUFFIX[side]}")) is not None:
                _draw_side(ax, series, side, curve.factor(series.walker) * torque, **dotted)
    if series.passive_torque:
        handles.append(style.entry("dotted: tissue alone", **dotted))
    style.legend_panel(panels[-1], handles)
    return fig


def support_changes(stride: Stride, side: Side) -> np.ndarray:
    """Return where a heel or toe of a foot meets or leaves the ground in its own cycle [%]."""
    strike, rows = stride.strike(side), stride.walker.pattern.rows(side)
    foot = stride.contacts[:, rows]
    changed = (foot != np.roll(foot, -1, axis=0)).any(axis=1)
    later = (stride.time[changed] - strike) % stride.duration
    return np.sort(100.0 * later / stride.duration)


def toe_joints(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return angle and torque of the toe joints, and the load of the tips, over the gait cycle.

    Extension and the torque that resists it are positive.

    Raises:
        InputError: If no joint carries the toes.
    """
    walker = series.walker
    if not walker.parts.toes:
        raise InputError("these feet have no toe joints", allowed="model.toes true")
    fig = style.new_figure(2.9)
    panels = fig.subplots(2, 2).ravel()
    tips = dict(zip(SIDES, series.force[:, walker.pattern.upward(TIPS)].T, strict=True))
    for side in SIDES:
        toe = f"mtp_{SUFFIX[side]}"
        _draw_side(panels[0], series, side, -to_degrees(series.column(toe)))
        torque = series.net_torque[:, walker.skeleton.index(toe)]
        _draw_side(panels[1], series, side, torque / walker.total_mass)
        _draw_side(panels[2], series, side, 100.0 * tips[side] / walker.weight)
    titles = {"Toes, extension +": "extension [deg]", "Toe joint, flexing +": "moment [N m/kg]",
              "Tips of the toes": "force [% body weight]"}  # fmt: skip
    _dress_cycles(panels, series, titles)
    return fig


def cuffs(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return what shells do to the leg over the gait cycle of each side that wears one.

    How much further than the hinge the ankle is dorsiflexed, the force of the cuff on shin (+) or
    calf, and how far the cuff is up the leg from where it was fitted.

    Raises:
        InputError: If no orthosis is a body of its own.
    """
    walker = series.walker
    if not walker.shelled:
        raise InputError("there is no orthosis of its own", allowed="model.orthosis body")
    fig = style.new_figure(2.9)
    panels = fig.subplots(2, 2).ravel()
    for side in walker.shelled:
        ankle, hinge = (series.column(f"{name}_{SUFFIX[side]}") for name in ("ankle", "hinge"))
        _draw_side(panels[0], series, side, to_degrees(hinge - ankle))
        across = series.cuff_force[:, 2 * SIDES.index(side)]
        _draw_side(panels[1], series, side, -100.0 * across / walker.weight)
        _draw_side(panels[2], series, side, 1000.0 * series.cuff_shift(side)[:, 1])
    titles = {"Ankle beyond the hinge": "dorsiflexion [deg]",
              "Cuff, shin +, calf -": "force [% body weight]",
              "Cuff up the leg": "pistoning [mm]"}  # fmt: skip
    _dress_cycles(panels, series, titles)
    return fig


def _dress_cycles(panels: Sequence[Axes], series: GaitSeries, titles: Mapping[str, str]) -> None:
    """Give panels their titles, labels and events; the last one is the legend's."""
    for ax, (title, label) in zip(panels, titles.items(), strict=False):
        style.dress(ax, title, y=label)
        style.zero_line(ax)
        for side in SIDES:
            style.toe_off_line(ax, own_cycle(series, side))
        style.percent_axis(ax)
    style.legend_panel(panels[-1], [*style.side_handles(), style.events_handle()])


def ground_forces(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return vertical and fore-aft ground reaction forces on each foot over its gait cycle."""
    bands, fig = reference.forces if reference else {}, style.new_figure(2.1)
    panels = fig.subplots(1, 2)
    handles = _draw(
        panels, series, FORCES, _FORCES, bands, lambda curve: f"{curve.name} [% body weight]"
    )
    style.legend(fig, handles)
    return fig


def _draw(
    panels: Sequence[Axes], series: GaitSeries, curves: Sequence[CycleCurve],
    titles: Mapping[str, str], bands: Mapping[str, Band], label: Callable[[CycleCurve], str],
) -> list[Artist]:  # fmt: skip
    """Draw a quantity per panel over both sides' own cycles; return the entries of the legend."""
    stride = stride_of(series)
    for ax, curve, (name, title) in zip(panels, curves, titles.items(), strict=False):
        for side in SIDES:
            if (band := bands.get(name.replace("*", SUFFIX[side]))) is not None:
                _draw_band(ax, band, side, float(curve.factor(series.walker)))
        style.dress(ax, title, y=label(curve))
        style.zero_line(ax)
        for side in SIDES:
            _draw_side(ax, series, side, curve.columns(stride, side)[:, 0])
            style.toe_off_line(ax, own_cycle(series, side))
        style.percent_axis(ax)
    recorded = [style.band_handle()] if bands else []
    return [*style.side_handles(), style.events_handle(), *recorded]


def _draw_side(ax: Axes, series: GaitSeries, side: Side, values: np.ndarray, **more: Any) -> None:
    cycle, look = own_cycle(series, side), style.side_line(side)
    ax.plot(cycle.percent, values[cycle.index], **(look | more))


def _draw_band(ax: Axes, band: Band, side: Side, factor: float) -> None:
    """Draw a recorded range and its mean in the unit of the panel."""
    look = {**style.side_line(side), "alpha": 0.6}
    low, high = sorted((factor * band.low, factor * band.high), key=lambda each: each.mean())
    ax.fill_between(band.percent, low, high, color=look["color"], alpha=0.15, linewidth=0)
    for edge in (low, high):  # so that the ranges of both sides differ without colour too
        ax.plot(band.percent, edge, linewidth=0.4, **look)
    ax.plot(band.percent, factor * band.mean, linewidth=0.7, **look)


def activations(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return activation and excitation of every generator over the gait cycle of its side."""
    fig = style.new_figure(4.6)
    grid = fig.subplots(4, 4, sharex=True, sharey=True)
    columns = tuple(product(SIDES, ("extension", "flexion")))
    for row, joint in zip(grid, LEG_JOINTS, strict=False):
        for ax, (side, direction) in zip(row, columns, strict=True):
            name = f"{joint}_{direction}_{SUFFIX[side]}"
            _draw_generator(ax, series, name, side, f"{side.capitalize()} {joint}\n{direction}")
    _draw_generator(grid[-1][0], series, "lumbar_extension", "right", "Trunk\nforward")
    _draw_generator(grid[-1][1], series, "lumbar_flexion", "right", "Trunk\nbackward")
    for row in grid:
        row[0].set_ylabel("activation [1]", labelpad=2.0)
    for top, ax in zip(grid[-2][2:], grid[-1][2:], strict=True):  # two panels have no generator
        ax.axis("off")
        style.percent_axis(top, "own cycle\n[%]")
        top.xaxis.set_tick_params(labelbottom=True)
    for ax in grid[-1][:2]:
        style.percent_axis(ax, "right cycle\n[%]")
    grid[0][0].set_ylim(-0.03, 1.05)
    grid[0][0].set_yticks([0.0, 0.5, 1.0])
    thin = style.entry("thin: excitation", linewidth=0.6)
    style.legend(fig, [*style.side_handles(), thin, style.events_handle()])
    return fig


def _draw_generator(ax: Axes, series: GaitSeries, name: str, side: Side, title: str) -> None:
    column, thin = GENERATORS.index(name), {"linewidth": 0.6, "linestyle": "-"}
    style.dress(ax, title)
    _draw_side(ax, series, side, series.excitation[:, column], **thin)
    _draw_side(ax, series, side, series.activation[:, column])
    style.toe_off_line(ax, own_cycle(series, side))
