"""What a file is, by the keys that it holds, and who checks it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel

from pathwalker_cli.checking import recorded, studies
from pathwalker_cli.checking.prediction import check_prediction
from pathwalker_cli.checking.report import Checked
from pathwalker_cli.config import StudyConfig, find_config
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.inverse.markers import MarkerSet
from pathwalker_cli.inverse.study import InverseDynamicsConfig, InverseKinematicsConfig
from pathwalker_cli.io.yaml_file import read_mapping
from pathwalker_cli.patient import OrthosisData, Patient, shipped_patients
from pathwalker_cli.problems import problem_named
from pathwalker_cli.studies.batch.schema import BatchStudy
from pathwalker_cli.studies.landscape.study import LandscapeStudy
from pathwalker_cli.studies.perturbation.study import PerturbationStudy
from pathwalker_cli.studies.sensitivity.study import SensitivityStudy
from pathwalker_cli.studies.tradeoff.study import TradeoffStudy
from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy

__all__ = ["KINDS", "check_file"]

Check = Callable[[str], Checked]

KINDS: Final[dict[str, tuple[type[BaseModel], Check]]] = {
    "prediction": (StudyConfig, check_prediction),
    "perturbation": (PerturbationStudy, studies.check_perturbation),
    "sensitivity": (SensitivityStudy, studies.check_sensitivity),
    "uncertainty": (UncertaintyStudy, studies.check_uncertainty),
    "landscape": (LandscapeStudy, studies.check_landscape),
    "tradeoff": (TradeoffStudy, studies.check_tradeoff),
    "cohort": (BatchStudy, studies.check_batch),
    "inverse-kinematics": (InverseKinematicsConfig, recorded.check_kinematics),
    "inverse-dynamics": (InverseDynamicsConfig, recorded.check_dynamics),
    "markers": (MarkerSet, recorded.check_markers),
    "patient": (Patient, recorded.check_patient_file),
    "orthosis": (OrthosisData, recorded.check_orthosis),
}
"""Name, model and check of every kind of file."""


def check_file(path: str, problem: str = "") -> Checked:
    """Return what would be done with a file, after all checks that need no solve.

    Args:
        path: A file, the name of a shipped config, or a patient: id or folder.
        problem: Problem that it must be of.

    Raises:
        InputError: The first thing that is wrong.
    """
    if problem:
        problem_named(problem)
        return check_prediction(path, problem)
    if path in shipped_patients() or (Path(path) / "patient.yaml").is_file():
        return recorded.check_patient_file(path)
    source = find_config(Path(path))
    mapping, _ = read_mapping(source, ConfigError)
    _, check = KINDS[_kind(mapping, source, path)]
    return check(str(source) if check is recorded.check_markers else path)


def _kind(mapping: Mapping[str, Any], source: Path, where: str) -> str:
    """Return what a file is: the kind that knows most of its keys; its name settles a tie.

    Raises:
        ConfigError: If no kind, or several, may be meant.
    """
    if "problem" in mapping:
        return "prediction"
    if mapping.get("study") in KINDS:
        return str(mapping["study"])
    known = {name: len(mapping.keys() & _keys(model)) for name, (model, _) in KINDS.items()}
    most = max(known.values())
    found = [name for name, count in known.items() if count == most]
    named = [name for name in found if name in source.stem]
    if len(named) == 1 or len(found) == 1:
        return (named or found)[0]
    shown = ", ".join(mapping) or "none"
    raise ConfigError(
        f"its keys ({shown}) do not tell what it is",
        where=where,
        allowed=", ".join(KINDS),
        mend="name a problem in it, or let the file's name begin with its kind",
    )


def _keys(model: type[BaseModel]) -> set[str]:
    return {field.alias or name for name, field in model.model_fields.items()}
