"""The command `init`: a folder to begin with."""

from __future__ import annotations

import sys
from math import isnan, nan
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from pathwalker_cli.starter.child import Child
    from pathwalker_cli.starter.seen import Brace


@click.command("init")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.argument("walks", nargs=-1, type=click.Path(path_type=Path), metavar="[C3D...]")
@click.option("--id", "name", metavar="NAME", help="Code of the child; name of DIR if left out.")
@click.option("--age", type=float, metavar="YEARS", help="Age, 4 to 15; 9 if left out.")
@click.option("--mass", type=float, metavar="KG", help="Body mass; from the age if left out.")
@click.option("--height", type=float, metavar="M", help="Height; from the age if left out.")
@click.option("--sex", type=click.Choice(["female", "male"]), help="Needed with --from.")
@click.option(
    "--from",
    "source",
    type=click.Path(path_type=Path),
    metavar="C3D",
    help="Measure the child in a recorded pose or walk; C3D... are its barefoot walks.",
)
@click.option("--subject", metavar="NAME", help="Whose markers, if that file names several.")
@click.option(
    "--brace",
    type=click.Choice(["none", "planned", "worn"]),
    help="Whether an orthosis is planned or worn already; planned if left out.",
)
@click.option("--without-orthosis", is_flag=True, help="The same as --brace none.")
@click.option("--speed", type=float, metavar="M/S", help="Walking speed that was seen, barefoot.")
@click.option(
    "--knee-flexion",
    metavar="DEG",
    help="Least knee flexion in stance that was seen, barefoot: 35, or 40,30 right and left.",
)
@click.option(
    "--examined",
    multiple=True,
    metavar="NAME=DEG",
    help="Range of motion from the couch, e.g. popliteal_angle=50 or hip_extension=-5,0.",
)
@click.option("--example", is_flag=True, help="Also make C3D recordings of the child, to try all.")
def init_command(
    folder: Path,
    walks: tuple[Path, ...],
    name: str | None,
    age: float | None,
    mass: float | None,
    height: float | None,
    sex: str | None,
    source: Path | None,
    subject: str | None,
    brace: Brace | None,
    without_orthosis: bool,
    speed: float | None,
    knee_flexion: str | None,
    examined: tuple[str, ...],
    example: bool,
) -> None:
    """Write a folder for a new child: patient, orthosis and configs that explain themselves.

    The files hold the numbers of a made-up child, so everything runs as it is; every key has a
    comment with its unit and where to measure it. With --example, C3D files are made too: gait that
    was recorded of another child, played by the model of the made-up one. DIR must be new or empty.

    On a terminal it asks for what decides a prediction (orthosis, speed, crouch, tightness) unless
    one of these is given; Enter leaves each open.

    With --from, body mass, height, lengths and feet are those of a recording with a marker set that
    is recognised, and the file says where each number comes from; walks, and that recording with
    them, are copied to c3d/barefoot.
    """
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.io.c3d_checks import c3d_files
    from pathwalker_cli.starter.child import made_child
    from pathwalker_cli.starter.files import command_lines, next_steps, write_folder
    from pathwalker_cli.starter.seen import seen_of

    id_ = name or _safe(folder.resolve().name)
    if source:
        if example:
            raise DataError(
                "makes up what --from measures", where="--example", mend="leave one out"
            )
        child = _measured_child(id_, age, sex, mass, height, source, subject)
    elif walks:
        mend = "add --from with a pose or a walk of the child"
        raise DataError("is given without --from", where=str(walks[0]), mend=mend)
    else:
        child = made_child(id_, age, mass, height, **({"sex": sex} if sex else {}))
    files = c3d_files([*walks, *([source] if source and walks else [])])
    brace = "none" if without_orthosis and brace is None else brace
    given = (brace, speed, knee_flexion, *examined)
    if not example and not any(given) and _at_a_terminal():
        brace, speed, knee_flexion, examined = _asked()
    seen = seen_of(brace or "planned", speed, knee_flexion or "", examined)
    if without_orthosis and seen.with_orthosis:
        raise DataError(f"contradicts --brace {brace}", where="--without-orthosis")
    write_folder(folder, child, seen, example, files)
    kind = "a child" if source else "a made-up child"
    click.echo(
        f"Wrote {folder}: {kind} of {child.age:g} years, {child.body_mass:g} kg and "
        f"{child.height:g} m.\n"
    )
    for origin in child.sources:
        click.echo(f"  {origin}")
    click.echo("\nNext:\n" if source else "Next:\n")
    click.echo(command_lines(f"cd {quote(str(folder))}", 2))
    for number, step in enumerate(next_steps(seen, example, bool(walks)), start=1):
        click.echo(f"\n{click.wrap_text(f'{number}. {step.why}', 80, '# ', '# ')}")
        for command in step.commands:
            click.echo(command_lines(command, 2))


def _at_a_terminal() -> bool:
    return sys.stdin.isatty()


def _asked() -> tuple[Brace, float | None, str, tuple[str, ...]]:
    """Ask for what decides a prediction; Enter leaves each open."""
    from pathwalker_cli.starter.seen import BRACES, EXAMINED

    click.echo("What decides the prediction; Enter leaves a question open.")
    brace = click.prompt("Orthosis", type=click.Choice(BRACES), default="planned")
    speed = click.prompt("Walking speed seen, barefoot [m/s]", type=float, default=nan,
                         show_default=False)  # fmt: skip
    knee = click.prompt("Least knee flexion in stance seen, barefoot [deg; right,left]",
                        default="", show_default=False)  # fmt: skip
    examined = {
        name: click.prompt(f"Examined {name.replace('_', ' ')} [deg; right,left]", default="",
                           show_default=False)
        for name in EXAMINED
    }  # fmt: skip
    click.echo()
    told = tuple(f"{name}={angles}" for name, angles in examined.items() if angles.strip())
    return brace, None if isnan(speed) else speed, knee, told


def _measured_child(
    name: str,
    age: float | None,
    sex: str | None,
    mass: float | None,
    height: float | None,
    source: Path,
    subject: str | None,
) -> Child:
    """Return the child of a recording; what is given counts before what it tells."""
    from pathwalker_cli.errors import DataError
    from pathwalker_cli.inverse.body import measured_body
    from pathwalker_cli.starter.child import made_child

    if age is None or sex is None:
        raise DataError(
            "no recording tells a child's age and sex", where="--from", mend="add --age and --sex"
        )
    body = measured_body(source, mass, height, subject)
    told = {"--mass": body.mass, "--height": body.height}
    if missing := " and ".join(option for option, value in told.items() if value is None):
        what = f"does not tell {missing.replace('--', '')}"
        raise DataError(what, where=str(source), mend=f"add {missing}")
    sources = ("age, sex: as given", *body.sources)
    return made_child(name, age, body.mass, body.height, sex=sex, lengths=body.lengths,
                      soles=body.soles, sources=sources)  # fmt: skip


def _safe(name: str) -> str:
    """Return the name of a folder as an id."""
    import re

    return re.sub(r"[^A-Za-z0-9_-]+", "-", name).strip("-_")[:64] or "child"
