"""Figure of the joint angles over the gait cycle."""

from __future__ import annotations

from typing import Final

from matplotlib.figure import Figure

from pathwalker_cli.conventions import SIDES, SUFFIX, to_degrees
from pathwalker_cli.stride.figures.curves import (
    CLINICAL_ANGLE,
    Reference,
    draw_band,
    draw_sides,
)
from pathwalker_cli.stride.figures.style import (
    band_handle,
    dress,
    events_handle,
    legend_panel,
    new_figure,
    percent_axis,
    side_handles,
    zero_line,
)
from pathwalker_cli.stride.series import GaitSeries

_PANELS: Final = {
    "pelvis_tilt": ("Pelvis", "forward tilt [deg]"),
    "hip": ("Hip", "flexion [deg]"),
    "knee": ("Knee", "flexion [deg]"),
    "ankle": ("Ankle", "dorsiflexion [deg]"),
    "lumbar": ("Trunk against pelvis", "forward lean [deg]"),
}


def joint_angles(series: GaitSeries, reference: Reference | None = None) -> Figure:
    """Return pelvis, hip, knee, ankle and lumbar angles over the gait cycle of each side.

    Flexion, dorsiflexion and forward lean are positive, as gait laboratories plot them.

    Args:
        series: The stride.
        reference: Recorded bands to draw behind.
    """
    bands = reference.angles if reference else {}
    fig = new_figure(3.9)
    panels = fig.subplots(3, 2).ravel()
    for ax, (joint, (title, label)) in zip(panels, _PANELS.items(), strict=False):
        sign, values = CLINICAL_ANGLE.get(joint, 1.0), {}
        for side in SIDES:
            name = f"{joint}_{SUFFIX[side]}"
            draw_band(ax, bands.get(name), side, sign * float(to_degrees(1.0)))
            column = name if joint in CLINICAL_ANGLE else joint
            values[side] = sign * to_degrees(series.column(column))
        dress(ax, title, y=label)
        zero_line(ax)
        draw_sides(ax, series, values)
        percent_axis(ax)
    handles = [*side_handles(), events_handle(), *([band_handle()] if bands else [])]
    legend_panel(panels[-1], handles)
    return fig
