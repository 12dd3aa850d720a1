"""Write `configuration.md`: every key of every config with type, range, default and reason.

Types, ranges and defaults come from the models that validate the configs, the reasons from the
comments in the shipped YAML files.

python docs/generate_configuration.py
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from types import NoneType, UnionType
from typing import Annotated, Any, Final, Literal, Union, get_args, get_origin

from annotated_types import Ge, Le
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.inverse.markers import MarkerSet
from pathwalker_cli.inverse.study import InverseDynamicsConfig, InverseKinematicsConfig
from pathwalker_cli.io.fields import Quantity, Sides
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.studies.batch.schema import BatchStudy
from pathwalker_cli.studies.landscape.study import LandscapeStudy
from pathwalker_cli.studies.perturbation.study import PerturbationStudy
from pathwalker_cli.studies.sensitivity.study import SensitivityStudy
from pathwalker_cli.studies.tradeoff.study import TradeoffStudy
from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy

PAGE: Final = Path(__file__).with_name("configuration.md")
CONFIGS: Final = PAGE.parent.parent / "configs"

STUDIES: Final[tuple[tuple[str, str, type[BaseModel]], ...]] = (
    ("Predictions", "mapd-orthosis.yaml", StudyConfig),
    ("Many cases", "cohort.yaml", BatchStudy),
    ("Softer and stiffer springs", "perturbation.yaml", PerturbationStudy),
    ("Uncertain numbers of the patient", "uncertainty.yaml", UncertaintyStudy),
    ("Cost over the springs", "landscape.yaml", LandscapeStudy),
    ("Effort against speed", "tradeoff.yaml", TradeoffStudy),
    ("What one percent changes", "sensitivity.yaml", SensitivityStudy),
    ("Recorded gait: angles", "inverse-kinematics.yaml", InverseKinematicsConfig),
    ("Recorded gait: torques and strengths", "inverse-dynamics.yaml", InverseDynamicsConfig),
    ("Recorded gait: markers", "markers.yaml", MarkerSet),
)
"""Heading, shipped file and model of every kind of config."""

ALLOWED: Final = {"problem": ", ".join(f"`{name}`" for name in PROBLEMS)}
"""Allowed values of keys that a validator checks."""

_HEAD: Final = """\
# Configuration

<!-- Written by docs/generate_configuration.py from the models and the shipped configs: change
those, not this. -->

Every key of every config, with type, range, default and reason.

A config is a YAML file; unknown keys, numbers outside their range and text in place of numbers are
refused with one sentence that names file, line and key. Units are SI and radians and are never
written beside a number. Paths are relative to the config's folder; those of C3D files and markers
may also be relative to where the command is run. `--set section.key=value` overrides a key on the
command line. All predictions (`ls-barefoot`, `mapd-barefoot`, `mapd-ws-orthosis`, `mapd-healthy`) have the keys
of `mapd-orthosis.yaml`. Keys of a patient's file are in [patient file](patient-file.md).

