"""What a file is, by the keys that it holds, and who checks it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, Final, NamedTuple

from pydantic import BaseModel

from pathwalker_cli.checking import recorded, studies
from pathwalker_cli.checking.prediction import check_prediction
from pathwalker_cli.checking.report import Changes, Checked
from pathwalker_cli.config import StudyConfig, config_content, find_config
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.inverse.markers import MarkerSet
from pathwalker_cli.inverse.study import InverseDynamicsConfig, InverseKinematicsConfig
from pathwalker_cli.patient import OrthosisData, Patient, shipped_patients
from pathwalker_cli.problems import problem_named
from pathwalker_cli.studies.batch.schema import BatchStudy
from pathwalker_cli.studies.landscape.study import LandscapeStudy
from pathwalker_cli.studies.perturbation.study import PerturbationStudy
from pathwalker_cli.studies.sensitivity.study import SensitivityStudy
from pathwalker_cli.studies.tradeoff.study import TradeoffStudy
from pathwalker_cli.studies.uncertainty.study import UncertaintyStudy

__all__ = ["KINDS", "Kind", "another_kind", "check_file"]

Check = Callable[[str, Changes], Checked]


class Kind(NamedTuple):
    """What a kind of file is read as, who checks it, and what takes it.

    Args:
        model: Model of its content.
        check: Says what would be done with it.
        taken_by: The command or key that it is for.
    """

    model: type[BaseModel]
    check: Check
    taken_by: str


KINDS: Final[dict[str, Kind]] = {
    "prediction": Kind(StudyConfig, check_prediction, "pathwalker solve PROBLEM"),
    "perturbation": Kind(PerturbationStudy, studies.check_perturbation, "pathwalker perturb"),
    "sensitivity": Kind(SensitivityStudy, studies.check_sensitivity, "pathwalker sensitivity"),
    "uncertainty": Kind(UncertaintyStudy, studies.check_uncertainty, "pathwalker uncertainty"),
    "landscape": Kind(LandscapeStudy, studies.check_landscape, "pathwalker landscape"),
    "tradeoff": Kind(TradeoffStudy, studies.check_tradeoff, "pathwalker tradeoff"),
    "cohort": Kind(BatchStudy, studies.check_batch, "pathwalker batch"),
    "inverse-kinematics": Kind(InverseKinematicsConfig, recorded.check_kinematics, "pathwalker ik"),
    "inverse-dynamics": Kind(InverseDynamicsConfig, recorded.check_dynamics, "pathwalker id"),
    "markers": Kind(
        MarkerSet,
        recorded.check_markers,
        "--markers of pathwalker import, and the key markers of configs of ik and id",
    ),
    "patient": Kind(
        Patient, recorded.check_patient_file, "the key patient of a config, or --set patient=FILE"
    ),
    "orthosis": Kind(OrthosisData, recorded.check_orthosis, "the key orthosis of a patient's file"),
}
"""Every kind of file by its name."""


def check_file(path: str, problem: str = "", changes: Changes = ()) -> Checked:
    """Return what would be done with a file, after all checks that need no solve.

    Args:
        path: A file, the name of a shipped config, or a patient: id or folder.
        problem: Problem that it must be of.
        changes: Overrides "dotted.key=value" of a config.

    Raises:
        InputError: The first thing that is wrong.
    """
    if problem:
        problem_named(problem)
        try:
            return check_prediction(path, changes, problem)
        except ConfigError as error:
            raise another_kind(path, "prediction") or error from None
    kind = _kind_of(path)
    # A shipped marker set is read where it lies: it has no loader that knows names.
    file = str(find_config(Path(path))) if kind == "markers" else path
    return KINDS[kind].check(file, changes)


def another_kind(path: str, kind: str) -> ConfigError | None:
    """Return what to say of a file that is refused, if it is one of another kind; None if not.

    Args:
        path: A file, the name of a shipped config, or a patient.
        kind: The kind that it is not accepted as.
    """
    try:
        found = _kind_of(path)
    except ConfigError:
        return None
    if found == kind:
        return None
    a = "an" if found[0] in "aeiou" else "a"
    return ConfigError(
        f"is {a} {found} file",
        where=path,
        allowed=f"a file for {KINDS[kind].taken_by}",
        mend=f"this file is for {KINDS[found].taken_by}",
    )


def _kind_of(path: str) -> str:
    """Return what a file, a shipped config or a patient is.

    Raises:
        ConfigError: If it cannot be read or told.
    """
    if path in shipped_patients() or (Path(path) / "patient.yaml").is_file():
        return "patient"
    source, mapping, _ = config_content(path)
    return _kind(mapping, source, path)


def _kind(mapping: Mapping[str, Any], source: Path, where: str) -> str:
    """Return what a file is: the kind that knows most of its keys; its name settles a tie.

    Raises:
        ConfigError: If no kind, or several, may be meant.
    """
    if "problem" in mapping:
        return "prediction"
    if mapping.get("study") in KINDS:
        return str(mapping["study"])
    known = {name: len(mapping.keys() & _keys(model)) for name, (model, _, _) in KINDS.items()}
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
