"""The documentation site: builds strictly, loads nothing from elsewhere, draws its equations."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parent.parent
MKDOCS = ROOT / "mkdocs.yml"
LOADED = re.compile(
    r'<(?:script|link|img|iframe|source)\b[^>]*\b(?:src|href)="((?:https?:)?//[^"]*)"'
)


def build(config: Path, target: Path) -> subprocess.CompletedProcess[str]:
    """Build a site strictly."""
    command = [sys.executable, "-m", "mkdocs", "build", "--strict"]
    return subprocess.run(
        [*command, "--config-file", str(config), "--site-dir", str(target)],
        env={**os.environ, "NO_MKDOCS_2_WARNING": "1"},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site as it is built from the project."""
    target = tmp_path_factory.mktemp("site")
    done = build(MKDOCS, target)
    assert done.returncode == 0, f"is `pip install '.[docs]'` done?\n{done.stdout}{done.stderr}"
    return target


def pages_of(site: Path) -> dict[str, str]:
    """Return the text of all pages by name."""
    return {path.name: path.read_text(encoding="utf-8") for path in site.glob("*.html")}


def test_every_page_is_built(site: Path) -> None:
    sources = {f"{path.stem}.html" for path in (ROOT / "docs").glob("*.md")}
    made = {"404.html", "trust.html", "contributing.html", "changes.html"}
    assert set(pages_of(site)) == sources | made
    assert not [path for path in site.rglob("*") if path.suffix in (".py", ".pyc")]


def test_nothing_is_loaded_from_elsewhere(site: Path) -> None:
    for name, text in pages_of(site).items():
        assert LOADED.findall(text) == [], name
    for style in site.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", style.read_text("utf-8"))


def test_all_equations_are_drawn(site: Path) -> None:
    theory = (ROOT / "docs" / "theory.md").read_text(encoding="utf-8")
    text = pages_of(site)["theory.html"]
    assert text.count('display="block"') == theory.count("$$") / 2
    for name, page in pages_of(site).items():
        assert "arithmatex" not in page, name
        for equation in re.findall(r"<math.*?</math>", page, re.DOTALL):
            assert "\\" not in equation, equation


def test_pages_from_other_files_link_within_the_site(site: Path) -> None:
    pages = pages_of(site)
    assert 'href="accuracy.html"' in pages["trust.html"]
    assert 'href="trust.html#how-far-to-trust-it"' in pages["landscape.html"]
    assert 'href="changes.html"' in pages["contributing.html"]


@pytest.mark.parametrize("link", ["missing.md", "#nowhere", "/absolute.md"])
def test_a_dead_link_stops_the_build(tmp_path: Path, link: str) -> None:
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "index.md").write_text(f"# Page\n\n[text]({link})\n", encoding="utf-8")
    changes = {"INHERIT": str(MKDOCS), "docs_dir": "docs", "nav": ["index.md"],
               "hooks": [], "extra_css": []}  # fmt: skip
    (tmp_path / "mkdocs.yml").write_text(yaml.safe_dump(changes), encoding="utf-8")
    done = build(tmp_path / "mkdocs.yml", tmp_path / "site")
    assert done.returncode != 0
    assert link.removeprefix("/") in done.stderr
