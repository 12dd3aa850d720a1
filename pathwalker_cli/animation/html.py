"""The animation as one HTML page that needs neither network nor server."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cache
from typing import Any, Final

import numpy as np
from jinja2 import Environment

from pathwalker_cli.animation.drawing import (
    Drawing,
    Shape,
    View,
    common_view,
    drawing,
    force_scale,
    words,
)
from pathwalker_cli.animation.frames import GaitFrames
from pathwalker_cli.animation.look import (
    ACTIVATION_COLOURS,
    CAVEAT,
    DASHES,
    SHADOW_COLOUR,
    SHELL_COLOUR,
    SPRING_COLOUR,
    arrow_look,
    pace,
    recorded_name,
    shape_look,
    subtitle,
)
from pathwalker_cli.conventions import GENERATORS, SIDES
from pathwalker_cli.io.templates import templates
from pathwalker_cli.stride.figures.style import BODY_COLOUR, FORCE_COLOUR

RATE: Final = 100.0
"""Instants of the page per second of gait [1/s]; between them the page interpolates."""


@dataclass(frozen=True)
class Video:
    """A video of the child that is shown beside the walkers, in step.

    Args:
        address: Where it is, as a page finds it from its own place.
        start: When the right heel strikes the ground in it [s].
    """

    address: str
    start: float


def html_page(runs: Sequence[GaitFrames], video: Video | None = None) -> str:
    """Return the page of one or two strides.

    Names of runs come from folders: the template escapes them in text and data alike.

    A stride of the video beside them takes as long as the recorded one behind the first walker, or
    else as that walker's own.
    """
    drawings = [drawing(frames) for frames in runs]
    view, first = common_view(drawings), runs[0]
    stride = first.recorded.duration if first.recorded else first.duration
    template = page_templates().get_template("animation/page.html")
    return template.render(
        title=" and ".join(frames.name for frames in runs),
        pace=pace(runs),
        video=video,
        **walkers_content(drawings, view, recorded_name(runs)),
        data={
            "colours": ACTIVATION_COLOURS,
            "half_width": view.half_width,
            "runs": [stride_data(each) for each in drawings],
            "video": None if video is None else {"start": video.start, "stride": stride},
        },
    )


def walkers_content(
    drawings: Sequence[Drawing], view: View, shadow_name: str = ""
) -> dict[str, Any]:
    """Return what `walker.html` needs of some strides: looks, words, and what is seen.

    The shadows behind them have a name, "" if there are none.
    """
    return {
        "caveat": CAVEAT,
        "colours": ACTIVATION_COLOURS,
        "dashes": DASHES,
        "right": BODY_COLOUR["right"],
        "left": BODY_COLOUR["left"],
        "force": FORCE_COLOUR,
        "shell": SHELL_COLOUR,
        "spring": SPRING_COLOUR,
        "shadow": SHADOW_COLOUR,
        "shadow_name": shadow_name,
        "view": view,
        "panels": [_panel(each) for each in drawings],
        "with_orthosis": any(each.frames.braced for each in drawings),
    }


@cache
def page_templates() -> Environment:
    """Return the templates of pages with walkers, by their place in the package."""
    environment = templates("pathwalker_cli", ".")
    # No spaces: the data of strides is most of a page.
    environment.policies["json.dumps_kwargs"] = {"separators": (",", ":"), "allow_nan": False}
    return environment


def _panel(each: Drawing) -> dict[str, Any]:
    """Return what the template draws of a stride."""
    frames = each.frames
    return {
        "name": frames.name,
        "subtitle": subtitle(frames),
        "notes": frames.notes,
        "weight": frames.weight,
        "weight_length": force_scale(frames) * frames.weight,
        "shapes": [asdict(shape_look(shape)) | {"title": _title(shape)} for shape in each.shapes],
        "arrows": [asdict(arrow_look(side)) | {"title": f"ground force, {side}"} for side in SIDES],
    }


def _title(shape: Shape) -> str:
    """Return what a shape stands for, in words."""
    what = shape.kind if shape.generator is None else words(GENERATORS[shape.generator])
    if shape.kind in ("recorded", "marker"):
        return shape.start
    if shape.kind in ("leg", "foot"):
        return f"{shape.side} {shape.kind}"
    return f"orthosis, {what}, {shape.side}" if shape.kind in ("shell", "spring") else what


def stride_data(each: Drawing) -> dict[str, Any]:
    """Return what the script of the page needs of a stride."""
    frames = each.frames
    return {
        "name": frames.name,
        "duration": frames.duration,
        "distance": frames.distance,
        "middle": frames.middle,
        "phases": [words(name) for name in frames.phase],
        "points": {name: _rounded(xz, 4) for name, xz in each.points.items()},
        "arrows": [
            [None if np.isnan(arrow).any() else _rounded(arrow, 4) for arrow in each.arrows[side]]
            for side in SIDES
        ],
        "activation": _rounded(frames.activation, 3),
        "shapes": [
            {
                "from": shape.start,
                "to": shape.end,
                "outline": _rounded(shape.outline, 4),
                "closed": shape.closed,
                "generator": shape.generator,
            }
            for shape in each.shapes
        ],
    }


def _rounded(values: np.ndarray, digits: int) -> list[Any]:
    """Return nested lists of rounded numbers."""
    return list(np.round(values, digits).tolist())
