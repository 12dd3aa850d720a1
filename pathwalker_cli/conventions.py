"""Names, orders, axes, signs and units: the one place that knows them.

World frame: x forward, z up, rotations about +y (right-hand rule), SI units and radians.
Positive: pelvis_tilt and lumbar = forward lean, hip = extension, knee = flexion,
ankle = plantarflexion.  The zero pose is upright with straight legs and feet at 90 degrees.
"""

from __future__ import annotations

from typing import Final, Literal

import numpy as np

GRAVITY: Final = 9.81
"""Gravitational acceleration [m/s^2]."""

COORDINATES: Final = (
    "pelvis_tx",
    "pelvis_tz",
    "pelvis_tilt",
    "hip_r",
    "knee_r",
    "ankle_r",
    "hip_l",
    "knee_l",
    "ankle_l",
    "lumbar",
)
"""Generalised coordinates in order: two translations [m], eight angles [rad]."""

TRANSLATIONS: Final = COORDINATES[:2]
ROOT: Final = COORDINATES[:3]
"""Coordinates of the free pelvis: no actuator acts on them."""

Side = Literal["right", "left"]
SIDES: Final[tuple[Side, Side]] = ("right", "left")
SUFFIX: Final = {"right": "r", "left": "l"}
"""Suffix of a side in coordinate and link names."""

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

CONTACT_POINTS: Final = ("heel_r", "toe_r", "heel_l", "toe_l")
CONTACT_FORCES: Final = (
    "heel_r_x",
    "heel_r_z",
    "toe_r_x",
    "toe_r_z",
    "heel_l_x",
    "heel_l_z",
    "toe_l_x",
    "toe_l_z",
)
"""Components of the ground reaction forces (on the body) in order [N]."""

CONDITIONS: Final = ("barefoot", "orthosis")
Condition = Literal["barefoot", "orthosis"]


def coordinate_index(name: str) -> int:
    """Return the position of a generalised coordinate in `COORDINATES`."""
    return COORDINATES.index(name)


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
