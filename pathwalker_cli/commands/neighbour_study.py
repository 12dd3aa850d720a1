"""What the commands that solve neighbours of one optimum share: options, base run, progress."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pathwalker_cli.commands.complete import complete_configs, complete_runs, set_option
from pathwalker_cli.commands.json_output import json_option

if TYPE_CHECKING:
    from pathwalker_cli.results.run_folder import Run
    from pathwalker_cli.studies.base import NeighbourStudy

__all__ = ["base_of", "study_options", "teller"]

Command = Callable[..., Any]


_CONFIG = click.argument("config", metavar="CONFIG", shell_complete=complete_configs)

_OPTIONS = (
    click.option(
        "--run",
        type=click.Path(path_type=Path),
        metavar="RUN",
        shell_complete=complete_runs,
        help="Folder of a converged run to stand on, instead of solving the base.",
    ),
    set_option("Override a value of CONFIG; 'set={KEY: VALUE}' overrides one of the base."),
    click.option("--quiet", is_flag=True, help="Print errors only."),
    json_option,
)


def _out_option(default: str) -> Callable[[Command], Command]:
    """Return the option of the folder of the results."""
    return click.option(
        "--out",
        type=click.Path(path_type=Path),
        default=Path(default),
        show_default=True,
        metavar="DIR",
        help="Folder of the results; what is solved there already is kept.",
    )


def study_options(out: str) -> Callable[[Command], Command]:
    """Return a decorator that adds argument and options of a study.

    Args:
        out: Folder of the results if none is given.
    """

    def decorate(command: Command) -> Command:
        for option in reversed(_OPTIONS):
            command = option(command)
        return _CONFIG(_out_option(out)(command))

    return decorate


def base_of(
    study: NeighbourStudy, run: Path | None, out: Path, quiet: bool, springs: bool = False
) -> Run:
    """Return the run that a study stands on: the given one, or the base solved now.

    Args:
        study: The study.
        run: Folder of the given run.
        out: Folder of the results.
        quiet: Whether nothing shall be shown.
        springs: Whether the problem must have springs.

    Raises:
        ConfigError: If a run is given and the study overrides values of the base, or if there are
            no springs where they are needed.
        DataError: If the run cannot be used.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import ConfigError, DataError, NotConvergedError
    from pathwalker_cli.results.run_folder import load_run
    from pathwalker_cli.studies.base import base_case, base_run
    from pathwalker_cli.studies.springs import require_springs

    if run is None:
        case = base_case(study)
        if springs:
            require_springs(case.config, f"base {study.base}")
        with Progress(quiet) as progress:
            return base_run(case, out / "base", progress)
    if study.set:
        raise ConfigError(
            "overrides values of the base, but --run brings a config of its own",
            where="set",
            mend="leave one of the two out",
        )
    try:
        found = load_run(run)
    except NotConvergedError as error:
        raise DataError(str(error), where="--run", allowed="a converged run") from None
    if springs:
        require_springs(found.config, f"--run {run}")
    return found


def teller(quiet: bool) -> Callable[[str], None]:
    """Return what shows one line of progress on stderr."""
    return (lambda line: None) if quiet else (lambda line: click.echo(line, err=True))
