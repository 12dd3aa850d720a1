"""The page on extending the model: its additions are made in a copy of the package, and work."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

import pathwalker_cli
from pathwalker_cli.paths import shipped

PAGE = Path(__file__).parents[1] / "docs" / "extending.md"
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE = re.compile(r"`(pathwalker_cli/[\w/]+\.py)`")


def blocks(section: str) -> Iterator[tuple[str, str, str]]:
    """Yield language, text and the file that is named last before each block of a section."""
    at = 0
    for match in BLOCK.finditer(section):
        named = FILE.findall(section[at : match.start()])
        yield match[1], match[2], named[-1] if named else ""
        at = match.end()


def changed(text: str, diff: str) -> str:
    """Return a file after every run of lines with a minus has given way to those with a plus."""
    for old, new in re.findall(r"((?:^-.*\n)+)((?:^\+.*\n|^\+\n)+)", diff, re.MULTILINE):
        before = re.sub("^-", "", old, flags=re.MULTILINE)
        assert text.count(before) == 1, f"once in the file: {before}"
        text = text.replace(before, re.sub(r"^\+", "", new, flags=re.MULTILINE))
    return text


@pytest.fixture(scope="module")
def copy(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder with the extended package and all that the page adds."""
    folder = tmp_path_factory.mktemp("extended")
    package = Path(pathwalker_cli.__file__).parent
    ignored = shutil.ignore_patterns("__pycache__", "data")
    shutil.copytree(package, folder / "pathwalker_cli", ignore=ignored)
    for name in ("configs", "patient_data", "urdf"):
        (folder / name).symlink_to(shipped(name))
    for language, text, file in blocks(PAGE.read_text(encoding="utf-8")):
        target = folder / file
        if language == "diff":
            target.write_text(changed(target.read_text(encoding="utf-8"), text), encoding="utf-8")
        elif language == "yaml":
            (folder / "extended.yaml").write_text(text, encoding="utf-8")
        elif language == "python" and file:
            assert not target.exists()
            target.write_text(text, encoding="utf-8")
        elif language == "python":
            (folder / "look.py").write_text(text, encoding="utf-8")
    return folder


def run(folder: Path, *words: str) -> str:
    environment = {**os.environ, "PYTHONPATH": str(folder), "PATHWALKER_CACHE": "off"}
    done = subprocess.run(
        [sys.executable, *words], cwd=folder, env=environment, capture_output=True, text=True,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr + done.stdout
    return done.stdout


def test_every_addition_takes_one_or_two_files() -> None:
    sections = PAGE.read_text(encoding="utf-8").split("\n## ")[2:-2]
    assert len(sections) == 5
    for section in sections:
        files = {file for _, _, file in blocks(section) if file}
        assert len(files) <= 2, section.splitlines()[0]


def test_what_the_page_adds_is_there_and_works(copy: Path) -> None:
    run(copy, "look.py")


def test_check_tells_of_it(copy: Path) -> None:
    output = run(
        copy, "-c", "from pathwalker_cli.cli import main; main()", "check", "extended.yaml"
    )
    for label in ("knee_band_stiffness: [1, 10] N m/rad", "neutral_angle: [-0.05, 0.03] rad"):
        assert label in " ".join(output.split())


def test_the_study_of_the_page_is_a_command(copy: Path) -> None:
    start = "from pathwalker_cli.cli import main; main()"
    assert "at a few least speeds" in run(copy, "-c", start, "speeds", "--help")
    (copy / "speeds.yaml").write_text("base: mapd-barefoot\nleast_speeds: [0.7, 0.8]\n")
    assert "2 least speeds" in run(copy, "-c", start, "check", "speeds.yaml")


def test_the_study_of_the_page_is_the_one_that_other_tests_run() -> None:
    code = (Path(__file__).parent / "speeds_study.py").read_text(encoding="utf-8")
    assert code in PAGE.read_text(encoding="utf-8")
