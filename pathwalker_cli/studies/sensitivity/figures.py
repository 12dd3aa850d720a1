"""The figure of a sensitivity study: which numbers matter most for what."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from pathwalker_cli.stride.figures.save import save_formats
from pathwalker_cli.stride.figures.style import NEUTRAL, STYLE, dress, new_figure
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.studies.sensitivity.result import Sensitivities, label_of

_PANELS: Final = (
    "cost",
    "min_stance_knee_flexion_right",
    "min_stance_knee_flexion_left",
    "step_length_right",
    "step_length_left",
    "stride_time",
)
_BARS: Final = 6
"""Numbers shown per panel, the strongest ones."""

_MORE: Final = "#009E73"
_LESS: Final = "#CC79A7"
"""Green and purple of the palette by Okabe and Ito: blue and vermilion stand for sides."""


def sensitivity_figure(result: Sensitivities) -> Figure:
    """Return the strongest elasticities of cost, crouch, steps and stride time as bars."""
    fig = new_figure(7.6)
    for axes, key in zip(fig.subplots(6, 1), _PANELS, strict=True):
        values = {row.place: row.elasticities.get(key) or 0.0 for row in result.rows}
        strongest = sorted(values, key=lambda place: -abs(values[place]))[:_BARS][::-1]
        numbers = np.array([values[place] for place in strongest])
        colours = [_MORE if number >= 0.0 else _LESS for number in numbers]
        hatches = ["" if number >= 0.0 else "////" for number in numbers]
        axes.barh(
            range(len(strongest)), numbers, color=colours, hatch=hatches, edgecolor="white",
            linewidth=0.3,
        )  # fmt: skip
        axes.set_yticks(range(len(strongest)), [label_of(place) for place in strongest])
        axes.axvline(0.0, color=NEUTRAL, linewidth=0.6)
        dress(axes, measure_of(key).label)
    axes.set_xlabel("elasticity [% per %]")
    return fig


def save_sensitivity_figure(result: Sensitivities, folder: Path) -> None:
    """Write `sensitivity.png` and `sensitivity.svg`."""
    with mpl.rc_context(STYLE):
        figure = sensitivity_figure(result)
    save_formats(figure, folder, "sensitivity")
