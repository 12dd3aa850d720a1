"""A page as one HTML file that needs nothing else."""

from __future__ import annotations

from functools import cache

from jinja2 import Environment
from markupsafe import Markup

from pathwalker_cli import __version__
from pathwalker_cli.io.templates import templates
from pathwalker_cli.report.content import Drawing, Page, tight
from pathwalker_cli.stride.figures.inline import inline_svg


def page_html(page: Page) -> str:
    """Return a page as HTML; all its texts are escaped, the figures are ours."""
    template = _environment().get_template("page.html.j2")
    text = template.render(page=page, version=__version__)
    return text.encode(errors="replace").decode()  # names of files need not be Unicode


@cache
def _environment() -> Environment:
    """Return the templates of this package, which escape everything."""
    environment = templates("pathwalker_cli.report")
    environment.filters |= {"svg": _svg, "tight": tight}
    return environment


def _svg(drawing: Drawing) -> Markup:
    """Return a figure without escaping: `inline_svg` writes it, and escapes its texts."""
    svg = inline_svg(drawing.figure, drawing.name, drawing.title)
    return Markup(svg)  # noqa: S704 - of `inline_svg`, which escapes
