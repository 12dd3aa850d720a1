"""Segment masses, centres of mass and inertias of a child after Jensen (1986).

Every segment stands in its own link frame: x forward, z up in the zero pose, origin at the joint
that connects it to its parent.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import TYPE_CHECKING, Final

from pathwalker_cli.conventions import SIDES, SUFFIX, Condition
from pathwalker_cli.errors import PatientError
from pathwalker_cli.model.choices import TOES_MASS_SHARE
from pathwalker_cli.model.devices import device_on
from pathwalker_cli.model.skeleton import PLANAR_WALKER, Skeleton

if TYPE_CHECKING:
    from pathwalker_cli.patient import Patient

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Line:
    """A straight line over age: value = intercept + slope * age [years]."""

    intercept: float
    slope: float

    def at(self, age: float) -> float:
        """Return the value at an age [years]."""
        return self.intercept + self.slope * age


@dataclass(frozen=True)
class Regression:
    """Jensen's lines of one segment.

    Args:
        mass: Fraction of body mass.
        com: Distance of the centre of mass from the proximal end, fraction of segment length.
        gyration: Radius of gyration about the proximal end, fraction of segment length.
    """

    mass: Line
    com: Line
    gyration: Line


JENSEN: Final = MappingProxyType(
    {
        "head": Regression(Line(0.2376, -0.0114), Line(0.4833, 0.0025), Line(0.5748, 0.0021)),
        "trunk": Regression(Line(0.4246, -0.0006), Line(0.5087, 0.0018), Line(0.5872, 0.00136)),
        "upper_arm": Regression(
            Line(0.0220, 0.00084), Line(0.5570, -0.00028), Line(0.64, -0.00098)
        ),
        "lower_arm": Regression(
            Line(0.01469, 0.00018), Line(0.5610, 0.0019), Line(0.6327, 0.00135)
        ),
        "hand": Regression(Line(0.00898, -0.00003), Line(0.6005, 0.00019), Line(0.6373, 0.00048)),
        "thigh": Regression(Line(0.06634, 0.00364), Line(0.4758, -0.00115), Line(0.5536, -0.00133)),
        "shank": Regression(Line(0.03809, 0.00122), Line(0.4526, -0.0030), Line(0.5307, -0.00224)),
        "foot": Regression(Line(0.0187, 0.00015), Line(0.4351, -0.00186), Line(0.5023, -0.00205)),
    }
)
"""Regressions of boys, dimensionless over age in years.

Head mass and centre of mass are confirmed by a printed table of Jensen's article; the others were
identified from the published model, whose masses, centres of mass and inertias they reproduce to
the printed digit.  Of lower arm, hand and foot gyration several neighbouring values do so.

References:
    Jensen (1986), Body segment mass, radius and radius of gyration proportions of children,
    J. Biomech. 19(5):359-368.
    Sreenivasa et al. (2017), doi 10.3389/fncom.2017.00023 (the published model).
"""

TRUNK_SHARE: Final = MappingProxyType({"pelvis": 0.4, "trunk": 0.6})
"""Share of Jensen's trunk mass that goes to pelvis and upper trunk in the published model."""

SAGITTAL_RATIO: Final = MappingProxyType({"pelvis": 0.55088, "trunk": 0.750793})
"""Iyy / Ixx of pelvis and upper trunk in the published model (their source is unknown).

For these two the regression gives the inertia about the forward axis x, for all others Iyy."""

LONGITUDINAL_RATIO: Final = 0.1
"""Moment of inertia of a limb about its long axis, as a share of that across it.

A uniform cylinder five and a half times as long as its radius has this ratio; in the sagittal
plane it acts on nothing."""


@dataclass(frozen=True)
class Segment:
    """A rigid segment and how it hangs on its parent.

    Args:
        name: Link name.
        parent: Name of the parent link, "" for the pelvis.
        joint: Coordinate between the two, or "" if they are welded.
        origin: Origin of the link frame in the parent's frame (x, y, z) [m].
        length: Segment length [m].
        mass: Mass [kg].
        com: Centre of mass in the link frame (x, y, z) [m].
        inertia: Moments of inertia (Ixx, Iyy, Izz) about the centre of mass [kg m^2].
    """

    name: str
    parent: str
    joint: str
    origin: Vector
    length: float
    mass: float
    com: Vector
    inertia: Vector


