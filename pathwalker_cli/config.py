"""Study configs: YAML in, validated frozen models out; every numerical choice has its place."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from pathwalker_cli.conventions import COORDINATES, STIFFNESSES, Condition
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, YamlModel, invalid
from pathwalker_cli.io.yaml_file import read_mapping, read_value, validate
from pathwalker_cli.model.contact import PHASE_NAMES
from pathwalker_cli.paths import shipped
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.patient_blocks import Stiffness
from pathwalker_cli.problems import PROBLEMS
from pathwalker_cli.variation import Variation, varied

__all__ = [
    "BoundsConfig",
    "CostConfig",
    "MeshConfig",
    "ModelConfig",
    "SolverConfig",
    "StartConfig",
    "StudyConfig",
    "apply_change",
    "find_config",
    "load_config",
    "patient_path",
    "smoke_version",
    "study_patient",
    "with_values",
]

Angle = Annotated[float, Quantity("rad", -3.2, 3.2, "is it in degrees?", "is it in degrees?")]
Range = Annotated[tuple[Angle, Angle], AS_TUPLE]
Seconds = Annotated[float, Quantity("s", 0.005, 2.0, above="is it in milliseconds?")]
Weight = Annotated[float, Quantity("", 0.0, 1e6)]
Share = Annotated[float, Quantity("", 0.0, 1.0)]
Metres = Annotated[float, Quantity("m", 0.05, 5.0, above="is it in centimetres?")]
Speed = Annotated[float, Quantity("m/s", 0.0, 3.0, above="is it in km/h or cm/s?")]


def _ordered(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise invalid(f"is [{value[0]:g}, {value[1]:g}], upside down", allowed="[lower, upper]")
    return value


def _as_text(value: Any) -> Any:
    """Let names of trials that look like numbers be names."""
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


class ModelConfig(YamlModel):
    """Which model is built."""

    backend: Literal["auto", "pinocchio.casadi", "compiled", "direct"] = "auto"
    published: bool = False


class CostConfig(YamlModel):
    """Weights of the cost terms."""

    effort_weight: Weight = 1.0
    rate_weight: Weight = 2e-2
    acceleration_weight: Weight = 1e-3
    walking_speed_weight: Weight = 0.0
    fit_weight: Weight = 1.0
    excitation_weight: Weight = 1e-4


class BoundsConfig(YamlModel):
    """Bounds of the prediction; they decide the answer as much as the cost does."""

    joint_range_margin: Annotated[float, Quantity("rad", 0.0, 1.5, above="is it in degrees?")] = 0.2
    joint_ranges: dict[str, Range] = Field(default_factory=dict)
    fallback_joint_ranges: dict[str, Range] = Field(
        default_factory=lambda: {
            "pelvis_tilt": (-0.5, 0.4),
            "hip_r": (-1.25, 0.55),
            "knee_r": (0.25, 1.6),
            "ankle_r": (-0.7, 0.3),
            "hip_l": (-1.25, 0.55),
            "knee_l": (0.25, 1.6),
            "ankle_l": (-0.7, 0.3),
            "lumbar": (-0.25, 0.85),
        }
    )
    least_walking_speed: Literal["recorded"] | Speed = "recorded"
    fallback_speed_ratio: Annotated[float, Quantity("", 0.0, 1.0)] = 0.25
    phase_duration: Annotated[tuple[Seconds, Seconds], AS_TUPLE] = (0.02, 0.45)
    phase_durations: dict[str, Annotated[tuple[Seconds, Seconds], AS_TUPLE]] = Field(
        default_factory=dict
    )
    distance: Annotated[tuple[Metres, Metres], AS_TUPLE] = (0.3, 3.0)
    joint_speed: Annotated[float, Quantity("rad/s", 1.0, 100.0)] = 30.0
    dorsiflexion_stiffness: Annotated[tuple[Stiffness, Stiffness], AS_TUPLE] | None = None
    plantarflexion_stiffness: Annotated[tuple[Stiffness, Stiffness], AS_TUPLE] | None = None
    stiffness: dict[str, Annotated[tuple[Stiffness, Stiffness], AS_TUPLE]] = Field(
        default_factory=dict
    )
    friction: Annotated[float, Quantity("", 0.05, 2.0)] = 0.8
    least_vertical_force: Annotated[float, Quantity("N", 0.0, 50.0)] = 0.0
    least_height: Annotated[float, Quantity("m", -0.02, 0.0)] = -1e-3

    @field_validator("joint_ranges", "fallback_joint_ranges")
    @classmethod
    def _coordinates(cls, value: dict[str, Range]) -> dict[str, Range]:
        for name, pair in value.items():
            if name not in COORDINATES[2:]:
                raise invalid(f"names '{name}'", allowed=", ".join(COORDINATES[2:]))
            _ordered(pair)
        return value

    @field_validator("phase_durations")
    @classmethod
    def _phases(cls, value: dict[str, Any]) -> dict[str, Any]:
        for name, pair in value.items():
            if name not in PHASE_NAMES:
                raise invalid(f"names '{name}'", allowed=", ".join(PHASE_NAMES))
            _ordered(pair)
        return value

    @field_validator("stiffness")
    @classmethod
    def _springs(cls, value: dict[str, Any]) -> dict[str, Any]:
        for name, pair in value.items():
            if name not in STIFFNESSES:
                raise invalid(f"names '{name}'", allowed=", ".join(STIFFNESSES))
            _ordered(pair)
        return value

    @field_validator(
        "phase_duration", "distance", "dorsiflexion_stiffness", "plantarflexion_stiffness"
    )
    @classmethod
    def _pairs(cls, value: tuple[float, float] | None) -> tuple[float, float] | None:
        return value if value is None else _ordered(value)


class MeshConfig(YamlModel):
    """Mesh intervals and the accuracy that they must reach."""

    degree: Annotated[int, Field(ge=2, le=6)] = 3
    intervals: (
        Annotated[int, Field(ge=8, le=1000)]
        | Annotated[tuple[Annotated[int, Field(ge=1, le=200)], ...], AS_TUPLE]
    ) = 48
    least_intervals_per_phase: Annotated[int, Field(ge=1, le=50)] = 2
    position_tolerance: Annotated[float, Quantity("rad or m", 1e-8, 1.0)] = 1e-3
    velocity_tolerance: Annotated[float, Quantity("rad/s or m/s", 1e-8, 10.0)] = 1e-2
    refinements: Annotated[int, Field(ge=0, le=20)] = 8

    @field_validator("intervals")
    @classmethod
    def _one_per_phase(cls, value: int | tuple[int, ...]) -> int | tuple[int, ...]:
        if isinstance(value, tuple) and len(value) != len(PHASE_NAMES):
            raise invalid(
                f"has {len(value)} entries",
                allowed=f"one number, or one per phase: {len(PHASE_NAMES)}",
            )
        return value


class StartConfig(YamlModel):
    """Where the search begins."""

    gait: Literal["synthetic", "recorded"] = "synthetic"
    trial: Annotated[str, BeforeValidator(_as_text)] = ""
    condition: Condition = "barefoot"
    knee_flexion: Annotated[float, Quantity("rad", 0.05, 1.5, above="is it in degrees?")] = 0.7
    stride_ratio: Annotated[float, Quantity("leg lengths", 0.3, 3.0)] = 1.1
    walking_speed: Speed | None = None
    stiffness: dict[str, Stiffness] = Field(default_factory=dict)
    seed: Annotated[int, Field(ge=0)] = 0

    @field_validator("stiffness")
    @classmethod
    def _stiffnesses(cls, value: dict[str, float]) -> dict[str, float]:
        for name in value:
            if name not in STIFFNESSES:
                raise invalid(f"names '{name}'", allowed=", ".join(STIFFNESSES))
        return value


class SolverConfig(YamlModel):
    """Tolerances and limits of the nonlinear solver."""

    tolerance: Annotated[float, Quantity("", 1e-12, 1e-1)] = 1e-6
    first_tolerance: Annotated[float, Quantity("", 1e-12, 1e-1)] = 1e-3
    constraint_tolerance: Annotated[float, Quantity("", 1e-12, 1e-3)] = 1e-9
    max_iterations: Annotated[int, Field(ge=1, le=100000)] = 1000
    first_barrier: Annotated[float, Quantity("", 1e-12, 1.0)] = 1e-2
    warm_barrier: Annotated[float, Quantity("", 1e-12, 1.0)] = 1e-4
    refined_barrier: Annotated[float, Quantity("", 1e-12, 1.0)] = 1e-6
    ipopt: dict[str, float | int | str] = Field(default_factory=dict)


class StudyConfig(YamlModel):
    """One problem for one patient."""

    problem: str
    patient: str
    variation: Variation = Variation()
    model: ModelConfig = ModelConfig()
    cost: CostConfig = CostConfig()
    bounds: BoundsConfig = BoundsConfig()
    mesh: MeshConfig = MeshConfig()
    start: StartConfig = StartConfig()
    solver: SolverConfig = SolverConfig()
    transcription: Literal["collocation", "multiple-shooting"] = "collocation"
    half_cycle: bool = False
    starts: Annotated[int, Field(ge=1, le=1000)] = 1
    verdict: bool = True
    smoke: bool = False

    @model_validator(mode="before")
    @classmethod
    def _defaults(cls, value: Any) -> Any:
        """Let the defaults of the problem stand where the config is silent."""
        if not isinstance(value, dict) or value.get("problem") not in PROBLEMS:
            return value
        defaults = PROBLEMS[str(value["problem"])].defaults
        return merged(defaults, value)

    @field_validator("problem")
    @classmethod
    def _known(cls, value: str) -> str:
        if value not in PROBLEMS:
            raise invalid(f"is '{value}'", allowed=", ".join(PROBLEMS))
        return value

    @model_validator(mode="after")
    def _start(self) -> StudyConfig:
        if self.start.trial and self.start.gait != "recorded":
            raise invalid(
                "names a start.trial but start.gait is synthetic",
                mend="set start.gait to recorded, or leave start.trial out",
            )
        if self.fits and (self.half_cycle or self.start.gait != "recorded"):
            raise invalid(
                f"asks {self.problem} for a "
                + ("half cycle" if self.half_cycle else "synthetic start"),
                allowed="a whole recorded passage: start.gait recorded, half_cycle false",
            )
        return self

    @property
    def condition(self) -> Condition:
        """Condition that the problem is about."""
        return PROBLEMS[self.problem].condition

    @property
    def fits(self) -> bool:
        """Whether a recording is followed, equation (8), instead of a gait predicted."""
        return PROBLEMS[self.problem].goal == "fit"


def merged(under: Mapping[str, Any], over: Mapping[str, Any]) -> dict[str, Any]:
    """Return two nested mappings as one; where both have a value, `over` counts."""
    result = dict(under)
    for key, value in over.items():
        below = result.get(key)
        if isinstance(below, Mapping) and isinstance(value, Mapping):
            result[key] = merged(below, value)
        else:
            result[key] = value
    return result


def load_config(path: str | Path, problem: str = "", changes: tuple[str, ...] = ()) -> StudyConfig:
    """Read a study config.

    Args:
        path: The YAML file, or the name of a shipped one, e.g. "mapd-orthosis".
        problem: Problem that was asked for; it must be the config's own.
        changes: Overrides "dotted.key=value", as from the command line.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    source = find_config(Path(path))
    mapping, lines = read_mapping(source, ConfigError)
    for change in changes:
        apply_change(mapping, change)
    config = validate(mapping, StudyConfig, where=str(path), error=ConfigError, lines=lines)
    if problem and config.problem != problem:
        raise ConfigError(
            f"is a config for {config.problem}, but {problem} was asked for",
            where=f"{path}, problem",
            mend=f"use configs/{problem}.yaml, or ask for {config.problem}",
        )
    return config.model_copy(update={"patient": patient_path(config.patient, source)})


