"""The command `perturb`: what softer or stiffer springs change."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.json_output import print_json
from pathwalker_cli.commands.kinds import meant_as
from pathwalker_cli.commands.neighbour_study import base_of, study_options, teller

__all__ = ["perturb_command"]

ENTRIES = frozenset({"base", "points", "figures", "perturbation.csv", "perturbation.json"})
"""All that the command writes."""


@click.command("perturb")
@study_options("runs/perturbation")
def perturb_command(
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Move every orthosis spring a little from its optimum and solve all the rest again.

    CONFIG is a YAML file or the name of a shipped one (perturbation). Changes of cost, crouch,
    steps and speed stand beside table 5 of the article where the two are about the same patient.
    An interrupted call goes on where it was. Exit codes: 0 all converged, 1 some solve did not,
    2 bad input.
    """
    from pathwalker_cli.errors import NotConvergedError
    from pathwalker_cli.studies.base import claimed_folder, load_study
    from pathwalker_cli.studies.perturbation.figures import save_perturbation_figure
    from pathwalker_cli.studies.perturbation.study import PerturbationStudy, perturb
    from pathwalker_cli.studies.perturbation.text import (
        perturbation_content,
        perturbation_lines,
        write_perturbation,
    )

    with meant_as("perturbation", config):
        study = load_study(config, PerturbationStudy, changes)
    tell = teller(quiet)
    with claimed_folder(out, ENTRIES, "perturb"):
        result = perturb(
            study,
            base_of(study, run, out, quiet, springs=True),
            out,
            lambda row: tell(
                f"{row.label}: {row.status}, {row.iterations} iterations, {row.seconds:.1f} s"
            ),
        )
        write_perturbation(result, out)
        save_perturbation_figure(result, out / "figures")
    if as_json:
        print_json({"folder": str(out), **perturbation_content(result)})
    elif not quiet:
        click.echo("\n".join(perturbation_lines(result)))
        click.echo(f"\nWritten to {out}")
    if result.failed:
        failed = ", ".join(row.label for row in result.failed)
        raise NotConvergedError(f"no solution was found for {failed}; {out} holds the others")
