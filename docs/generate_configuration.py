"""Write `configuration.md`: every key of every config with type, range, default and reason.

Types, ranges and defaults come from the models that validate the configs, the reasons from the
comments in the shipped YAML files.

python docs/generate_configuration.py
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.inverse.markers import MarkerSet
from pathwalker_cli.inverse.study import InverseDynamicsConfig, InverseKinematicsConfig
from pathwalker_cli.io.commented_yaml import reasons
from pathwalker_cli.io.fields import described, field_at, is_model
from pathwalker_cli.patient import OrthosisData, Patient
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.starter.files import explained_keys
from pathwalker_cli.studies.batch.schema import BatchStudy
from pathwalker_cli.studies.registry import STUDIES as AROUND

PAGE: Final = Path(__file__).with_name("configuration.md")
CONFIGS: Final = PAGE.parent.parent / "configs"

STUDIES: Final[tuple[tuple[str, str, type[BaseModel]], ...]] = (
    ("Predictions", "mapd-orthosis.yaml", StudyConfig),
    ("Many cases", "cohort.yaml", BatchStudy),
    *((e.heading, f"{e.name}.yaml", e.load().model) for e in AROUND.values()),
    ("Recorded gait: angles", "inverse-kinematics.yaml", InverseKinematicsConfig),
    ("Recorded gait: torques and strengths", "inverse-dynamics.yaml", InverseDynamicsConfig),
    ("Recorded gait: markers", "markers.yaml", MarkerSet),
)
"""Heading, shipped file and model of every kind of config."""

ALLOWED: Final = {"problem": ", ".join(f"`{name}`" for name in PROBLEMS)}
"""Allowed values of keys that a validator checks."""

FILES: Final = {"learnt"}
"""Keys that name a file, whose content stands in a table of its own place."""

NOT_SHIPPED: Final = {
    "smoke": "not for your own configs: `solve --smoke` writes `true` into the config of its run folder, which marks "
    "the run as a quick check wherever it is shown; set by hand it marks too, but makes no mesh coarser",
}
"""Meaning of keys that no shipped file has."""

_HEAD: Final = """\
# Configuration

<!-- Written by docs/generate_configuration.py from the models and the shipped configs: change
those, not this. -->

Every key of every config, with type, range, default and reason.

A config is a YAML file; unknown keys, numbers outside their range and text in place of numbers are
refused with one sentence that names file, line and key. Units are SI and radians and are never
written beside a number. Paths are relative to the config's folder; those of C3D files and markers
may also be relative to where the command is run. `--set section.key=value` overrides a key on the
command line; paths in it are relative to where the command is run. All predictions (`ls-barefoot`, `mapd-barefoot`, `mapd-ws-orthosis`, `mapd-healthy`) have the keys
of `mapd-orthosis.yaml`. Keys of a patient's file are in [patient file](patient-file.md).

*What and why* is the comment that stands beside the key in the shipped file.
"""


_PATIENT: Final = {
    "patient": """\
`pathwalker init DIR` writes one, with these comments. `id`, `sex`, `age`, `body_mass` and `height`
are needed, and `strengths` for a prediction; everything else may be left out. `recorded` (speed,
steps and joint ranges from recorded gait) is written by `pathwalker id --update-patient`.
""",
    "orthosis": """\
The block `orthosis` of a patient's file, or a file of its own. `springs` may be left out.
""",
}


def page() -> str:
    """Return the whole page."""
    parts = [_HEAD]
    for heading, file, model in STUDIES:
        parts += [f"## {heading}: `configs/{file}`\n", *_tables(model, reasons(CONFIGS / file))]
    return "\n".join([*parts, *_patient_file()])


def _patient_file() -> Iterator[str]:
    """Yield what can be said of a patient and an orthosis, with the words of `pathwalker init`."""
    for heading, model in (("patient", Patient), ("orthosis", OrthosisData)):
        yield f"## Patient file{': the orthosis' * (model is OrthosisData)}\n"
        yield _PATIENT[heading]
        yield "| key | type | allowed | what it is and where to measure it |"
        yield "| --- | --- | --- | --- |"
        for place, text in explained_keys()[heading].items():
            field = field_at(model, place)
            kind, allowed = described(field.annotation, list(field.metadata))
            if place == "orthosis":
                kind, allowed = "path, or block of the keys below", ""
            cells = [f"`{place}`", kind, allowed or "any", text]
            yield "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"
        yield ""


def _tables(model: type[BaseModel], why: dict[str, str]) -> Iterator[str]:
    """Yield one table for the keys of a model and one for each model inside it."""
    fields = model.model_fields.items()
    inner = {name: f for name, f in fields if is_model(f.annotation) and name not in FILES}
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
        lines.append(row(key, field, {**NOT_SHIPPED, **why}[key]))
    return "\n".join([*lines, ""])


def row(key: str, field: FieldInfo, meaning: str) -> str:
    """Return the row of a key: its dotted name, type, allowed values, default and meaning."""
    kind, allowed = described(field.annotation, list(field.metadata))
    allowed = ALLOWED.get(key, allowed)
    default = "required" if field.is_required() else f"`{_shown(_default(field))}`"
    cells = [f"`{key}`", kind, allowed or "any", default, meaning or "-"]
    return "| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |"


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
