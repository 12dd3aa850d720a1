"""The commands that study an optimum: perturb, sensitivity, uncertainty and more, one for each."""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import click

from pathwalker_cli.commands.complete import complete_configs, complete_runs
from pathwalker_cli.commands.options import (
    json_option,
    meant_as,
    print_json,
    quiet_option,
    set_option,
)
from pathwalker_cli.studies.registry import STUDIES


def study_command(name: str) -> click.Command:
    """Return the command of a study, with the options that all studies share."""
    entry = STUDIES[name]
    options: tuple[Callable[..., Any], ...] = (
        click.argument("config", metavar="CONFIG", shell_complete=complete_configs),
        click.option(
            "--out",
            type=click.Path(path_type=Path),
            default=Path("runs", entry.name),
            show_default=True,
            metavar="DIR",
            help="Folder of the results; what is solved there already is kept.",
        ),
        click.option(
            "--run",
            type=click.Path(path_type=Path),
            metavar="RUN",
            shell_complete=complete_runs,
            help="Folder of a converged run to stand on, instead of solving the base.",
        ),
        set_option("Override a value of CONFIG; 'set={KEY: VALUE}' overrides one of the base."),
        quiet_option,
        json_option,
        *([_workers_option] if entry.parallel else []),
    )
    command: Callable[..., Any] = partial(_run, name)
    for option in reversed(options):
        command = option(command)
    return click.command(name, help=entry.help)(command)


_workers_option = click.option(
    "--workers",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Processes that solve; as many as there are cores if left out. Results are the same.",
)


def _run(
    name: str,
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
    workers: int | None = None,
) -> None:
    """Run a study: read it, check all that needs no solve, solve it, write and print its result."""
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import Work, base_run, claimed_folder, load_study, planned

    def say(line: str) -> None:
        if not quiet:
            click.echo(line, err=True)

    entry = STUDIES[name]
    kind = entry.load()
    with meant_as(entry.name, config):
        study = load_study(config, kind.model, changes)
    work = Work(out, say, Progress(quiet=True), workers or len(os.sched_getaffinity(0)))
    with claimed_folder(out, kind.files | {"base"}, name):
        case, base = planned(kind, study, run)
        if base is None:
            with Progress(quiet) as progress:
                base = base_run(case, out / "base", progress)
        result = kind.run(study, base, work)
        kind.write(result, out)
    if as_json:
        print_json({"folder": str(out), **kind.content(result)})
    elif not quiet:
        click.echo("\n".join([*kind.lines(result), f"\nWritten to {out}"]))
    if failed := kind.failed(result, out):
        raise NotConvergedError(failed)
