"""Every key of a study config with type, range and default: all numerical choices."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict
from typing import Annotated, Any, Final, Literal, get_args

from pydantic import (
    AfterValidator,
    BeforeValidator,
    Field,
    PlainSerializer,
    field_validator,
    model_validator,
)

from pathwalker_cli.config.learnt import Learnt
from pathwalker_cli.conventions import ANGLES, STIFFNESSES, Condition
from pathwalker_cli.errors import ConfigError, did_you_mean
from pathwalker_cli.gait.costs import ELSEWHERE, GOALS, Costs
from pathwalker_cli.installed import load_installed
from pathwalker_cli.io.fields import AS_TUPLE, Quantity, Sides, Words, YamlModel, invalid
from pathwalker_cli.model.choices import FRICTION
from pathwalker_cli.model.contact import (
    AS_RECORDED,
    HEEL_TOE,
    PHASE_NAMES,
    SHIPPED_USES,
    SOLES,
    USES,
    Contact,
    ContactPattern,
    Feet,
    Posture,
    Use,
    contact_pattern,
)
from pathwalker_cli.model.skeleton import EVERY_JOINT, SIDES, Build, walker_skeleton
from pathwalker_cli.patient.blocks import Stiffness
from pathwalker_cli.patient.variation import Variation
from pathwalker_cli.problems import PROBLEMS

Angle = Annotated[float, Quantity("rad", -3.2, 3.2, "is it in degrees?", "is it in degrees?")]
Seconds = Annotated[float, Quantity("s", 0.005, 2.0, above="is it in milliseconds?")]
Weight = Annotated[float, Quantity("", 0.0, 1e6)]
Share = Annotated[float, Quantity("", 0.0, 1.0)]
Metres = Annotated[float, Quantity("m", 0.05, 5.0, above="is it in centimetres?")]
Speed = Annotated[float, Quantity("m/s", 0.0, 3.0, above="is it in km/h or cm/s?")]


def _ordered(value: tuple[float, float]) -> tuple[float, float]:
    if value[0] > value[1]:
        raise invalid(f"is [{value[0]:g}, {value[1]:g}], upside down", allowed="[lower, upper]")
    return value


def _no_number(value: Any) -> Any:
    """Refuse one number in place of a range, and say how a range prescribes it."""
    if isinstance(value, int | float) and not isinstance(value, bool):
        shown = f"{min(max(value, -1e99), 1e99):g}"  # an integer may be too large for a float
        mend = f"[{shown}, {shown}] prescribes {shown}"
        raise invalid(f"is {shown}", allowed="a range [lower, upper]", mend=mend)
    return value


ORDERED: Final = AfterValidator(_ordered)
Range = Annotated[tuple[Angle, Angle], AS_TUPLE, ORDERED]
Durations = Annotated[tuple[Seconds, Seconds], AS_TUPLE, ORDERED]
StiffnessRange = Annotated[
    tuple[Stiffness, Stiffness], AS_TUPLE, BeforeValidator(_no_number), ORDERED
]
Amount = Annotated[float, Quantity("SI units", -1e8, 1e8)]
AmountRange = Annotated[tuple[Amount, Amount], AS_TUPLE, BeforeValidator(_no_number), ORDERED]


def _keys_of(allowed: Collection[str], elsewhere: Collection[str] = ()) -> AfterValidator:
    """Return what refuses a mapping with other keys than these."""

    def check(value: dict[str, Any]) -> dict[str, Any]:
        for name in value:
            if name not in allowed:
                load_installed()
            if name not in allowed and name not in elsewhere:
                known = ", ".join(allowed)
                raise invalid(f"names '{name}'", allowed=known, mend=did_you_mean(name, allowed))
        return value

    return AfterValidator(check)


RangeByAngle = Annotated[dict[str, Range], _keys_of(ANGLES)]
RangeByJoint = Annotated[dict[str, Range], _keys_of(EVERY_JOINT.angles)]


# names of trials that look like numbers are names
TrialName = Annotated[str, BeforeValidator(lambda x: str(x) if type(x) is int else x)]


def _use(value: Any) -> Any:
    """Return how a foot is used from its name, or from what is on the ground in both supports."""
    if value == _RECORDED:
        return AS_RECORDED
    if isinstance(value, str):
        if value not in USES:
            load_installed()
        if value not in USES:
            mend = did_you_mean(value, USES) or "import what registers it first"
            raise invalid(f"is '{value}'", allowed=", ".join((*USES, _RECORDED)), mend=mend)
        return USES[value]
    if not isinstance(value, dict):
        return value
    if set(value) != {"single", "landing"}:
        known = ", ".join((*USES, _RECORDED))
        raise invalid("is no use of a foot", allowed=f"{known}, or {_POSTURES}")
    supports = [value[name] for name in ("single", "landing")]
    for support in supports:
        if not isinstance(support, list | tuple) or not set(support) <= set(get_args(Posture)):
            raise invalid(f"has {support!r} in a support", allowed=_POSTURES)
    use = Use(*map(tuple, supports))
    if use.fault:
        raise invalid(use.fault, allowed=_POSTURES)
    return use


def plain_use(use: Use) -> Any:
    """Return a use by the name that comes with this package, else in full: to be read anywhere."""
    return _RECORDED if use == AS_RECORDED else use.name or asdict(use)


_RECORDED: Final = "recorded"
"""What a config calls the use that recordings show."""
_POSTURES: Final = (
    "{single: [...], landing: [...]} of heel, flat and toe, "
    "e.g. {single: [flat, toe], landing: [toe, flat]}"
)
FootUse = Annotated[
    Use,
    BeforeValidator(_use),
    PlainSerializer(plain_use),
    Words(
        "text or block of single, landing",
        ", ".join(f"`{name}`" for name in (*SHIPPED_USES, _RECORDED)),
    ),
]


class ModelConfig(YamlModel):
    """Which model is built."""

    backend: Literal["auto", "pinocchio.casadi", "compiled", "direct"] = "auto"
    published: bool = False
    tissue: bool = False
    elements: Annotated[tuple[str, ...], AS_TUPLE] = ()
    feet: Feet = "points"
    toes: bool = False
    orthosis: Build = "glued"
    contact: Sides[FootUse] = Sides[FootUse](right=HEEL_TOE[0], left=HEEL_TOE[1])

    @property
    def uses(self) -> Contact:
        """Use of the right and the left foot."""
        return self.contact.right, self.contact.left

    @property
    def pattern(self) -> ContactPattern:
        """The phases of a stride; as a case has them, which knows what recordings show."""
        return contact_pattern(self.feet, self.uses, self.toes)

    @model_validator(mode="after")
    def _rolling(self) -> ModelConfig:
        if self.feet in SOLES and self.uses != HEEL_TOE:
            raise invalid(
                "gives model.contact for feet with soles, which roll over whatever they land on",
                mend="leave contact out, or set feet to rockers",
            )
        return self


class CostConfig(YamlModel):
    """Weights of the cost terms."""

    effort_weight: Weight = 1.0
    rate_weight: Weight = 2e-2
    acceleration_weight: Weight = 1e-3
    walking_speed_weight: Weight = 0.0
    fit_weight: Weight = 1.0
    excitation_weight: Weight = 1e-4
    activation_power: Annotated[int, Field(ge=2, le=10)] = 2
    goals: Annotated[dict[str, Weight], _keys_of(GOALS, ELSEWHERE)] = Field(default_factory=dict)
    comfort_ranges: RangeByAngle = Field(default_factory=dict)
    trunk_lean: Angle = 0.0

    @model_validator(mode="after")
    def _ranges_of_goals(self) -> CostConfig:
        if self.goals.get("discomfort") and not self.comfort_ranges:
            raise invalid(
                "weighs the goal 'discomfort' but says of no joint what is comfortable",
                mend="add comfort_ranges, e.g. {knee_r: [0.0, 0.9]}",
            )
        return self

    @property
    def weights(self) -> dict[str, float]:
        """Weight of every cost term by its name."""
        own = {key.removesuffix("_weight"): value for key, value in self if "_weight" in key}
        return {**own, **self.goals}

    @property
    def weighed(self) -> tuple[str, ...]:
        """The goals that have a weight, known ones first."""
        return tuple(name for name in {**GOALS, **self.goals} if self.goals.get(name, 0.0) > 0.0)

    @property
    def wanted(self) -> Costs:
        """The goals that have a weight, and what they need.

        Raises:
            ConfigError: If nothing has registered one of them.
        """
        names = self.weighed
        if names and names[-1] not in GOALS:
            raise ConfigError(
                f"weighs '{names[-1]}', which nothing has registered",
                where="cost.goals",
                mend="import what registers it first, or install its package",
            )
        return Costs(names, self.activation_power, self.comfort_ranges, self.trunk_lean)


class BoundsConfig(YamlModel):
    """Bounds of the prediction; they decide the answer as much as the cost does."""

    joint_range_margin: Annotated[float, Quantity("rad", 0.0, 1.5, above="is it in degrees?")] = 0.2
    joint_ranges: RangeByJoint = Field(default_factory=dict)
    fallback_joint_ranges: RangeByAngle = Field(
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
    phase_duration: Durations = (0.02, 0.45)
    phase_durations: Annotated[dict[str, Durations], _keys_of(PHASE_NAMES)] = Field(
        default_factory=dict
    )
    distance: Annotated[tuple[Metres, Metres], AS_TUPLE, ORDERED] = (0.3, 3.0)
    joint_speed: Annotated[float, Quantity("rad/s", 1.0, 100.0)] = 30.0
    dorsiflexion_stiffness: StiffnessRange | None = None
    plantarflexion_stiffness: StiffnessRange | None = None
    stiffness: Annotated[dict[str, StiffnessRange], _keys_of(STIFFNESSES)] = Field(
        default_factory=dict
    )
    friction: Annotated[float, Quantity("", 0.05, 2.0)] = FRICTION
    least_vertical_force: Annotated[float, Quantity("N", 0.0, 50.0)] = 0.0
    least_height: Annotated[float, Quantity("m", -0.02, 0.0)] = -1e-3


class MeshConfig(YamlModel):
    """Mesh intervals and the accuracy that they must reach."""

    degree: Annotated[int, Field(ge=2, le=6)] = 3
    intervals: (
        Annotated[int, Field(ge=8, le=1000)]
        | Annotated[tuple[Annotated[int, Field(ge=1, le=200)], ...], AS_TUPLE]
    ) = 64
    least_intervals_per_phase: Annotated[int, Field(ge=1, le=50)] = 2
    position_tolerance: Annotated[float, Quantity("rad or m", 1e-8, 1.0)] = 1e-3
    velocity_tolerance: Annotated[float, Quantity("rad/s or m/s", 1e-8, 10.0)] = 1e-2
    cost_tolerance: Annotated[float, Quantity("", 1e-6, 1.0)] = 0.005
    refinements: Annotated[int, Field(ge=0, le=20)] = 12


class StartConfig(YamlModel):
    """Where the search begins."""

    gait: Literal["typical", "synthetic", "recorded"] = "typical"
    walk: Annotated[int, Field(ge=0, le=99)] = 0
    trial: TrialName = ""
    condition: Condition = "barefoot"
    knee_flexion: Annotated[float, Quantity("rad", 0.05, 1.5, above="is it in degrees?")] = 0.7
    stride_ratio: Annotated[float, Quantity("leg lengths", 0.3, 3.0)] = 1.1
    walking_speed: Speed | None = None
    stiffness: Annotated[dict[str, Stiffness], _keys_of(STIFFNESSES)] = Field(default_factory=dict)
    free: dict[str, Amount] = Field(default_factory=dict)
    seed: Annotated[int, Field(ge=0)] = 0

    @model_validator(mode="before")
    @classmethod
    def _synthetic_if_shaped(cls, value: Any) -> Any:
        """Take a synthetic stride where its shape is given."""
        if isinstance(value, dict) and _SHAPE.intersection(value):
            return {"gait": "synthetic", **value}
        return value

    @model_validator(mode="after")
    def _shaped(self) -> StartConfig:
        usual = type(self).model_fields
        for key in sorted(_SHAPE) if self.gait == "typical" else ():
            if getattr(self, key) != usual[key].default:
                raise invalid(
                    f"gives start.{key}, which a typical walk does not follow",
                    mend="set start.gait to synthetic",
                )
        return self


_SHAPE: Final = {"knee_flexion", "stride_ratio", "walking_speed"}
"""Keys of the start that a synthetic stride alone follows."""


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
    learnt: Learnt | None = None
    numbers: dict[str, Amount] = Field(default_factory=dict)
    free: dict[str, AmountRange] = Field(default_factory=dict)
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
    figures: Literal["all", "svg", "none"] = "all"
    smoke: bool = False

    @model_validator(mode="before")
    @classmethod
    def _defaults(cls, value: Any) -> Any:
        """Let the defaults of the problem stand where the config is silent."""
        problem = value.get("problem") if isinstance(value, dict) else None
        if not isinstance(problem, str) or problem not in PROBLEMS:
            return value
        return merged(PROBLEMS[problem].defaults, value)

    @field_validator("problem")
    @classmethod
    def _known(cls, value: str) -> str:
        if value not in PROBLEMS:
            allowed = ", ".join(PROBLEMS)
            raise invalid(f"is '{value}'", allowed=allowed, mend=did_you_mean(value, PROBLEMS))
        return value

    @model_validator(mode="after")
    def _suits_the_feet(self) -> StudyConfig:
        if AS_RECORDED not in self.model.uses:
            self._suits_the_phases()
        if self.model.feet in SOLES and self.cost.goals.get("centre_of_pressure"):
            raise invalid(
                "weighs the goal 'centre_of_pressure', which needs heel and toe: a sole rolls",
                mend="leave the goal out, or set model.feet to points or rockers",
            )
        if self.model.toes and self.condition == "orthosis":
            raise invalid(
                "gives toes to feet with orthoses, whose soles are one plate",
                mend="set model.toes to false, or solve a barefoot problem",
            )
        quick = {"toes": self.model.toes, "orthosis": self.shelled}
        for key, name, off in (
            ("toes", "feet with toes", "false"),
            ("orthosis", "an orthosis that is a body of its own", "glued"),
        ):
            if quick[key] and self.transcription != "collocation":
                raise invalid(
                    f"asks for {self.transcription} of {name}, too quick for its steps",
                    mend=f"set transcription to collocation, or model.{key} to {off}",
                )
        if self.model.feet == "compliant":
            if self.fits:
                raise invalid(
                    f"asks {self.problem} for feet that give way; it follows phases",
                    allowed="model.feet points, rockers or sole",
                )
            if self.transcription != "collocation":
                raise invalid(
                    f"asks for {self.transcription} of feet that give way, too quick for its steps",
                    mend="set transcription to collocation, or model.feet to sole",
                )
        return self

    def _suits_the_phases(self) -> None:
        given, names = self.mesh.intervals, self.model.pattern.names
        if isinstance(given, tuple) and len(given) != len(names):
            raise invalid(
                f"has {len(given)} entries in mesh.intervals",
                allowed=f"one number, or one per phase: {len(names)} ({', '.join(names)})",
            )
        if strangers := sorted(self.bounds.phase_durations.keys() - set(names)):
            raise invalid(
                f"bounds the phase {strangers[0]}, which these feet do not have",
                allowed=", ".join(names),
            )

    @model_validator(mode="after")
    def _bounds_of_joints(self) -> StudyConfig:
        skeleton = walker_skeleton(self.model.toes, SIDES if self.shelled else ())
        for name in sorted(self.bounds.joint_ranges.keys() - set(skeleton.angles)):
            missing, mend = (
                ("toes that no joint carries", "model.toes to true")
                if name.startswith("mtp")
                else ("an orthosis that is no body of its own", "model.orthosis to body")
            )
            raise invalid(
                f"bounds {name} of {missing}",
                mend=f"set {mend}, or leave it out of bounds.joint_ranges",
            )
        return self

    @model_validator(mode="after")
    def _start(self) -> StudyConfig:
        if self.start.trial and self.start.gait != "recorded":
            raise invalid(
                f"names a start.trial but start.gait is {self.start.gait}",
                mend="set start.gait to recorded, or leave start.trial out",
            )
        if self.fits and (self.half_cycle or self.start.gait != "recorded"):
            raise invalid(
                f"asks {self.problem} for a "
                + ("half cycle" if self.half_cycle else f"{self.start.gait} start"),
                allowed="a whole recorded passage: start.gait recorded, half_cycle false",
            )
        return self

    @model_validator(mode="after")
    def _goals_that_suit(self) -> StudyConfig:
        names = self.cost.weighed
        if self.fits and names:
            raise invalid(
                f"asks for the goal '{names[0]}', but {self.problem} follows a recording",
                mend="leave cost.goals out",
            )
        known = {name: GOALS[name] for name in names if name in GOALS}
        whole = [name for name, goal in known.items() if goal.whole_stride]
        if self.half_cycle and whole:
            raise invalid(
                f"asks half a cycle for the goal '{whole[0]}': it is symmetric already",
                mend="leave the goal out, or set half_cycle to false",
            )
        smooth = [name for name, goal in known.items() if goal.collocation]
        if self.transcription != "collocation" and smooth:
            raise invalid(
                f"asks {self.transcription} for the goal '{smooth[0]}', which needs the rates of "
                "forces: collocation alone knows them",
                mend="leave the goal out, or set transcription to collocation",
            )
        return self

    @property
    def condition(self) -> Condition:
        """Condition that the problem is about."""
        return PROBLEMS[self.problem].condition

    @property
    def shelled(self) -> bool:
        """Whether orthoses are worn that are bodies of their own."""
        return self.model.orthosis == "body" and self.condition == "orthosis"

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
