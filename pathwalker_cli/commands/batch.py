"""The command `batch`: patients, problems and overrides in any number, on all cores."""

from __future__ import annotations

from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pathwalker_cli.commands.complete import complete_configs
from pathwalker_cli.commands.options import (
    json_option,
    meant_as,
    out_option,
    print_json,
    quiet_option,
    set_option,
)

if TYPE_CHECKING:
    from pathwalker_cli.studies.batch.worker import Pool


@click.command("batch")
@click.argument("study", metavar="STUDY", shell_complete=complete_configs)
@out_option(
    "Folder of runs and table; runs/ and the name of STUDY if left out. What is done there "
    "already is kept.",
    "-o",
)
@click.option(
    "--workers",
    type=click.IntRange(1, 10000),
    metavar="N",
    help="Cases at a time, each on one core; all cores if left out. With slurm: jobs.",
)
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Dask scheduler whose workers solve the cases, e.g. tcp://10.0.0.1:8786; or slurm.",
)
@click.option(
    "--time-limit",
    type=click.FloatRange(0.0, min_open=True),
    metavar="SECONDS",
    help="Give up a case that takes longer. On this machine only.",
)
@set_option("Override a key of STUDY.")
@quiet_option
@json_option
def batch_command(
    study: str,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    time_limit: float | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Solve every case of STUDY: patients, problems and overrides in any number.

    STUDY is a YAML file or the name of a shipped one. All cases are checked before the first is
    solved. DIR/cases.csv has a row for every case, DIR/cases a run folder. A case that converged
    with the same config is not solved again, so an interrupted call goes on where it was, and
    patients may be added. Exit codes: 0 all converged, 1 some case did not, 2 bad input.
    """
    from pathwalker_cli.commands.progress import BatchProgress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.batch.cases import load_cases
    from pathwalker_cli.studies.batch.study import (
        failure_sentence,
        report_content,
        report_text,
        run_batch,
    )

    with meant_as("cohort", study):
        batch = load_cases(study, changes)
    folder = out or Path("runs") / batch.name
    with _pool(workers, scheduler, time_limit) as pool, BatchProgress(quiet) as progress:
        report = run_batch(batch.cases, folder, pool, progress)
    if as_json:
        print_json(report_content(report))
    elif not quiet:
        click.echo(report_text(report))
    if report.failed:
        raise NotConvergedError(failure_sentence(report))


def _pool(
    workers: int | None, scheduler: str | None, time_limit: float | None
) -> AbstractContextManager[Pool]:
    import os

    if scheduler is None:
        from pathwalker_cli.studies.batch.worker import LocalPool

        return nullcontext(LocalPool(workers or len(os.sched_getaffinity(0)), time_limit))
    _check_options(workers, scheduler, time_limit)
    from pathwalker_cli.studies.batch.cluster import connected, slurm_jobs

    return connected(scheduler) if workers is None else slurm_jobs(workers)


def _check_options(workers: int | None, scheduler: str, time_limit: float | None) -> None:
    """Refuse options that do not go with a scheduler."""
    from pathwalker_cli.errors import ConfigError

    if time_limit is not None:
        mend = "with --scheduler limit the solver, e.g. --set set.solver.ipopt.max_wall_time=600"
        raise ConfigError("is kept on this machine only", where="--time-limit", mend=mend)
    if scheduler == "slurm" and workers is None:
        what = "says how many jobs slurm shall start"
        raise ConfigError(what, where="--workers", mend="add --workers N")
    if scheduler != "slurm" and workers is not None:
        what = "does not change the workers of a scheduler that runs already"
        raise ConfigError(what, where="--workers", mend="leave it out")
