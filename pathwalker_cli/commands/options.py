"""Options that commands share, and what they mean: --out, --set, --quiet, --json, run folders."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Final

import click

from pathwalker_cli.commands.complete import complete_keys, complete_runs
from pathwalker_cli.errors import ConfigError

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

_WANTED: Final = "pathwalker.json.wanted"
_PRINTED: Final = "pathwalker.json.printed"

quiet_option = click.option("--quiet", is_flag=True, help="Print errors only.")


def out_option(
    text: str, *names: str, required: bool = False, metavar: str | None = "DIR"
) -> Decorator:
    """Return what adds the option --out, a path, to a command."""
    kind = click.Path(path_type=Path)
    return click.option(*names, "--out", type=kind, required=required, metavar=metavar, help=text)


def set_option(text: str) -> Decorator:
    """Return what adds the option --set to a command, as `changes`."""
    return click.option(
        "--set",
        "changes",
        multiple=True,
        metavar="KEY=VALUE",
        help=text,
        shell_complete=complete_keys,
    )


def runs_argument(metavar: str = "RUN...") -> Decorator:
    """Return what adds the argument `runs`, one run folder or more, to a command."""
    return click.argument(
        "runs",
        nargs=-1,
        required=True,
        metavar=metavar,
        type=click.Path(path_type=Path),
        shell_complete=complete_runs,
    )


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
"""Adds --json as `as_json` to a command: one document on stdout and nothing else there."""


def print_json(content: Mapping[str, Any]) -> None:
    """Print the document of a command on stdout."""
    from pathwalker_cli.io.json_file import json_text

    click.echo(json_text(content), nl=False)
    click.get_current_context().meta[_PRINTED] = True


def print_failure(context: click.Context, sentence: str) -> None:
    """Print a document about a solve that did not converge, unless the command printed its own."""
    if context.meta.get(_WANTED) and not context.meta.get(_PRINTED):
        print_json({"status": "not converged", "converged": False, "message": sentence})


@contextmanager
def meant_as(kind: str, path: object) -> Iterator[None]:
    """Say of a config that is refused, if so, that it is of another of `checking.kinds.KINDS`."""
    try:
        yield
    except ConfigError as error:
        # loaded only where something is wrong: it knows every kind of file
        from pathwalker_cli.checking.kinds import another_kind

        raise another_kind(str(path), kind) or error from None
