"""The commands `verify` and `rerun`: is a run what it says, and does it come out again?"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path

import click

from pathwalker_cli.commands.complete import complete_runs
from pathwalker_cli.commands.options import (
    json_option,
    out_option,
    print_json,
    quiet_option,
    runs_argument,
)


@click.command("verify")
@runs_argument()
@json_option
@click.pass_context
def verify_command(context: click.Context, runs: tuple[Path, ...], as_json: bool) -> None:
    """Check run folders from their files alone, without solving again.

    The folder of a batch or a trade-off stands for all converged runs in it. Tables and numbers are
    made anew from the motion; the equations of motion are evaluated by three engines, the stride is
    integrated anew, work is held against energy and forces against momentum, and the optimality
    conditions are evaluated outside the solver. Exit codes: 0 all is in order, 1 a check failed or
    a run did not converge, 2 a folder cannot be read.
    """
    from pathwalker_cli.errors import NotConvergedError, PathwalkerError
    from pathwalker_cli.verification.checks import Verification, verify_run
    from pathwalker_cli.verification.folders import runs_in, verify_table
    from pathwalker_cli.verification.text import verification_lines

    verifications: list[Verification] = []
    refused: list[PathwalkerError] = []
    steps: list[Callable[[], Verification | None]]
    steps = [partial(verify_table, folder) for folder in runs]
    steps += [partial(verify_run, run) for folder in runs for run in runs_in(folder)]
    for step in steps:
        try:
            verification = step()
        except PathwalkerError as error:  # the others are looked at all the same
            refused.append(error)
            click.echo(f"Error: {error}", err=True)
            continue
        if verification is not None:
            verifications.append(verification)
            if not as_json:
                click.echo("\n".join(verification_lines(verification)) + "\n")
    if as_json:
        verified = [each.as_dict() for each in verifications]
        print_json({"runs": verified, "refused": [str(error) for error in refused]})
    failed = [str(each.folder) for each in verifications if not each.passed]
    if failed:
        click.echo(f"Error: {', '.join(failed)}: a check failed", err=True)
    damaged = any(not isinstance(error, NotConvergedError) for error in refused)
    context.exit(2 if damaged else 1 if failed or refused else 0)


@click.command("rerun")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@out_option("Run folder; RUN-again if left out. An earlier run in it is replaced.")
@quiet_option
def rerun_command(run: Path, out: Path | None, quiet: bool) -> None:
    """Solve RUN again from its folder alone, and tell how the two differ.

    Config, patient and a recorded start are those that the folder keeps. On the same machine with
    the same versions the motion is the same to the last bit. Exit codes: 0 converged, 1 not
    converged, 2 bad input.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.results.run_folder import claimed_run, load_run
    from pathwalker_cli.results.text import failure_text
    from pathwalker_cli.studies.run import run_study
    from pathwalker_cli.verification.text import difference_lines

    before = load_run(run, allow_unconverged=True)
    folder = out or run.with_name(f"{run.resolve().name}-again")
    with claimed_run(folder), Progress(quiet) as progress:
        outcome = run_study(before.case, folder, None, progress)
    if not outcome.solution.converged:
        raise NotConvergedError(failure_text(outcome.solution, str(folder)))
    if not quiet:
        click.echo("\n".join(difference_lines(before, load_run(folder))))
        click.echo(f"\nWritten to {folder}")
