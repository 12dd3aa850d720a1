"""The command `view`: the stride of a run in 3D."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.complete import complete_runs

__all__ = ["view_command"]


@click.command("view")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@click.option(
    "--strides",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Strides to play; until Ctrl-C if left out.",
)
@click.option("--no-open", is_flag=True, help="Print the address only, open no browser.")
def view_command(run: Path, strides: int | None, no_open: bool) -> None:
    """Show the stride of RUN in 3D in a browser, in real time, until Ctrl-C.

    The walker moves on the spot, as on a treadmill. Needs MeshCat: pip install meshcat. A run that
    did not converge is refused.
    """
    from pathwalker_cli.animation.viewer import open_viewer, show
    from pathwalker_cli.evaluation.run import stride_of_run

    _, series = stride_of_run(run)
    viewer = open_viewer(series.walker)
    click.echo(f"{run} at {viewer.viewer.url()}; Ctrl-C ends it")
    if not no_open:
        viewer.viewer.open()
    try:
        show(viewer, series, strides)
    except KeyboardInterrupt:
        click.echo()
