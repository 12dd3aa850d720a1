"""From one C3D file to trials: which markers, which passes, angles, events, forces."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import SIDES, SUFFIX, Condition, Side
from pathwalker_cli.inverse.cycles import gait_cycles
from pathwalker_cli.inverse.forces import foot_extents, ground_forces, plate_loads
from pathwalker_cli.inverse.found_events import events_of_motion, set_by_plates
from pathwalker_cli.inverse.joint_centres import legs_in_plane
from pathwalker_cli.inverse.marker_sets import KnownSet, leg_length, recognised, set_points
from pathwalker_cli.inverse.markers import MarkerPoint, bridge_gaps, load_marker_set, marker_points
from pathwalker_cli.inverse.misplaced import robust_kinematics
from pathwalker_cli.inverse.study import RecordedConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.walk import is_projected, orientation_doubts, walks
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_checks import check_markers, readable_recording
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory


def c3d_trials(
    path: Path,
    patient: Patient,
    condition: Condition,
    config: RecordedConfig,
    taken: Collection[str] = (),
) -> list[tuple[Trial, Recording]]:
    """Evaluate one C3D file: angles, events and, with force plates, forces, but no torques.

    No pass takes a name in `taken`.  Each trial comes with the recording as the file holds it.

    Raises:
        StandingError: If nobody walks.
        DataError: If the recording cannot be used.
    """
    raw, known, points = read_markers(path, patient, condition, config)
    return [
        (_walk_trial(walk, known, points, patient, condition, config), raw)
        for walk in walks(raw, points, taken)
    ]


def read_markers(
    path: Path, patient: Patient, condition: Condition, config: RecordedConfig
) -> tuple[Recording, KnownSet | None, tuple[MarkerPoint, ...]]:
    """Read a file and find out where its markers sit.

    Returns:
        The recording in the laboratory's axes; the set that its names are of, None for a given or
        the shipped one; and its points.

    Raises:
        DataError: If the recording cannot be used.
    """
    raw = readable_recording(path, config.subject)
    known = None if config.markers else recognised(raw, str(path))
    if known:
        points = set_points(known, patient)
        raw = replace(raw, remarks=(*raw.remarks, f"its markers are those of {known.name}"))
    else:
        points = marker_points(load_marker_set(config.markers), patient, condition)
    check_markers(raw, [point.marker for point in points], patient.height, path)
    return raw, known, points


def _walk_trial(
    walk: Recording,
    known: KnownSet | None,
    points: tuple[MarkerPoint, ...],
    patient: Patient,
    condition: Condition,
    config: RecordedConfig,
) -> Trial:
    """Return the trial of one pass in the walking plane."""
    names = tuple(point.marker for point in points)
    walk, gaps = bridge_gaps(walk, names, config.longest_gap)
    flat = is_projected(walk, points)
    fitted, ahead = walk, None
    if known:
        if not flat:
            height = patient.height
            fitted, ahead = legs_in_plane(walk, known.markers, leg_length(patient), height)
        points = set_points(known, patient, fitted, condition)
    model: pin.Model = pinocchio_model(patient, condition)
    motion, distances, doubts = robust_kinematics(
        model, fitted, points, patient.height, config.longest_gap
    )
    if not any(event.kind == "foot_strike" for event in walk.events):
        walk = _with_events(walk, model, motion)
    forces = None
    if walk.plates:
        aside = None if flat else _aside(walk, points)
        forces = ground_forces(walk, model, motion, aside, ahead, mend=config.mend_plates)
        walk = replace(walk, plates=forces.loads, samples_per_frame=1)
    return Trial(
        walk.name,
        motion,
        walk.events,
        forces.table if forces else None,
        condition,
        gait_cycles(walk.events),
        stances=forces.stances if forces else (),
        markers=distances,
        gaps=gaps,
        walk=walk,
        doubts=(*orientation_doubts(walk, points), *doubts, *(forces.remarks if forces else ())),
    )


def _with_events(walk: Recording, model: pin.Model, motion: Trajectory) -> Recording:
    """Return a recording with the events that its motion and its plates show."""
    found = events_of_motion(motion["pelvis_tx"], foot_extents(model, motion.values), walk.rate)
    loads = [np.abs(load.force[:, 2]) for load in plate_loads(walk)]
    events, moved = set_by_plates(found, loads, LOADED, walk.rate)
    by_plates = f", {moved} of them at the edges of a plate's load" if moved else ""
    remark = f"names no foot strikes: {len(events)} events found by the markers{by_plates}"
    return replace(walk, events=events, remarks=(*walk.remarks, remark))


def _aside(walk: Recording, points: tuple[MarkerPoint, ...]) -> dict[Side, np.ndarray]:
    """Return the sideways position of both feet [m], shape (n,) each."""
    feet: dict[Side, np.ndarray] = {}
    for side in SIDES:
        own = [p.marker for p in points if p.link == f"foot_{SUFFIX[side]}"]
        paths = np.stack([walk.marker(name)[:, 1] for name in own or [points[0].marker]])
        feet[side] = np.ma.masked_invalid(paths).mean(axis=0).filled(np.nan)
    return feet
