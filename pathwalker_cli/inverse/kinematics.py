"""Joint angles from marker positions: weighted least squares on the walker, frame by frame."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import pinocchio as pin

from pathwalker_cli.conventions import COORDINATES, TRANSLATIONS, coordinate_unit
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.markers import MarkerPoint
from pathwalker_cli.io.c3d import Recording
from pathwalker_cli.trajectory import Trajectory

TOLERANCE: Final = 1e-8
"""Largest step at which a frame counts as solved [m, rad]: far below what markers resolve."""

ITERATIONS: Final = 200
"""Steps per frame after which the recording is refused; two to four are usual."""

DAMPING: Final = 1e-3
"""Damping after a step that led uphill [m^2/rad^2]: a tenth of the lever of a foot, squared."""

LARGEST_STEP: Final = 0.5
"""Largest step of one iteration [m, rad]; keeps the first frame from turning a joint round."""

FLAT: Final = 1e-6
"""Smallest curvature that counts [m^2/rad^2]; a joint without markers stays where it is."""


@dataclass(frozen=True)
class MarkerResiduals:
    """Distances between markers and the walker's points after the fit.

    Args:
        names: Point names, "RANK on foot_r".
        distances: Distances [m], NaN where the marker was missing, shape (n, points).
    """

    names: tuple[str, ...]
    distances: np.ndarray

    @property
    def mean(self) -> float:
        """Mean distance over all points and frames [m]."""
        return float(np.nanmean(self.distances))

    def rms(self) -> dict[str, float]:
        """Return the root mean square distance of each point [m], NaN if it was never seen."""
        mean = np.ma.masked_invalid(self.distances**2).mean(axis=0)
        return dict(zip(self.names, np.sqrt(np.ma.filled(mean, np.nan)).tolist(), strict=True))


def inverse_kinematics(
    model: pin.Model, recording: Recording, points: tuple[MarkerPoint, ...]
) -> tuple[Trajectory, MarkerResiduals]:
    """Fit the walker to the markers in every frame; nothing is filtered.

    Args:
        model: The walker, its q in the order of `COORDINATES`.
        recording: The recording, x along the walk and z up.
        points: Where its markers sit on the walker.

    Returns:
        The coordinates over time, time from the first frame on, and the distances that remain.

    Raises:
        DataError: If a marker is unknown, a frame shows too little, or the fit does not settle.
    """
    paths = [recording.marker(point.marker) for point in points]
    targets = np.stack(paths, axis=1)[..., [0, 2]]
    fit = _Fit(model, points)
    q = fit.start(targets[0])
    values = np.empty((targets.shape[0], model.nq))
    distances = np.empty(targets.shape[:2])
    for frame, target in enumerate(targets):
        q, residuals = fit.solve(
            target, q, f"{recording.name}, frame {recording.first_frame + frame}"
        )
        values[frame] = q
        distances[frame] = np.hypot(residuals[:, 0], residuals[:, 1])
    distances.setflags(write=False)
    units = tuple(coordinate_unit(name) for name in COORDINATES)
    trajectory = Trajectory(recording.time, COORDINATES, values, units)
    return trajectory, MarkerResiduals(tuple(point.name for point in points), distances)


def marker_paths(model: pin.Model, points: tuple[MarkerPoint, ...], q: np.ndarray) -> np.ndarray:
    """Return where the walker's points are (forward, up) [m] in poses (n, 10), (n, points, 2)."""
    fit = _Fit(model, points)
    return np.array([fit.positions(pose)[0] for pose in q])


