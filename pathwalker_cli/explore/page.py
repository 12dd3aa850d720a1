"""The page of an explored run: dials, walker, curves and numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, Final

from pathwalker_cli.animation.drawing import View, common_view
from pathwalker_cli.animation.html import page_templates, walkers_content
from pathwalker_cli.animation.look import ACTIVATION_COLOURS, who
from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.explore.dials import Dial
from pathwalker_cli.explore.picture import CURVES, drawing_of, numbers_shown, picture
from pathwalker_cli.explore.session import Session
from pathwalker_cli.stride.figures.style import LINE_COLOUR

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
