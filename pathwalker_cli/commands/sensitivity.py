"""The command `sensitivity`: what every number of patient and orthosis does to the answer."""

from __future__ import annotations

from pathlib import Path

import click

from pathwalker_cli.commands.json_output import print_json
from pathwalker_cli.commands.kinds import meant_as
from pathwalker_cli.commands.neighbour_study import base_of, study_options

__all__ = ["sensitivity_command"]


@click.command("sensitivity")
@study_options("runs/sensitivity")
def sensitivity_command(
    config: str,
    out: Path,
    run: Path | None,
    changes: tuple[str, ...],
    quiet: bool,
    as_json: bool,
) -> None:
    """Tell what one percent of every number would change, without solving again.

    CONFIG is a YAML file or the name of a shipped one (sensitivity). Springs, orthosis, strengths,
    mass and lengths are asked about, one by one; the derivatives of cost and of every gait metric
    come from the optimality conditions. Exit codes: 0 done, 1 the base did not converge, 2 bad
    input.
    """
    from pathwalker_cli.studies.base import claimed_folder, load_study
    from pathwalker_cli.studies.sensitivity.figures import save_sensitivity_figure
    from pathwalker_cli.studies.sensitivity.study import SensitivityStudy, sensitivities
    from pathwalker_cli.studies.sensitivity.text import (
        FILES,
        sensitivity_content,
        sensitivity_lines,
        write_sensitivities,
    )

    with meant_as("sensitivity", config):
        study = load_study(config, SensitivityStudy, changes)
    with claimed_folder(out, frozenset({"base", "points", "figures", *FILES}), "sensitivity"):
        result = sensitivities(study, base_of(study, run, out, quiet), out)
        write_sensitivities(result, out)
        save_sensitivity_figure(result, out / "figures")
    if as_json:
        print_json({"folder": str(out), **sensitivity_content(result)})
    elif not quiet:
        click.echo("\n".join(sensitivity_lines(result)))
        click.echo(f"\nWritten to {out}")
