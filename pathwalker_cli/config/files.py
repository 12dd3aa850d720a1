"""Study configs from files: YAML in, validated frozen models out."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, TypeVar

from pydantic import BaseModel

from pathwalker_cli.config.learnt import Learnt, config_values
from pathwalker_cli.config.schema import StudyConfig, merged
from pathwalker_cli.config.values import PLACES, apply_change, nested
from pathwalker_cli.errors import ConfigError, did_you_mean
from pathwalker_cli.io.refusals import KeyPath, Lines
from pathwalker_cli.io.yaml_file import read_mapping, validate
from pathwalker_cli.paths import shipped

Model = TypeVar("Model", bound=BaseModel)


def load_config(path: str | Path, problem: str = "", changes: tuple[str, ...] = ()) -> StudyConfig:
    """Read a study config.

    Args:
        path: The YAML file, or the name of a shipped one, e.g. "mapd-orthosis".
        problem: Problem that was asked for; it must be the config's own.
        changes: Overrides "dotted.key=value", as from the command line.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    config, source = read_config(path, StudyConfig, changes, complete=_with_learnt)
    if problem and config.problem != problem:
        raise ConfigError(
            f"is a config for {config.problem}, but {problem} was asked for",
            where=f"{path}, problem",
            mend=f"use the shipped config {problem}, or ask for {config.problem}",
        )
    folder = place_of("patient", source, changes)
    return config.model_copy(update={"patient": patient_path(config.patient, folder)})


def read_config(
    path: str | Path,
    model: type[Model],
    changes: tuple[str, ...] = (),
    places: Collection[KeyPath] = PLACES,
    complete: Callable[[dict[str, Any], Path, tuple[str, ...]], None] = lambda *_: None,
) -> tuple[Model, Path]:
    """Read a config of any kind; return it and its file.

    Args:
        path: The YAML file, or the name of a shipped one.
        model: Model of its content.
        changes: Overrides "dotted.key=value", as from the command line.
        places: Mappings whose keys have dots.
        complete: Puts into the content, from this file with these overrides, what other files hold.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    source, mapping, lines = config_content(path)
    origins = dict(lines)
    for change in changes:
        key = apply_change(mapping, change, places)
        for replaced in [k for k in origins if k[: len(key)] == key]:
            del origins[replaced]
        origins[key] = f"--set {change}"
    complete(mapping, source, changes)
    return validate(mapping, model, where=str(path), error=ConfigError, lines=origins), source


def _with_learnt(mapping: dict[str, Any], source: Path, changes: tuple[str, ...]) -> None:
    """Put learnt numbers in the place of the name of their file, and where the config is silent.

    A file is looked for beside the config, then beside the shipped patients.

    Raises:
        ConfigError: If it cannot be read.
    """
    name = mapping.get("learnt")
    if not isinstance(name, str):
        return
    beside = place_of("learnt", source, changes) / name
    file = beside if os.path.isfile(beside) else shipped("patient_data") / name
    if not os.path.isfile(file):
        raise ConfigError(
            f"names {name}, which does not exist",
            where=f"{source}, learnt",
            allowed="a file that `pathwalker learn` wrote, beside the config",
        )
    content, lines = read_mapping(file, ConfigError)
    learnt = validate(content, Learnt, where=str(file), error=ConfigError, lines=lines)
    mapping.update(merged(nested(config_values(learnt.values)), mapping) | {"learnt": content})


def config_content(path: str | Path) -> tuple[Path, dict[str, Any], Lines]:
    """Return the file of a config, what it holds, and the line of each of its keys.

    Raises:
        ConfigError: If it cannot be read.
    """
    source = find_config(Path(path))
    if not os.path.exists(source):
        near = [file.stem for file in shipped("configs").glob("*.yaml")]
        if os.path.isdir(source.parent):
            near += [file.stem for file in source.parent.glob("*.yaml")]
        if mend := did_you_mean(source.stem, near):
            raise ConfigError("no such file", where=str(path), mend=mend)
    return source, *read_mapping(source, ConfigError)


def place_of(key: str, source: Path, changes: tuple[str, ...]) -> Path:
    """Return the folder that a path at a key counts from: here if an override gave it."""
    overridden = {change.partition("=")[0].strip() for change in changes}
    return Path() if key in overridden else source.parent


def find_config(path: Path) -> Path:
    """Return the file, or the shipped config of that name where there is no such file."""
    if not os.path.isfile(path):  # False too for what cannot be a path
        for name in (path.name, f"{path.name}.yaml"):
            candidate = shipped("configs") / name
            if os.path.isfile(candidate) and path.parent.name in ("", "configs"):
                return candidate
    return path


def patient_path(patient: str, folder: Path) -> str:
    """Return a patient path relative to a folder as a full path; ids stay."""
    candidate = folder / patient
    return str(candidate.resolve()) if "/" in patient or os.path.isfile(candidate) else patient
