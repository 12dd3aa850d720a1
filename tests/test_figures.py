"""Every figure can be read in a column of a journal: `conftest` measures all that tests save."""

from __future__ import annotations

import ast
import io
from collections.abc import Iterator
from os import environ
from pathlib import Path
from subprocess import CompletedProcess, run
from sys import executable
from typing import Any

import matplotlib as mpl
import pytest

import pathwalker_cli
from figure_measure import LEAST, WIDTHS, complaints
from pathwalker_cli.stride.figures.style import COLUMN, PAGE, PANEL, STYLE, TEXT, dress, new_figure

PACKAGE = Path(pathwalker_cli.__file__).parent
FOR_SCREENS = ("animation/film.py",)
SIZES = ("fontsize", "labelsize")


def calls() -> Iterator[tuple[str, ast.Call]]:
    """Yield every call in the modules that draw on paper, with its place."""
    for path in sorted(PACKAGE.rglob("*.py")):
        name = path.relative_to(PACKAGE).as_posix()
        if name not in FOR_SCREENS:
            tree = ast.parse(path.read_text(encoding="utf-8"))
            yield from ((name, node) for node in ast.walk(tree) if isinstance(node, ast.Call))


def test_all_figures_are_as_wide_as_a_column_a_page_or_its_quarter() -> None:
    made = {name for name, call in calls() if ast.unparse(call.func) == "Figure"}
    assert made == {"stride/figures/style.py"}, "figures are made by `new_figure`"
    assert new_figure(2.0).get_figwidth() == COLUMN
    assert pytest.approx(WIDTHS, abs=0.01) == (PANEL, COLUMN, PAGE)


def test_no_text_is_set_smaller_than_can_be_read() -> None:
    assert TEXT >= LEAST
    assert {v for k, v in STYLE.items() if k.endswith("size")} == {TEXT}
    given = [
        (name, keyword.value.value)
        for name, call in calls()
        for keyword in call.keywords
        if keyword.arg in SIZES and isinstance(keyword.value, ast.Constant)
    ]
    assert [(name, size) for name, size in given if size < LEAST] == []


def saved(words: str = "words", size: float = TEXT, x: float = 0.5, y: float = 0.2) -> None:
    """Save a figure with two texts, the first of them in the middle."""
    with mpl.rc_context(STYLE):
        figure = new_figure(2.0)
        ax = figure.subplots()
        dress(ax, "title", "time [s]", "force [N]")
        ax.text(0.5, 0.5, "middle", transform=ax.transAxes)
        ax.text(x, y, words, transform=ax.transAxes, fontsize=size, in_layout=False)
        figure.savefig(io.StringIO(), format="svg")


def test_what_cannot_be_read_is_found() -> None:
    saved()
    found: tuple[tuple[dict[str, Any], str], ...] = (
        ({"size": 5.9}, "'words' is 5.9 pt"),
        ({"x": 1.0}, "'words' leaves the figure"),
        ({"words": "$K_D$"}, "is 4.9 pt"),
        ({"y": 0.5}, "'middle' and 'words' overlap"),
    )
    for changes, complaint in found:
        with pytest.raises(AssertionError, match=complaint):
            saved(**changes)


def test_a_wide_figure_is_measured_at_the_width_of_a_page() -> None:
    with mpl.rc_context(STYLE):
        figure = new_figure(2.0)
        figure.set_figwidth(2.0 * PAGE)
        figure.text(0.5, 0.5, "words", fontsize=8.0)
    assert complaints(figure) == ["'words' is 4.0 pt"]


@pytest.mark.parametrize(
    ("chosen", "right"), [("", "#0072B2"), ("blue", "#0072B2"), ("green", "#009E73")]
)
def test_a_laboratory_chooses_the_colour_of_the_right_side(chosen: str, right: str) -> None:
    shown = _style_with(chosen)
    assert shown.returncode == 0, shown.stderr
    assert shown.stdout.split() == [right, "#D55E00"]


def test_another_colour_of_the_right_side_is_refused() -> None:
    refused = _style_with("red")
    assert refused.returncode == 1
    assert "PATHWALKER_RIGHT: there is no colour 'red' for the right side" in refused.stderr


def _style_with(chosen: str) -> CompletedProcess[str]:
    code = (
        "from pathwalker_cli.stride.figures.style import LINE_COLOUR, FORCE_COLOUR\n"
        "assert FORCE_COLOUR not in LINE_COLOUR.values()\n"
        "print(*LINE_COLOUR.values())"
    )
    return run(
        [executable, "-c", code],
        env={**environ, "PATHWALKER_RIGHT": chosen},
        capture_output=True,
        text=True,
        check=False,
    )
