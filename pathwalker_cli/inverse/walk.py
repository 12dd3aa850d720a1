"""From the laboratory to the walking plane: who walks where, which way is up, and when."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Final

import numpy as np
from scipy.ndimage import uniform_filter1d

from pathwalker_cli.conventions import COORDINATES
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.markers import MarkerPoint
from pathwalker_cli.io.c3d import LEAST_FRAMES, Recording

SHORTEST_WALK: Final = 0.3
"""Travel below which the direction is not certain [m]: a child's step."""

_IN_PLANE: Final = 1e-6
"""Sideways coordinate below which a marker lies in the plane [m]."""

_SWAY: Final = 0.5
"""Time over which the pelvis' path is averaged before its turns are sought [s]: half a stride."""

_BEND: Final = 20.0
"""Angle between the halves of a path from which one plane does not hold it [deg]."""

_FASTEST: Final = 10.0
"""Speed beyond which a marker was not carried but jumped, as where recordings are joined [m/s]."""

_UNDER_WAY: Final = 0.3
"""Share of the usual speed from which a pass counts as walking, where a file holds several."""


class StandingError(DataError):
    """Nobody walks in a recording: it may be that of a pose."""


def walks(
    recording: Recording, points: tuple[MarkerPoint, ...], taken: Collection[str] = ()
) -> tuple[Recording, ...]:
    """Return every pass of a recording with +x along the walk and +z up.

    Frames at the ends that show too few markers are cut, the vertical is the axis along which the
    trunk stands above the feet, and each pass is turned to the mean velocity of its pelvis.

    Args:
        recording: The recording in the laboratory's axes.
        points: Where its markers sit on the walker.
        taken: Names of other recordings; passes are called otherwise.

    Raises:
        StandingError: If nobody walks.
        DataError: If no frame shows enough markers.
    """
    recording = upright(_shown(recording, points), points)
    path = _pelvis_path(recording, points)
    runs = _passes(path, recording.rate)
    if not runs:
        travel = float(np.linalg.norm(path[-1] - path[0]))
        raise StandingError(
            f"{', '.join(dict.fromkeys(_on(points, 'pelvis')))} travel {travel:.2f} m",
            where=recording.name,
            allowed=f"at least {SHORTEST_WALK} m, so that the walking direction is certain",
            mend="walks on a treadmill cannot be read" if feet_move(recording, points) else "",
        )
    if len(runs) == 1:
        return (turned(recording, _heading(path)),)
    turns = ", ".join(str(run.start + recording.first_frame) for run in runs[1:])
    stem, numbers = f"{recording.name}-", range(1, len(runs) + 1)
    while any(f"{stem}{number}" in taken for number in numbers):
        stem += "pass-"
    names = [f"{stem}{number}" for number in numbers]
    remark = f"turns round before frame {turns}: its passes are {' and '.join(names)}"
    return tuple(
        replace(
            turned(cut(recording, run.start, run.stop), _heading(path[run])),
            name=name,
            remarks=(*recording.remarks, remark),
        )
        for name, run in zip(names, runs, strict=True)
    )


def cut(recording: Recording, first: int, end: int) -> Recording:
    """Return the frames from `first` up to, but without, `end`."""
    per_frame = recording.samples_per_frame
    samples = slice(first * per_frame, end * per_frame)
    return replace(
        recording,
        positions=recording.positions[first:end],
        events=tuple(
            replace(event, frame=event.frame - first)
            for event in recording.events
            if first <= event.frame < end
        ),
        plates=tuple(
            replace(plate, force=plate.force[samples], moment=plate.moment[samples])
            for plate in recording.plates
        ),
        first_frame=recording.first_frame + first,
        stored={name: values[first:end] for name, values in recording.stored.items()},
    )


