"""The command `uncertainty`: how far the answers spread if the patient's numbers are uncertain."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from pathwalker_cli.commands.json_output import print_json
from pathwalker_cli.commands.kinds import meant_as
from pathwalker_cli.commands.neighbour_study import base_of, study_options, teller

if TYPE_CHECKING:
    from pathwalker_cli.studies.pool import Solved

__all__ = ["uncertainty_command"]

ENTRIES = frozenset(
    {
        "base",
        "draws",
        "figures",
        "draws.csv",
        "uncertainty.csv",
        "correlations.csv",
        "uncertainty.json",
    }
)
"""All that the command writes."""

EVERY = 10
"""Draws between two lines of progress."""


@click.command("uncertainty")
@study_options("runs/uncertainty")
@click.option(
    "--workers",
    type=click.IntRange(1, 1000),
    metavar="N",
    help="Processes that solve; as many as there are cores if left out. Results are the same.",
)
def uncertainty_command(
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
    workers: int | None,
) -> None:
    """Draw the uncertain numbers of a patient and identify the springs anew for every draw.

    CONFIG is a YAML file or the name of a shipped one (uncertainty): what is uncertain, and by how
    much. Tells how far springs, cost and gait spread, how often a spring sits at a limit, and
    which number matters most. An interrupted call goes on where it was. Exit codes: 0 all draws
    converged, 1 some did not, 2 bad input.
    """
    import os

    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import claimed_folder, load_study
    from pathwalker_cli.studies.uncertainty.figures import save_uncertainty_figures
    from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy, uncertainty
    from pathwalker_cli.studies.uncertainty.text import (
        uncertainty_content,
        uncertainty_lines,
        write_uncertainty,
    )

    with meant_as("uncertainty", config):
        study = load_study(config, UncertaintyStudy, changes)
    count = workers or len(os.sched_getaffinity(0))
    with claimed_folder(out, ENTRIES, "uncertainty"):
        base = base_of(study, run, out, quiet, springs=True)
        result = uncertainty(study, base, out, count, _counted(study.draws, teller(quiet)))
        write_uncertainty(result, out)
        save_uncertainty_figures(result, out / "figures")
    if as_json:
        print_json({"folder": str(out), **uncertainty_content(result)})
    elif not quiet:
        click.echo("\n".join(uncertainty_lines(result)))
        click.echo(f"\nWritten to {out}")
    if result.failed:
        raise NotConvergedError(
            f"{len(result.failed)} of {len(result.solved)} draws did not converge; {out} holds "
            "the others, and what was drawn for these"
        )


def _counted(total: int, tell: Callable[[str], None]) -> Callable[[Solved], None]:
    """Return what tells how many draws are done, and of failed ones at once."""
    done = 0

    def told(solved: Solved) -> None:
        nonlocal done
        done += 1
        if solved.status != "converged":
            tell(f"{solved.name}: {solved.status}")
        if done % EVERY == 0 or done == total:
            tell(f"{done} of {total} draws")

    return told
