"""The script that records the tutorial: places are filled in order, and filled again alike."""

from __future__ import annotations

from pathlib import Path

import pytest
from tutorial.record import PAGE, Printed, Recorder, blank, commands, filled

TEXT = """\
Some words.

<!-- OUTPUT (first 1, last 2): seq 9 -->
<!-- END -->

1. A list:

    <!-- OUTPUT (exit 3): echo no; exit 3 -->
    <!-- END -->

<!-- PICTURE: runs/curve.png | A curve -->
<!-- END -->
"""


def nowhere(file: str) -> str:
    return f"tutorial/{Path(file).name}"


def test_places_are_filled_in_order(tmp_path: Path) -> None:
    page = filled(TEXT, Recorder(tmp_path).run, nowhere)
    assert "```console\n$ seq 9\n1\n...\n8\n9\n```\n\n<!-- END -->" in page
    assert "    ```console\n    $ echo no; exit 3\n    no\n    ```\n" in page
    assert "![A curve](tutorial/curve.png)" in page
    assert page.startswith("Some words.\n\n<!-- OUTPUT (first 1, last 2): seq 9 -->\n")


def test_filling_again_changes_nothing(tmp_path: Path) -> None:
    page = filled(TEXT, Recorder(tmp_path).run, nowhere)
    assert filled(page, Recorder(tmp_path).run, nowhere) == page
    assert blank(page) == blank(TEXT)


def test_seconds_are_told_where_they_matter() -> None:
    text = "<!-- OUTPUT: a -->\n<!-- END -->\n"
    assert "*This took 12 s.*" in filled(text, lambda c, e: Printed((), 12.2), nowhere)
    assert "took" not in filled(text, lambda c, e: Printed((), 0.3), nowhere)


def test_another_exit_code_stops_the_script(tmp_path: Path) -> None:
    with pytest.raises(SystemExit, match="exit code 1 instead of 0"):
        Recorder(tmp_path).run("false", 0)


def test_machine_paths_do_not_reach_the_page(tmp_path: Path) -> None:
    printed = Recorder(tmp_path).run("echo written to $PWD/runs; pwd", 0)
    assert printed.lines == ("written to runs", ".")


def test_the_page_shows_the_commands_that_are_run() -> None:
    page = PAGE.read_text(encoding="utf-8")
    assert len(commands(page)) > 8
    for command in commands(page):
        assert f"```console\n$ {command}\n" in page
