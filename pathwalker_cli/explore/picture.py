"""What is seen of an optimum: walker, curves and numbers, as plain values for a page."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

import numpy as np

from pathwalker_cli.animation.drawing import Drawing, drawing
from pathwalker_cli.animation.frames import gait_frames
from pathwalker_cli.animation.html import stride_data
from pathwalker_cli.conventions import SIDES
from pathwalker_cli.evaluation.curves import toe_off_percent
from pathwalker_cli.explore.dials import Dial
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.stride.figures.curves import ANGLES, FORCES, MOMENTS, CycleCurve
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.stride.stride import stride_of
from pathwalker_cli.studies.measures import all_measures

INSTANTS: Final = 60
"""Instants of the walker in a stride; between them the page interpolates."""
_POINTS: Final = 51
"""Points of a curve: one every 2 % of the cycle of its side."""

CURVES: Final[tuple[CycleCurve, ...]] = (*ANGLES[1:4], *MOMENTS[1:], FORCES[0])
"""What a laboratory looks at first."""

_FIRST: Final = ("cost", "min_stance_knee_flexion_left", "min_stance_knee_flexion_right",
                 "walking_speed")  # fmt: skip


def numbers_shown() -> tuple[Measure, ...]:
    """Return the measures beside the walker: cost, crouch and speed first."""
    known = {measure.key: measure for measure in measures_in("studies")}
    return tuple(known[key] for key in (*_FIRST, *(k for k in known if k not in _FIRST)))


def drawing_of(optimum: Optimum, name: str) -> Drawing:
    """Return what is drawn of the walker of an optimum."""
    return drawing(gait_frames(optimum.series, name, optimum.config.problem, INSTANTS))


def picture(optimum: Optimum, dials: Sequence[Dial], name: str = "") -> dict[str, Any]:
    """Return what is seen of an optimum, solved or extrapolated, and where the dials stand."""
    stride, values = stride_of(optimum.series), all_measures(optimum)
    held = {dial.unknown: dial.key for dial in dials if dial.unknown}
    return {
        "walker": stride_data(drawing_of(optimum, name)),
        "curves": {
            curve.key: [
                np.round(line, 3).tolist()
                for side in SIDES
                for line in curve.lines(stride, side, _POINTS)
            ]
            for curve in CURVES
        },
        "toe_off": [toe_off_percent(stride, side) for side in SIDES],
        "values": {
            measure.key: measure.in_shown_unit(value)
            for measure in numbers_shown()
            if (value := values.get(measure.key)) is not None
        },
        "found": {key: optimum.value(unknown) for unknown, key in held.items()},
    }
