"""The command `check`: what would be done, and whether it can be, without doing it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pathwalker_cli.commands.complete import complete_configs, complete_problems
from pathwalker_cli.commands.options import json_option, print_json, set_option

if TYPE_CHECKING:
    from pathwalker_cli.checking.report import Checked

_REFUSED = 2


@click.command("check")
@click.argument(
    "configs", nargs=-1, required=True, metavar="CONFIG...", shell_complete=complete_configs
)
@click.option(
    "--problem",
    metavar="NAME",
    help="Problem that every CONFIG must be of.",
    shell_complete=complete_problems,
)
@set_option("Override a value of every CONFIG.")
@json_option
@click.pass_context
def check_command(
    context: click.Context,
    configs: tuple[str, ...],
    problem: str | None,
    changes: tuple[str, ...],
    as_json: bool,
) -> None:
    """Check configs, patients and marker sets, and say what would be solved; nothing is solved.

    CONFIG is a YAML file of any kind, the name of a shipped one, or a patient. Every file is read
    by what its command reads it with, and values that are allowed one by one but make no sense
    together are refused too. A prediction is told with every bound and where it comes from, its
    size and the time to expect, orthoses with the direction of every angle. All files are checked
    and all failures reported, by --json in place of what was found. Exit codes: 0 all
    in order, 2 some not.
    """
    from pathwalker_cli.checking.kinds import check_file
    from pathwalker_cli.checking.report import checked_lines
    from pathwalker_cli.errors import InputError

    checked_files: list[Checked] = []
    entries: list[dict[str, Any]] = []
    failures: list[str] = []
    for path in configs:
        try:
            checked_files.append(check_file(path, problem or "", changes))
            entries.append(checked_files[-1].as_dict())
        except InputError as error:
            sentence = str(error)
            failures.append(sentence if Path(path).name in sentence else f"{path}: {sentence}")
            entries.append({"config": path, "ok": False, "error": failures[-1]})
    if as_json:
        print_json({"ok": not failures, "configs": entries})
    else:
        click.echo(
            "\n\n".join("\n".join(checked_lines(checked)) for checked in checked_files), nl=False
        )
        click.echo("\n" * bool(checked_files), nl=False)
    for sentence in failures:
        click.echo(f"Error: {sentence}", err=True)
    context.exit(_REFUSED if failures else 0)
