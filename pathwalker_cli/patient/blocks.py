"""The blocks of a patient's file: lengths, contact points, strengths, orthosis, recordings.

SI units and radians; angles carry the signs of `conventions` (+ankle = plantarflexion).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import product
from typing import Annotated, Any, Final

from pydantic import AfterValidator, Field, field_validator, model_validator

from pathwalker_cli.conventions import ANGLES, GENERATORS, SIDES, SUFFIX, Side
from pathwalker_cli.io.fields import (
    AS_TUPLE,
    Quantity,
    Sides,
    Worn,
    YamlModel,
    invalid,
    on_sides,
)

Length = Annotated[float, Quantity("m", 0.005, 1.0, above="is it in centimetres or millimetres?")]
Offset = Annotated[
    float, Quantity("m", -0.4, 0.4, "is it in millimetres?", "is it in millimetres?")
]
Strength = Annotated[float, Quantity("N m", 0.1, 500.0)]
Angle = Annotated[float, Quantity("rad", -3.2, 3.2, "is it in degrees?", "is it in degrees?")]
Stiffness = Annotated[float, Quantity("N m/rad", 1.0, 1000.0, below="is it in N m per degree?")]
_StopStiffness = Annotated[
    float,
    Quantity("N m/rad", 1.0, 5000.0, "is it in N m per degree?", "no stop is rigid: measure it"),
]
_Radius = Annotated[float, Quantity("m", 0.0, 0.5, above="is it in centimetres or millimetres?")]
Roundness = Annotated[float, Quantity("", 0.05, 50.0)]
"""Radius of a sole where it lies flat, beside its length."""
_Reach = Annotated[float, Quantity("deg", -90.0, 110.0)]
Point = Annotated[tuple[Offset, Offset], AS_TUPLE]
"""A point in the foot frame: [forward, up] of the ankle [m]."""


class SegmentLengths(YamlModel):
    """Segment lengths and joint offsets [m]; what is left out comes from body proportions.

    `hip_drop` is how far the hips lie below the pelvis origin, `lumbar_height` how far the lumbar
    joint lies above it, `shoulder_height` how far the shoulders lie above the lumbar joint.
    `foot` reaches from the heel to the toe marker.
    """

    pelvis: Length | None = None
    hip_drop: Length | None = None
    lumbar_height: Length | None = None
    trunk: Length | None = None
    head: Length | None = None
    shoulder_height: Sides[Length] | None = None
    upper_arm: Sides[Length] | None = None
    lower_arm: Sides[Length] | None = None
    hand: Sides[Length] | None = None
    thigh: Sides[Length] | None = None
    shank: Sides[Length] | None = None
    foot: Sides[Length] | None = None


class FootPoints(YamlModel):
    """Where one foot touches the ground: [x forward, z up] of the ankle [m] in the foot frame."""

    heel: Point
    toe: Point

    @model_validator(mode="after")
    def _toe_in_front(self) -> FootPoints:
        if self.toe[0] <= self.heel[0]:
            raise invalid(
                f"has its toe at {self.toe[0]:g} m, behind its heel at {self.heel[0]:g} m",
                allowed="toe in front of heel, both [x, z] with x forward",
            )
        for name, point in (("heel", self.heel), ("toe", self.toe)):
            if point[1] >= 0.0:
                raise invalid(
                    f"has its {name} at height {point[1]:g} m",
                    allowed="a negative height: the sole lies below the ankle",
                )
        return self


class ContactPoints(YamlModel):
    """Contact points per condition; those of the bare foot come from proportions if left out.

    With an orthosis, one sole counts for the sides that wear it; a foot that is left out is bare.
    """

    barefoot: Sides[FootPoints] | None = None
    orthosis: Worn[FootPoints] | None = None


class RockerRadius(YamlModel):
    """Radii of the circles on which heel and ball of the foot roll [m], barefoot and shod.

    They count in problems with `model.feet: rockers`; what is left out is a share of the length of
    the foot.
    """

    heel: Sides[_Radius] | None = None
    toe: Sides[_Radius] | None = None


class Strengths(YamlModel):
    """Maximum isometric torques of the muscle torque generators [N m]."""

    hip_extension: Sides[Strength]
    hip_flexion: Sides[Strength]
    knee_extension: Sides[Strength]
    knee_flexion: Sides[Strength]
    ankle_extension: Sides[Strength]
    ankle_flexion: Sides[Strength]
    lumbar_extension: Strength
    lumbar_flexion: Strength

    def vector(self) -> tuple[float, ...]:
        """Return the 14 torques [N m] in the order of `conventions.GENERATORS`."""
        torques = dict(self)
        for kind, value in self:
            if isinstance(value, Sides):
                torques |= {f"{kind}_{SUFFIX[side]}": value[side] for side in SIDES}
        return tuple(float(torques[name]) for name in GENERATORS)


class Examination(YamlModel):
    """Passive range of motion from the couch [deg], with the usual names and signs.

    Hip and knee extension, and dorsiflexion, count in the direction of their names and are negative
    where the joint does not reach zero; the popliteal angle is the knee flexion that is left with
    the hip at 90 degrees.  What is left out is that of typical children.
    """

    hip_extension: Sides[_Reach] | None = None
    popliteal_angle: Sides[_Reach] | None = None
    knee_extension: Sides[_Reach] | None = None
    dorsiflexion_knee_extended: Sides[_Reach] | None = None
    dorsiflexion_knee_flexed: Sides[_Reach] | None = None


class AddedMass(YamlModel):
    """What orthosis and shoe add to a leg that wears them [kg]."""

    shank: Worn[Annotated[float, Quantity("kg", 0.0, 5.0, above="is it in grams?")]]
    foot: Worn[Annotated[float, Quantity("kg", 0.0, 5.0, above="is it in grams?")]]


class Springs(YamlModel):
    """One stiffness per direction [N m/rad]."""

    dorsiflexion: Worn[Stiffness]
    plantarflexion: Worn[Stiffness]


_Stiffnesses = Annotated[tuple[Stiffness, Stiffness], AS_TUPLE]


class Stops(YamlModel):
    """Stiffness of the hard stop of each direction [N m/rad]."""

    dorsiflexion: Worn[_StopStiffness]
    plantarflexion: Worn[_StopStiffness]


class SpringRange(YamlModel):
    """Stiffness that the joint's springs can be tuned to [N m/rad], and who says so."""

    dorsiflexion: Worn[_Stiffnesses]
    plantarflexion: Worn[_Stiffnesses]
    source: str = Field(min_length=1)


