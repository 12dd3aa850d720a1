"""The page that folders ask for, about a patient, recorded gait or a cohort; as one HTML file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from pathlib import Path

from jinja2 import Environment
from markupsafe import Markup

from pathwalker_cli import __version__
from pathwalker_cli.io.templates import templates
from pathwalker_cli.report.cohort_page import cohort_page
from pathwalker_cli.report.content import Drawing, Page, tight
from pathwalker_cli.report.folders import STUDIES, sorted_folders, studies_near
from pathwalker_cli.report.gait_page import gait_page
from pathwalker_cli.report.recorded_page import recorded_page
from pathwalker_cli.report.runs import read_runs
from pathwalker_cli.stride.figures.inline import inline_svg


def page_of(folders: Sequence[Path]) -> Page:
    """Return the page about runs with their studies, about recorded gait, or about a cohort.

    Raises:
        DataError: If a folder cannot be used, or they do not go together.
    """
    by_kind = sorted_folders(folders)
    if "recorded" in by_kind:
        return recorded_page(by_kind["recorded"])
    if "cohort" in by_kind:
        return cohort_page(by_kind["cohort"])
    runs = read_runs(by_kind["run"])
    named = {kind: places for kind, places in by_kind.items() if kind in STUDIES}
    near = studies_near([(run.run.folder, run.run.metrics) for run in runs], named)
    return gait_page(runs, near)


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
