"""From C3D files to trials: which markers, which passes, angles, events, forces."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import SIDES, SUFFIX, Condition, Side
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.body import facing
from pathwalker_cli.inverse.cycles import gait_cycles
from pathwalker_cli.inverse.forces import foot_extents, ground_forces, plate_loads
from pathwalker_cli.inverse.found_events import events_of_motion, set_by_plates
from pathwalker_cli.inverse.joint_centres import legs_in_plane
from pathwalker_cli.inverse.marker_sets import (
    FootPlaces,
    KnownSet,
    foot_places,
    leg_length,
    recognised,
    set_points,
)
from pathwalker_cli.inverse.markers import MarkerPoint, bridge_gaps, load_marker_set, marker_points
from pathwalker_cli.inverse.misplaced import robust_kinematics
from pathwalker_cli.inverse.study import RecordedConfig
from pathwalker_cli.inverse.trial import Trial
from pathwalker_cli.inverse.walk import (
    StandingError,
    feet_move,
    is_projected,
    orientation_doubts,
    walks,
)
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.io.c3d_checks import check_markers, readable_recording
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.model.urdf import pinocchio_model
from pathwalker_cli.patient import Patient
from pathwalker_cli.trajectory import Trajectory

Progress = Callable[[str], None]
"""Called with "barefoot 3053179" before a trial is evaluated."""


@dataclass(frozen=True)
class MarkedFile:
    """A C3D file whose markers are known.

    Args:
        recording: What it holds, in the laboratory's axes.
        points: Where its markers sit.
        known: The set that its names are of, None for a given or the shipped one.
    """

    recording: Recording
    points: tuple[MarkerPoint, ...]
    known: KnownSet | None


def read_markers(
    path: Path, patient: Patient, condition: Condition, config: RecordedConfig
) -> MarkedFile:
    """Read a file and find out where its markers sit.

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
    return MarkedFile(raw, points, known)


def c3d_trials(
    files: Sequence[Path],
    patient: Patient,
    condition: Condition,
    config: RecordedConfig,
    names: Collection[str] = (),
    progress: Progress = lambda _: None,
) -> list[tuple[Trial, Recording]]:
    """Evaluate C3D files of one condition: angles, events and, with plates, forces.

    Those in which nobody walks are set aside; a pose in the same marker set tells where the foot
    markers are on a foot that stands flat.

    Args:
        files: The files.
        patient: The patient.
        condition: What is worn.
        config: How files are read.
        names: Names of the files to evaluate, all if there are none.
        progress: What to call before each.

    Returns:
        The trials, a pass each, with the recordings as the files hold them.

    Raises:
        StandingError: If nobody walks in any.
        DataError: If a recording cannot be used.
    """
    passes: list[tuple[Recording, MarkedFile]] = []
    still: list[StandingError] = []
    pose: MarkedFile | None = None
    stems = {path.stem for path in files}
    for path in files:
        file = read_markers(path, patient, condition, config)
        try:
            own = walks(file.recording, file.points, stems - {path.stem})
            passes += [(walk, file) for walk in own if not names or path.stem in names]
        except StandingError as error:
            still.append(error)
            pose = pose if feet_move(file.recording, file.points) else file
    if still and len(still) == len(files):
        raise still[0]
    if still and passes:
        aside = (f"{error.where} is set aside: its {error.what}" for error in still)
        walk, file = passes[0]
        passes[0] = replace(walk, remarks=(*walk.remarks, *aside)), file
    feet = _feet_of_pose(pose, patient) if pose else {}
    trials = []
    for walk, file in passes:
        progress(f"{condition} {walk.name}")
        same = pose and file.known and pose.known and file.known.name == pose.known.name
        trial = _walk_trial(walk, file, patient, condition, config, feet if same else {})
        trials.append((trial, file.recording))
    return trials


def _feet_of_pose(pose: MarkedFile, patient: Patient) -> FootPlaces:
    """Return where a pose shows the foot markers, see `foot_places`; nothing if it does not."""
    if pose.known is None:
        return {}
    try:
        stood = facing(pose.recording, pose.known)
        if not is_projected(stood, pose.points):
            leg = leg_length(patient)
            stood, _ = legs_in_plane(stood, pose.known.markers, leg, patient.height)
        return foot_places(pose.known, stood)
    except DataError:
        return {}


def _walk_trial(
    walk: Recording,
    file: MarkedFile,
    patient: Patient,
    condition: Condition,
    config: RecordedConfig,
    feet: FootPlaces,
) -> Trial:
    """Return the trial of one pass in the walking plane; `feet` are those of a pose, if any."""
    points, known = file.points, file.known
    names = tuple(point.marker for point in points)
    walk, gaps = bridge_gaps(walk, names, config.longest_gap)
    flat = is_projected(walk, points)
    fitted, ahead = walk, None
    if known:
        if not flat:
            height = patient.height
            fitted, ahead = legs_in_plane(walk, known.markers, leg_length(patient), height)
        points = set_points(known, patient, fitted, condition, feet)
    if feet:
        remark = "where its foot markers sit is measured in the pose"
        walk = replace(walk, remarks=(*walk.remarks, remark))
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