def find_config(path: Path) -> Path:
    """Return the file, or the shipped config of that name where there is no such file."""
    if not path.is_file():
        for name in (path.name, f"{path.name}.yaml"):
            candidate = shipped("configs") / name
            if candidate.is_file() and path.parent.name in ("", "configs"):
                return candidate
    return path


def patient_path(patient: str, config_file: Path) -> str:
    """Return a patient path relative to the config's folder as a full path; ids stay."""
    candidate = config_file.parent / patient
    return str(candidate.resolve()) if "/" in patient or candidate.is_file() else patient


def study_patient(config: StudyConfig) -> Patient:
    """Return the patient of a study, with its variation.

    Raises:
        PatientError: If there is no such patient or its file is refused.
        ConfigError: If the variation does not fit the patient.
    """
    return varied(load_patient(config.patient), config.variation)


def apply_change(mapping: dict[str, Any], change: str) -> None:
    """Put one override "a.b=value" into a mapping; the value is read as YAML."""
    key, equals, text = change.partition("=")
    if not equals or not key.strip():
        raise ConfigError(f"'{change}' is no override", where="--set", allowed="dotted.key=value")
    value = read_value(text, f"--set {key}")
    *parents, last = key.strip().split(".")
    for parent in parents:
        mapping = mapping.setdefault(parent, {})
        if not isinstance(mapping, dict):
            raise ConfigError(f"'{parent}' holds no keys", where=f"--set {key}")
    mapping[last] = value