def segments(
    patient: Patient,
    condition: Condition,
    published: bool = False,
    values: Mapping[str, float] | None = None,
    skeleton: Skeleton = PLANAR_WALKER,
) -> tuple[Segment, ...]:
    """Return the segments of a patient, parents before children.

    Args:
        patient: The patient.
        condition: "barefoot", or "orthosis" with its mass added to foot and shank or shell.
        published: Hang the right lower arm and hand where the published model has them: at the
            length of the segment itself below its parent's origin instead of at the parent's.
        values: Masses of the device [kg] and places of its hinges [m] by address, if not those of
            the patient's file.
        skeleton: Which joints there are.

    Raises:
        PatientError: If a foot has no room for a toe joint, or a shell has no mass.
    """
    given, braced = values or {}, patient.braced(condition)
    device = device_on(braced, "body" if "shell" in _kinds(skeleton) else "glued")
    number = {n: given.get(n.address, n.value_for(patient)) for n in device.body_numbers}
    added = {link: number[mass] for link, mass in device.added_mass.items()}
    legs: list[Segment] = []
    for side in SIDES:
        thigh, shank, foot = _leg(patient, side, added)
        feet = [foot]
        if "toes" in _kinds(skeleton):
            ball = patient.contacts(condition)[side].toe
            feet = list(_split(foot, ball, patient.toes_length(side)))
        legs += [thigh, shank, *feet]
        if f"shell_{SUFFIX[side]}" in skeleton.links:
            forward, up = (number[place] for place in device.cuffs[side].hinge)
            legs.append(_shell(shank, foot, added[f"shell_{SUFFIX[side]}"], (forward, up)))
    return (
        _segment(patient, "pelvis", "", 0.0),
        *legs,
        _segment(patient, "trunk", "pelvis", patient.length("lumbar_height"), "lumbar"),
        _segment(patient, "head", "trunk", patient.length("trunk")),
        *(s for side in SIDES for s in _arm(patient, side, published and side == "right")),
    )


def _leg(
    patient: Patient, side: str, added: Mapping[str, float]
) -> tuple[Segment, Segment, Segment]:
    """Return thigh, shank and foot of a side; a device adds mass, and inertia in proportion."""
    suffix = SUFFIX[side]
    chain = (
        ("thigh", "pelvis", "hip", patient.length("hip_drop")),
        ("shank", f"thigh_{suffix}", "knee", patient.length("thigh", side)),
        ("foot", f"shank_{suffix}", "ankle", patient.length("shank", side)),
    )
    thigh, shank, foot = (
        _segment(
            patient,
            name,
            parent,
            -drop,
            f"{joint}_{suffix}",
            side,
            added.get(f"{name}_{suffix}", 0.0),
        )
        for name, parent, joint, drop in chain
    )
    return thigh, shank, foot


def _kinds(skeleton: Skeleton) -> set[str]:
    """Return the names of its links without sides."""
    return {link.rpartition("_")[0] for link in skeleton.links}


def _shell(shank: Segment, foot: Segment, mass: float, hinge: tuple[float, float]) -> Segment:
    """Return the shell of an orthosis, which turns on the foot about its hinge.

    Its mass is spread like the shank's own, as is that of an orthosis that is glued to it.

    Args:
        shank: The shank alone.
        foot: The foot.
        mass: Of the shell [kg].
        hinge: Where it is: in front of the ankle, above it [m].

    Raises:
        PatientError: If it has no mass.
    """
    if mass <= 0.0:
        raise PatientError(
            "is 0, and a shell without mass cannot be a body of its own",
            where="orthosis.mass.shank",
            mend="weigh the shell, or set model.orthosis to glued",
        )
    (x, z), share = hinge, mass / shank.mass
    return Segment(
        name=shank.name.replace("shank", "shell"),
        parent=foot.name,
        joint=foot.joint.replace("ankle", "hinge"),
        origin=(x, 0.0, z),
        length=shank.length,
        mass=mass,
        com=(-x, 0.0, shank.com[2] - foot.origin[2] - z),
        inertia=(share * shank.inertia[0], share * shank.inertia[1], share * shank.inertia[2]),
    )


