"""The command `model`: a patient's walking model as a URDF."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from pathwalker_cli.commands.complete import complete_patients
from pathwalker_cli.commands.options import out_option

if TYPE_CHECKING:
    from pathwalker_cli.conventions import Condition


@click.command("model")
@click.argument("patient", metavar="PATIENT", shell_complete=complete_patients)
@click.option(
    "--condition",
    required=True,
    type=click.Choice(["barefoot", "orthosis"]),
    help="What is worn: nothing, or shoes and orthoses.",
)
@out_option("File; else stdout.", "-o", metavar="FILE")
@click.option(
    "--published", is_flag=True, help="Keep the published model's misplaced right forearm and hand."
)
def model_command(patient: str, condition: str, out: Path | None, published: bool) -> None:
    """Write the walking model of PATIENT as a URDF, and its masses to stderr.

    PATIENT is a shipped id, a folder with patient.yaml, or a YAML file.
    """
    from pathwalker_cli.io.atomic import write_text
    from pathwalker_cli.model.anthropometry import segments
    from pathwalker_cli.model.urdf import urdf_text
    from pathwalker_cli.patient import load_patient

    who, chosen = load_patient(patient), cast("Condition", condition)
    text = urdf_text(who, chosen, published)
    if out is None:
        click.echo(text, nl=False)
    else:
        write_text(out, text)
    parts = segments(who, chosen, published)
    masses = ", ".join(f"{part.name} {part.mass:.3f}" for part in parts)
    click.echo(f"{who.id}, {chosen}: {sum(part.mass for part in parts):.3f} kg in all", err=True)
    click.echo(f"masses [kg]: {masses}", err=True)
    for note in who.notes:
        click.echo(f"note: {note}", err=True)
