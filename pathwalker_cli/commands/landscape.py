"""The command `landscape`: cost over the spring stiffnesses of a side."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.json_output import print_json
from pathwalker_cli.commands.kinds import meant_as
from pathwalker_cli.commands.neighbour_study import base_of, study_options, teller

__all__ = ["landscape_command"]


@click.command("landscape")
@study_options("runs/landscape")
def landscape_command(
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Map the cost over K_D and K_P of a side, as CONFIG says, and the region of nearly best ones.

    CONFIG is a YAML file or the name of a shipped one. Every point is solved from its neighbours,
    those on another branch too, and kept in DIR/points: the same command goes on after a stop.
    DIR/landscape.csv, DIR/landscape.json and DIR/figures hold the result. Exit codes: 0 done, 1 the
    base did not converge or Ctrl-C, 2 bad input.
    """
    from pathwalker_cli.studies.base import claimed_folder, load_study
    from pathwalker_cli.studies.landscape.files import ENTRIES, landscape_content, write_landscape
    from pathwalker_cli.studies.landscape.solve import landscape_of
    from pathwalker_cli.studies.landscape.study import LandscapeStudy
    from pathwalker_cli.studies.landscape.text import landscape_lines

    with meant_as("landscape", config):
        study = load_study(config, LandscapeStudy, changes)
    with claimed_folder(out, ENTRIES, "landscape"):
        base = base_of(study, run, out, quiet)
        landscape = landscape_of(study, base, out / "points", teller(quiet))
        write_landscape(out, landscape)
    if as_json:
        print_json({"folder": str(out), **landscape_content(landscape)})
    elif not quiet:
        click.echo("\n".join([*landscape_lines(landscape), f"\nWritten to {out}"]))
