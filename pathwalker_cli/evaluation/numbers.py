"""The quantities of one gait by itself, and of the recordings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from pathwalker_cli.conventions import GENERATORS, SUFFIX, Side
from pathwalker_cli.evaluation.ankle import ankle_line, ankle_profile, recorded_ankle_profiles
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.evaluation.spread import Spread, spread
from pathwalker_cli.inverse.cycles import GaitCycle, step_lengths, walking_speed
from pathwalker_cli.inverse.dynamics import frame_rate
from pathwalker_cli.inverse.forces import foot_extents
from pathwalker_cli.io.c3d import Event
from pathwalker_cli.stride.cycle import BOTH_SIDES

__all__ = ["gait_numbers", "recorded_numbers"]


def gait_numbers(gait: Gait) -> dict[str, float]:
    """Return what the gait says by itself, by key of `quantities.QUANTITIES`, SI units."""
    found = {"walking_speed": gait.walking_speed}
    stances = {side: gait.toe_off(side) - gait.strike(side) for side in BOTH_SIDES}
    found |= _timing(gait.duration, stances)
    found |= _double(gait.duration, sum(stances.values()) - gait.duration)
    if gait.effort is not None:
        found["effort_per_distance"] = gait.effort / (gait.walking_speed * gait.duration)
    for side in BOTH_SIDES:
        knee = gait.column(f"knee_{SUFFIX[side]}")[gait.stance_rows(side)]
        found[f"step_length_{side}"] = gait.step_length(side)
        found[f"min_stance_knee_flexion_{side}"] = float(knee.min())
        found |= _loads(gait, side) | _muscles(gait, side) | _stiffness(gait, side)
    return found


def recorded_numbers(recorded: RecordedGait) -> dict[str, Spread]:
    """Return mean and range of what recordings say, by key of `quantities.QUANTITIES`, SI units.

    Walking speed is that of a trial; the other values are those of single steps, strides and
    stances, forces and torques of measured ones only.
    """
    speeds = [walking_speed(trial.motion) for trial in recorded.trials]
    values: dict[str, Sequence[float]] = {"walking_speed": speeds, **_recorded_timing(recorded)}
    steps = _steps(recorded)
    for side in BOTH_SIDES:
        profiles = recorded_ankle_profiles(recorded, side)
        up = recorded.stance_forces(side)[:, :, 1:].max(axis=(1, 2), initial=-np.inf)
        values |= {
            f"step_length_{side}": steps[side],
            f"min_stance_knee_flexion_{side}": _least_knees(recorded, side),
            f"peak_vertical_force_{side}": (up / recorded.walker.weight).tolist(),
            f"ankle_torque_slope_stance_{side}": [ankle_line(profile)[0] for profile in profiles],
            f"peak_net_ankle_torque_{side}": profiles[:, :, 1].max(axis=1).tolist(),
        }
    spreads = {key: spread(found) for key, found in values.items()}
    return {key: found for key, found in spreads.items() if found is not None}


def _timing(stride: float, stances: Mapping[Side, float]) -> dict[str, float]:
    """Return times and shares of a stride.

    Args:
        stride: Its time [s].
        stances: Time of the stance of each side [s].
    """
    found = {"stride_time": stride, "cadence": 120.0 / stride}
    for side, stance in stances.items():
        swing = stride - stance
        found |= {f"stance_share_{side}": stance / stride, f"stance_time_{side}": stance}
        found |= {f"swing_share_{side}": swing / stride, f"swing_time_{side}": swing}
    return found


def _double(stride: float, time: float) -> dict[str, float]:
    """Return time and share of double support in a stride [s]."""
    return {"double_support_time": time, "double_support_share": time / stride}


def _recorded_timing(recorded: RecordedGait) -> dict[str, list[float]]:
    """Return the times of every recorded stride, and its shares of stance and double support."""
    found: dict[str, list[float]] = {}
    for side in BOTH_SIDES:
        for trial, cycle in recorded.cycles(side):
            rate = frame_rate(trial.motion)
            stride = (cycle.end - cycle.start) / rate
            stance = (cycle.toe_off - cycle.start) / rate
            values = _timing(stride, {side: stance})
            both = _double_support(trial.events, cycle)
            if both is not None:
                values |= _double(stride, both / rate)
            for key, value in values.items():
                found.setdefault(key, []).append(value)
    return found


def _double_support(events: Sequence[Event], cycle: GaitCycle) -> int | None:
    """Return the frames of a gait cycle with both feet on the ground, None if events are missing.

    Within the stance of the side, the other foot leaves the ground and comes back to it.
    """
    other = {
        e.kind: e.frame
        for e in events
        if e.side != cycle.side and cycle.start < e.frame < cycle.toe_off
    }
    if other.keys() != {"toe_off", "foot_strike"}:
        return None
    return (other["toe_off"] - cycle.start) + (cycle.toe_off - other["foot_strike"])


def _loads(gait: Gait, side: Side) -> dict[str, float]:
    """Return peak ground force and net ankle torque of a side, as far as they are known."""
    found = {}
    if gait.force is not None:
        peak = float(gait.force[side][:, 1].max())
        found[f"peak_vertical_force_{side}"] = peak / gait.walker.weight
    profile = ankle_profile(gait, side)
    if profile is not None:
        found[f"ankle_torque_slope_stance_{side}"] = ankle_line(profile)[0]
        found[f"peak_net_ankle_torque_{side}"] = float(profile[:, 1].max())
    return found


def _muscles(gait: Gait, side: Side) -> dict[str, float]:
    """Return torque and activation of the ankle extensor of a side, as far as they are known."""
    found = {}
    index = GENERATORS.index(f"ankle_extension_{SUFFIX[side]}")
    for name, values in (("torque", gait.muscle_torque), ("activation", gait.activation)):
        if values is not None:
            stem = f"ankle_extension_{name}_{side}"
            found[f"peak_{stem}"] = float(values[:, index].max())
            found[f"mean_{stem}"] = float(gait.mean(values[:, index]))
    return found


def _stiffness(gait: Gait, side: Side) -> dict[str, float]:
    """Return the stiffnesses of the orthosis of a side, if there is one."""
    if gait.stiffness is None:
        return {}
    first = BOTH_SIDES.index(side)
    return {
        f"dorsiflexion_stiffness_{side}": float(gait.stiffness[first]),
        f"plantarflexion_stiffness_{side}": float(gait.stiffness[first + 2]),
    }


def _steps(recorded: RecordedGait) -> dict[Side, list[float]]:
    """Return the lengths of all steps per side [m]."""
    found: dict[Side, list[float]] = {side: [] for side in BOTH_SIDES}
    for trial in recorded.trials:
        feet = foot_extents(recorded.walker.model, trial.motion.values)
        heels = {side: ends[:, 0] for side, ends in feet.items()}
        for side, lengths in step_lengths(trial.events, heels, frame_rate(trial.motion)).items():
            found[side] += lengths
    return found


def _least_knees(recorded: RecordedGait, side: Side) -> list[float]:
    """Return the least knee flexion of every stance of a side [rad]."""
    name = f"knee_{SUFFIX[side]}"
    return [
        float(trial.motion[name][stance.strike : stance.toe_off + 1].min())
        for trial, stance in recorded.stances(side)
    ]
