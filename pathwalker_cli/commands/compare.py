"""The command `compare`: runs beside one another."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from pathwalker_cli.commands.complete import runs_argument
from pathwalker_cli.commands.json_output import json_option, print_json

if TYPE_CHECKING:
    from pathwalker_cli.report.compare import Comparison

__all__ = ["compare_command"]


@click.command("compare")
@runs_argument()
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder for compare.csv, compare.json and figures; nothing is written if left out.",
)
@json_option
def compare_command(runs: tuple[Path, ...], out: Path | None, as_json: bool) -> None:
    """Compare the metrics of two or more run folders; the first RUN is the base.

    Runs may be of any problems, conditions and patients; values of their configs that differ are
    listed. A run that did not converge is refused.
    """
    from textwrap import fill

    from pathwalker_cli.errors import DataError
    from pathwalker_cli.report.compare import compare_runs, comparison_content, comparison_lines

    if len(runs) < 2:
        raise DataError("is one run", where=str(runs[0]), allowed="two runs or more")
    found = compare_runs(runs)
    if out is not None:
        _write(out, found)
    if as_json:
        print_json(comparison_content(found))
        return
    click.echo("\n".join(comparison_lines(found)))
    for note in found.notes:
        click.echo(fill(f"note: {note}", 80, subsequent_indent="      "))
    if out is not None:
        click.echo(f"\nWritten to {out}")


def _write(out: Path, found: Comparison) -> None:
    """Write tables and figures, all or none."""
    from pathwalker_cli.evaluation.curves import traces
    from pathwalker_cli.evaluation.figures import save_overlays
    from pathwalker_cli.inverse.recorded_files import staged_folder
    from pathwalker_cli.io.json_file import write_json
    from pathwalker_cli.report.compare import comparison_content, write_comparison_csv

    with staged_folder(out) as folder:
        write_json(folder / "compare.json", comparison_content(found))
        write_comparison_csv(folder / "compare.csv", found)
        save_overlays(traces(found.gaits, found.names), folder / "figures")