def turned(recording: Recording, axes: np.ndarray) -> Recording:
    """Return a recording, plates too, in axes that are given in the old ones, a row each (3, 3)."""
    positions = recording.positions @ axes.T
    positions.setflags(write=False)
    plates = tuple(
        replace(
            plate,
            corners=plate.corners @ axes.T,
            force=plate.force @ axes.T,
            moment=plate.moment @ axes.T,
            origin=plate.origin @ axes.T,
        )
        for plate in recording.plates
    )
    return replace(recording, positions=positions, plates=plates)


def about_vertical(forward: np.ndarray) -> np.ndarray:
    """Return axes with x along a horizontal direction (2,) and z up, one a row."""
    x, y = forward / np.linalg.norm(forward)
    return np.array([[x, y, 0.0], [-y, x, 0.0], [0.0, 0.0, 1.0]])


def is_projected(recording: Recording, points: tuple[MarkerPoint, ...]) -> bool:
    """Return whether the markers were laid into the walking plane before they were stored.

    Then they may have been turned as well, and say nothing about the plates' axes.
    """
    return bool(np.nanmax(np.abs(_positions(recording, points)[..., 1])) < _IN_PLANE)


def orientation_doubts(walk: Recording, points: tuple[MarkerPoint, ...]) -> tuple[str, ...]:
    """Return what contradicts a pass along +x of a person who faces it, a sentence each."""
    places = np.nanmean(_positions(walk, points), axis=0)
    doubts = []
    front = [i for i, p in enumerate(points) if p.link == "pelvis" and p.position[0] > 0.0]
    back = [i for i, p in enumerate(points) if p.link == "pelvis" and p.position[0] < 0.0]
    if front and back and places[front, 0].mean() < places[back, 0].mean():
        doubts.append(
            "the pelvis faces away from where it goes: backwards, or its markers are exchanged"
        )
    right, left = (
        [i for i, p in enumerate(points) if p.link.endswith(side)] for side in ("_r", "_l")
    )
    if right and left and places[left, 1].mean() < places[right, 1].mean() - _IN_PLANE:
        doubts.append(
            "left markers lie on the right: sides or axes of the laboratory are exchanged"
        )
    path = _pelvis_path(walk, points)
    half = len(path) // 2
    headings = [np.polyfit(np.arange(len(part)), part, 1)[0] for part in (path[:half], path[half:])]
    bend = float(np.degrees(abs(np.subtract(*(np.arctan2(h[1], h[0]) for h in headings)))))
    if _BEND < bend < 360.0 - _BEND and min(map(np.linalg.norm, headings)) * half > SHORTEST_WALK:
        doubts.append(f"its path bends by {bend:.0f} degrees: angles are those in one plane")
    return tuple(doubts)


def _positions(recording: Recording, points: tuple[MarkerPoint, ...]) -> np.ndarray:
    """Return the positions of the points' markers [m], shape (n, points, 3)."""
    return np.stack([recording.marker(point.marker) for point in points], axis=1)


def _on(points: tuple[MarkerPoint, ...], *links: str) -> list[str]:
    """Return the markers of some links, all markers if there are none."""
    return [p.marker for p in points if p.link in links] or [p.marker for p in points]


def _shown(recording: Recording, points: tuple[MarkerPoint, ...]) -> Recording:
    """Return a recording without the frames at its ends that show too few markers for a fit."""
    seen = np.isfinite(_positions(recording, points)[..., 0]).sum(axis=1)
    enough = np.flatnonzero(2 * seen >= len(COORDINATES))
    first, end = (int(enough[0]), int(enough[-1]) + 1) if enough.size else (0, 0)
    if end - first < LEAST_FRAMES:
        raise DataError(
            f"shows the markers of the set in {end - first} frames",
            where=recording.name,
            allowed=f"at least {LEAST_FRAMES} frames with {len(COORDINATES) // 2} points",
            mend="label the markers, or give another marker set",
        )
    if end - first == len(seen):
        return recording
    kept = cut(recording, first, end)
    last = kept.first_frame + end - first - 1
    remark = (
        f"cut to frames {kept.first_frame} to {last} of {recording.first_frame} to "
        f"{recording.first_frame + len(seen) - 1}: the others show too few markers"
    )
    return replace(kept, remarks=(*recording.remarks, remark))


