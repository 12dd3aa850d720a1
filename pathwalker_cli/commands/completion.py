"""The command `completion`: what a shell has to read so that the Tab key knows PathWalker."""

from __future__ import annotations

import click

__all__ = ["completion_command"]


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion_command(context: click.Context, shell: str) -> None:
    """Print the script that completes commands, options, configs, problems and runs in SHELL.

    Bash needs version 4.4 or later. Load it at every start of the shell, as the examples say.
    """
    from click.shell_completion import ShellComplete, get_completion_class

    kind = get_completion_class(shell)
    assert kind is not None  # noqa: S101 - click knows every shell of the choice
    program = context.find_root().command
    complete = kind(program, {}, "pathwalker", "_PATHWALKER_COMPLETE")
    # Bash's own `source` asks a bash for its version; the script is the same without one.
    click.echo(ShellComplete.source(complete), nl=False)
