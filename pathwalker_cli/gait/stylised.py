"""A stylised gait from the patient's own proportions: a start that needs no recorded motion."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import CubicSpline, PchipInterpolator

from pathwalker_cli.conventions import GRAVITY, coordinate_unit
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.start import ReferenceStride
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.trajectory import Trajectory


@dataclass(frozen=True)
class StylisedGait:
    """Shape of a stylised gait; both steps are alike.

    Args:
        walking_speed: Mean speed [m/s].
        stride_length: Distance of one stride [m].
        knee_flexion: Knee flexion at mid-stance [rad]: the crouch.
        pelvis_tilt: Constant forward lean of the pelvis [rad].
        trunk_lean: Constant lumbar angle [rad].
        phase_shares: Share of each phase of a step in the step time: flat, toe, toe and other
            heel, toe and other foot flat.
        push_off_pitch: Toe-down pitch of the foot at toe-off, from flat [rad].
        strike_pitch: Toe-up pitch of the foot at heel strike, from flat [rad].
        clearance: Extra lift of the ankle in mid-swing, as a share of leg length.
        setback: How far the foot is planted behind the hip of mid-stance, as a share of leg
            length: rolling over the toe carries the ankle on.
    """

    walking_speed: float
    stride_length: float
    knee_flexion: float = 0.6
    pelvis_tilt: float = 0.05
    trunk_lean: float = 0.1
    phase_shares: tuple[float, float, float, float] = (0.26, 0.54, 0.10, 0.10)
    push_off_pitch: float = 0.6
    strike_pitch: float = 0.2
    clearance: float = 0.06
    setback: float = 0.09

    @property
    def stride_time(self) -> float:
        """Time of one stride [s]."""
        return self.stride_length / self.walking_speed

    @property
    def durations(self) -> np.ndarray:
        """Phase durations [s], shape (8,)."""
        return np.tile(self.phase_shares, 2) * self.stride_time / 2


def stylised_stride(
    walker: Walker, walking_speed: float, knee_flexion: float, stride_ratio: float
) -> ReferenceStride:
    """Return a stylised stride; at least 0.1 sqrt(g leg length) fast."""
    slowest = choices.SLOWEST * float(np.sqrt(GRAVITY * walker.leg_length))
    gait = StylisedGait(max(walking_speed, slowest), stride_ratio * walker.leg_length, knee_flexion)
    durations = walker.pattern.durations(gait.durations)
    return ReferenceStride("synthetic", stylised_trajectory(walker, gait), durations)


@dataclass(frozen=True)
class _Leg:
    """Lengths of one leg [m] and its contact points in the foot frame."""

    thigh: float
    shank: float
    heel: np.ndarray
    toe: np.ndarray

    @property
    def flat_pitch(self) -> float:
        """Pitch at which heel and toe are equally high [rad], + toe-down."""
        dx, dz = self.toe - self.heel
        return float(np.arctan2(dz, dx))

    def angles(self, hip: np.ndarray, ankle: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return absolute thigh angle and knee flexion [rad] for points of shape (n, 2)."""
        reach = ankle - hip
        longest = 0.998 * (self.thigh + self.shank)
        distance = np.minimum(np.hypot(*reach.T), longest)
        cosine = (distance**2 - self.thigh**2 - self.shank**2) / (2 * self.thigh * self.shank)
        knee = np.arccos(np.clip(cosine, -1.0, 1.0))
        direction = np.arctan2(-reach[:, 0], -reach[:, 1])
        inner = np.arctan2(self.shank * np.sin(knee), self.thigh + self.shank * np.cos(knee))
        return direction - inner, knee


