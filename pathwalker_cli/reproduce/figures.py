"""Figures 1 to 7 of the article, drawn from our results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from pathwalker_cli.conventions import GENERATORS, LEG_JOINTS, SIDES, SUFFIX, Side, to_degrees
from pathwalker_cli.evaluation.curves import Trace
from pathwalker_cli.evaluation.figures import ankle_figure, cycle_figure
from pathwalker_cli.model.elements.muscle import generators
from pathwalker_cli.reproduce.results import ProblemResult, Results
from pathwalker_cli.reproduce.words import SUBJECTS
from pathwalker_cli.stride.figures import orthosis_curves, style
from pathwalker_cli.stride.figures.curves import (
    ANGLES,
    CLINICAL_ANGLE,
    EXTENSION,
    FORCES,
    CycleCurve,
)
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.series import GaitSeries
from pathwalker_cli.stride.stride import own_cycle

_ARTICLE: Final = ("mapd-orthosis", "mapd-barefoot", "ls-barefoot")
"""Problems that figures 3 and 4 of the article show."""
_BEYOND: Final = ("mapd-ws-orthosis", "mapd-healthy")
"""Problems whose curves the article leaves to its supplement or out."""


_Plan = tuple[str, str, Callable[[], Figure]]
"""Name and caption of a figure, and what draws it."""


def save_paper_figures(results: Results, folder: Path) -> tuple[tuple[str, str], ...]:
    """Save the figures that the results allow as PNG and SVG.

    Returns:
        PNG file name and caption of every figure.
    """
    saved = []
    for name, caption, make in _plans(results):
        with mpl.rc_context(style.STYLE):
            figure = make()
        save_formats(figure, folder, name)
        saved.append((f"{name}.png", caption))
    return tuple(saved)


def _plans(results: Results) -> Iterator[_Plan]:
    """Yield what can be drawn, in the order of the article."""
    solved = {name: each for name, each in results.problems.items() if each.converged}
    caption = (
        "Figure 1: active torque over angle and torque over angular velocity of the muscle torque "
        "generators, as shares of the maximum isometric torque."
    )
    yield "figure-1", caption, curve_figure
    if "mapd-orthosis" in solved:
        caption = "Figure 2: torque over angle of the orthoses, with the springs of MAPD-Orthosis."
        yield "figure-2", caption, partial(orthosis_curves, _series(solved["mapd-orthosis"]))
    yield from _kinds(solved, "figure-3", "joint angles", ANGLES)
    yield from _kinds(solved, "figure-4", "ground reaction forces", FORCES)
    if {"mapd-barefoot", "mapd-orthosis"} <= solved.keys():
        gaits = tuple(_series(solved[name]) for name in ("mapd-barefoot", "mapd-orthosis"))
        caption = (
            "Figure 5: torques of the muscles, MAPD-Barefoot and MAPD-Orthosis, and the torque of "
            "the orthoses at the ankles. Extension and plantarflexion are positive."
        )
        yield "figure-5", caption, partial(muscle_torque_figure, *gaits)
        caption = (
            "Figure 6: muscle activations and neural excitations, MAPD-Barefoot and MAPD-Orthosis."
        )
        yield "figure-6", caption, partial(activation_figure, *gaits)
    if "mapd-orthosis" in solved:
        caption = (
            "Figure 7: net ankle torque over ankle angle in stance, MAPD-Orthosis and recordings "
            "with orthoses."
        )
        yield "figure-7", caption, partial(ankle_figure, _trace(solved["mapd-orthosis"]))


def _kinds(
    solved: Mapping[str, ProblemResult], name: str, what: str, curves: Sequence[CycleCurve]
) -> Iterator[_Plan]:
    """Yield one figure per problem of what the article shows in one figure."""
    number = name.replace("figure-", "Figure ")
    for problem in (*_ARTICLE, *_BEYOND):
        if problem in solved:
            trace = _trace(solved[problem])
            beyond = " (not in the article's main text)" if problem in _BEYOND else ""
            band = "" if trace.recorded is None else ", over the recorded range"
            caption = f"{number}, {SUBJECTS[problem]}{beyond}: {what}{band}."
            yield f"{name}-{problem}", caption, partial(cycle_figure, trace, curves)


def _series(result: ProblemResult) -> GaitSeries:
    """Return the stride of a converged problem."""
    if result.series is None:
        raise ValueError(f"{result.run.config.problem} did not converge")
    return result.series


def _trace(result: ProblemResult) -> Trace:
    """Return the gait of a converged problem over the recordings."""
    if result.evaluation is None:
        raise ValueError(f"{result.run.config.problem} did not converge")
    gait = result.evaluation.gait
    return Trace(gait, gait.problem, result.evaluation.recorded)


_BAREFOOT: Final = {"color": "#D55E00", "linestyle": "--"}
_ORTHOSIS: Final = {"color": "#0072B2", "linestyle": "-"}
"""Looks of the two gaits, told apart with any colour vision and without colour."""
_DIRECTIONS: Final = ("extension", "flexion")
_LOOK: Final = {"extension": _ORTHOSIS, "flexion": _BAREFOOT}
_ANGLES: Final = {"hip": (-40.0, 115.0), "knee": (-20.0, 115.0), "ankle": (-60.0, 60.0)}
"""Flexion and dorsiflexion over which curves are drawn [deg]."""
_TORQUE: Final = "muscle torque [N m]"
_LARGEST_SPEED: Final = 12.0
"""Angular velocity up to which curves are drawn [rad/s]."""


def curve_figure() -> Figure:
    """Return the torque-angle and torque-velocity curves of hip, knee and ankle.

    Shares of the maximum isometric torque; flexion and dorsiflexion angles are positive, and so is
    the velocity of shortening.
    """
    fig = style.new_figure(4.4)
    grid = fig.subplots(3, 2, sharey="col")
    by_name = {each.name: each for each in generators()}
    angle, speed = np.linspace(-2.0, 2.0, 401), np.linspace(-_LARGEST_SPEED, _LARGEST_SPEED, 401)
    for row, joint in enumerate(LEG_JOINTS):
        for direction in _DIRECTIONS:
            generator, look = by_name[f"{joint}_{direction}_r"], _LOOK[direction]
            shown = CLINICAL_ANGLE[joint] * to_degrees(angle)
            force = np.array([float(generator.angle_factor(q)) for q in angle])
            grid[row][0].plot(shown, force, **look)
            velocity = generator.torque_sign * speed
            share = np.array([float(generator.velocity_factor(v)) for v in velocity])
            grid[row][1].plot(speed, share, **look)
        grid[row][0].set_xlim(*_ANGLES[joint])
        flexion = "dorsiflexion" if joint == "ankle" else "flexion"
        title, speeds = joint.capitalize(), "shortening velocity\n[rad/s]"
        style.dress(grid[row][0], title, f"{flexion} [deg]", "torque-angle factor [1]")
        style.dress(grid[row][1], title, speeds, "torque-velocity factor [1]")
    style.legend(fig, [style.entry(name, **_LOOK[name]) for name in _DIRECTIONS])
    return fig


def muscle_torque_figure(barefoot: GaitSeries, orthosis: GaitSeries) -> Figure:
    """Return the muscle torques of both gaits at hip, knee and ankle of each side.

    Extension and plantarflexion are positive; the torque of the orthoses is drawn thin.
    """
    fig = style.new_figure(4.2)
    grid = fig.subplots(3, 2, sharex=True, sharey="row")
    for column, side in enumerate(SIDES):
        for ax, joint in zip(grid[:, column], LEG_JOINTS, strict=True):
            style.dress(ax, f"{side.capitalize()} {joint}", y="" if column else _TORQUE)
            style.zero_line(ax)
            for series, look in ((barefoot, _BAREFOOT), (orthosis, _ORTHOSIS)):
                for direction in _DIRECTIONS:
                    name = f"{joint}_{direction}_{SUFFIX[side]}"
                    torque = series.muscle_torque[:, GENERATORS.index(name)]
                    _draw(ax, series, side, EXTENSION[joint] * torque, look)
            if joint == "ankle":
                own = orthosis.orthosis_torque[:, SIDES.index(side)]
                _draw(ax, orthosis, side, own, {"color": style.NEUTRAL, "linewidth": 0.7})
            style.percent_axis(ax, *([] if joint == LEG_JOINTS[-1] else [""]))
    style.legend(fig, [*_gait_handles(), style.entry("thin: orthosis", linewidth=0.7)])
    return fig


def activation_figure(barefoot: GaitSeries, orthosis: GaitSeries) -> Figure:
    """Return activations and excitations of both gaits for the muscles of each leg."""
    fig = style.new_figure(3.8)
    grid = fig.subplots(3, 4, sharex=True, sharey=True)
    columns = [(side, direction) for side in SIDES for direction in _DIRECTIONS]
    for row, joint in zip(grid, LEG_JOINTS, strict=True):
        for ax, (side, direction) in zip(row, columns, strict=True):
            name = f"{joint}_{direction}_{SUFFIX[side]}"
            column = GENERATORS.index(name)
            style.dress(ax, f"{side.capitalize()} {joint}\n{direction}",
                  y="activation [1]" if (side, direction) == columns[0] else "")  # fmt: skip
            for series, look in ((barefoot, _BAREFOOT), (orthosis, _ORTHOSIS)):
                thin = {**look, "linewidth": 0.6, "alpha": 0.7}
                _draw(ax, series, side, series.excitation[:, column], thin)
                _draw(ax, series, side, series.activation[:, column], look)
            style.percent_axis(ax, "own cycle\n[%]" if joint == LEG_JOINTS[-1] else "")
    grid[0][0].set_ylim(-0.03, 1.05)
    style.legend(fig, [*_gait_handles(), style.entry("thin: excitation", linewidth=0.6)])
    return fig


def _draw(
    ax: Axes, series: GaitSeries, side: Side, values: np.ndarray, look: Mapping[str, object]
) -> None:
    """Draw a curve over the gait cycle of a side."""
    cycle = own_cycle(series, side)
    ax.plot(cycle.percent, values[cycle.index], **look)  # type: ignore[arg-type]


def _gait_handles() -> list[Artist]:
    looks = {"MAPD-Barefoot": _BAREFOOT, "MAPD-Orthosis": _ORTHOSIS}
    return [style.entry(label, **look) for label, look in looks.items()]
