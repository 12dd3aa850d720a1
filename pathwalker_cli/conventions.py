"""Names, orders, units and mirror images of what tables and files hold.

Axes and signs stand in `model.skeleton`, from which the generalised coordinates come.
"""

from __future__ import annotations

from collections.abc import Collection
from typing import Final, Literal

import numpy as np

from pathwalker_cli.model.contact import POINTS, contact_pattern
from pathwalker_cli.model.skeleton import PLANAR_WALKER
from pathwalker_cli.model.skeleton import SIDES as SIDES
from pathwalker_cli.model.skeleton import SUFFIX as SUFFIX
from pathwalker_cli.model.skeleton import Side as Side

GRAVITY: Final = 9.81
"""Gravitational acceleration [m/s^2]."""

COORDINATES: Final = PLANAR_WALKER.coordinates
"""Generalised coordinates of recordings in order: two translations [m], eight angles [rad].

Those of a walker are in its skeleton: these ten, and whatever joints it has besides behind them."""

ANGLES: Final = PLANAR_WALKER.angles
TRANSLATIONS: Final = PLANAR_WALKER.translations
ROOT: Final = PLANAR_WALKER.root
"""Coordinates of the free pelvis: no actuator acts on them."""

LEG_JOINTS: Final = ("hip", "knee", "ankle")

GENERATORS: Final = (
    "hip_extension_r",
    "hip_flexion_r",
    "knee_extension_r",
    "knee_flexion_r",
    "ankle_extension_r",
    "ankle_flexion_r",
    "hip_extension_l",
    "hip_flexion_l",
    "knee_extension_l",
    "knee_flexion_l",
    "ankle_extension_l",
    "ankle_flexion_l",
    "lumbar_extension",
    "lumbar_flexion",
)
"""Muscle torque generators in order. As in the published model, `lumbar_extension` (the stronger
one) bends the trunk forward (torque sign +) and `lumbar_flexion` extends it."""

STIFFNESSES: Final = tuple(
    f"{kind}_stiffness_{side}" for kind in ("dorsiflexion", "plantarflexion") for side in SIDES
)
"""Free orthosis parameters in order: K_D right, left, K_P right, left [N m/rad]."""

CONTACT_POINTS: Final = tuple(point.name for point in POINTS)
CONTACT_FORCES: Final = contact_pattern().force_names
"""Components of the ground reaction forces (on the body) in order [N], of heels and toes."""

CONDITIONS: Final = ("barefoot", "orthosis")
Condition = Literal["barefoot", "orthosis"]


def worn_words(braced: Collection[Side]) -> str:
    """Return in words what is worn if these sides wear an orthosis."""
    if not braced:
        return "barefoot"
    one = f"with an orthosis on the {min(braced)}"
    return one if len(braced) == 1 else "with orthoses"


def coordinate_unit(name: str) -> str:
    """Return the SI unit of a generalised coordinate: "m" or "rad"."""
    return "m" if name in TRANSLATIONS else "rad"


def velocity_unit(name: str) -> str:
    """Return the SI unit of a generalised velocity: "m/s" or "rad/s"."""
    return coordinate_unit(name) + "/s"


def force_unit(name: str) -> str:
    """Return the SI unit of a generalised force: "N" or "N m"."""
    return "N" if name in TRANSLATIONS else "N m"


def generator_coordinate(name: str) -> str:
    """Return the coordinate that a muscle torque generator drives, e.g. hip_flexion_l -> hip_l."""
    parts = name.split("_")
    return parts[0] if len(parts) == 2 else f"{parts[0]}_{parts[2]}"


def mirrored(name: str) -> str:
    """Return the name of the same thing on the other side; midline names stay."""
    for a, b in (("_r", "_l"), ("_l", "_r"), ("_right", "_left"), ("_left", "_right")):
        if name.endswith(a):
            return name.removesuffix(a) + b
        if f"{a}_" in name:
            return name.replace(f"{a}_", f"{b}_")
    return name


def mirror_permutation(names: tuple[str, ...]) -> np.ndarray:
    """Return the index array that exchanges left and right in a vector with these names."""
    return np.array([names.index(mirrored(name)) for name in names], dtype=int)


def to_degrees(values: np.ndarray | float) -> np.ndarray:
    """Convert angles from rad to degrees, for figures and tables only."""
    return np.rad2deg(values)
