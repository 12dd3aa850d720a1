"""The figures of a page: a column wide each, right beside left, runs over one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.evaluation.curves import (
    ACTIVATIONS,
    ANGLES,
    FORCES,
    MOMENTS,
    CycleCurve,
    Trace,
    known_curves,
    traces,
)
from pathwalker_cli.evaluation.figures import ankle_pair, cycle_pairs, legend_handles
from pathwalker_cli.inverse.figures import joint_torque_figure, name_figure
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.patient.blocks import SpringSet
from pathwalker_cli.report.content import Drawing, Section, Shape
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.report.study_files import Spreads
from pathwalker_cli.stride.figures.inline import inline_svg
from pathwalker_cli.stride.figures.style import STYLE, legend, new_figure
from pathwalker_cli.studies.landscape.figures import Chosen, cost_figure
from pathwalker_cli.studies.landscape.result import Landscape
from pathwalker_cli.studies.tradeoff.figures import tradeoff_figure
from pathwalker_cli.studies.tradeoff.result import Tradeoff
from pathwalker_cli.studies.uncertainty.figures import spread_figure


def curve_section(runs: Sequence[ReportRun]) -> Section:
    """Return angles, ground forces, moments, ankle torque over angle and activations."""
    shown = _traces(runs)
    names = " and ".join(trace.label for trace in shown)
    drawings = [
        *(_cycle(curve, shown, names) for curve in (*ANGLES, *FORCES, *MOMENTS)),
        _drawn(
            lambda: ankle_pair(shown),
            "ankle-torque",
            f"Net ankle torque [N m] over dorsiflexion [deg] in stance, right and left: {names}",
            "tall",
        ),
        *(_cycle(curve, shown, names) for curve in known_curves(ACTIVATIONS, shown)),
    ]
    return Section(
        "Curves over the gait cycle",
        ("Each side from its own foot strike to its next one. Dots: least knee flexion of stance; "
         "foot strike at the ankle, where numbers are the slopes of the dotted lines.",),
        legend=_legend(shown),
        drawings=tuple(drawings),
    )  # fmt: skip


def torque_drawing(trials: Sequence[Trial], body_mass: float, name: str, title: str) -> Drawing:
    """Return the recorded joint torques of one condition.

    Args:
        trials: Trials of one condition.
        body_mass: Mass of the patient [kg].
        name: A name that no other figure of the page has.
        title: What it shows.
    """

    def draw() -> Figure:
        figure = joint_torque_figure(trials, body_mass)
        name_figure(figure, f"{trials[0].condition}, {len(trials)} trials")
        return figure

    return _drawn(draw, name, title, "tall")


def landscape_drawing(landscape: Landscape, springs: SpringSet | None, chosen: Chosen) -> Drawing:
    """Return the cost over the springs of a side.

    Args:
        landscape: The landscape.
        springs: Springs that exist, or None.
        chosen: K_D and K_P of the springs to take by side [N m/rad].
    """
    title = "Cost above the least [%] over K_D and K_P [N m/rad]"
    return _drawn(lambda: cost_figure(landscape, springs, chosen), "landscape", title, "tall")


def tradeoff_drawing(tradeoff: Tradeoff) -> Drawing:
    """Return effort over speed, and the springs along the front."""
    title = "Effort per distance [s/m] and springs [N m/rad] over walking speed [m/s]"
    return _drawn(lambda: tradeoff_figure(tradeoff), "tradeoff", title, "tall")


def spread_drawing(spreads: Spreads) -> Drawing:
    """Return where springs, cost and gait of all draws end up."""
    title = "Springs of all draws [N m/rad], and deviation of cost and gait from the base [%]"
    return _drawn(
        lambda: spread_figure(spreads.values, spreads.ranges, spreads.spreads),
        "uncertainty", title, "tall",
    )  # fmt: skip


def _traces(runs: Sequence[ReportRun]) -> tuple[Trace, ...]:
    """Return the gaits of the runs over their recordings."""
    gaits_recorded = [(run.evaluation.gait, run.evaluation.recorded) for run in runs]
    if len(gaits_recorded) == 1:
        gait, behind = gaits_recorded[0]
        return (Trace(gait, gait.problem, behind),)
    gaits, recorded = zip(*gaits_recorded, strict=True)
    return traces(gaits, [run.label for run in runs], recorded)


def _cycle(curve: CycleCurve, shown: Sequence[Trace], names: str) -> Drawing:
    """Return a quantity of both sides over the gait cycle."""
    title = f"{curve.name}, {curve.label} over the gait cycle, right and left: {names}"
    return _drawn(lambda: cycle_pairs([curve], shown), curve.key.replace("_", "-"), title)


def _legend(shown: Sequence[Trace]) -> Drawing:
    """Return the legend of all figures over the gait cycle."""
    handles = legend_handles(shown)

    def draw() -> Figure:
        figure = new_figure(0.17 * ((len(handles) + 1) // 2) + 0.06)
        legend(figure, handles)
        return figure

    return _drawn(draw, "legend", "Legend of the curves")


def _drawn(draw: Callable[[], Figure], name: str, title: str, shape: Shape = "pair") -> Drawing:
    """Return a figure as it stands on the page."""
    with mpl.rc_context(STYLE):
        figure = draw()
    return Drawing(inline_svg(figure, name, title[:1].upper() + title[1:]), shape)
