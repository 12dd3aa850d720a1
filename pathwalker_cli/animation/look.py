"""Colours, line widths and words of the drawn walker, the same in every kind of animation."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from pathwalker_cli.animation.drawing import Shape
from pathwalker_cli.animation.frames import GaitFrames
from pathwalker_cli.conventions import Side, worn_words
from pathwalker_cli.stride.figures.style import BODY_COLOUR, FORCE_COLOUR, LINE_COLOUR

ACTIVATION_COLOURS: Final = (
    "#ffffe5",
    "#fff7bc",
    "#fee391",
    "#fec44f",
    "#fe9929",
    "#ec7014",
    "#cc4c02",
    "#993404",
    "#662506",
)
"""Activation from 0 to 1 in even steps: YlOrBr of ColorBrewer (Harrower and Brewer, 2003), which
darkens all the way, so that it reads with any colour vision and in print."""

DASHES: Final = (0.022, 0.014)
"""Dash and gap of the left leg [m]; the right leg is solid."""

CAVEAT: Final = (
    "Motion of a walking model, not a recording. PathWalker is research software and no medical "
    "device."
)

SHADOW_COLOUR: Final = "#CC79A7"
"""Another stride behind the walker: reddish purple of the palette by Okabe and Ito."""

SHELL_COLOUR: Final = "#56B4E9"
SPRING_COLOUR: Final = LINE_COLOUR["right"]
"""Areas and lines of the orthosis."""
_WIDTHS: Final = {
    "leg": 0.014,
    "foot": 0.008,
    "trunk": 0.018,
    "head": 0.01,
    "muscle": 0.003,
    "shell": 0.004,
    "spring": 0.005,
    "recorded": 0.009,
    "marker": 0.002,
}
"""Line width of each kind of shape [m]."""


@dataclass(frozen=True)
class Look:
    """How something is drawn.

    Args:
        stroke: Colour of the line.
        width: Width of the line [m].
        dashed: Whether the line is broken, as all of the left leg is.
        fill: Colour of the area; "none" leaves it open.
        opacity: Opacity of that colour.
    """

    stroke: str
    width: float
    dashed: bool
    fill: str = "none"
    opacity: float = 1.0


def shape_look(shape: Shape) -> Look:
    """Return the look of a shape; the colour of a muscle is that of activation 0."""
    left = shape.side == "left"
    width = _WIDTHS[shape.kind]
    if shape.kind == "marker":
        return Look("#ffffff", width, False, SHADOW_COLOUR)
    if shape.kind == "recorded":
        return Look(SHADOW_COLOUR, width, left)
    if shape.kind in ("shell", "spring"):
        fill = SHELL_COLOUR if shape.kind == "shell" else "none"
        return Look(SPRING_COLOUR, width, left and shape.kind == "shell", fill, 0.45)
    fill = ACTIVATION_COLOURS[0] if shape.kind == "muscle" else "none"
    stroke = BODY_COLOUR[shape.side or "right"]
    return Look(stroke, width, left and shape.kind in ("leg", "foot"), fill)


def arrow_look(side: Side) -> Look:
    """Return the look of a ground force: filled on the right, hollow on the left."""
    return Look(FORCE_COLOUR, 0.004, False, FORCE_COLOUR if side == "right" else "#ffffff")


def who(frames: GaitFrames) -> str:
    """Return who walks, and with what."""
    return f"{frames.patient}, {worn_words(frames.braced)} ({frames.problem})"


def subtitle(frames: GaitFrames) -> str:
    """Return in one line who walks how fast."""
    walk = f"stride {frames.distance:.2f} m in {frames.duration:.2f} s"
    return f"{who(frames)}: {frames.walking_speed:.2f} m/s, {walk}"


def recorded_name(runs: Sequence[GaitFrames]) -> str:
    """Return what is drawn behind a stride, "" if nothing is."""
    behind = next((frames.recorded for frames in runs if frames.recorded), None)
    if behind is None:
        return ""
    return f"recorded, trial {behind.name}, in step{'; dots: markers' if behind.markers else ''}"


def _faster(ratio: float) -> str:
    """Return how a stride is shown that in truth takes so many times as long."""
    if round(ratio, 2) == 1.0:
        return "in its own time"
    word, share = ("faster", ratio) if ratio > 1.0 else ("slower", 1.0 / ratio)
    return f"{100.0 * (share - 1.0):.0f} % {word} than it walks"


def pace(runs: Sequence[GaitFrames]) -> str:
    """Return how the clocks of two strides go together; nothing for one stride."""
    if len(runs) < 2:
        return ""
    first, second = runs
    ratio = second.duration / first.duration
    return (
        f"Both walkers are shown at the same share of the right gait cycle, at the pace of "
        f"{first.name}: {second.name} is shown {_faster(ratio)}."
    )
