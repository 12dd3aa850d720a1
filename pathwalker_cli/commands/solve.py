"""The command `solve`: from a config to a run folder."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pathwalker_cli.commands.complete import complete_configs, complete_problems, complete_runs
from pathwalker_cli.commands.options import (
    json_option,
    meant_as,
    out_option,
    print_json,
    quiet_option,
    set_option,
)

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from pathwalker_cli.case import Case
    from pathwalker_cli.studies.run import Outcome


@click.command("solve")
@click.argument("problem", metavar="PROBLEM", shell_complete=complete_problems)
@click.argument("config", metavar="CONFIG", shell_complete=complete_configs)
@out_option(
    "Run folder; runs/PROBLEM-PATIENT if left out, with -smoke behind it after --smoke. An "
    "earlier run in it is replaced."
)
@click.option(
    "--warm-start",
    type=click.Path(path_type=Path),
    metavar="RUN",
    shell_complete=complete_runs,
    help="Folder of a converged run of the same condition to begin with.",
)
@click.option("--smoke", is_flag=True, help="Coarse mesh without refinement, for a quick check.")
@set_option("Override a config value.")
@quiet_option
@json_option
def solve_command(
    problem: str,
    config: str,
    out: Path | None,
    warm_start: Path | None,
    smoke: bool,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Solve PROBLEM, e.g. mapd-orthosis, as CONFIG says and write a run folder.

    CONFIG is a YAML file or the name of a shipped one. Ctrl-C stops after the current iteration
    and keeps the last iterate. Exit codes: 0 converged, 1 not converged, 2 bad input.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.results.run_folder import claimed_run, default_folder
    from pathwalker_cli.results.text import failure_text
    from pathwalker_cli.studies.run import run_study

    case = _case(problem, config, changes, smoke)
    folder = out or default_folder(case.config, case.patient.id)
    with claimed_run(folder), Progress(quiet, heading=_worn(case)) as progress:
        outcome = run_study(case, folder, warm_start, progress)
    solution = outcome.solution
    if as_json:
        ended = {"status": solution.status, "converged": solution.converged}
        print_json({"folder": str(folder), **ended, "metrics": outcome.metrics})
    elif not quiet:
        _report(outcome, folder)
    if not solution.converged:
        raise NotConvergedError(failure_text(solution, str(folder)))


def _case(problem: str, path: str, changes: tuple[str, ...], smoke: bool) -> Case:
    """Return the config with all overrides, and its patient."""
    from dataclasses import replace

    from pathwalker_cli.case import load_case
    from pathwalker_cli.config import smoke_version
    from pathwalker_cli.problems import problem_named

    problem_named(problem)
    with meant_as("prediction", path):
        case = load_case(path, problem, changes)
    return replace(case, config=smoke_version(case.config)) if smoke else case


def _worn(case: Case) -> tuple[str, ...]:
    """Return what is worn, to be read while the solve runs: a wrong sign shows as a direction."""
    from pathwalker_cli.results.text import orthosis_rows

    worn = case.patient.orthosis
    if case.config.condition == "barefoot" or worn is None:
        return ()
    return tuple(f"{label}: {text}" for label, text in orthosis_rows(worn))


def _report(outcome: Outcome, folder: Path) -> None:
    from pathwalker_cli.results.text import (
        detail_lines,
        notes_together,
        optimum_lines,
        solution_notes,
        source_lines,
        spring_notes,
        summary_rows,
    )
    from pathwalker_cli.studies.verdict.words import verdict_lines

    solution, metrics, verdict = outcome
    if solution.config.smoke:
        click.echo("SMOKE: a quick check on a coarse mesh; its numbers are not for use.\n")
    notes = []
    if solution.converged:
        notes = spring_notes(metrics, metrics["stiffness_ranges"]) + solution_notes(solution)
    _echo(summary_rows(metrics, solution.status, solution.cost), notes)
    click.echo()
    if verdict is not None:
        click.echo(f"How sure are the {'numbers' if verdict.numbers else 'springs'}?")
        _echo([*verdict_lines(verdict, solution.config.learnt, folder)], width=20)
        click.echo()
    rows = [*optimum_lines(solution.optima), *detail_lines(solution, metrics)]
    rows += [("bounds", line) for line in source_lines(solution.bounds.sources)]
    rows += [("patient", note) for note in notes_together(solution.walker.patient.notes)]
    _echo(rows, width=20)
    click.echo(f"\nWritten to {folder}")


def _echo(rows: Sequence[tuple[str, str]], notes: Iterable[str] = (), width: int = 0) -> None:
    """Print labels and texts, those of a terminal in colour."""
    from rich.console import Console

    from pathwalker_cli.results.text import summary, summary_renderable

    console = Console()
    if console.is_terminal:
        console.print(summary_renderable(rows, notes, width))
    else:
        click.echo(summary(rows, notes, width))
