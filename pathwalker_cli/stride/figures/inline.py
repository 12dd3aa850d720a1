"""Figures as SVG: inside an HTML page, or with letters as outlines for what knows no fonts."""

from __future__ import annotations

import io
import re
import xml.etree.ElementTree as ET
from collections.abc import Iterator
from typing import Final

import matplotlib as mpl
from matplotlib.figure import Figure

from pathwalker_cli.stride.figures.style import STYLE

_SVG: Final = "http://www.w3.org/2000/svg"
ET.register_namespace("", _SVG)
_HREF: Final = "{http://www.w3.org/1999/xlink}href"
_LOCAL: Final = re.compile(r"url\(#([^)]+)\)")
_PLACES: Final = frozenset({"d", "x", "y", "transform"})
"""Attributes that hold coordinates."""
_DIGITS: Final = re.compile(r"(-?\d+\.\d{2})\d+")
"""Coordinates with more digits than a printer resolves [pt]."""


def inline_svg(figure: Figure, name: str, title: str) -> str:
    """Return a figure as an element of an HTML page.

    Its ids begin with the name, so that figures of one page do not take each other's clip paths;
    it has no fixed size, and what Matplotlib says of itself is left out.

    Args:
        figure: A figure made under `style.STYLE`.
        name: A name that no other figure of the page has; letters, digits and "-".
        title: What the figure shows, in words.
    """
    root = _drawn(figure)
    for element in root.iter():
        _localise(element, name)
    for key in ("width", "height", "version"):
        root.attrib.pop(key, None)
    # The page must not take over what Matplotlib sets for all elements.
    root.set("style", "stroke-linejoin: round; stroke-linecap: butt")
    root.attrib |= {"role": "img", "aria-label": title}
    words = ET.Element(f"{{{_SVG}}}title")
    words.text = title
    root.insert(0, words)
    return ET.tostring(root, encoding="unicode")


def outlined_svg(figure: Figure) -> bytes:
    """Return a figure made under `style.STYLE` as an SVG file in which letters are outlines."""
    return ET.tostring(_drawn(figure, outlined=True))


def _drawn(figure: Figure, outlined: bool = False) -> ET.Element:
    """Return a figure as SVG without what Matplotlib says of itself."""
    buffer = io.StringIO()
    with mpl.rc_context(STYLE | ({"svg.fonttype": "path"} if outlined else {})):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    root = ET.fromstring(buffer.getvalue())  # noqa: S314 - Matplotlib has just written it
    for parent, child in list(_pairs(root)):
        if child.tag in (f"{{{_SVG}}}metadata", f"{{{_SVG}}}style"):
            parent.remove(child)
    return root


def _pairs(root: ET.Element) -> Iterator[tuple[ET.Element, ET.Element]]:
    """Yield every element with its parent."""
    for parent in root.iter():
        for child in parent:
            yield parent, child


def _localise(element: ET.Element, name: str) -> None:
    """Put a name before the id of an element and before the ids that it refers to."""
    if "id" in element.attrib:
        element.set("id", f"{name}-{element.get('id')}")
    link = element.attrib.pop(_HREF, "")
    if link:
        element.set("href", f"#{name}-{link.removeprefix('#')}")
    for key, value in element.attrib.items():
        if "url(#" in value:
            element.set(key, _LOCAL.sub(rf"url(#{name}-\1)", value))
        if key in _PLACES:
            element.set(key, _DIGITS.sub(r"\1", " ".join(value.split())))