class _Fit:
    """Damped Newton fit of the walker's points to one frame of markers."""

    def __init__(self, model: pin.Model, points: tuple[MarkerPoint, ...]) -> None:
        self.model: Any = model
        self.data: Any = model.createData()
        self.weights = np.array([point.weight for point in points])
        frames = [model.frames[model.getFrameId(point.link)] for point in points]
        self.joints = [frame.parentJoint for frame in frames]
        self.local = [
            frame.placement.act(np.array([point.position[0], 0.0, point.position[1]]))
            for frame, point in zip(frames, points, strict=True)
        ]
        count = range(model.nv)
        carries = np.array([[c + 1 in list(model.supports[j + 1]) for c in count] for j in count])
        hinges = np.array([name not in TRANSLATIONS for name in COORDINATES])
        self.moves = carries[np.array(self.joints) - 1]
        self.curved = (carries | carries.T) & np.outer(hinges, hinges)
        self.lower = np.maximum.outer(count, count)

    def start(self, target: np.ndarray) -> np.ndarray:
        """Return the upright pose among the markers of a first frame."""
        q = np.zeros(self.model.nq)
        seen = np.isfinite(target[:, 0])
        if seen.any():
            moved = (target - self.positions(q)[0])[seen].mean(axis=0)
            q[[COORDINATES.index(name) for name in TRANSLATIONS]] = moved
        return q

    def positions(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return the points (forward, up) [m], shape (p, 2), and their Jacobian, (p, 2, nv)."""
        pin.computeJointJacobians(self.model, self.data, q)
        placed = [self.data.oMi[j].act(p) for j, p in zip(self.joints, self.local, strict=True)]
        x, _, z = np.array(placed).T[:, :, None]
        velocity = self.data.J
        jacobian = np.empty((len(self.joints), 2, self.model.nv))
        jacobian[:, 0] = (velocity[0] + z * velocity[4]) * self.moves
        jacobian[:, 1] = (velocity[2] - x * velocity[4]) * self.moves
        return np.hstack([x, z]), jacobian

    def newton(
        self, residuals: np.ndarray, jacobian: np.ndarray, weights: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the gradient and the exact Hessian of half the weighted squared distances.

        Turning two hinges of a chain bends a point's path towards the lower hinge o: its second
        derivative is -(p - o), and p - o is that hinge's column of the Jacobian, turned back.
        """
        pulled = residuals * weights[:, None]
        slopes = jacobian.reshape(residuals.size, -1)
        weighted = slopes.T * np.repeat(weights, 2)
        bend = pulled[:, 1] @ jacobian[:, 0] - pulled[:, 0] @ jacobian[:, 1]
        hessian = weighted @ slopes + np.where(self.curved, bend[self.lower], 0.0)
        return weighted @ residuals.ravel(), hessian

    def solve(self, target: np.ndarray, q: np.ndarray, where: str) -> tuple[np.ndarray, np.ndarray]:
        """Return q and the residuals, target minus point [m], shape (p, 2), of one frame.

        Args:
            target: Marker positions (forward, up) [m], NaN where missing, shape (p, 2).
            q: Where to start.
            where: Trial and frame, for the message.
        """
        seen = np.isfinite(target[:, 0])
        if 2 * seen.sum() < self.model.nv:
            raise DataError(
                f"shows {seen.sum()} of {seen.size} marker points",
                where=where,
                allowed=f"enough to fix {self.model.nv} coordinates",
                mend="cut the recording or bridge longer gaps",
            )
        weights = np.where(seen, self.weights, 0.0)
        target = np.where(seen[:, None], target, 0.0)
        points, jacobian = self.positions(q)
        residuals, damping = target - points, 0.0
        cost = float(weights @ (residuals**2).sum(axis=1))
        for _ in range(ITERATIONS):
            gradient, hessian = self.newton(residuals, jacobian, weights)
            step = _downhill(hessian, gradient, damping)
            points, trial_jacobian = self.positions(q + step)
            trial = target - points
            trial_cost = float(weights @ (trial**2).sum(axis=1))
            if trial_cost <= cost * (1.0 + 1e-12):
                q, residuals, jacobian, cost = q + step, trial, trial_jacobian, trial_cost
                if np.abs(step).max() < TOLERANCE:
                    return q, np.where(seen[:, None], residuals, np.nan)
                damping /= 10.0
            else:
                damping = max(10.0 * damping, DAMPING)
        raise DataError("markers and walker do not fit", where=where, mend="check the markers")


def _downhill(hessian: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    """Return the Newton step; directions that are flat or curve the wrong way are damped."""
    values, vectors = np.linalg.eigh(hessian)
    step = vectors @ ((vectors.T @ gradient) / (np.maximum(np.abs(values), FLAT) + damping))
    return step * min(1.0, LARGEST_STEP / np.abs(step).max(initial=LARGEST_STEP))