def _split(foot: Segment, ball: tuple[float, float], length: float) -> tuple[Segment, Segment]:
    """Return a foot without its toes, and the toes: together they are the foot as it was.

    The toes are a uniform rod from the ball on, as high as the foot's own centre of mass.

    Args:
        foot: The foot in one piece.
        ball: Where the joint is: in front of the ankle, above it [m].
        length: Of the toes [m].

    Raises:
        PatientError: If the joint is so far in front that no foot would be left behind it.
    """
    (x, z), share, (along, across, _) = ball, TOES_MASS_SHARE, foot.inertia
    far = x + length / 2.0 - foot.com[0]
    rod = share * foot.mass * length**2 / 12.0
    toes = Segment(
        name=foot.name.replace("foot", "toes"),
        parent=foot.name,
        joint=foot.joint.replace("ankle", "mtp"),
        origin=(x, 0.0, z),
        length=length,
        mass=share * foot.mass,
        com=(length / 2.0, 0.0, foot.com[2] - z),
        inertia=(rod * along / across, rod, rod),
    )
    rest = across - rod - share / (1.0 - share) * foot.mass * far**2
    if rest <= 0.0:
        raise PatientError(
            f"has its toe at {x:g} m, too far in front of the {foot.name.replace('_', ' ')} to be "
            "the ball of the foot, where a toe joint would be",
            where="contact_points.barefoot",
            mend="set model.toes to false, or give the ball of the foot",
        )
    behind = foot.com[0] - share / (1.0 - share) * far
    left = replace(
        foot,
        mass=(1.0 - share) * foot.mass,
        com=(behind, 0.0, foot.com[2]),
        inertia=(rest * along / across, rest, rest),
    )
    return left, toes


def _arm(patient: Patient, side: str, misplaced: bool) -> tuple[Segment, ...]:
    """Return upper arm, lower arm and hand of a side, welded in line."""
    suffix = SUFFIX[side]
    elbow, wrist = ("lower_arm", "hand") if misplaced else ("upper_arm", "lower_arm")
    chain = (
        ("upper_arm", "trunk", patient.length("shoulder_height", side)),
        ("lower_arm", f"upper_arm_{suffix}", -patient.length(elbow, side)),
        ("hand", f"lower_arm_{suffix}", -patient.length(wrist, side)),
    )
    return tuple(_segment(patient, name, parent, z, side=side) for name, parent, z in chain)


def _segment(
    patient: Patient,
    name: str,
    parent: str,
    height: float,
    joint: str = "",
    side: str | None = None,
    added_mass: float = 0.0,
) -> Segment:
    """Return one segment from its height above its parent's origin [m] on.

    Trunk and head extend upward, the foot forward, all others downward.
    """
    regression = JENSEN["trunk" if name in TRUNK_SHARE else name]
    age = patient.regression_age
    length = patient.length(name, side)
    body = patient.body_mass * regression.mass.at(age) * TRUNK_SHARE.get(name, 1.0)
    com, gyration = regression.com.at(age), regression.gyration.at(age)
    across = body * length**2 * (gyration**2 - com**2) * (body + added_mass) / body
    offset = com * length if name in ("trunk", "head", "foot") else -com * length
    return Segment(
        name=f"{name}_{SUFFIX[side]}" if side else name,
        parent=parent,
        joint=joint,
        origin=(0.0, 0.0, height),
        length=length,
        mass=body + added_mass,
        com=(offset, 0.0, 0.0) if name == "foot" else (0.0, 0.0, offset),
        inertia=_inertia(name, across),
    )


def _inertia(name: str, across: float) -> Vector:
    """Return (Ixx, Iyy, Izz) from the moment of inertia across the segment [kg m^2].

    Of pelvis and trunk, Izz is set equal to Iyy, which no body of these two moments contradicts.
    """
    if name in SAGITTAL_RATIO:
        sagittal = SAGITTAL_RATIO[name] * across
        return (across, sagittal, sagittal)
    along = LONGITUDINAL_RATIO * across
    return (along, across, across) if name == "foot" else (across, across, along)