def upright(recording: Recording, points: tuple[MarkerPoint, ...]) -> Recording:
    """Return a recording whose z points from the feet to the trunk."""
    high = _on(points, "pelvis", "trunk")
    low = _on(points, "foot_r", "foot_l")
    middle = [
        np.nanmean(np.stack([recording.marker(name) for name in names]), axis=(0, 1))
        for names in (high, low)
    ]
    rise = middle[0] - middle[1]
    axis = int(np.argmax(np.abs(rise)))
    sign = 1.0 if rise[axis] >= 0.0 else -1.0
    if (axis, sign) == (2, 1.0):
        return recording
    ahead, up = np.eye(3)[(axis + 1) % 3], sign * np.eye(3)[axis]
    name = f"{'+' if sign > 0 else '-'}{'xyz'[axis]}"
    remark = f"its vertical is {name}: turned so that z points up"
    upright = turned(recording, np.stack([ahead, np.cross(up, ahead), up]))
    return replace(upright, remarks=(*recording.remarks, remark))


def feet_move(recording: Recording, points: tuple[MarkerPoint, ...]) -> bool:
    """Return whether a foot goes to and fro, however little the pelvis travels."""
    foot = recording.marker(_on(points, "foot_r")[0])[:, :2]
    seen = foot[np.isfinite(foot[:, 0])]
    return bool(seen.size and np.ptp(seen, axis=0).max() > SHORTEST_WALK)


def _pelvis_path(recording: Recording, points: tuple[MarkerPoint, ...]) -> np.ndarray:
    """Return where the pelvis is on the ground in every frame [m], shape (n, 2), without gaps.

    It moves from frame to frame by the mean step of the markers that both frames show.
    """
    names = dict.fromkeys(_on(points, "pelvis"))
    markers = np.stack([recording.marker(name)[:, :2] for name in names])
    steps = np.diff(markers, axis=1)
    known = np.linalg.norm(steps, axis=2) < _FASTEST / recording.rate
    steps[~known] = 0.0
    mean = steps.sum(axis=0) / np.maximum(known.sum(axis=0), 1)[:, None]
    rows, seen = np.arange(len(mean)), known.any(axis=0)
    if seen.any():  # through gaps of all markers it goes straight on
        mean = np.stack([np.interp(rows, rows[seen], column[seen]) for column in mean.T], axis=1)
    return np.concatenate([np.zeros((1, 2)), np.cumsum(mean, axis=0)])


def _heading(path: np.ndarray) -> np.ndarray:
    """Return axes along the mean velocity of a path (n, 2), fitted to all of it."""
    velocity = np.polyfit(np.arange(len(path)), path, 1)[0]
    return about_vertical(velocity)


def _passes(path: np.ndarray, rate: float) -> list[slice]:
    """Return the frames of every pass: one way along the line on which most of the walk lies.

    A walk in one direction is one pass with all its frames, standing ones among them.
    """
    smooth = uniform_filter1d(path, max(int(_SWAY * rate), 1), axis=0, mode="nearest")
    centred = smooth - smooth.mean(axis=0)
    line = np.linalg.svd(centred, full_matrices=False)[2][0]
    along = centred @ line
    speed = np.gradient(along)
    runs: list[tuple[int, int]] = []
    moving = np.abs(speed) > _UNDER_WAY * np.quantile(np.abs(speed), 0.75)
    for sign in (1.0, -1.0):
        rows = np.flatnonzero(moving & (np.sign(speed) == sign))
        for run in np.split(rows, np.flatnonzero(np.diff(rows) > _SWAY * rate) + 1):
            if run.size >= LEAST_FRAMES and abs(along[run[-1]] - along[run[0]]) >= SHORTEST_WALK:
                runs.append((int(run[0]), int(run[-1]) + 1))
    ways = {np.sign(along[end - 1] - along[first]) for first, end in runs}
    if len(ways) == 1:
        return [slice(0, len(path))]
    return [slice(*run) for run in sorted(runs)]
