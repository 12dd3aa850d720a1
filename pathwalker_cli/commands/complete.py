"""What the shell offers for words: problems, configs, patients, run folders, keys of configs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Final

import click
from click.shell_completion import CompletionItem

from pathwalker_cli.studies.registry import STUDIES

_DEEPEST: Final = 3
_MOST_FOLDERS: Final = 300
"""How far and wide runs are looked for below a folder: an answer must come within a keystroke."""

_SHIPPED: Final = {
    "batch": "cohort",
    "id": "inverse-dynamics",
    "ik": "inverse-kinematics",
    **{name: entry.name for name, entry in STUDIES.items()},
}
"""Shipped configs of commands that read others than predictions."""


def complete_problems(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer the names of the problems."""
    from pathwalker_cli.problems import PROBLEMS

    return _items(name for name in PROBLEMS if name.startswith(begun))


def complete_configs(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer YAML files, folders on the way to them, and the names of shipped configs."""
    from pathwalker_cli.paths import shipped

    names = sorted(path.stem for path in shipped("configs").glob("*.yaml"))
    return _files_or(names, begun)


def complete_patients(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer YAML files, folders, and the ids of shipped patients."""
    from pathwalker_cli.paths import shipped

    ids = sorted(path.parent.name for path in shipped("patient_data").glob("*/patient.yaml"))
    return _files_or(ids, begun)


def _files_or(names: Iterable[str], begun: str) -> list[CompletionItem]:
    files = _paths(begun, (".yaml", ".yml"))
    return _items([*files, *(name for name in names if name.startswith(begun))])


def complete_runs(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer runs without a slash behind them, and folders below which there are some.

    For `report`, all folders count that a page can be made of.
    """
    wanted = _is_reported if context.info_name == "report" else _is_run
    offered = []
    for path in _paths(begun, ()):
        if wanted(Path(path)):
            offered.append(path.removesuffix("/"))
        elif _holds(Path(path), wanted):
            offered.append(path)
    return _items(offered)


def complete_keys(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer the dotted keys of the configs that a command reads."""
    name = _SHIPPED.get(context.info_name or "")
    keys = _keys_of_shipped(name) if name else _keys_of_predictions()
    return _items(key for key in keys if key.startswith(begun))


def _is_run(folder: Path) -> bool:
    return (folder / "metrics.json").is_file()


def _is_reported(folder: Path) -> bool:
    from pathwalker_cli.report.folders import kind_of

    return kind_of(folder) is not None


def _holds(folder: Path, wanted: Callable[[Path], bool]) -> bool:
    """Return whether there is a wanted folder below one, or too much to know at once."""
    level, seen = [folder], 0
    for _ in range(_DEEPEST):
        below = [inner for outer in level for inner in _folders(outer)]
        if any(map(wanted, below)) or (seen := seen + len(below)) > _MOST_FOLDERS:
            return True
        level = below
    return False


def _folders(folder: Path) -> list[Path]:
    """Return the visible folders in a folder; none if it may not be read."""
    try:
        with os.scandir(folder) as entries:
            names = [e.name for e in entries if e.is_dir() and not e.name.startswith(".")]
    except OSError:
        return []
    return [folder / name for name in sorted(names)]


def _keys_of_predictions() -> Iterator[str]:
    """Yield the keys of the config of a prediction, from its model."""
    from pathwalker_cli.config import StudyConfig
    from pathwalker_cli.io.fields import is_model

    for name, field in StudyConfig.model_fields.items():
        block = field.annotation
        if block is not None and is_model(block):
            yield from (f"{name}.{key}" for key in block.model_fields)
        else:
            yield name


def _keys_of_shipped(name: str) -> Iterator[str]:
    """Yield the keys of a shipped config, which holds all; models of studies take long to import.

    Below a key whose own keys have dots, overrides cannot reach.
    """
    from pathwalker_cli.io.yaml_file import read_mapping
    from pathwalker_cli.paths import shipped

    content, _ = read_mapping(shipped("configs") / f"{name}.yaml")
    for key, value in content.items():
        if isinstance(value, dict) and value and not any("." in inner for inner in value):
            yield from (f"{key}.{inner}" for inner in value)
        else:
            yield key


def _items(values: Iterable[str]) -> list[CompletionItem]:
    return [CompletionItem(value) for value in dict.fromkeys(values)]


def _paths(begun: str, endings: tuple[str, ...]) -> Iterator[str]:
    """Yield folders, with a slash, and files of these endings that begin so."""
    folder, slash, name = begun.rpartition("/")
    place = Path(folder or slash or ".")
    if not place.is_dir():
        return
    for path in sorted(place.iterdir()):
        if not path.name.startswith(name) or (path.name.startswith(".") and not name):
            continue
        if path.is_dir():
            yield f"{folder}{slash}{path.name}/"
        elif path.suffix in endings:
            yield f"{folder}{slash}{path.name}"


@click.command("completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def completion_command(context: click.Context, shell: str) -> None:
    """Print the script that completes commands, options, configs, problems and runs in SHELL.

    Bash needs version 4.4 or later. Load it at every start of the shell, as the examples say.
    """
    from click.shell_completion import ShellComplete, get_completion_class

    kind = get_completion_class(shell)
    assert kind is not None  # noqa: S101 - click knows every shell of the choice
    program = context.find_root().command
    complete = kind(program, {}, "pathwalker", "_PATHWALKER_COMPLETE")
    # Bash's own `source` asks a bash for its version; the script is the same without one.
    click.echo(ShellComplete.source(complete), nl=False)
