"""The figures of a page."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.evaluation.curves import Trace, traces
from pathwalker_cli.evaluation.laboratory import ROWS, ankle_panel, cycle_panel, legend_panel
from pathwalker_cli.inverse.figures import joint_torque_figure, name_figure
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.report.content import Drawing, Section, Shape
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.stride.figures.curves import TOES
from pathwalker_cli.stride.figures.stick_figures import walks_figure
from pathwalker_cli.stride.figures.style import STYLE


def walk_section(runs: Sequence[ReportRun]) -> Section:
    """Return stick figures of every run over the gait cycle."""
    shown = _traces(runs)
    names = " and ".join(run.label for run in runs)
    title = f"Stick figures of the predicted walk over the right gait cycle: {names}"
    walks = [(trace.label, trace.gait) for trace in shown]
    drawing = drawn(partial(walks_figure, walks), "walk", title, "page")
    return Section("How the child would walk", drawings=(drawing,))


def curve_section(runs: Sequence[ReportRun]) -> Section:
    """Return a column of curves per joint, both sides and all runs over one another."""
    shown = _traces(runs)
    names = " and ".join(trace.label for trace in shown)
    drawings = [
        drawn(
            partial(cycle_panel, curve, shown),
            curve.key.replace("_", "-"),
            f"{curve.name}, {curve.label} over the gait cycle, right and left: {names}",
            "panel",
        )
        for curve in (
            *(curve for row in ROWS for curve in row),
            *([TOES] if any(trace.gait.walker.parts.toes for trace in shown) else []),
        )
    ]
    drawings += [
        drawn(
            partial(ankle_panel, shown, side),
            f"ankle-torque-{side}",
            f"Net {side} ankle torque [N m] over dorsiflexion [deg] in stance: {names}",
            "panel",
        )
        for side in SIDES
    ]
    drawings.append(drawn(partial(legend_panel, shown), "legend", "Legend of the curves", "panel"))
    line = (
        "Each side from its own foot strike (0 %) to its next one. Joint moments are internal, "
        "those of muscles, tissue and orthosis; on feet of points they jump where the support "
        "changes. Slopes: torque over angle in stance, in the order of the legend."
    )
    return Section("Curves over the gait cycle", (line,), drawings=tuple(drawings), new_page=True)


def torque_drawing(trials: Sequence[Trial], body_mass: float, name: str, title: str) -> Drawing:
    """Return the recorded joint torques of one condition over body mass [kg]; see `drawn`."""

    def draw() -> Figure:
        figure = joint_torque_figure(trials, body_mass)
        name_figure(figure, f"{trials[0].condition}, {len(trials)} trials")
        return figure

    return drawn(draw, name, title, "tall")


def _traces(runs: Sequence[ReportRun]) -> tuple[Trace, ...]:
    gaits = [run.evaluation.gait for run in runs]
    return traces(gaits, [run.label for run in runs], [run.evaluation.recorded for run in runs])


def drawn(draw: Callable[[], Figure], name: str, title: str, shape: Shape = "pair") -> Drawing:
    """Return a figure as it stands on the page; see `Drawing`."""
    with mpl.rc_context(STYLE):
        figure = draw()
    return Drawing(figure, name, title[:1].upper() + title[1:], shape)
