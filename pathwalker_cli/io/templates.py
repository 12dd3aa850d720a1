"""Templates of pages and files, read from a package."""

from __future__ import annotations

from jinja2 import Environment, PackageLoader, StrictUndefined


def templates(package: str, folder: str = "templates", *, escape: bool = True) -> Environment:
    """Return the templates of a package; undefined names are errors.

    Values are to be escaped as HTML but in plain text and YAML.
    """
    return Environment(
        loader=PackageLoader(package, folder),
        autoescape=escape,  # noqa: S701 - True for HTML, False for plain text and YAML only
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
