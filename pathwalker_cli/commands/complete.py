"""What the shell offers for arguments: problems, configs, patients and run folders."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import click
from click.shell_completion import CompletionItem

__all__ = [
    "complete_configs",
    "complete_patients",
    "complete_problems",
    "complete_runs",
    "runs_argument",
]

Complete = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


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
    return _items([*_paths(begun, (".yaml", ".yml")), *(n for n in names if n.startswith(begun))])


def complete_patients(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer YAML files, folders, and the ids of shipped patients."""
    from pathwalker_cli.paths import shipped

    ids = sorted(path.parent.name for path in shipped("patient_data").glob("*/patient.yaml"))
    return _items([*_paths(begun, (".yaml", ".yml")), *(n for n in ids if n.startswith(begun))])


def complete_runs(
    context: click.Context, parameter: click.Parameter, begun: str
) -> list[CompletionItem]:
    """Offer folders: runs without a slash behind them, others as a way to go on."""
    found = []
    for path in _paths(begun, ()):
        run = (Path(path) / "metrics.json").is_file()
        found.append(path.removesuffix("/") if run else path)
    return _items(found)


def runs_argument(metavar: str = "RUN...") -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return what adds the argument `runs`, one run folder or more, to a command."""
    return click.argument(
        "runs",
        nargs=-1,
        required=True,
        metavar=metavar,
        type=click.Path(path_type=Path),
        shell_complete=complete_runs,
    )


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
