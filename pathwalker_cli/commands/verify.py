"""The commands `verify` and `rerun`: is a run what it says, and does it come out again?"""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.complete import complete_runs, runs_argument
from pathwalker_cli.commands.json_output import json_option, print_json

__all__ = ["rerun_command", "verify_command"]


@click.command("verify")
@runs_argument()
@json_option
def verify_command(runs: tuple[Path, ...], as_json: bool) -> None:
    """Check run folders from their files alone, without solving again.

    Tables and numbers are made anew from the motion; the equations of motion are evaluated by three
    engines, the stride is integrated anew, work is held against energy and forces against momentum,
    and the optimality conditions are evaluated outside the solver. Exit codes: 0 all is in order, 1
    a check failed or a run did not converge, 2 a folder cannot be read.
    """
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.verification.checks import verify_run
    from pathwalker_cli.verification.text import verification_lines

    found = []
    for folder in runs:
        found.append(verify_run(folder))
        if not as_json:
            click.echo("\n".join(verification_lines(found[-1])) + "\n")
    if as_json:
        print_json({"runs": [each.as_dict() for each in found]})
    failed = [str(each.folder) for each in found if not each.passed]
    if failed:
        raise NotConvergedError(f"{', '.join(failed)}: a check failed")


@click.command("rerun")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Run folder; RUN-again if left out. An earlier run in it is replaced.",
)
@click.option("--quiet", is_flag=True, help="Print errors only.")
def rerun_command(run: Path, out: Path | None, quiet: bool) -> None:
    """Solve RUN again from its folder alone, and tell how the two differ.

    Config, patient and a recorded start are those that the folder keeps. On the same machine with
    the same versions the motion is the same to the last bit. Exit codes: 0 converged, 1 not
    converged, 2 bad input.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.output.run_folder import claimed_run, load_run, repeatable_config
    from pathwalker_cli.output.solve_text import failure_text
    from pathwalker_cli.studies.run import run_study
    from pathwalker_cli.verification.again import difference_lines

    before = load_run(run, allow_unconverged=True)
    folder = out or run.with_name(f"{run.resolve().name}-again")
    with claimed_run(folder), Progress(quiet) as progress:
        outcome = run_study(repeatable_config(before), folder, None, progress)
    if not outcome.solution.converged:
        raise NotConvergedError(failure_text(outcome.solution, str(folder)))
    if not quiet:
        click.echo("\n".join(difference_lines(before, load_run(folder))))
        click.echo(f"\nWritten to {folder}")
