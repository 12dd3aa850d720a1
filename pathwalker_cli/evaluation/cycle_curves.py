"""What is drawn over the gait cycle: angles, forces, moments and activations, one panel per side.

Flexion, dorsiflexion and forward lean are positive angles, as gait laboratories plot them;
moments are internal ones, extension and plantarflexion positive.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
from matplotlib.axes import Axes

from pathwalker_cli.conventions import (
    COORDINATES,
    GENERATORS,
    LEG_JOINTS,
    SUFFIX,
    Side,
    to_degrees,
)
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.evaluation.traces import Trace
from pathwalker_cli.inverse.cycles import POINTS
from pathwalker_cli.stride.figures.curves import CLINICAL_ANGLE, EXTENSION, Band
from pathwalker_cli.stride.figures.style import dress, percent_axis, zero_line

__all__ = [
    "ACTIVATIONS",
    "ANGLES",
    "FORCES",
    "MOMENTS",
    "CycleCurve",
    "draw_cycle",
    "dress_cycle",
    "known_curves",
]

PERCENT: Final = np.linspace(0.0, 100.0, POINTS)
FINE: Final = np.linspace(0.0, 100.0, 301)
"""Positions in the gait cycle [%] of recorded and of computed curves, which are smooth."""

Lines = tuple[np.ndarray, ...]


@dataclass(frozen=True)
class CycleCurve:
    """A quantity over the gait cycle of a side.

    Args:
        key: Its name in files.
        name: Its name for people, e.g. "hip".
        label: Label of the y axis with its unit.
        lines: Its curves of a gait, each of shape (len(FINE),), in the unit of the label; none if
            the gait does not tell.
        recorded: Curves of recordings in the unit of the label, shape (cycles, POINTS); None for
            what nobody records.
        midline: Whether it belongs to no side, so that the title names the cycle.
        zero: Whether zero is of interest.
        least_in_stance: Whether a dot marks the least value of stance.
    """

    key: str
    name: str
    label: str
    lines: Callable[[Gait, Side], Lines]
    recorded: Callable[[RecordedGait, Side], np.ndarray] | None = None
    midline: bool = False
    zero: bool = True
    least_in_stance: bool = False

    def title(self, side: Side) -> str:
        """Return the title of the panel of a side."""
        return (
            f"{self.name}, {side} cycle" if self.midline else f"{side} {self.name}"
        ).capitalize()


def draw_cycle(ax: Axes, curve: CycleCurve, shown: Sequence[Trace], side: Side) -> None:
    """Draw a quantity of one side of every gait over its recorded range, with the toe-offs."""
    if curve.zero:
        zero_line(ax)
    for trace in shown:
        if curve.recorded is not None and trace.recorded is not None:
            _draw_recorded(ax, trace, curve.recorded(trace.recorded, side))
    for trace in shown:
        look = trace.look(side)
        for line in curve.lines(trace.gait, side):
            ax.plot(FINE, line, **look)
            if curve.least_in_stance:
                _mark_least(ax, trace, line, side)
        ax.axvline(_toe_off(trace.gait, side), **(look | {"linewidth": 0.6}))
    percent_axis(ax)


def known_curves(curves: Sequence[CycleCurve], shown: Sequence[Trace]) -> tuple[CycleCurve, ...]:
    """Return the quantities that some gait tells."""
    return tuple(c for c in curves if any(c.lines(trace.gait, "right") for trace in shown))


def dress_cycle(ax: Axes, curve: CycleCurve, side: Side, label: bool) -> None:
    """Give a low panel its title and, if wanted, the label of its y axis in two lines."""
    dress(ax, curve.title(side), y=curve.label if label else "")
    ax.set_xlabel(f"{side} gait cycle [%]")
    ax.locator_params(axis="y", nbins=4)


def _draw_recorded(ax: Axes, trace: Trace, curves: np.ndarray) -> None:
    """Draw recorded range and mean."""
    if len(curves) == 0:
        return
    band = Band.over(PERCENT, curves)
    ax.fill_between(band.percent, band.low, band.high, **trace.band)
    for line in (band.mean,) if trace.order is None else (band.low, band.high):
        ax.plot(band.percent, line, **trace.edge)


def _mark_least(ax: Axes, trace: Trace, line: np.ndarray, side: Side) -> None:
    """Mark the least value between foot strike and toe-off."""
    row = int(np.argmin(line[: np.searchsorted(FINE, _toe_off(trace.gait, side))]))
    ax.plot(FINE[row], line[row], "o", color=trace.look(side)["color"], markersize=4.0)


def _toe_off(gait: Gait, side: Side) -> float:
    """Return the position of the toe-off in the gait cycle [%]."""
    return 100.0 * (gait.toe_off(side) - gait.strike(side)) / gait.duration


def _angle(joint: str, name: str, label: str) -> CycleCurve:
    factor = CLINICAL_ANGLE.get(joint, 1.0) * float(to_degrees(1.0))
    midline = joint not in CLINICAL_ANGLE

    def coordinate(side: Side) -> str:
        return joint if midline else f"{joint}_{SUFFIX[side]}"

    def lines(gait: Gait, side: Side) -> Lines:
        column = gait.column(coordinate(side))[:, None]
        return (factor * gait.over_cycle(column, side, FINE.size)[:, 0],)

    def recorded(found: RecordedGait, side: Side) -> np.ndarray:
        return factor * found.cycle_angles(side, coordinate(side))

    knee = joint == "knee"  # it is never straight
    return CycleCurve(f"angle_{joint}", name, label, lines, recorded, midline, not knee, knee)


def _force(key: str, axis: int, name: str) -> CycleCurve:
    def lines(gait: Gait, side: Side) -> Lines:
        if gait.force is None:
            return ()
        force = gait.over_cycle(gait.force[side], side, FINE.size)
        return (100.0 / gait.walker.weight * force[:, axis],)

    def recorded(found: RecordedGait, side: Side) -> np.ndarray:
        curves = found.cycle_forces(side)
        return 100.0 / found.walker.weight * curves[:, :, axis] if len(curves) else curves

    return CycleCurve(key, name, "force [% body weight]", lines, recorded)


def _moment(joint: str, label: str) -> CycleCurve:
    def lines(gait: Gait, side: Side) -> Lines:
        if gait.net_torque is None:
            return ()
        column = gait.net_torque[:, [COORDINATES.index(f"{joint}_{SUFFIX[side]}")]]
        factor = EXTENSION[joint] / gait.walker.total_mass
        return (factor * gait.over_cycle(column, side, FINE.size)[:, 0],)

    def recorded(found: RecordedGait, side: Side) -> np.ndarray:
        factor = EXTENSION[joint] / found.walker.total_mass
        return factor * found.cycle_moments(side, f"{joint}_{SUFFIX[side]}")

    return CycleCurve(f"moment_{joint}", f"{joint} moment", label, lines, recorded)


def _activation(joint: str, up: str, down: str) -> CycleCurve:
    """Return the activation of an antagonistic pair: one upward, the other downward."""
    midline = joint not in LEG_JOINTS

    def lines(gait: Gait, side: Side) -> Lines:
        if gait.activation is None:
            return ()
        suffix = "" if midline else f"_{SUFFIX[side]}"
        columns = [GENERATORS.index(f"{joint}_{way}{suffix}") for way in (up, down)]
        found = gait.over_cycle(gait.activation[:, columns], side, FINE.size)
        return found[:, 0], -found[:, 1]

    name, ways = ("trunk", "ext. +, bend -") if midline else (joint, "ext. +, flex. -")
    return CycleCurve(
        f"activation_{joint}", f"{name} muscles", f"{ways} [1]", lines, midline=midline
    )


ANGLES: Final = (
    _angle("pelvis_tilt", "pelvis", "forward tilt [deg]"),
    _angle("hip", "hip", "flexion [deg]"),
    _angle("knee", "knee", "flexion [deg]"),
    _angle("ankle", "ankle", "dorsiflexion [deg]"),
    _angle("lumbar", "trunk", "forward lean [deg]"),
)
FORCES: Final = (
    _force("force_vertical", 1, "vertical force"),
    _force("force_forward", 0, "fore-aft force"),
)
MOMENTS: Final = (
    _moment("hip", "extension [N m/kg]"),
    _moment("knee", "extension [N m/kg]"),
    _moment("ankle", "plantarflexion [N m/kg]"),
)
# `lumbar_flexion` extends the trunk, see `conventions.GENERATORS`.
ACTIVATIONS: Final = (
    *(_activation(joint, "extension", "flexion") for joint in LEG_JOINTS),
    _activation("lumbar", "flexion", "extension"),
)
