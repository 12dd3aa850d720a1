"""Recorded joint angles as bands to draw behind those of a prediction."""

from __future__ import annotations

from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, SIDES, SUFFIX, Condition
from pathwalker_cli.errors import InputError
from pathwalker_cli.inverse.bands import POINTS, cycle_band
from pathwalker_cli.inverse.cycles import gait_cycles
from pathwalker_cli.io.recordings import read_recording, recording_names
from pathwalker_cli.patient import Patient
from pathwalker_cli.stride.figures.curves import Band, Reference

__all__ = ["recorded_reference"]

_MIDLINE: Final = ("pelvis_tilt", "lumbar")


def recorded_reference(patient: Patient, condition: Condition) -> Reference | None:
    """Return the bands of all recordings beside a patient's file, or None without usable ones.

    Args:
        patient: The patient.
        condition: Condition of the recordings.
    """
    try:
        recordings = [
            read_recording(patient, condition, name) for name in recording_names(patient, condition)
        ]
        trials = [(each.motion, gait_cycles(each.events)) for each in recordings]
        bands = {side: cycle_band(trials, side) for side in SIDES}
    except InputError:  # a prediction needs no recordings
        return None
    percent = np.linspace(0.0, 100.0, POINTS)
    angles = {}
    for side, band in bands.items():
        for name in COORDINATES[2:]:
            key = f"{name}_{SUFFIX[side]}" if name in _MIDLINE else name
            if key.endswith(f"_{SUFFIX[side]}"):
                i = band.names.index(name)
                angles[key] = Band(percent, band.lowest[:, i], band.mean[:, i], band.highest[:, i])
    return Reference(angles=angles)
