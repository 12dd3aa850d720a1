"""Write `commands.md`, the reference of the command line, from the commands themselves.

python docs/generate_commands.py
"""

from __future__ import annotations

import inspect
import re
from pathlib import Path
from typing import Final

import click

from pathwalker_cli.cli import COMMANDS, NOT_CONVERGED, REFUSED, STOPPED, cli
from pathwalker_cli.commands.examples import EXAMPLES

PAGE: Final = Path(__file__).with_name("commands.md")

_HEAD: Final = """\
# Commands

<!-- Written by docs/generate_commands.py from the commands themselves: change those, not this. -->

Every command with its arguments, options and exit codes.

`pathwalker COMMAND --help` says the same on the terminal. Every config may be named by its path or,
if it comes with PathWalker, by its name alone (`mapd-orthosis`); its keys are in
[configuration](configuration.md). `--set KEY=VALUE` overrides one key, dotted where it is nested
(`--set bounds.friction=0.6`), as often as needed. With `--json`, stdout holds one JSON document and
nothing else, also for a solve that did not converge; after bad input it stays empty. That of `solve` has `folder`,
`status`, `converged` and `metrics` (the keys of [metrics.json](run-folder.md#metricsjson)); that of a command that
writes a JSON file has the content of this file.

| exit code | meaning |
| --- | --- |
| 0 | done; of `solve`, `reproduce` and all studies: converged; of `doctor`: ready |
| {not_converged} | `solve`, `reproduce`, studies: not converged; `doctor`: something is missing |
| {refused} | bad input: one sentence on stderr says what, where and how to mend it |
| {stopped} | Ctrl-C outside of a solve: what was finished before is kept |

| command | purpose |
| --- | --- |
"""


def page() -> str:
    """Return the whole page."""
    head = _HEAD.format(not_converged=NOT_CONVERGED, refused=REFUSED, stopped=STOPPED)
    context = click.Context(cli, info_name="pathwalker")
    sections = []
    for name, (_, line) in COMMANDS.items():
        command = cli.get_command(context, name)
        assert command is not None, name
        head += f"| [`{name}`](#{name}) | {line} |\n"
        sections.append(_section(name, command))
    return "\n".join([head, *sections])


def _section(name: str, command: click.Command) -> str:
    """Return what one command does and takes."""
    words = [_usage(parameter) for parameter in command.params]
    lines = [f"## {name}", "", "```", f"pathwalker {name} {' '.join(words)}", "```", ""]
    lines += [_prose(command.help or ""), ""]
    options = [p for p in command.params if isinstance(p, click.Option)]
    if options:
        lines += ["| option | meaning |", "| --- | --- |"]
    lines += [f"| `{_names(option)}` | {_meaning(option)} |" for option in options]
    lines += ["", "```", *EXAMPLES.get(name, ()), "```"]
    return "\n".join([*lines, ""])


def _prose(text: str) -> str:
    """Return a help text with one line per paragraph, so that its wrapping does not matter."""
    paragraphs = re.split(r"\n\s*\n", inspect.cleandoc(text))
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in paragraphs)


def _value(parameter: click.Parameter) -> str:
    """Return the placeholder of a parameter's value, "" for a flag."""
    if isinstance(parameter, click.Option) and parameter.is_flag:
        return ""
    if isinstance(parameter.type, click.Choice):
        return "|".join(map(str, parameter.type.choices))
    return parameter.metavar or (parameter.name or "value").upper()


def _names(option: click.Option) -> str:
    """Return the names of an option with its placeholder."""
    return f"{', '.join(option.opts)} {_value(option)}".rstrip().replace("|", r"\|")


def _usage(parameter: click.Parameter) -> str:
    """Return a parameter as it stands in a usage line."""
    if isinstance(parameter, click.Argument):
        return _value(parameter)
    word = f"{parameter.opts[-1]} {_value(parameter)}".rstrip()
    return word if parameter.required else f"[{word}]"


def _meaning(option: click.Option) -> str:
    """Return the help of an option and whether it is needed or repeatable."""
    notes = ["required"] * option.required + ["may be repeated"] * option.multiple
    return f"{option.help} ({', '.join(notes)})" if notes else str(option.help)


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
