"""One recorded trial from the C3D file to angles, events, forces and torques."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import pinocchio as pin

from pathwalker_cli.conventions import Condition, velocity_unit
from pathwalker_cli.inverse.direction import is_projected, walking_plane
from pathwalker_cli.inverse.dynamics import gait_torques
from pathwalker_cli.inverse.filters import MOTION_CUTOFF, smooth_rates
from pathwalker_cli.inverse.forces import GroundForces, ground_forces
from pathwalker_cli.inverse.gaps import LONGEST_GAP, Gap, bridge_gaps
from pathwalker_cli.inverse.kinematics import MarkerResiduals, inverse_kinematics, pelvis_markers
from pathwalker_cli.inverse.markers import MarkerSet, load_marker_set, marker_points
from pathwalker_cli.inverse.stance_checks import StanceForce
from pathwalker_cli.io.c3d import Event, read_c3d
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory

__all__ = ["ProcessedTrial", "process_trial", "smooth_motion"]


@dataclass(frozen=True)
class ProcessedTrial:
    """What one recording tells.

    Args:
        name: Name of the trial.
        condition: "barefoot" or "orthosis".
        motion: Coordinates in every frame, unfiltered.
        markers: Distances of the markers from the walker.
        gaps: Gaps in the marker paths.
        events: Foot strikes and toe-offs.
        forces: Forces on the feet, None without force plates.
        tau: Residuals and joint torques, None without force plates.
    """

    name: str
    condition: Condition
    motion: Trajectory
    markers: MarkerResiduals
    gaps: tuple[Gap, ...]
    events: tuple[Event, ...]
    forces: GroundForces | None
    tau: Trajectory | None

    @property
    def stances(self) -> tuple[StanceForce, ...]:
        """What the plates know about every stance."""
        return self.forces.stances if self.forces else ()


def process_trial(
    path: str | Path,
    patient: Patient,
    condition: Condition,
    marker_set: MarkerSet | None = None,
    longest_gap: float = LONGEST_GAP,
) -> ProcessedTrial:
    """Evaluate one C3D file.

    Args:
        path: The C3D file.
        patient: The patient.
        condition: What was worn.
        marker_set: Marker set; the shipped one if left out.
        longest_gap: Longest gap in a marker's path that is bridged [s].

    Raises:
        DataError: If the recording cannot be used.
    """
    recording = read_c3d(path)
    model: pin.Model = pinocchio_model(patient, condition)
    points = marker_points(marker_set or load_marker_set(), patient, condition)
    names = tuple(point.marker for point in points)
    recording, gaps = bridge_gaps(recording, names, longest_gap)
    plane = walking_plane(recording, pelvis_markers(points))
    motion, distances = inverse_kinematics(model, recording, points, plane)
    in_lab = None if is_projected(recording, plane, names) else plane
    forces = ground_forces(recording, model, motion, in_lab) if recording.plates else None
    tau = gait_torques(model, motion, forces) if forces else None
    return ProcessedTrial(
        recording.name, condition, motion, distances, gaps, recording.events, forces, tau
    )


def smooth_motion(
    motion: Trajectory, cutoff: float = MOTION_CUTOFF
) -> tuple[Trajectory, Trajectory]:
    """Return filtered coordinates and their rates.

    Args:
        motion: Coordinates in every frame [m, rad].
        cutoff: Cut-off frequency [Hz].
    """
    q, v, _ = smooth_rates(motion, cutoff)
    units = tuple(velocity_unit(name) for name in motion.names)
    return replace(motion, values=q), replace(motion, values=v, units=units)
