"""The inverse dynamics study of the recordings, kept in a file so that it is done once."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli import __version__
from pathwalker_cli.inverse.evaluate import dynamics_trials
from pathwalker_cli.inverse.study import InverseDynamicsConfig, load_inverse_dynamics
from pathwalker_cli.inverse.study_tables import residual_tables, strength_table
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.patient import Patient, load_patient

__all__ = ["METHODS", "NO_C3D", "InverseResult", "inverse_config", "inverse_result"]

METHODS: Final = ("default", "published")
"""Methods of inverse dynamics, ours and the article's."""

NO_C3D: Final = "not computed: the published method needs the article's C3D files (--c3d)"
"""Why there is no result of the published method."""

_PARTS: Final = ("forward", "up", "moment")


@dataclass(frozen=True)
class InverseResult:
    """Strengths and residuals by one method.

    Args:
        method: "default" or "published".
        body_mass: Mass by which residuals are divided [kg].
        strengths: Maximum isometric torque by generator [N m].
        residuals: By "<condition>_<forward|up|moment>_<mean|min|max>", means of trials over whole
            gait cycles, per body mass [N/kg, N m/kg].
        remarks: By generator, what makes its strength uncertain.
    """

    method: str
    body_mass: float
    strengths: Mapping[str, float]
    residuals: Mapping[str, float]
    remarks: Mapping[str, str]


def inverse_config(method: str, c3d: Path | None) -> InverseDynamicsConfig | None:
    """Return the shipped study with a method, None if it lacks the C3D files.

    Args:
        method: A member of `METHODS`.
        c3d: Folder with the folders barefoot and orthosis of the article's C3D files, or None.
    """
    if method == "default":
        return load_inverse_dynamics("inverse-dynamics")
    if c3d is None:
        return None
    folders = (f"c3d.{name}=[{json.dumps(str(c3d / name))}]" for name in ("barefoot", "orthosis"))
    return load_inverse_dynamics("inverse-dynamics", ("source=c3d", "method=published", *folders))


def inverse_result(
    config: InverseDynamicsConfig, file: Path, progress: Callable[[str], None]
) -> tuple[InverseResult, bool]:
    """Return strengths and residuals, and whether they were read from the file of an earlier run.

    Args:
        config: The study.
        file: Where the result is kept; written if it was not there or belongs to something else.
        progress: Told which trial is at work.
    """
    patient = load_patient(config.patient)
    key = _key(config, patient)
    kept = _read(file, key)
    if kept is not None:
        return kept, True
    trials = dynamics_trials(config, patient, progress)
    residuals = {}
    for table in residual_tables(trials, patient, config):
        if table.part == "whole cycle" and table.range is not None:
            spans = {
                "mean": table.range.mean,
                "min": table.range.lowest,
                "max": table.range.highest,
            }
            for kind, values in spans.items():
                for part, value in zip(_PARTS, values / table.body_mass, strict=True):
                    residuals[f"{table.condition}_{part}_{kind}"] = float(value)
    rows = strength_table(trials, patient, config).rows
    result = InverseResult(
        method=config.method,
        body_mass=float(patient.body_mass),
        strengths={row.generator: float(row.value) for row in rows},
        residuals=residuals,
        remarks={row.generator: row.remark for row in rows},
    )
    file.parent.mkdir(parents=True, exist_ok=True)
    with atomic_open(file) as stream:
        json.dump({"made_from": key, **asdict(result)}, stream, indent=2)
        stream.write("\n")
    return result, False


def _key(config: InverseDynamicsConfig, patient: Patient) -> dict[str, Any]:
    """Return what a result depends on."""
    text = patient.source.read_text(encoding="utf-8") if patient.source is not None else ""
    return {"config": config.model_dump(mode="json"), "patient": text, "version": __version__}


def _read(file: Path, key: dict[str, Any]) -> InverseResult | None:
    """Return an earlier result that was made from the same, or None."""
    try:
        content = json.loads(file.read_text(encoding="utf-8"))
        made_from = content.pop("made_from")
        return InverseResult(**content) if made_from == key else None
    except (OSError, ValueError, KeyError, TypeError, AttributeError):
        return None
