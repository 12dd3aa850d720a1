"""The command `tradeoff`: effort against walking speed."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.json_output import print_json
from pathwalker_cli.commands.kinds import meant_as
from pathwalker_cli.commands.neighbour_study import base_of, study_options, teller

__all__ = ["tradeoff_command"]


@click.command("tradeoff")
@study_options("runs/tradeoff")
def tradeoff_command(
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Find the front of effort per distance and walking speed, as CONFIG says.

    CONFIG is a YAML file or the name of a shipped one. The problem is solved for a chain of weights
    of speed, to and fro; points for which the mesh of the base is too coarse are solved again on a
    finer one, into DIR/runs. The same command goes on after a stop. DIR/tradeoff.csv and
    DIR/figures hold the result. Exit codes: 0 done, 1 the base did not converge or Ctrl-C, 2 bad
    input.
    """
    from pathwalker_cli.commands.progress import Progress
    from pathwalker_cli.studies.base import claimed_folder, load_study
    from pathwalker_cli.studies.tradeoff.files import ENTRIES, tradeoff_content, write_tradeoff
    from pathwalker_cli.studies.tradeoff.study import TradeoffStudy, tradeoff_of
    from pathwalker_cli.studies.tradeoff.text import tradeoff_lines

    with meant_as("tradeoff", config):
        study = load_study(config, TradeoffStudy, changes)
    with claimed_folder(out, ENTRIES, "tradeoff"):
        base = base_of(study, run, out, quiet)
        tradeoff = tradeoff_of(study, base, out, teller(quiet), Progress(quiet=True))
        write_tradeoff(out, tradeoff)
    if as_json:
        print_json({"folder": str(out), **tradeoff_content(tradeoff)})
    elif not quiet:
        click.echo("\n".join([*tradeoff_lines(tradeoff), f"\nWritten to {out}"]))