def stylised_trajectory(walker: Walker, gait: StylisedGait, samples: int = 201) -> Trajectory:
    """Return one stride of the stylised gait: generalised coordinates over time.

    Feet are planted, roll over the toe, swing and land on the heel; the pelvis moves on at
    constant speed and height, and the leg angles follow from the leg's geometry.

    Returns:
        The coordinates of the walker [m, rad] from the start of right_flat on.
    """
    time = np.linspace(0.0, gait.stride_time, samples)
    legs = {side: _leg(walker, side) for side in "rl"}
    switches = np.concatenate([[0.0], np.cumsum(gait.durations)])
    hip_height = _hip_height(legs, gait)
    mid_right = (switches[7] - gait.stride_time + switches[4]) / 2
    pelvis_x = gait.walking_speed * time
    hip_drop = -walker.model.jointPlacements[walker.model.getJointId("hip_r")].translation[2]
    hip = np.column_stack(
        [pelvis_x - hip_drop * np.sin(gait.pelvis_tilt), np.full(samples, hip_height)]
    )
    q: dict[str, np.ndarray | float] = {
        "pelvis_tx": pelvis_x,
        "pelvis_tz": hip_height + hip_drop * np.cos(gait.pelvis_tilt),
        "pelvis_tilt": gait.pelvis_tilt,
        "lumbar": gait.trunk_lean,
    }
    for side, delay in (("r", 0.0), ("l", gait.stride_time / 2)):
        plant = hip[0, 0] + gait.walking_speed * (mid_right + delay)
        plant -= gait.setback * (legs[side].thigh + legs[side].shank)
        ankle, pitch = _foot_path(legs[side], gait, time - delay, plant)
        thigh, knee = legs[side].angles(hip, ankle)
        q[f"hip_{side}"] = thigh - gait.pelvis_tilt
        q[f"knee_{side}"] = knee
        q[f"ankle_{side}"] = pitch - thigh - knee
    names = walker.skeleton.coordinates
    values = np.column_stack([np.broadcast_to(q.get(name, 0.0), samples) for name in names])
    return Trajectory(time, names, values, tuple(map(coordinate_unit, names)))


def _leg(walker: Walker, side: str) -> _Leg:
    """Read a leg's lengths off the model."""
    model = walker.model
    thigh = -model.jointPlacements[model.getJointId(f"knee_{side}")].translation[2]
    shank = -model.jointPlacements[model.getJointId(f"ankle_{side}")].translation[2]
    heel, toe = (
        model.frames[model.getFrameId(f"{point}_{side}")].placement.translation[[0, 2]]
        for point in ("heel", "toe")
    )
    return _Leg(float(thigh), float(shank), heel, toe)


def _hip_height(legs: dict[str, _Leg], gait: StylisedGait) -> float:
    """Return the hip height at which the longer leg stands flat with the wanted knee flexion."""
    bend = np.cos(gait.knee_flexion)
    heights = [
        np.sqrt(leg.thigh**2 + leg.shank**2 + 2 * leg.thigh * leg.shank * bend)
        - _turn(leg.toe, np.array([leg.flat_pitch]))[0, 1]
        for leg in legs.values()
    ]
    return float(np.mean(heights))


def _turn(point: np.ndarray, pitch: np.ndarray) -> np.ndarray:
    """Return a foot point in world axes for pitches + toe-down, shape (n, 2)."""
    c, s = np.cos(pitch), np.sin(pitch)
    return np.column_stack([point[0] * c + point[1] * s, -point[0] * s + point[1] * c])


def _foot_path(
    leg: _Leg, gait: StylisedGait, time: np.ndarray, plant: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return ankle positions (n, 2) [m] and foot pitch (n,) [rad] of a right foot.

    It stands flat at time 0 [s], its ankle at `plant` [m].
    """
    stride, t = gait.stride_time, np.concatenate([[0.0], np.cumsum(gait.durations)])
    strides, local = np.divmod(time, stride)
    flat = leg.flat_pitch
    off, strike = flat + gait.push_off_pitch, flat - gait.strike_pitch
    pitch_knots = np.array([flat, flat, off, strike, flat, flat])
    pitch = PchipInterpolator(np.array([0.0, *t[[1, 4, 6, 7, 8]]]), pitch_knots)(local)
    home = np.array([plant, -_turn(leg.toe, np.array([flat]))[0, 1]])
    toe = home + _turn(leg.toe, np.array([flat]))[0]
    heel = home + _turn(leg.heel, np.array([flat]))[0] + [gait.stride_length, 0.0]
    rolling = toe - _turn(leg.toe, pitch)
    landing = heel - _turn(leg.heel, pitch)
    start = toe - _turn(leg.toe, np.array([off]))[0]
    end = heel - _turn(leg.heel, np.array([strike]))[0]
    share = np.clip((local - t[4]) / (t[6] - t[4]), 0.0, 1.0)
    blend = CubicSpline([0.0, 1.0], [0.0, 1.0], bc_type="clamped")(share)
    swinging = start + blend[:, None] * (end - start)
    lift = gait.clearance * (leg.thigh + leg.shank)
    swinging[:, 1] += lift * np.sin(np.pi * share) ** 2
    ankle = np.where((local < t[4])[:, None], rolling, swinging)
    ankle = np.where((local >= t[6])[:, None], landing, ankle)
    ankle[:, 0] += strides * gait.stride_length
    return ankle, pitch
