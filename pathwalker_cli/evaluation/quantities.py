"""The quantities in which a gait is compared: name, words, unit and section."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

__all__ = ["CHANGES", "QUANTITIES", "Quantity", "quantity_of"]


@dataclass(frozen=True)
class Quantity:
    """Something that a gait, a recording or the article has a number for.

    Args:
        key: Its name in files.
        label: Its name on the terminal.
        unit: SI unit in files; "1" for shares and activations, "body weights" for such.
        section: Heading on the terminal.
    """

    key: str
    label: str
    unit: str
    section: str


_JOINTS: Final = ("pelvis", "hip", "knee", "ankle", "trunk")

_WALK: Final = "Steps and time"
_KNEE: Final = "Least knee flexion in stance"
_TRIAL: Final = "Joint angles, RMS difference to one trial at equal time"
_CYCLE: Final = "Joint angles, RMS difference to the recorded mean over the gait cycle"
_FORCE: Final = "Ground reaction forces"
_ANKLE: Final = "Net ankle torque in stance, muscles and orthosis"
_MUSCLE: Final = "Ankle extensor muscles"
_EFFORT: Final = "Effort and springs"


def _sides(key: str, label: str, unit: str, section: str) -> tuple[Quantity, ...]:
    """Return a quantity of the right and of the left side."""
    return tuple(
        Quantity(f"{key}_{side}", f"{label}, {side}", unit, section) for side in ("right", "left")
    )


QUANTITIES: Final = (
    Quantity("walking_speed", "walking speed", "m/s", _WALK),
    *_sides("step_length", "step length", "m", _WALK),
    Quantity("stride_time", "stride time", "s", _WALK),
    Quantity("cadence", "cadence", "1/min", _WALK),
    *_sides("stance_share", "stance share", "1", _WALK),
    *_sides("stance_time", "stance time", "s", _WALK),
    *_sides("swing_share", "swing share", "1", _WALK),
    *_sides("swing_time", "swing time", "s", _WALK),
    Quantity("double_support_share", "double support share", "1", _WALK),
    Quantity("double_support_time", "double support time", "s", _WALK),
    *_sides("min_stance_knee_flexion", "knee", "rad", _KNEE),
    *(Quantity(f"rms_one_trial_{joint}", joint, "rad", _TRIAL) for joint in _JOINTS),
    *(Quantity(f"rms_mean_cycle_{joint}", joint, "rad", _CYCLE) for joint in _JOINTS),
    *_sides("peak_vertical_force", "vertical peak", "body weights", _FORCE),
    Quantity("rms_vertical_force_stance", "vertical RMS, stance", "N", _FORCE),
    Quantity("rms_vertical_force_cycle", "vertical RMS, cycle", "N", _FORCE),
    Quantity("rms_forward_force_stance", "fore-aft RMS, stance", "N", _FORCE),
    *_sides("ankle_torque_slope_stance", "mean slope", "N m/rad", _ANKLE),
    *_sides("peak_net_ankle_torque", "peak", "N m", _ANKLE),
    *_sides("peak_ankle_extension_torque", "peak torque", "N m", _MUSCLE),
    *_sides("mean_ankle_extension_torque", "mean torque", "N m", _MUSCLE),
    *_sides("peak_ankle_extension_activation", "peak activation", "1", _MUSCLE),
    *_sides("mean_ankle_extension_activation", "mean activation", "1", _MUSCLE),
    Quantity("effort_per_distance", "effort per distance", "s/m", _EFFORT),
    *_sides("dorsiflexion_stiffness", "K_D", "N m/rad", _EFFORT),
    *_sides("plantarflexion_stiffness", "K_P", "N m/rad", _EFFORT),
)
"""All quantities in the order in which they are shown; signs as in `conventions`."""

CHANGES: Final = tuple(
    quantity
    for quantity in QUANTITIES
    if not quantity.key.startswith("rms_") and "stiffness" not in quantity.key
)
"""The quantities of which the change from barefoot to orthosis is shown."""


def quantity_of(key: str) -> Quantity:
    """Return a quantity by its key."""
    return next(quantity for quantity in QUANTITIES if quantity.key == key)