*What and why* is the comment that stands beside the key in the shipped file.
"""

_KINDS: Final[dict[Any, str]] = {
    float: "number",
    int: "whole number",
    bool: "true or false",
    str: "text",
    Any: "any value",
}


def page() -> str:
    """Return the whole page."""
    parts = [_HEAD]
    for heading, file, model in STUDIES:
        parts += [f"## {heading}: `configs/{file}`\n", *_tables(model, reasons(CONFIGS / file))]
    return "\n".join(parts)


def reasons(path: Path) -> dict[str, str]:
    """Return the comment of every dotted key of a YAML file.

    A comment goes on in the lines below it that hold only a comment, further in than the key.
    """
    found: dict[str, str] = {}
    parents: list[tuple[int, str]] = []
    key, commented = "", False
    for line in path.read_text(encoding="utf-8").splitlines():
        entry = re.match(r"(?P<indent> *)(?P<key>\w+):(?P<rest>.*)$", line)
        mark = re.search(r"(?:^|\s)#\s?(?P<text>.*)$", line)
        if entry:
            indent = len(entry["indent"])
            parents = [parent for parent in parents if parent[0] < indent]
            key = ".".join([*(name for _, name in parents), entry["key"]])
            parents.append((indent, entry["key"]))
            commented = mark is not None
            found[key] = mark["text"].strip() if mark else ""
        elif mark and commented and line.index("#") > parents[-1][0]:
            text = mark["text"].strip()
            found[key] += f"; {text}" if re.match(r"\w+: ", text) else f" {text}"
        else:
            commented = False
    return found


def _tables(model: type[BaseModel], why: dict[str, str]) -> Iterator[str]:
    """Yield one table for the keys of a model and one for each model inside it."""
    inner = {name: f for name, f in model.model_fields.items() if is_model(f.annotation)}
    plain = {name: f for name, f in model.model_fields.items() if name not in inner}
    plain = dict(sorted(plain.items(), key=lambda entry: not entry[1].is_required()))
    yield _table(plain, "", why)
    for name, field in inner.items():
        block = field.annotation
        assert block is not None
        about = " ".join((block.__doc__ or "").split("\n\n")[0].split())
        note = why.get(name, "").rstrip(";")
        said = f" In the shipped file: {note}{'' if note.endswith('?') else '.'}" if note else ""
        yield f"### {name}\n"
        yield f"{about}{said}\n"
        yield _table(block.model_fields, f"{name}.", why)


def _table(fields: dict[str, FieldInfo], prefix: str, why: dict[str, str]) -> str:
    """Return a table of keys."""
    lines = ["| key | type | allowed | default | what and why |", "| --- | --- | --- | --- | --- |"]
    for field_name, field in fields.items():
        key = f"{prefix}{field.alias or field_name}"
        lines.append(row(key, field, why.get(key, "not in the shipped file")))
    return "\n".join([*lines, ""])


def row(key: str, field: FieldInfo, meaning: str) -> str:
    """Return the row of a key: its dotted name, type, allowed values, default and meaning."""
    kind, allowed = described(field.annotation, list(field.metadata))
    allowed = ALLOWED.get(key, allowed)
    default = "required" if field.is_required() else f"`{_shown(_default(field))}`"
    cells = [f"`{key}`", kind, allowed or "any", default, meaning or "-"]
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


def described(annotation: Any, metadata: list[Any]) -> tuple[str, str]:
    """Return the type and the allowed values of an annotation in words."""
    for entry in metadata:
        if isinstance(entry, Quantity):
            unit = f", {entry.unit}" if entry.unit else ""
            return f"number{unit}", f"{entry.lower:g} to {entry.upper:g}"
    lowest = next((entry.ge for entry in metadata if isinstance(entry, Ge)), None)
    highest = next((entry.le for entry in metadata if isinstance(entry, Le)), None)
    if lowest is not None or highest is not None:
        return _KINDS[annotation], _between(lowest, highest)
    if annotation in _KINDS:
        return _KINDS[annotation], ""
    if is_model(annotation) and issubclass(annotation, Sides):
        kind, allowed = described(side_type(annotation), [])
        return f"{kind}; per side", allowed
    if is_model(annotation):
        return f"block of {', '.join(annotation.model_fields)}", ""
    return _composed(get_origin(annotation), get_args(annotation))


def _between(lowest: Any, highest: Any) -> str:
    """Return a range in words; either end may be open."""
    if highest is None:
        return f"{lowest} or more"
    return f"up to {highest}" if lowest is None else f"{lowest} to {highest}"


def _composed(origin: Any, parts: tuple[Any, ...]) -> tuple[str, str]:
    """Return the same for an annotation that is made of others."""
    if origin is Literal:
        return "text", ", ".join(f"`{part}`" for part in parts)
    if origin is Annotated:
        return described(parts[0], list(parts[1:]))
    if origin in (Union, UnionType):
        kinds = [("null", "") if part is NoneType else described(part, []) for part in parts]
        allowed = "; ".join(text for _, text in kinds if text)
        return " or ".join(kind for kind, _ in kinds), allowed
    if origin is dict:
        kind, allowed = described(parts[1], [])
        return f"{kind} per name", allowed
    kind, allowed = described(parts[0], [])
    if len(parts) == 1 or parts[1] is Ellipsis:
        return f"list of {kind}", allowed
    return kind.replace("number", "[lower, upper]"), allowed


def side_type(annotation: type[Sides]) -> Any:
    """Return the type of the value of one side."""
    return annotation.__pydantic_generic_metadata__["args"][0]


def is_model(annotation: Any) -> bool:
    """Return whether an annotation is a block of keys."""
    return isinstance(annotation, type) and issubclass(annotation, BaseModel)


def _default(field: FieldInfo) -> Any:
    return field.get_default(call_default_factory=True)


def _shown(value: Any) -> str:
    """Return a default as it would be written in YAML."""
    if value is None or isinstance(value, bool):
        return {None: "null", True: "true", False: "false"}[value]
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, dict):
        return "{" + ", ".join(f"{name}: {_shown(entry)}" for name, entry in value.items()) + "}"
    if isinstance(value, tuple | list):
        return "[" + ", ".join(map(_shown, value)) + "]"
    return str(value) or '""'


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
