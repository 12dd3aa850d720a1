"""Figures 1 to 7 of the article, drawn from our results."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Final

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.evaluation.curves import ANGLES, FORCES, CycleCurve, Trace
from pathwalker_cli.evaluation.figures import ankle_figure, cycle_figure
from pathwalker_cli.reproduce.muscle_figures import (
    activation_figure,
    curve_figure,
    muscle_torque_figure,
)
from pathwalker_cli.reproduce.results import ProblemResult, Results
from pathwalker_cli.stride.figures import orthosis_curves
from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.figures.style import STYLE
from pathwalker_cli.stride.series import GaitSeries

__all__ = ["save_paper_figures"]

_NAMES: Final = {
    "ls-barefoot": "LS-Barefoot",
    "mapd-barefoot": "MAPD-Barefoot",
    "mapd-orthosis": "MAPD-Orthosis",
    "mapd-ws-orthosis": "MAPD-WS-Orthosis",
    "mapd-healthy": "MAPD-Healthy",
}
_ARTICLE: Final = ("mapd-orthosis", "mapd-barefoot", "ls-barefoot")
"""Problems that figures 3 and 4 of the article show."""
_BEYOND: Final = ("mapd-ws-orthosis", "mapd-healthy")
"""Problems whose curves the article leaves to its supplement or out."""


@dataclass(frozen=True)
class _Plan:
    """One figure to be drawn."""

    name: str
    caption: str
    make: Callable[[], Figure]


def save_paper_figures(results: Results, folder: Path) -> tuple[tuple[str, str], ...]:
    """Save the figures that the results allow as PNG and SVG.

    Args:
        results: What was computed.
        folder: Where; made if it does not exist.

    Returns:
        PNG file name and caption of every figure.
    """
    saved = []
    for plan in _plans(results):
        with mpl.rc_context(STYLE):
            figure = plan.make()
        save_formats(figure, folder, plan.name)
        saved.append((f"{plan.name}.png", plan.caption))
    return tuple(saved)


def _plans(results: Results) -> Iterator[_Plan]:
    """Yield what can be drawn, in the order of the article."""
    solved = {name: each for name, each in results.problems.items() if each.converged}
    yield _Plan(
        "figure-1",
        "Figure 1: active torque over angle and torque over angular velocity of the muscle torque "
        "generators, as shares of the maximum isometric torque.",
        curve_figure,
    )
    if "mapd-orthosis" in solved:
        yield _orthosis(solved["mapd-orthosis"])
    yield from _kinds(solved, "figure-3", "joint angles", ANGLES)
    yield from _kinds(solved, "figure-4", "ground reaction forces", FORCES)
    if {"mapd-barefoot", "mapd-orthosis"} <= solved.keys():
        gaits = tuple(_series(solved[name]) for name in ("mapd-barefoot", "mapd-orthosis"))
        yield _Plan(
            "figure-5",
            "Figure 5: torques of the muscles, MAPD-Barefoot and MAPD-Orthosis, and the torque "
            "of the orthoses at the ankles. Extension and plantarflexion are positive.",
            lambda: muscle_torque_figure(*gaits),
        )
        yield _Plan(
            "figure-6",
            "Figure 6: muscle activations and neural excitations, MAPD-Barefoot and MAPD-Orthosis.",
            lambda: activation_figure(*gaits),
        )
    if "mapd-orthosis" in solved:
        trace = _trace(solved["mapd-orthosis"])
        yield _Plan(
            "figure-7",
            "Figure 7: net ankle torque over ankle angle in stance, MAPD-Orthosis and recordings "
            "with orthoses.",
            lambda: ankle_figure(trace),
        )


def _orthosis(result: ProblemResult) -> _Plan:
    """Return the plan of figure 2."""
    series = _series(result)
    caption = "Figure 2: torque over angle of the orthoses, with the springs of MAPD-Orthosis."
    return _Plan("figure-2", caption, lambda: orthosis_curves(series))


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
            caption = f"{number}, {_NAMES[problem]}{beyond}: {what}{band}."
            yield _Plan(f"{name}-{problem}", caption, partial(cycle_figure, trace, curves))


def _series(result: ProblemResult) -> GaitSeries:
    """Return the stride of a converged problem."""
    if result.series is None:
        raise ValueError(f"{result.problem} did not converge")
    return result.series


def _trace(result: ProblemResult) -> Trace:
    """Return the gait of a converged problem over the recordings."""
    if result.evaluation is None:
        raise ValueError(f"{result.problem} did not converge")
    gait = result.evaluation.gait
    return Trace(gait, gait.problem, result.evaluation.recorded)
