"""The made-up child of a new folder: what is not given follows from its age.

References:
    Weech (1954), Signposts on the road of growth, American Journal of Diseases of Children 88,
    452-457: body mass and height of children over age.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Final

from pathwalker_cli.errors import PatientError
from pathwalker_cli.patient import JENSEN_AGES
from pathwalker_cli.patient.file import healthy_child, healthy_strength

AGE: Final = 9.0
"""Age of a child of which nothing is said [years]."""

_OTHER_AGES: Final = "for another age begin with one of these, and see age_for_regressions there"

_SHARES: Final = {
    "hip_extension": (0.55, 0.65),
    "hip_flexion": (0.55, 0.65),
    "knee_extension": (0.65, 0.70),
    "knee_flexion": (0.65, 0.70),
    "ankle_extension": (0.50, 0.60),
    "ankle_flexion": (0.50, 0.60),
}
"""Strength right and left as a share of a healthy child's of the same size: made up, of the kind
that table 1 of Sreenivasa et al. (2017) shows."""


@dataclass(frozen=True)
class Child:
    """A made-up child, or one as far as a recording tells.

    Args:
        id: Its id.
        age: Age [years].
        body_mass: Body mass [kg].
        height: Height [m].
        sex: "female" or "male".
        lengths: Lengths that were measured, right and left [m].
        soles: Per side, heel and toe of the bare foot that were measured, from the ankle [m].
        sources: Where the numbers come from; none of a made-up child.
    """

    id: str
    age: float
    body_mass: float
    height: float
    sex: str = "female"
    lengths: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    soles: Mapping[str, Mapping[str, tuple[float, float]]] = field(default_factory=dict)
    sources: tuple[str, ...] = ()

    def length(self, name: str) -> float:
        """Return the length of a limb [m], else in the proportions of the shipped healthy child."""
        if name in self.lengths:
            return sum(self.lengths[name]) / 2.0
        patient = healthy_child()
        return round(patient.length(name, "right") * self.height / patient.height, 3)

    def strength(self, name: str) -> tuple[float, ...]:
        """Return a strength right and left, or the one of the trunk [N m]."""
        if name.startswith("lumbar"):
            sides = self.strength(name.replace("lumbar", "hip"))
            return (round(sum(sides) / len(sides), 1),)
        whole = healthy_strength(name, self.body_mass, self.height)
        return tuple(round(share * whole, 1) for share in _SHARES[name])


def made_child(
    id_: str,
    age: float | None = None,
    mass: float | None = None,
    height: float | None = None,
    **measured: Any,
) -> Child:
    """Return a child of an age [years]; mass [kg] and height [m] that are not given follow from it.

    `measured` are further fields of `Child`.

    Raises:
        PatientError: If the regressions of the segment masses do not hold for the age.
    """
    age = AGE if age is None else age
    if not JENSEN_AGES.lower <= age <= JENSEN_AGES.upper:
        raise PatientError(
            f"is {age:g} years", where="--age", allowed=JENSEN_AGES.allowed, mend=_OTHER_AGES
        )
    usual = 2.0 * age + 8.0 if age < 7.0 else (7.0 * age - 5.0) / 2.0
    mass = round(usual, 1) if mass is None else mass
    height = round(0.06 * age + 0.77, 2) if height is None else height
    return Child(id_, age, mass, height, **measured)
