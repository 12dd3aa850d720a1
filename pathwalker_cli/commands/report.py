"""The command `report`: one page instead of many files."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.complete import runs_argument

__all__ = ["report_command"]


@click.command("report")
@runs_argument()
@click.option(
    "-o",
    "--out",
    required=True,
    type=click.Path(path_type=Path),
    metavar="FILE.html",
    help="The page; an earlier one is replaced.",
)
def report_command(runs: tuple[Path, ...], out: Path) -> None:
    """Write one self-contained HTML page about RUN folders, to be read or printed.

    Runs of one patient, barefoot and with orthoses, stand side by side; folders of perturb,
    sensitivity and landscape among RUN, inside or beside a run add their tables. Folders that id
    or batch wrote give a page of their own, of any number of patients. A run that did not converge
    is refused, except in a cohort, where it is shown as failed.
    """
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.io.atomic import check_output, write_text
    from pathwalker_cli.report.build import page_of
    from pathwalker_cli.report.html import page_html

    if out.suffix not in (".html", ".htm"):
        raise DataError("is no name of a page", where=f"--out {out}", allowed="FILE.html")
    check_output(out)
    write_text(out, page_html(page_of(runs)))
    click.echo(f"Written to {out}")
