"""The option --json: one JSON document on stdout and nothing else there, whatever happens."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

import click

__all__ = ["json_option", "print_failure", "print_json"]

_WANTED: Final = "pathwalker.json.wanted"
_PRINTED: Final = "pathwalker.json.printed"


def _note(context: click.Context, parameter: click.Parameter, value: bool) -> bool:
    context.meta[_WANTED] = value
    return value


json_option = click.option(
    "--json",
    "as_json",
    is_flag=True,
    callback=_note,
    help="Print one JSON document instead of text; progress stays on stderr.",
)
"""Adds --json as `as_json` to a command."""


def print_json(content: Mapping[str, Any]) -> None:
    """Print the document of a command on stdout."""
    from pathwalker_cli.io.json_file import json_text

    click.echo(json_text(content), nl=False)
    click.get_current_context().meta[_PRINTED] = True


def print_failure(context: click.Context, sentence: str) -> None:
    """Print a document about a solve that did not converge, unless the command printed its own."""
    if context.meta.get(_WANTED) and not context.meta.get(_PRINTED):
        from pathwalker_cli.io.json_file import json_text

        content = {"status": "not converged", "converged": False, "message": sentence}
        click.echo(json_text(content), nl=False)
