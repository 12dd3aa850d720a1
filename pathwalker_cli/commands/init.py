"""The command `init`: a folder to begin with."""

from __future__ import annotations

from pathlib import Path

import click


@click.command("init")
@click.argument("folder", metavar="DIR", type=click.Path(path_type=Path))
@click.option("--id", "name", metavar="NAME", help="Code of the child; name of DIR if left out.")
@click.option("--age", type=float, metavar="YEARS", help="Age, 4 to 15; 9 if left out.")
@click.option("--mass", type=float, metavar="KG", help="Body mass; from the age if left out.")
@click.option("--height", type=float, metavar="M", help="Height; from the age if left out.")
@click.option("--without-orthosis", is_flag=True, help="Of a child that only walks barefoot.")
@click.option("--example", is_flag=True, help="Also make C3D recordings of the child, to try all.")
def init_command(
    folder: Path,
    name: str | None,
    age: float | None,
    mass: float | None,
    height: float | None,
    without_orthosis: bool,
    example: bool,
) -> None:
    """Write a folder for a new child: patient, orthosis and configs that explain themselves.

    The files hold the numbers of a made-up child, so everything runs as it is; every key has a
    comment with its unit and where to measure it. With --example, C3D files are made too: gait that
    was recorded of another child, played by the model of the made-up one. DIR must be new or empty.
    """
    import re
    import shlex

    from pathwalker_cli.starter.child import made_child
    from pathwalker_cli.starter.files import command_lines, next_steps, write_folder

    safe = re.sub(r"[^A-Za-z0-9_-]+", "-", folder.resolve().name).strip("-_")[:64] or "child"
    child = made_child(name or safe, age, mass, height)
    with_orthosis = not without_orthosis
    write_folder(folder, child, with_orthosis, example)
    click.echo(
        f"Wrote {folder}: a made-up child of {child.age:g} years, {child.body_mass:g} kg and "
        f"{child.height:g} m.\n\nNext:\n"
    )
    click.echo(f"{command_lines(f'cd {shlex.quote(str(folder))}', 2)}")
    for number, step in enumerate(next_steps(with_orthosis, example), start=1):
        click.echo(f"\n{click.wrap_text(f'{number}. {step.why}', 80, '# ', '# ')}")
        for command in step.commands:
            click.echo(command_lines(command, 2))
