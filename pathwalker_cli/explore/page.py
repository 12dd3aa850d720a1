"""The page of an explored run: dials, walker, curves and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, Final

import numpy as np

from pathwalker_cli.animation.drawing import Drawing, View, common_view, drawing
from pathwalker_cli.animation.frames import gait_frames
from pathwalker_cli.animation.html import page_templates, stride_data, walkers_content
from pathwalker_cli.animation.look import ACTIVATION_COLOURS, who
from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.evaluation.curves import toe_off_percent
from pathwalker_cli.explore.dials import Dial
from pathwalker_cli.explore.session import Session
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.stride.figures.curves import ANGLES, FORCES, MOMENTS, CycleCurve
from pathwalker_cli.stride.figures.style import LINE_COLOUR
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.stride.stride import stride_of

_ROOM: Final = 1.12
"""By how much more is seen than the walk of the run needs: others take longer steps."""

_TIED: Final = {"Strength": "factor", "Tightness": "shift"}
"""What stays when both sides are turned together, by group; elsewhere they get one value."""

SHADOW: Final = "the state before"


def explore_page(session: Session, name: str, offline: Mapping[str, Any] | None = None) -> str:
    """Return the page of a session at the run itself; a server answers unless `offline` does."""
    drawn = drawing_of(session.optimum, name)
    view = common_view([drawn])
    view = replace(view, half_width=_ROOM * view.half_width, top=_ROOM * view.top)
    return page_templates().get_template("explore/explore.html").render(
        name=name,
        who=who(drawn.frames),
        groups=_groups(session.dials),
        offline=offline is not None,
        **walkers_content([drawn], view, SHADOW),
        data=_data(session, name, view) | {"offline": offline},
    )  # fmt: skip


def _data(session: Session, name: str, view: View) -> dict[str, Any]:
    """Return what the scripts of the page need."""
    shown = picture(session.optimum, session.dials, name)
    return {
        "colours": ACTIVATION_COLOURS,
        "half_width": view.half_width,
        "lines": [LINE_COLOUR[side] for side in SIDES],
        "runs": [shown["walker"]],
        "picture": shown,
        "dials": [_dial(dial) for dial in session.dials],
        "curves": [
            {"key": curve.key, "title": curve.name, "label": curve.label, "zero": curve.zero}
            for curve in CURVES
        ],
        "numbers": [
            {
                "key": m.key,
                "label": m.label,
                "unit": m.shown_unit,
                "digits": m.digits + (m.key == "cost"),
            }
            for m in numbers_shown()
        ],
    }


def _groups(dials: tuple[Dial, ...]) -> dict[str, list[list[int]]]:
    """Return the places of dials by group and then by label: those of both sides together."""
    groups: dict[str, dict[str, list[int]]] = {}
    for i, dial in enumerate(dials):
        groups.setdefault(dial.group, {}).setdefault(dial.label, []).append(i)
    return {group: list(pairs.values()) for group, pairs in groups.items()}


def _dial(dial: Dial) -> dict[str, Any]:
    """Return a dial as the page knows it; angles in degrees."""
    angle = dial.unit == "rad"
    return {
        "key": dial.key,
        "label": dial.label,
        "side": dial.side or "",
        "unit": "deg" if angle else dial.unit,
        "size": float(to_degrees(1.0)) if angle else 1.0,
        "low": dial.low,
        "high": dial.high,
        "value": dial.value,
        "free": dial.unknown is not None,
        "tied": _TIED.get(dial.group, "value"),
    }


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
    stride = stride_of(optimum.series)
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
            if (value := optimum.cost if measure.value is None else measure.of(stride)) is not None
        },
        "found": {key: optimum.value(unknown) for unknown, key in held.items()},
    }
