"""The command `export`: a run as other programs read it."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.complete import complete_runs
from pathwalker_cli.commands.options import out_option


@click.command("export")
@click.argument("run", metavar="RUN", type=click.Path(path_type=Path), shell_complete=complete_runs)
@out_option("Output folder.", "-o", required=True)
@click.option(
    "--opensim",
    is_flag=True,
    help="Also write the walker as an OpenSim model, with states, controls, external loads and a "
    "set-up of the inverse dynamics tool.",
)
def export_command(run: Path, out: Path, opensim: bool) -> None:
    """Write the stride of RUN for other programs: motion, ground forces, torques, points.

    Tables are .mot, .sto and .trc in OpenSim's axes (x forward, y up, z to the right) and SI units
    (points in mm), with PathWalker's names and signs of the coordinates. A run that did not
    converge is refused.
    """
    from pathwalker_cli.evaluation.run import stride_of_run
    from pathwalker_cli.export.files import write_export
    from pathwalker_cli.io.atomic import staged_folder

    _, series = stride_of_run(run)
    with staged_folder(out) as folder:
        write_export(folder, series, opensim)
        files = sorted(path.name for path in folder.iterdir())
    click.echo(f"Written to {out}: {', '.join(files)}")
