"""The figures of a page: a column wide each, right beside left, runs over one another."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.evaluation.curves import Trace, known_curves, traces
from pathwalker_cli.evaluation.figures import ankle_pair, cycle_pairs, legend_handles
from pathwalker_cli.inverse.figures import joint_torque_figure, name_figure
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.report.content import Drawing, Section, Shape
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.stride.figures.curves import ACTIVATIONS, ANGLES, FORCES, MOMENTS, CycleCurve
from pathwalker_cli.stride.figures.inline import inline_svg
from pathwalker_cli.stride.figures.style import STYLE, legend, new_figure


def curve_section(runs: Sequence[ReportRun]) -> Section:
    """Return angles, ground forces, moments, ankle torque over angle and activations."""
    shown = _traces(runs)
    names = " and ".join(trace.label for trace in shown)
    drawings = [
        *(_cycle(curve, shown, names) for curve in (*ANGLES, *FORCES, *MOMENTS)),
        drawn(
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
    """Return the recorded joint torques of one condition over body mass [kg]; see `drawn`."""

    def draw() -> Figure:
        figure = joint_torque_figure(trials, body_mass)
        name_figure(figure, f"{trials[0].condition}, {len(trials)} trials")
        return figure

    return drawn(draw, name, title, "tall")


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
    return drawn(lambda: cycle_pairs([curve], shown), curve.key.replace("_", "-"), title)


def _legend(shown: Sequence[Trace]) -> Drawing:
    """Return the legend of all figures over the gait cycle."""
    handles = legend_handles(shown)

    def draw() -> Figure:
        figure = new_figure(0.17 * ((len(handles) + 1) // 2) + 0.06)
        legend(figure, handles)
        return figure

    return drawn(draw, "legend", "Legend of the curves")


def drawn(draw: Callable[[], Figure], name: str, title: str, shape: Shape = "pair") -> Drawing:
    """Return a figure as it stands on the page.

    Args:
        draw: Makes the figure.
        name: A name that no other figure of the page has; letters, digits and "-".
        title: What it shows, in words.
        shape: "tall" if it is at least twice as high as a row of panels.
    """
    with mpl.rc_context(STYLE):
        figure = draw()
    return Drawing(inline_svg(figure, name, title[:1].upper() + title[1:]), shape)