class RealSpring(YamlModel):
    """A spring that can be bought: its name and its stiffness at the joint [N m/rad]."""

    name: str = Field(min_length=1, max_length=40)
    stiffness: Stiffness


class SpringSet(YamlModel):
    """The springs that exist for each direction, and who says so."""

    dorsiflexion: Annotated[tuple[RealSpring, ...], AS_TUPLE, Field(min_length=1)]
    plantarflexion: Annotated[tuple[RealSpring, ...], AS_TUPLE, Field(min_length=1)]
    source: str = Field(min_length=1)

    @field_validator("dorsiflexion", "plantarflexion")
    @classmethod
    def _apart(cls, value: tuple[RealSpring, ...]) -> tuple[RealSpring, ...]:
        names, sizes = {spring.name for spring in value}, {spring.stiffness for spring in value}
        if min(len(names), len(sizes)) < len(value):
            raise invalid("names a spring, or a stiffness, twice", allowed="different springs")
        return value


_HingePlace = Annotated[float, Quantity("m", -0.1, 0.1, *["is it in millimetres?"] * 2)]
_CuffStiffness = Annotated[float, Quantity("N/m", 100.0, 1e8, below="is it in N/mm?")]
_CuffDamping = Annotated[float, Quantity("N s/m", 0.0, 1e6, below="give its size, unsigned")]

_STEEPEST: Final = 250.0
"""Largest ratio of the stiffnesses of stop and spring at which the torque is exact."""
_STOP_CLEARANCE: Final = 1.06
"""Least distance of a stop from the neutral angle, in plays: the knots of the curve are in order
from 19 / 18 on."""


_DORSIFLEXION: Final = Quantity(
    "rad", -0.7, -0.001, "is it in degrees?",
    "dorsiflexion angles are negative: give it a minus sign",
)  # fmt: skip
_PLANTARFLEXION: Final = Quantity(
    "rad", 0.001, 0.7, "plantarflexion angles are positive", "is it in degrees?"
)
_DIRECTIONS: Final = ("dorsiflexion", "plantarflexion")


def _in_order(value: tuple[Side, ...]) -> tuple[Side, ...]:
    if len(set(value)) < len(value):
        raise invalid("names a side twice", allowed="[right, left], [right] or [left]")
    return tuple(side for side in SIDES if side in value)


