"""What the documentation site does beyond MkDocs: equations as MathML, and pages from other files.

MathML is drawn by browsers themselves, so equations need neither scripts nor fonts from elsewhere.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import Any, Final

from latex2mathml.converter import convert
from mkdocs.structure.files import File, Files

ROOT: Final = Path(__file__).parent.parent

OUTSIDE: Final = {
    "README.md": (
        "trust.md",
        ("How far to trust it", "Limits", "Compared with the published system"),
    ),
    "CONTRIBUTING.md": ("contributing.md", ()),
    "CHANGELOG.md": ("changes.md", ()),
}
"""Files above docs/ that are pages as well: name there, and the sections that are taken, () all."""

_EQUATION: Final = re.compile(
    r'<(?P<tag>span|div) class="arithmatex">\\[(\[](?P<latex>.*?)\\[)\]]</(?P=tag)>', re.DOTALL
)


def on_files(files: Files, config: Any) -> Files:
    """Add the pages that are made from files above docs/."""
    for name, (page, sections) in OUTSIDE.items():
        text = (ROOT / name).read_text(encoding="utf-8")
        content = _within_docs(_sections(text, sections) if sections else text)
        files.append(File.generated(config, page, content=content))
    return files


def on_page_markdown(markdown: str, **others: Any) -> str:
    """Lead links to files above docs/ to the pages that are made from them."""
    for name, (page, _) in OUTSIDE.items():
        markdown = markdown.replace(f"](../{name}", f"]({page}")
    return markdown


def on_page_content(content: str, **others: Any) -> str:
    """Write equations in MathML."""
    return _EQUATION.sub(_mathml, content)


def _mathml(found: re.Match[str]) -> str:
    """Return an equation; a displayed one scrolls for itself where the screen is narrow."""
    block = found["tag"] == "div"
    equation = convert(html.unescape(found["latex"]), display="block" if block else "inline")
    return f'<div class="equation">{equation}</div>' if block else equation


def _sections(text: str, headings: tuple[str, ...]) -> str:
    """Return some sections of second order, the first of them as the title."""
    parts = dict(re.findall(r"^## (.*?)\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL))
    found = [f"{'##' if i else '#'} {name}\n{parts[name]}" for i, name in enumerate(headings)]
    return "".join(found)


def _within_docs(text: str) -> str:
    """Return a text of the folder above with links that hold in docs/."""
    for name, (page, _) in OUTSIDE.items():
        text = text.replace(f"]({name}", f"]({page}")
    return text.replace("](docs/", "](").replace("[docs/", "[")
