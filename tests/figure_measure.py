"""What is wrong with the text of a figure once it is printed as wide as it is meant to be."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations

from matplotlib.axes import Axes
from matplotlib.cbook import is_math_text
from matplotlib.figure import Figure
from matplotlib.text import Text

POINT = 72.0
"""Points of an inch [pt]."""
WIDTHS = (47.0 / 25.4, 85.0 / 25.4, 188.0 / 25.4)
"""Widths at which figures are printed: a quarter of a page, a column, a page [in]."""
LEAST = 6.0
"""Smallest text that can be read in print [pt]."""
INDEX = 0.7
"""Size of an index as a share of the formula's."""
SLACK = 1.5
"""By how much boxes of texts may overlap, or leave the figure: they hold empty space [pt]."""


def complaints(figure: Figure) -> list[str]:
    """Return which texts are too small, outside the figure or over one another.

    Args:
        figure: A figure.
    """
    figure.draw_without_rendering()  # texts know their places for the dots per inch of the figure
    shown = [text for text in _texts(figure) if text.get_visible() and text.get_text().strip()]
    width = figure.get_figwidth()
    scale = min(WIDTHS, key=lambda printed: abs(printed - width)) / width
    sizes = [(text, scale * _size(text)) for text in shown]
    found = [f"{text.get_text()!r} is {size:.1f} pt" for text, size in sizes if size < LEAST]
    boxes = [(text, text.get_window_extent()) for text in shown]
    slack = SLACK * figure.dpi / POINT
    width, height = figure.bbox.size
    found += [
        f"{text.get_text()!r} leaves the figure"
        for text, box in boxes
        if min(box.x0, box.y0, width - box.x1, height - box.y1) < -slack
    ]
    found += [
        f"{one.get_text()!r} and {other.get_text()!r} overlap"
        for (one, a), (other, b) in combinations(boxes, 2)
        if min(a.x1, b.x1) - max(a.x0, b.x0) > slack and min(a.y1, b.y1) - max(a.y0, b.y0) > slack
    ]
    return found


def _size(text: Text) -> float:
    """Return the size of the smallest letters [pt]: of a formula those of its indices."""
    return text.get_fontsize() * (INDEX if is_math_text(text.get_text()) else 1.0)


def _texts(figure: Figure) -> Iterator[Text]:
    """Yield the texts that are drawn."""
    yield from figure.texts
    for box in figure.legends:
        yield from (*box.get_texts(), box.get_title())
    for ax in figure.axes:
        yield from _texts_of(ax)


def _texts_of(ax: Axes) -> Iterator[Text]:
    if ax.get_legend():
        yield from (*ax.get_legend().get_texts(), ax.get_legend().get_title())
    if not ax.axison:
        return
    yield from (ax.title, ax.xaxis.label, ax.yaxis.label, *ax.texts)
    for axis in (ax.xaxis, ax.yaxis):
        low, high = sorted(axis.get_view_interval())
        for tick in axis.get_major_ticks():
            if low <= tick.get_loc() <= high:
                yield from (tick.label1, tick.label2)
