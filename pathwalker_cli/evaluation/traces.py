"""How gaits look in a figure: one gait by its sides, several each in a look of its own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

from pathwalker_cli.conventions import Side
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.stride.figures.style import LINE_COLOUR, LINE_STYLE, NEUTRAL

__all__ = ["Trace", "lone_trace", "traces"]

_COLOURS: Final = ("#000000", "#009E73", "#CC79A7", "#E69F00", "#56B4E9")
"""Colours of the palette by Okabe and Ito that stand for no side."""

_STYLES: Final = ("-", (0, (3.2, 1.4)), (0, (5.0, 1.2, 1.0, 1.2)), (0, (1.0, 1.0)))
"""Line styles; as many as share no divisor with the colours, so that 20 gaits differ."""

_BAND: Final = "#cccccc"


@dataclass(frozen=True)
class Trace:
    """A gait in a figure whose panels show one side each.

    Args:
        gait: The gait.
        label: Its name in the legend.
        recorded: Recordings to draw behind it, or None.
        order: Its place among several gaits; None for a gait alone, which takes the look of the
            side.
    """

    gait: Gait
    label: str
    recorded: RecordedGait | None = None
    order: int | None = None

    def look(self, side: Side) -> dict[str, Any]:
        """Return colour and line style of its curve."""
        if self.order is None:
            return {"color": LINE_COLOUR[side], "linestyle": LINE_STYLE[side]}
        colour = _COLOURS[self.order % len(_COLOURS)]
        return {"color": colour, "linestyle": _STYLES[self.order % len(_STYLES)]}

    @property
    def band(self) -> dict[str, Any]:
        """Return the look of the recorded range."""
        if self.order is None:
            return {"color": _BAND, "linewidth": 0}
        return {"color": self.look("right")["color"], "alpha": 0.14, "linewidth": 0}

    @property
    def edge(self) -> dict[str, Any]:
        """Return the look of the recorded mean, and of the edges of ranges that may overlap."""
        if self.order is None:
            return {"color": NEUTRAL, "linewidth": 0.7}
        return {**self.look("right"), "linewidth": 0.6, "alpha": 0.6}


def lone_trace(gait: Gait, recorded: RecordedGait | None = None) -> Trace:
    """Return a gait alone, under the name of its problem."""
    return Trace(gait, gait.problem, recorded)


def traces(
    gaits: Sequence[Gait],
    labels: Sequence[str],
    recorded: Sequence[RecordedGait | None] | None = None,
) -> tuple[Trace, ...]:
    """Return several gaits that differ in colour and line style.

    Args:
        gaits: The gaits.
        labels: Their names in the legend.
        recorded: Recordings to draw behind each; none if left out.
    """
    behind = recorded or [None] * len(gaits)
    rows = zip(gaits, labels, behind, strict=True)
    return tuple(
        Trace(gait, _plain(label), recordings, order=i)
        for i, (gait, label, recordings) in enumerate(rows)
    )


def _plain(label: str) -> str:
    """Return a label that Matplotlib takes as it stands: no formula, no hidden entry.

    Names of folders may hold anything.
    """
    printable = "".join(c if c.isprintable() else "?" for c in label).replace("$", r"\$")
    return f" {printable}" if printable.startswith("_") else printable
