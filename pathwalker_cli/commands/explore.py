"""The command `explore`: play with a run."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.complete import complete_runs
from pathwalker_cli.commands.options import out_option


@click.command("explore")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@out_option(
    "Write a page that needs no server, and end: it interpolates.", "-o", metavar="FILE.html"
)
@click.option(
    "--saves",
    type=click.Path(path_type=Path),
    metavar="DIR",
    help="Folder in which settings are saved; that of RUN if left out.",
)
@click.option("--no-open", is_flag=True, help="Print the address only, open no browser.")
def explore_command(run: Path, out: Path | None, saves: Path | None, no_open: bool) -> None:
    """Turn the numbers of RUN on a page of this machine, and see how the walk changes.

    Springs, orthosis, strengths, tightness and what is wanted of the walk have a slider each; every
    move is solved again from the walk before, as perturb and landscape do. What is shown can be
    saved as a run. It ends with Ctrl-C, or when the last page closes. With -o, a page for others
    is written instead, which interpolates between the points of a landscape around RUN and goes on
    by first-order changes.
    """
    import asyncio

    from pathwalker_cli.errors import DataError
    from pathwalker_cli.results.run_folder import load_converged
    from pathwalker_cli.studies.base import require_neighbours

    base = load_converged(run, mend="solve it again first")
    require_neighbours(base.config, str(run), predicts=True)
    if out is not None:
        from pathwalker_cli.explore.offline import offline_page
        from pathwalker_cli.io.atomic import check_output, write_text

        if out.suffix not in (".html", ".htm"):
            raise DataError("is no name of a page", where=f"--out {out}", allowed="FILE.html")
        check_output(out)
        write_text(out, offline_page(base))
        click.echo(f"Written to {out}")
        return
    from pathwalker_cli.explore.server import serve

    places = saves or run.resolve().parent
    if not places.is_dir():
        raise DataError("is no folder", where=f"--saves {places}", allowed="a folder that is there")

    def tell(address: str) -> None:
        click.echo(f"{run} at {address}; it ends with Ctrl-C or with its last page")
        if not no_open:
            click.launch(address)

    click.echo("Getting ready...", err=True)
    try:
        asyncio.run(serve(run, places, tell))
    except KeyboardInterrupt:
        click.echo()
