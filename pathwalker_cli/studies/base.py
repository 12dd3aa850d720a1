"""What every study begins with: its own config, and the optimum whose neighbours it solves."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

from pydantic import Field

from pathwalker_cli.case import Case
from pathwalker_cli.config import load_config, place_of, read_config, with_values
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.io.atomic import check_room, sweep
from pathwalker_cli.io.fields import YamlModel
from pathwalker_cli.io.lock import locked
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.studies.run import RunLog, done_run, run_study

__all__ = [
    "NeighbourStudy",
    "base_case",
    "base_run",
    "check_folder",
    "claimed_folder",
    "load_study",
    "require_optimum",
    "resolver_of",
]


class NeighbourStudy(YamlModel):
    """A study around one optimum.

    `base` is the config of the problem, `set` overrides its values by dotted key.
    """

    base: str
    set: dict[str, Any] = Field(default_factory=dict)


Study = TypeVar("Study", bound=YamlModel)


def load_study(path: str | Path, model: type[Study], changes: tuple[str, ...] = ()) -> Study:
    """Read the config of a study; a path in `base` becomes a full one.

    Args:
        path: The YAML file, or the name of a shipped one.
        model: Model of its content.
        changes: Overrides "dotted.key=value" of the study's own keys.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    study, source = read_config(path, model, changes)
    base = getattr(study, "base", "")
    beside = place_of("base", source, changes) / base
    return (
        study.model_copy(update={"base": str(beside.resolve())})
        if base and os.path.isfile(beside)
        else study
    )


def base_case(study: NeighbourStudy) -> Case:
    """Return the problem that a study is about, and its patient.

    Raises:
        ConfigError: If there is no such config, or it is wrong.
        PatientError: If there is no such patient, or its file is refused.
    """
    config = load_config(study.base)
    return Case.of(with_values(config, study.set, f"set of the study on {study.base}"))


def base_run(case: Case, folder: Path, log: RunLog | None = None) -> Run:
    """Return the converged run of a case in a folder; it is solved unless it is there.

    Raises:
        NotConvergedError: If it does not converge: there is nothing to stand on then.
        DataError: If the folder holds something else.
    """
    run = done_run(folder, case)
    if run is None:
        solution = run_study(case, folder, log=log).solution
        if not solution.converged:
            raise NotConvergedError(
                f"{case.config.problem}, on which the study stands, did not converge: "
                f"{solution.status}; its last iterate is in {folder}"
            )
    return run or load_run(folder)


def resolver_of(run: Run, tolerance: float | None = None) -> Resolver:
    """Return a solver of the neighbours of a run."""
    return Resolver(run.case, run.motion, run.multipliers, tolerance)


def require_optimum(resolver: Resolver, run: Run, tolerance: float) -> Optimum:
    """Return the optimum around which a resolver solves neighbours.

    Args:
        resolver: The solver of neighbours of the run.
        run: The run, for the message.
        tolerance: Optimality tolerance of the solves, for the message.

    Raises:
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    optimum = resolver.optimum
    if not optimum.converged:
        raise NotConvergedError(
            f"the optimum in {run.folder} could not be solved to a tolerance of {tolerance:g}: "
            f"{optimum.result.status}"
        )
    return optimum


def check_folder(folder: Path, entries: frozenset[str], command: str) -> None:
    """Refuse a folder that cannot take the results, before anything is computed.

    Args:
        folder: Where results shall go.
        entries: Names of all files and folders that the command writes there.
        command: The command, for the message.

    Raises:
        DataError: If it is a file or holds something else.
    """
    if folder.exists() and not folder.is_dir():
        raise DataError("is a file, not a folder", where=str(folder), mend="choose another --out")
    check_room(folder)
    found = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    foreign = sorted(name for name in found - entries if not name.startswith("."))
    if foreign:
        raise DataError(
            f"is not empty and holds {foreign[0]}, which is no result of this command",
            where=str(folder),
            allowed=f"a new folder, or one that an earlier `pathwalker {command}` began",
            mend="choose another --out",
        )


@contextmanager
def claimed_folder(folder: Path, entries: frozenset[str], command: str) -> Iterator[None]:
    """Keep other processes out of the folder of a study, and tidy up after killed ones.

    Args:
        folder: Where results shall go; see `check_folder`.
        entries: Names of all files and folders that the command writes there.
        command: The command, for the message.

    Raises:
        DataError: If it cannot take the results, or another process is at work there.
    """
    check_folder(folder, entries, command)
    with locked(folder / ".lock", folder):
        sweep(folder, deep=True)
        yield
