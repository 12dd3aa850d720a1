"""The command `reproduce`: the article's study from the shipped data to one page of results."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pathwalker_cli.commands.options import out_option, quiet_option

if TYPE_CHECKING:
    from pathwalker_cli.case import Case


@click.command("reproduce")
@out_option(
    "Folder of page, figures and runs; what is done there already is kept.", "-o", required=True
)
@click.option("--quick", is_flag=True, help="Coarse meshes and single starts, for a quick check.")
@click.option(
    "--starts",
    type=click.IntRange(1, 1000),
    default=8,
    show_default=True,
    metavar="N",
    help="Starts of mapd-barefoot and mapd-orthosis.",
)
@click.option(
    "--c3d",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="The article's C3D files in DIR/barefoot and DIR/orthosis, for its own inverse dynamics.",
)
@quiet_option
def reproduce_command(out: Path, quick: bool, starts: int, c3d: Path | None, quiet: bool) -> None:
    """Reproduce the article from the shipped data and write DIR/results.md.

    Inverse dynamics, all five problems, figures 1 to 7, and every number of tables 1, 3 and 4 and
    of the results section: paper, ours, deviation, and why. A run in DIR/runs that converged with
    the same config is not solved again, so an interrupted call goes on where it was. Exit codes: 0
    all converged, 1 some problem did not, 2 bad input.
    """
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.reproduce.pipeline import ENTRIES, PAGE, reproduce
    from pathwalker_cli.studies.base import claimed_folder

    def say(line: str) -> None:
        if not quiet:
            click.echo(line)

    with claimed_folder(out, ENTRIES, "reproduce"):
        results = reproduce(out, partial(_solve, quiet=quiet), say, starts, quick, c3d)
    say(f"\nWritten to {out / PAGE}")
    if results.failed:
        raise NotConvergedError(
            f"{', '.join(results.failed)} did not converge; {out / PAGE} says how it ended, and "
            "leaves out what depends on it"
        )


def _solve(case: Case, folder: Path, quiet: bool) -> None:
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.run import run_study

    try:
        with Progress(quiet) as progress:
            solution = run_study(case, folder, log=progress).solution
        stopped = solution.status == "stopped by the user"
    except KeyboardInterrupt:
        stopped = True
    if stopped:
        raise NotConvergedError(
            f"stopped by the user in {case.config.problem}; the same command goes on from there"
        )