def with_values(config: StudyConfig, values: Mapping[str, Any], where: str = "") -> StudyConfig:
    """Return a config with some values replaced and validated anew.

    Args:
        config: The config.
        values: New values by dotted key, e.g. {"cost.walking_speed_weight": 1.0}.  A mapping at a
            section, e.g. {"mesh": {...}}, replaces only what it names; one below a section, e.g.
            {"variation.scale": {...}}, takes the place of what was there.
        where: Origin of the values, for the message.

    Raises:
        ConfigError: If a key does not exist or a value is refused.
    """
    content: dict[str, Any] = config.model_dump(mode="json")
    for key, value in values.items():
        *parents, last = key.split(".")
        holder = content
        for parent in parents:
            holder = holder.setdefault(parent, {})
            if not isinstance(holder, dict):
                raise ConfigError(f"'{parent}' holds no keys", where=f"{where}, {key}")
        whole = isinstance(value, Mapping) and not parents and isinstance(holder.get(last), dict)
        holder[last] = merged(holder[last], value) if whole else value
    return validate(content, StudyConfig, where=where or "overrides", error=ConfigError)


def smoke_version(config: StudyConfig) -> StudyConfig:
    """Return a config with a short horizon for quick checks: coarse mesh, no refinement."""
    mesh = config.mesh.model_copy(update={"intervals": (2,) * len(PHASE_NAMES), "refinements": 0})
    loose = {"max_iterations": min(400, config.solver.max_iterations), "tolerance": 1e-3}
    solver = config.solver.model_copy(update=loose)
    changes = {"mesh": mesh, "solver": solver, "smoke": True, "verdict": False}
    return config.model_copy(update=changes)
