"""What the page of results is made from: solved problems, inverse dynamics, recordings."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli import __version__
from pathwalker_cli.conventions import CONDITIONS, Condition
from pathwalker_cli.evaluation.evaluate import Change, Evaluation, changes_between, evaluate_gait
from pathwalker_cli.evaluation.paper import PATIENT
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.inverse.residuals import COMPONENTS, residual_tables
from pathwalker_cli.inverse.strengths import strength_table
from pathwalker_cli.inverse.study import InverseDynamicsConfig, load_inverse_dynamics
from pathwalker_cli.inverse.trials import dynamics_trials
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.model.walker import build_walker
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.results.run_folder import Run, load_run
from pathwalker_cli.stride.series import GaitSeries, gait_series
from pathwalker_cli.stride.stride import stride_of

METHODS: Final = ("default", "published")
"""Methods of inverse dynamics, ours and the article's."""

NO_C3D: Final = "not computed: the published method needs the article's C3D files (--c3d)"
"""Why there is no result of the published method."""


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


def inverse_result(config: InverseDynamicsConfig, file: Path) -> tuple[InverseResult, bool]:
    """Return strengths and residuals, and whether they were read from the file of an earlier run.

    Args:
        config: The study.
        file: Where the result is kept; written if it was not there or belongs to something else.
    """
    patient = load_patient(config.patient)
    key = _key(config, patient)
    kept = _read(file, key)
    if kept is not None:
        return kept, True
    trials = dynamics_trials(config, patient, lambda _: None)
    residuals = {
        f"{table.condition}_{part}_{kind}": float(value)
        for table in residual_tables(trials, patient, config)
        if table.part == "whole cycle"
        for kind, values in table.range.items()
        for part, value in zip(COMPONENTS, values / table.body_mass, strict=True)
    }
    rows = strength_table(trials, patient, config).rows
    result = InverseResult(
        method=config.method,
        body_mass=float(patient.body_mass),
        strengths={row.generator: float(row.value) for row in rows},
        residuals=residuals,
        remarks={row.generator: row.remark for row in rows},
    )
    file.parent.mkdir(parents=True, exist_ok=True)
    write_json(file, {"made_from": key, **asdict(result)})
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


@dataclass(frozen=True)
class ProblemResult:
    """The run of a problem, and whether it was solved before and not again.

    If it converged, with its stride, also beside the recordings.
    """

    run: Run
    kept: bool
    series: GaitSeries | None = None
    evaluation: Evaluation | None = None

    @property
    def converged(self) -> bool:
        """Whether it is a solution."""
        return self.evaluation is not None


@dataclass(frozen=True)
class Results:
    """Everything that was computed: in place of an inverse dynamics result, why there is none."""

    problems: Mapping[str, ProblemResult]
    inverse: Mapping[str, InverseResult | str]
    recorded: Mapping[Condition, RecordedGait]
    quick: bool

    @property
    def changes(self) -> tuple[Change, ...]:
        """Changes from mapd-barefoot to mapd-orthosis; none unless both converged."""
        pair = (self.problems[name].evaluation for name in ("mapd-barefoot", "mapd-orthosis"))
        return changes_between([each for each in pair if each is not None])

    @property
    def failed(self) -> tuple[str, ...]:
        """Problems that did not converge."""
        return tuple(name for name, each in self.problems.items() if not each.converged)


def recordings() -> dict[Condition, RecordedGait]:
    """Return the recordings of the article's patient by condition."""
    patient = load_patient(PATIENT)
    return {
        condition: gait
        for condition in CONDITIONS
        if (gait := recorded_gait(build_walker(patient, condition))) is not None
    }


def evaluated(
    folder: Path, kept: bool, recorded: Mapping[Condition, RecordedGait]
) -> ProblemResult:
    """Return the result that a run folder holds."""
    run = load_run(folder, allow_unconverged=True)
    if run.metrics["status"] != "converged":
        return ProblemResult(run, kept)
    series, problem = gait_series(run.case.walker(), run.motion), run.config.problem
    theirs = recorded.get(run.config.condition) if run.case.patient.id == PATIENT else None
    evaluation = evaluate_gait(stride_of(series, problem, problem), recorded=theirs)
    return ProblemResult(run, kept, series, evaluation)
