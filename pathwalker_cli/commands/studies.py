"""The commands that study an optimum: perturb, sensitivity, uncertainty and more, one for each."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

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

if TYPE_CHECKING:
    from pathwalker_cli.results.run_folder import Run
    from pathwalker_cli.studies.base import NeighbourStudy, StudyKind


@dataclass(frozen=True)
class StudyCall:
    """A study as it was called.

    Args:
        config: Its config, a file or the name of a shipped one.
        out: Folder of the results.
        run: Folder of the run to stand on; None to solve the base of the study.
        changes: Overrides "dotted.key=value".
        quiet: Whether to show nothing.
        as_json: Whether to print one document.
        workers: Processes; None for as many as there are cores.
    """

    config: str
    out: Path
    run: Path | None
    changes: tuple[str, ...]
    quiet: bool
    as_json: bool
    workers: int | None = None

    def say(self, line: str) -> None:
        """Show one line of progress on stderr."""
        if not self.quiet:
            click.echo(line, err=True)

    def base(self, kind: StudyKind[Any, Any], study: NeighbourStudy) -> Run:
        """Return the run that a study stands on, read or solved now.

        Raises:
            ConfigError: If the study cannot take the base; then nothing is solved.
            DataError: If the run cannot be used.
            NotConvergedError: If the base did not converge.
        """
        from pathwalker_cli.commands.progress import Progress
        from pathwalker_cli.studies.base import base_run, planned

        case, run = planned(kind, study, self.run)
        if run is not None:
            return run
        with Progress(self.quiet) as progress:
            return base_run(case, self.out / "base", progress)


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


def _run(name: str, **words: Any) -> None:
    """Run a study: read it, check all that needs no solve, solve it, write and print its result."""
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import Work, claimed_folder, load_study

    call, entry = StudyCall(**words), STUDIES[name]
    kind = entry.load()
    with meant_as(entry.name, call.config):
        study = load_study(call.config, kind.model, call.changes)
    workers = call.workers or len(os.sched_getaffinity(0))
    work = Work(call.out, call.say, Progress(quiet=True), workers)
    with claimed_folder(call.out, kind.files | {"base"}, name):
        result = kind.run(study, call.base(kind, study), work)
        kind.write(result, call.out)
    if call.as_json:
        print_json({"folder": str(call.out), **kind.content(result)})
    elif not call.quiet:
        click.echo("\n".join([*kind.lines(result), f"\nWritten to {call.out}"]))
    if failed := kind.failed(result, call.out):
        raise NotConvergedError(failed)