WornSides = Annotated[tuple[Side, ...], AS_TUPLE, Field(min_length=1), AfterValidator(_in_order)]


class Hinge(YamlModel):
    """Where the hinge of a shell is in the frame of the foot, from the ankle [m]."""

    forward: Worn[_HingePlace] | None = None
    up: Worn[_HingePlace] | None = None


class CuffStiffness(YamlModel):
    """Stiffness of cuff and leg across the shank and along it [N/m]."""

    across: Worn[_CuffStiffness] | None = None
    along: Worn[_CuffStiffness] | None = None


class CuffDamping(YamlModel):
    """Damping of cuff and leg across the shank and along it [N s/m]."""

    across: Worn[_CuffDamping] | None = None
    along: Worn[_CuffDamping] | None = None


class OrthosisData(YamlModel):
    """Ankle-foot orthosis: geometry and springs, angles in rad (+ = plantarflexion).

    Every number may be one for all sides that wear it, or one for each.
    """

    sides: WornSides = SIDES
    mass: AddedMass
    neutral_angle: Worn[Annotated[float, Quantity("rad", -0.6, 0.6, *["is it in degrees?"] * 2)]]
    free_play: Worn[Annotated[float, Quantity("rad", 1e-4, 0.2, above="is it in degrees?")]]
    preload_torque: Worn[
        Annotated[float, Quantity("N m", 0.0, 50.0, below="give its size, unsigned")]
    ]
    dorsiflexion_stop: Worn[Annotated[float, _DORSIFLEXION]]
    plantarflexion_stop: Worn[Annotated[float, _PLANTARFLEXION]]
    stop_stiffness: Stops
    stiffness_guess: Springs
    stiffness_range: SpringRange
    springs: SpringSet | None = None
    cuff_height: Worn[Length] | None = None
    cuff_area: Worn[Annotated[float, Quantity("m^2", 1e-4, 0.1, above="is it in cm^2?")]] | None = (
        None
    )
    cuff_stiffness: CuffStiffness | None = None
    cuff_damping: CuffDamping | None = None
    hinge: Hinge | None = None

    @model_validator(mode="before")
    @classmethod
    def _worn(cls, value: Any) -> Any:
        sides = sides_of(value)
        return on_sides(cls, value, sides) if sides else value

    @model_validator(mode="after")
    def _springs(self) -> OrthosisData:
        for name, side in product(_DIRECTIONS, self.sides):
            low, high = getattr(self.stiffness_range, name)[side]
            guess = getattr(self.stiffness_guess, name)[side]
            key = f"stiffness_range.{name}"
            if low >= high:
                raise invalid(f"has {key} [{low:g}, {high:g}], which is upside down or empty",
                              allowed="[lower, upper] in N m/rad")  # fmt: skip
            if not low <= guess <= high:
                raise invalid(f"has stiffness_guess.{name} {guess:g} N m/rad outside its range",
                              allowed=f"{low:g} to {high:g} N m/rad, the {key}")  # fmt: skip
        return self

    @model_validator(mode="after")
    def _exact(self) -> OrthosisData:
        for side in self.sides:
            fault = orthosis_fault(self.ranges(side), side)
            if fault is not None:
                prefix = f"stiffness_range.{fault.spring} " if fault.spring else ""
                raise invalid(f"has {prefix}{fault.what}", allowed=fault.allowed)
        return self

    def ranges(self, side: str) -> dict[str, tuple[float, float]]:
        """Return every number of the torque curve of a side, springs with their whole range."""
        stops = (f"{name}_stop" for name in _DIRECTIONS)
        names = ("neutral_angle", "free_play", "preload_torque", *stops)
        single = {name: getattr(self, name)[side] for name in names}
        springs: dict[str, tuple[float, float]] = {}
        for name in _DIRECTIONS:
            single[f"{name}_stop_stiffness"] = getattr(self.stop_stiffness, name)[side]
            springs[f"{name}_stiffness"] = getattr(self.stiffness_range, name)[side]
        return {**springs, **{name: (value, value) for name, value in single.items()}}


def sides_of(orthosis: Any) -> tuple[Side, ...]:
    """Return the sides that wear an orthosis by its unchecked content; none if that is wrong."""
    given = orthosis.get("sides", SIDES) if isinstance(orthosis, dict) else ()
    return tuple(side for side in SIDES if isinstance(given, list | tuple) and side in given)


