"""A page as one HTML file that needs nothing else."""

from __future__ import annotations

import re
from functools import cache
from typing import Final

from jinja2 import Environment
from markupsafe import Markup

from pathwalker_cli import __version__
from pathwalker_cli.io.templates import templates
from pathwalker_cli.report.content import Drawing, Page

__all__ = ["page_html"]

_UNIT: Final = re.compile(r"(?<=\d) (?=%|N m|m/s|s/m|deg\b|kg\b)|(?<=\bN) (?=m\b)")
"""Spaces before and within units."""


def page_html(page: Page) -> str:
    """Return a page as HTML; all its texts are escaped, the figures are ours."""
    template = _environment().get_template("page.html.j2")
    text = template.render(page=page, version=__version__)
    return text.encode(errors="replace").decode()  # names of files need not be Unicode


@cache
def _environment() -> Environment:
    """Return the templates of this package, which escape everything."""
    environment = templates("pathwalker_cli.report")
    environment.filters |= {"svg": _svg, "tight": _tight}
    return environment


def _tight(text: str) -> str:
    """Return a text whose units do not part from their numbers at the end of a line."""
    return _UNIT.sub("\N{NO-BREAK SPACE}", text)


def _svg(drawing: Drawing) -> Markup:
    """Return a figure without escaping: `inline_svg` wrote it, and escaped its texts."""
    return Markup(drawing.svg)  # noqa: S704 - of `inline_svg`, which escapes
