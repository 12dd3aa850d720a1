"""The command `compare`: runs beside one another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pathwalker_cli.commands.options import json_option, out_option, print_json, runs_argument

if TYPE_CHECKING:
    from pathwalker_cli.evaluation.evaluate import Change, Evaluation
    from pathwalker_cli.report.compare import Comparison


@click.command("compare")
@runs_argument()
@out_option(
    "Folder for compare.csv, compare.json and figures; nothing is written if left out.", "-o"
)
@json_option
def compare_command(runs: tuple[Path, ...], out: Path | None, as_json: bool) -> None:
    """Compare the metrics of two or more run folders; the first RUN is the base.

    Runs may be of any problems, conditions and patients; values of their configs that differ are
    listed. A run that did not converge is refused.
    """
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.report.compare import compare_runs, comparison_content, comparison_lines

    if len(runs) < 2:
        raise DataError("is one run", where=str(runs[0]), allowed="two runs or more")
    comparison = compare_runs(runs)
    if out is not None:
        _write(out, comparison)
    if as_json:
        print_json(comparison_content(comparison))
        return
    click.echo("\n".join(comparison_lines(comparison)))
    _echo_notes(comparison.notes)
    if out is not None:
        click.echo(f"\nWritten to {out}")


def _write(out: Path, comparison: Comparison) -> None:
    from pathwalker_cli.evaluation.curves import traces
    from pathwalker_cli.evaluation.figures import save_overlays
    from pathwalker_cli.io.atomic import staged_folder
    from pathwalker_cli.io.json_file import write_json
    from pathwalker_cli.report.compare import comparison_content, write_comparison_csv

    with staged_folder(out) as folder:
        write_json(folder / "compare.json", comparison_content(comparison))
        write_comparison_csv(folder / "compare.csv", comparison)
        save_overlays(traces(comparison.gaits, comparison.names), folder / "figures")


@click.command("evaluate")
@runs_argument()
@click.option("--trial", metavar="NAME", help="Trial to compare joint angles with at equal time.")
@out_option("Output folder; runs/evaluation-RUN if left out.", "-o")
@json_option
def evaluate_command(
    runs: tuple[Path, ...], trial: str | None, out: Path | None, as_json: bool
) -> None:
    """Compare the gait of one or more run folders with the recordings of the patient.

    A barefoot run and one with orthoses of the same patient also give the change from one to the
    other. Recordings are those beside the patient's file. A run that did not converge is refused.
    """
    from pathwalker_cli.evaluation.evaluate import changes_between, evaluate_gaits
    from pathwalker_cli.evaluation.run import gaits_of_runs
    from pathwalker_cli.evaluation.tables import evaluation_content

    gaits = [gait for _, gait in gaits_of_runs(runs)]
    evaluations = evaluate_gaits(gaits, trial)
    changes = changes_between(evaluations)
    content = evaluation_content(evaluations, changes)
    out = out or Path("runs") / "-".join(["evaluation", *(gait.name for gait in gaits)])
    _write_evaluation(out, evaluations, content)
    if as_json:
        print_json(content)
    else:
        _report(evaluations, changes, out)


def _write_evaluation(
    out: Path, evaluations: Sequence[Evaluation], content: dict[str, Any]
) -> None:
    """Write tables and figures, all or none."""
    from pathwalker_cli.evaluation.curves import Trace
    from pathwalker_cli.evaluation.figures import save_evaluation_figures
    from pathwalker_cli.evaluation.tables import write_csv
    from pathwalker_cli.io.atomic import staged_folder
    from pathwalker_cli.io.json_file import write_json

    with staged_folder(out) as folder:
        write_json(folder / "evaluation.json", content)
        write_csv(folder / "evaluation.csv", evaluations)
        for each in evaluations:
            figures = folder / "figures"
            save_evaluation_figures(
                Trace(each.gait, each.gait.problem, each.recorded),
                figures / each.gait.name if len(evaluations) > 1 else figures,
            )


def _report(evaluations: Sequence[Evaluation], changes: Sequence[Change], out: Path) -> None:
    from pathwalker_cli.evaluation.tables import change_lines, evaluation_lines, evaluation_notes

    for each in evaluations:
        click.echo("\n".join(evaluation_lines(each)) + "\n")
    if changes:
        click.echo("\n".join(change_lines(changes)) + "\n")
    notes = list(evaluation_notes(evaluations))
    if len(evaluations) > 1 and not changes:
        notes.append(
            "a change is shown from one barefoot run to one run with orthoses of the same patient"
        )
    _echo_notes(notes)
    click.echo(f"\nWritten to {out}")


def _echo_notes(notes: Iterable[str]) -> None:
    from textwrap import fill

    for note in notes:
        click.echo(fill(f"note: {note}", 80, subsequent_indent="      "))