@dataclass(frozen=True)
class OrthosisFault:
    """Why the torque curve of an orthosis would not be exact.

    Args:
        numbers: Names of the numbers at fault, the first of them the one to change.
        what: What is wrong, without the name of a range of springs.
        allowed: What is allowed.
        spring: "dorsiflexion" or "plantarflexion" where it is about springs.
    """

    numbers: tuple[str, ...]
    what: str
    allowed: str
    spring: str = ""


def orthosis_fault(ranges: Mapping[str, tuple[float, float]], side: str) -> OrthosisFault | None:
    """Return why the torque curve is not exact everywhere within ranges of its numbers, if so.

    Args:
        ranges: Least and largest value by name, as `OrthosisData.ranges` has them [SI].
        side: The side, for the message.
    """
    low = {name: pair[0] for name, pair in ranges.items()}
    high = {name: pair[1] for name, pair in ranges.items()}
    stops = high["dorsiflexion_stop"], low["plantarflexion_stop"]
    middle, clearance = "neutral_angle", _STOP_CLEARANCE * high["free_play"]
    if not stops[0] < low[middle] - clearance < high[middle] + clearance < stops[1]:
        return OrthosisFault(
            (middle, "dorsiflexion_stop", "plantarflexion_stop", "free_play"),
            f"neutral_angle {_range(ranges[middle])} rad with free_play "
            f"{_range(ranges['free_play'])} rad, not between the {side} stops",
            f"between {stops[0]:g} and {stops[1]:g} rad, {_STOP_CLEARANCE:g} times the "
            "free play from either",
        )
    for kind, reach in (
        ("dorsiflexion", (low[middle] - stops[0], high[middle] - low["dorsiflexion_stop"])),
        ("plantarflexion", (stops[1] - high[middle], high["plantarflexion_stop"] - low[middle])),
    ):
        spring, stop = f"{kind}_stiffness", f"{kind}_stop_stiffness"
        softest = low[spring] + low["preload_torque"] / (reach[1] - low["free_play"] / 2.0)
        stiffest = high[spring] + high["preload_torque"] / (reach[0] - high["free_play"] / 2.0)
        if high[stop] / _STEEPEST <= softest and stiffest <= low[stop] * _STEEPEST:
            continue
        return OrthosisFault(
            (spring, stop, "preload_torque", middle),
            f"[{low[spring]:g}, {high[spring]:g}] N m/rad, too far from stop_stiffness.{kind} "
            f"{_range(ranges[stop])}",
            f"springs within a factor of {_STEEPEST:g} of the stop",
            kind,
        )
    return None


def _range(pair: tuple[float, float]) -> str:
    """Return a number as text, or the range in which it lies."""
    return f"{pair[0]:g}" if pair[0] == pair[1] else f"[{pair[0]:g}, {pair[1]:g}]"


Speed = Annotated[float, Quantity("m/s", 0.0, 5.0, above="is it in km/h or cm/s?")]


class SpeedRange(YamlModel):
    """Recorded walking speeds [m/s]."""

    mean: Speed
    min: Speed
    max: Speed

    @model_validator(mode="after")
    def _ordered(self) -> SpeedRange:
        if not self.min <= self.mean <= self.max:
            raise invalid("is not in order", allowed="min <= mean <= max [m/s]")
        return self


class LengthRange(YamlModel):
    """Recorded step lengths [m]."""

    min: Annotated[float, Quantity("m", -0.5, 2.0, above="is it in centimetres?")]
    max: Annotated[float, Quantity("m", -0.5, 2.0, above="is it in centimetres?")]

    @model_validator(mode="after")
    def _ordered(self) -> LengthRange:
        if self.min > self.max:
            raise invalid("is upside down", allowed="min <= max [m]")
        return self


class Recorded(YamlModel):
    """What was recorded in one condition."""

    walking_speed: SpeedRange
    step_length: Sides[LengthRange]
    joint_ranges: dict[str, Annotated[tuple[Angle, Angle], AS_TUPLE]]

    @field_validator("joint_ranges")
    @classmethod
    def _known(cls, value: dict[str, tuple[float, float]]) -> dict[str, tuple[float, float]]:
        for name, (low, high) in value.items():
            if name not in ANGLES:
                raise invalid(f"names '{name}'", allowed=", ".join(ANGLES))
            if low > high:
                raise invalid(f"has {name} upside down", allowed="[lowest, highest] in rad")
        return value
