"""All measures of a stride: what files, tables and pages call them, and how each is computed.

A new measure is one entry of `REGISTRY`.  Without further words it stands in `metrics.json`, in
every table, among the sensitivities, and on the pages of the reference.

References:
    Hof (1996) Gait & Posture 4, 222-223: numbers over leg length.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import (
    COORDINATES,
    GENERATORS,
    GRAVITY,
    ROOT,
    SIDES,
    SUFFIX,
    TRANSLATIONS,
    Side,
)
from pathwalker_cli.installed import load_installed
from pathwalker_cli.model.elements import ForceElement
from pathwalker_cli.stride.measure import (
    ANKLE,
    EFFORT,
    FORCE,
    KNEE,
    LOADS,
    MUSCLE,
    SOLUTION,
    WALK,
    WORK,
    Measure,
    per_side,
)  # fmt: skip
from pathwalker_cli.stride.stride import (
    LOADED_SHARE,
    NotKnownError,
    Stride,
    toe_bearing,
)


def _effort(stride: Stride) -> float:
    return float(stride.weights @ (stride.known("activation") ** 2).sum(axis=1))


def _stance_time(stride: Stride, side: Side) -> float:
    strike, toe_off = stride.stance(side)
    return toe_off - strike


def _stance_share(stride: Stride, side: Side) -> float:
    return _stance_time(stride, side) / stride.duration


def _double_support(stride: Stride) -> float:
    """Return the time with both feet on the ground [s]."""
    return sum(_stance_time(stride, side) for side in SIDES) - stride.duration


def _crouch(stride: Stride, side: Side) -> tuple[float, float]:
    """Return the least knee flexion of stance [rad] and its instant [s]."""
    rows = np.flatnonzero(stride.stands(side))
    knee = stride.column(f"knee_{SUFFIX[side]}")[rows]
    least = int(np.argmin(knee))
    return float(knee[least]), float(stride.time[rows[least]])


def _joint_range(stride: Stride) -> dict[str, tuple[float, float]]:
    known = zip(stride.walker.skeleton.coordinates, stride.q.T, strict=False)
    return {name: (q.min(), q.max()) for name, q in known if name not in TRANSLATIONS}


def _peak_vertical_force(stride: Stride, side: Side) -> float:
    return float(stride.foot_force(side)[:, 1].max())


def _least_point_force(stride: Stride) -> float:
    """Return the least vertical force on a contact point in contact [N]."""
    up = stride.known("point_force")[:, 1::2]
    return float((up if stride.walker.parts.compliant else up[stride.contacts]).min())


def _friction_ratio(stride: Stride, side: Side) -> float:
    """Return the largest |forward| / vertical force of a loaded foot; NaN if it never is."""
    forward, up = stride.foot_force(side).T
    rows = up > LOADED_SHARE * stride.walker.weight
    return float((np.abs(forward[rows]) / up[rows]).max()) if rows.any() else np.nan


def _peak_moments(stride: Stride, scale: float = 1.0) -> dict[str, float]:
    """Return the net moment of largest magnitude of every joint, with its sign [N m]."""
    torque = stride.known("net_torque")
    row = np.argmax(np.abs(torque), axis=0)
    largest = zip(stride.walker.skeleton.coordinates, torque[row, range(row.size)], strict=False)
    return {name: moment / scale for name, moment in largest if name not in ROOT}


def _work(stride: Stride, muscles: bool, sign: float) -> float:
    """Return what muscles or orthoses did (+) or took up (-), each for itself [J]."""
    walker = stride.walker
    parts: Sequence[ForceElement] = walker.muscles if muscles else walker.device.forces
    power = stride.known("element_power")
    each = (sign * power[:, walker.columns([part])].sum(axis=1) for part in parts)
    return sign * sum(float(stride.weights @ np.maximum(work, 0.0)) for work in each)


def ankle_torque_line(stride: Stride, side: Side) -> tuple[float, float]:
    """Return slope [N m/rad] and torque at zero angle [N m] of the ankle's net torque.

    Of the least-squares line of net ankle torque (muscles and orthosis, + plantarflexing) over
    dorsiflexion (minus the ankle coordinate), while the foot stands flat or on its toe; every
    instant counts by its share of time.  Positive like a spring that resists dorsiflexion; NaN if
    the ankle does not move.
    """
    rows = toe_bearing(stride, side)
    name = f"ankle_{SUFFIX[side]}"
    angle, weight = -stride.column(name)[rows], stride.weights[rows]
    torque = stride.known("net_torque")[rows, COORDINATES.index(name)]
    weight = weight / weight.sum()
    middle = float(weight @ angle)
    spread = float(weight @ (angle - middle) ** 2)
    slope = float(weight @ ((angle - middle) * torque)) / spread if spread > 0.0 else np.nan
    return slope, float(weight @ torque) - slope * middle


def ankle_line(profile: np.ndarray) -> tuple[float, float]:
    """Return slope [N m/rad] and torque at zero angle [N m] of the line through a profile.

    The least-squares line of torque over dorsiflexion, every per cent of stance counting alike.
    Positive like a spring that resists dorsiflexion.

    Args:
        profile: Dorsiflexion [rad] and torque [N m], shape (POINTS, 2).
    """
    slope, offset = np.polyfit(profile[:, 0], profile[:, 1], 1)
    return float(slope), float(offset)


def _ankle_extensor(stride: Stride, side: Side, of: str, mean: bool) -> float:
    """Return peak or mean of a quantity of the ankle extensor of a side."""
    values = stride.known(of)[:, GENERATORS.index(f"ankle_extension_{SUFFIX[side]}")]
    return float(stride.mean(values)) if mean else float(values.max())


def _strike_index(stride: Stride, side: Side) -> float:
    """Return where between heel (0) and toe (1) a foot first touches the ground."""
    pose = stride.pose(stride.strike(side))
    pose[:2] = 0.0  # where the pelvis is does not matter, and recordings may not know it
    if not np.isfinite(pose).all():
        raise NotKnownError("q")
    heel, toe = stride.walker.foot_points(pose)[2 * SIDES.index(side) :][:2]
    pattern = stride.walker.pattern
    places = stride.walker.contact_points(pose)[pattern.rows(side)]
    landed = places[np.argmin(places[:, 1])]
    return float((landed - heel) @ (toe - heel) / ((toe - heel) @ (toe - heel)))


def _rearmost_pressure(stride: Stride, side: Side) -> float:
    """Return how near to the heel (0) from the toe (1) the centre of pressure of a side gets.

    NaN if the foot is never loaded.
    """
    walker, first = stride.walker, 2 * SIDES.index(side)
    at = np.flatnonzero(stride.foot_force(side)[:, 1] > LOADED_SHARE * walker.weight)
    if not at.size:
        return np.nan
    rows = walker.pattern.rows(side)
    load = stride.known("point_force")[at, 1::2][:, rows]
    centre = (load * stride.contact_position[at][:, rows, 0]).sum(axis=1) / load.sum(axis=1)
    ends = walker.foot_points(stride.q[at])[:, first : first + 2, 0]
    return float(((centre - ends[:, 0]) / np.diff(ends)[:, 0]).min())


def _cuff_forces(stride: Stride, side: Side, axis: int) -> np.ndarray:
    """Return what a cuff does to the leg, across (0) or along (1) the shank [N], shape (n,).

    NaN where none is worn.
    """
    forces = stride.known("cuff_force")[:, 2 * SIDES.index(side) + axis]
    return forces if side in stride.walker.device.cuffs else np.full_like(forces, np.nan)


def _cuff_force(stride: Stride, side: Side, sign: float) -> float:
    """Return the largest force of a cuff on the shin (+) or the calf (-) [N]."""
    return float(np.maximum(0.0, (-sign * _cuff_forces(stride, side, 0)).max()))


def _of_shell(of: Callable[[Stride, Side], float]) -> Callable[[Stride, Side], float]:
    """Return the same measure of an orthosis that is a body of its own; others do not know it."""

    def measured(stride: Stride, side: Side) -> float:
        if side not in stride.walker.shelled:
            raise NotKnownError("shell")
        return float(of(stride, side))

    return measured


def _beside(stride: Stride, side: Side) -> float:
    """Return the largest difference of the angles of ankle and hinge [rad]."""
    ankle, hinge = (stride.column(f"{joint}_{SUFFIX[side]}") for joint in ("ankle", "hinge"))
    return float(np.abs(ankle - hinge).max())


def _cuff_pressure(stride: Stride, side: Side) -> float:
    """Return the largest mean pressure under a cuff [Pa]."""
    peak = max(_cuff_force(stride, side, 1.0), _cuff_force(stride, side, -1.0))
    return peak / stride.walker.patient.cuff_area(side)


def _stiffness(stride: Stride, side: Side, first: int) -> float:
    return float(stride.known("stiffness")[first + SIDES.index(side)])


def _extensor_measures() -> Iterator[Measure]:
    """Yield peak and mean of torque and activation of both ankle extensors."""
    for of, unit, name in (("muscle_torque", "N m", "torque"), ("activation", "1", "activation")):
        for kind in ("peak", "mean"):
            yield from per_side(
                f"{kind}_ankle_extension_{name}_*", f"{kind} ankle extensor {name}, *", unit,
                f"{kind} {name} of the ankle extensor muscles",
                partial(_ankle_extensor, of=of, mean=kind == "mean"),
                f"{kind} {name}, *", section=MUSCLE, kept=False,
            )  # fmt: skip


REGISTRY: tuple[Measure, ...] = (
    Measure("cost", "cost", "1", "value of the objective", None, section=SOLUTION),
    Measure("distance", "stride length", "m", "distance of the stride", lambda s: s.distance,
            section=WALK, shown=False),
    Measure("stride_time", "stride time", "s", "time of the stride", lambda s: s.duration,
            short="stride", section=WALK),
    Measure("walking_speed", "walking speed", "m/s", "distance over time",
            lambda s: s.walking_speed, short="speed", section=WALK, part="recording"),
    Measure("cadence", "cadence", "1/min", "steps per minute", lambda s: 120.0 / s.duration,
            section=WALK),
    *per_side("step_length_*", "step length, *", "m",
              "from the other foot's heel to this foot's heel, both flat", Stride.step_length,
              short="step *", section=WALK, part="step"),
    Measure("normalised_walking_speed", "normalised walking speed", "1",
            "over the root of gravity times leg length (Hof 1996)",
            lambda s: s.walking_speed / np.sqrt(GRAVITY * s.walker.leg_length),
            "normalised speed", section=WALK, part="recording", kept=False),
    Measure("normalised_cadence", "normalised cadence", "1",
            "steps per second over the root of gravity over leg length (Hof 1996)",
            lambda s: 2.0 / s.duration / np.sqrt(GRAVITY / s.walker.leg_length),
            "normalised cadence", section=WALK, kept=False),
    *per_side("normalised_step_length_*", "normalised step length, *", "1",
              "over leg length (Hof 1996)",
              lambda s, side: s.step_length(side) / s.walker.leg_length, "normalised step, *",
              section=WALK, part="step", kept=False),
    *per_side("stance_share_*", "stance share, *", "1",
              "share of the stride with the foot on the ground", _stance_share, section=WALK),
    *per_side("stance_time_*", "stance time, *", "s", "time from foot strike to toe-off",
              _stance_time, section=WALK, kept=False),
    *per_side("swing_share_*", "swing share, *", "1",
              "share of the stride with the foot in the air",
              lambda s, side: 1.0 - _stance_share(s, side), section=WALK),
    *per_side("swing_time_*", "swing time, *", "s", "time from toe-off to the next foot strike",
              lambda s, side: s.duration - _stance_time(s, side), section=WALK, kept=False),
    Measure("double_support_share", "double support share", "1",
            "share of the stride with both feet on the ground",
            lambda s: _double_support(s) / s.duration, section=WALK),
    Measure("double_support_time", "double support time", "s",
            "time of the stride with both feet on the ground", _double_support, section=WALK,
            kept=False),
    *per_side("min_stance_knee_flexion_*", "least stance knee flexion, *", "rad",
              "least knee flexion of stance: the crouch measure",
              lambda s, side: _crouch(s, side)[0], "knee, *", "knee *", section=KNEE,
              part="stance"),
    *per_side("min_stance_knee_flexion_time_*", "time of least stance knee flexion, *", "s",
              "when that is", lambda s, side: _crouch(s, side)[1], section=KNEE, shown=False),
    Measure("joint_range", "joint ranges", "rad",
            "per coordinate but the pelvis position, least and largest value", _joint_range,
            shown=False),
    Measure("body_weight", "body weight", "N", "weight, with orthoses if they are worn",
            lambda s: s.walker.weight, shown=False),
    *per_side("strike_index_*", "strike index, *", "1",
              "where from heel to toe a foot lands: rearfoot below 1/3, forefoot above 2/3 "
              "(Cavanagh and Lafortune 1980)", _strike_index, section=WALK, part="stance"),
    *per_side("rearmost_pressure_*", "rearmost pressure, *", "1",
              "where from heel to toe the centre of pressure is when it is nearest to the heel: "
              "above 2/3 a foot walks on its toes", _rearmost_pressure, section=WALK,
              part="stance", shown=False),
    *per_side("peak_vertical_force_*", "peak vertical force, *", "N",
              "largest vertical ground reaction force", _peak_vertical_force, section=FORCE,
              part="stance", shown=False),
    *per_side("peak_vertical_force_*_body_weights", "peak vertical force, *", "body weights",
              "the same over body weight",
              lambda s, side: _peak_vertical_force(s, side) / s.walker.weight, "vertical peak, *",
              compared_as="peak_vertical_force_*", section=FORCE, part="stance"),
    Measure("min_vertical_force", "least vertical force", "N",
            "least vertical force on a contact point in contact; below zero the ground would have "
            "to pull", _least_point_force, shown=False),
    *per_side("max_friction_ratio_*", "friction ratio, *", "1",
              "largest |forward| / vertical force while loaded", _friction_ratio, section=LOADS),
    Measure("peak_joint_moment", "peak joint moments", "N m",
            "per joint, net moment of largest magnitude, with its sign", _peak_moments,
            shown=False),
    Measure("peak_joint_moment_per_mass", "peak joint moments per mass", "N m/kg",
            "the same over mass", lambda s: _peak_moments(s, s.walker.total_mass), shown=False),
    Measure("peak_activation", "peak activations", "1", "per generator, largest activation",
            lambda s: dict(zip(GENERATORS, s.known("activation").max(axis=0), strict=True)),
            shown=False),
    Measure("phase_durations", "phase durations", "s", "per phase",
            lambda s: s.phase_durations, shown=False),
    Measure("positive_muscle_work", "muscles, positive", "J",
            "work that generators did, each for itself",
            lambda s: _work(s, True, 1.0), section=WORK),
    Measure("negative_muscle_work", "muscles, negative", "J",
            "work that generators took up, each for itself, negative",
            lambda s: _work(s, True, -1.0), section=WORK),
    Measure("positive_orthosis_work", "orthoses, positive", "J",
            "work that the orthoses gave back", lambda s: _work(s, False, 1.0),
            section=WORK),
    Measure("negative_orthosis_work", "orthoses, negative", "J",
            "work that the orthoses took up, negative",
            lambda s: _work(s, False, -1.0), section=WORK),
    Measure("effort", "effort", "s", "integral of the sum of squared activations", _effort,
            section=EFFORT, shown=False),
    Measure("effort_per_distance", "effort per distance", "s/m", "effort over distance",
            lambda s: _effort(s) / s.distance, short="effort", section=EFFORT),
    Measure("max_height_violation", "height below the ground", "m",
            "how far a contact point is below the ground at most",
            lambda s: max(0.0, -s.contact_position[:, :, 1].min()), shown=False),
    *per_side("ankle_torque_slope_*", "ankle torque slope, *", "N m/rad",
              "slope of net ankle torque over dorsiflexion while flat or on the toe",
              lambda s, side: ankle_torque_line(s, side)[0], section=LOADS),
    *per_side("ankle_torque_slope_stance_*", "ankle torque slope over stance, *", "N m/rad",
              "slope of net ankle torque over dorsiflexion, every per cent of stance alike",
              lambda s, side: ankle_line(s.ankle_profile(side))[0], "stance slope, *",
              section=ANKLE, part="stance", kept=False),
    *per_side("peak_net_ankle_torque_*", "peak net ankle torque, *", "N m",
              "largest net plantarflexing ankle torque of stance",
              lambda s, side: s.ankle_profile(side)[:, 1].max(), "peak, *", section=ANKLE,
              part="stance", kept=False),
    *_extensor_measures(),
    *per_side("peak_shin_force_*", "cuff on the shin, *", "N",
              "largest force of the cuff across the front of the leg, as the orthosis resists "
              "dorsiflexion; of one that is glued, its torque over the height of the cuff",
              partial(_cuff_force, sign=1.0), section=LOADS),
    *per_side("peak_calf_force_*", "cuff on the calf, *", "N",
              "largest force of the cuff on the calf, as the orthosis resists plantarflexion",
              partial(_cuff_force, sign=-1.0), section=LOADS),
    *per_side("peak_cuff_pressure_*", "pressure under the cuff, *", "Pa",
              "the larger of both over the area of the cuff", _cuff_pressure, section=LOADS),
    *per_side("peak_cuff_shear_*", "cuff along the shank, *", "N",
              "largest force of the cuff along the shank; of an orthosis that is a body of its own",
              _of_shell(lambda s, side: np.abs(_cuff_forces(s, side, 1)).max()), section=LOADS),
    *per_side("pistoning_*", "pistoning, *", "m",
              "how far the cuff slides along the leg, from its lowest to its highest; likewise",
              _of_shell(lambda s, side: np.ptp(s.cuff_shift(side)[:, 1])), section=LOADS,
              small=True),
    *per_side("cuff_depth_*", "cuff into the leg, *", "m",
              "how deep the cuff is pressed into shin or calf at most; likewise",
              _of_shell(lambda s, side: np.abs(s.cuff_shift(side)[:, 0]).max()), section=LOADS,
              small=True),
    *per_side("hinge_difference_*", "ankle against hinge, *", "rad",
              "largest difference of the angles of ankle and hinge; likewise", _of_shell(_beside),
              section=LOADS),
    *per_side("dorsiflexion_stiffness_*", "K_D *", "N m/rad", "K_D; `null` when barefoot",
              partial(_stiffness, first=0), "K_D, *", "K_D *", section=EFFORT),
    *per_side("plantarflexion_stiffness_*", "K_P *", "N m/rad", "K_P; `null` when barefoot",
              partial(_stiffness, first=2), "K_P, *", "K_P *", section=EFFORT),
)  # fmt: skip
"""All measures, in the order of `metrics.json`."""

_SPRINGS: Final = ("dorsiflexion_stiffness_*", "plantarflexion_stiffness_*")
_NORMALISED: Final = ("normalised_walking_speed", "normalised_step_length_*", "normalised_cadence")
_CROUCH: Final = "min_stance_knee_flexion_*"
_TIMES: Final = ("stance_share_*", "stance_time_*", "swing_share_*", "swing_time_*",
                 "double_support_share", "double_support_time", _CROUCH,
                 "peak_vertical_force_*_body_weights")  # fmt: skip

TABLES: Final[Mapping[str, Sequence[str]]] = {
    "summary": ("walking_speed", "distance", "stride_time", "step_length_*", _CROUCH, *_SPRINGS),
    "evaluate": (
        "walking_speed", "step_length_*", "stride_time", "cadence", *_NORMALISED, *_TIMES,
        "strike_index_*", "ankle_torque_slope_stance_*", "peak_net_ankle_torque_*",
        *(f"{kind}_ankle_extension_{name}_*" for name in ("torque", "activation")
          for kind in ("peak", "mean")),
        "effort_per_distance", *_SPRINGS,
    ),
    "report": ("walking_speed", "step_length_*", "cadence", "stride_time", *_NORMALISED,
               *(key for key in _TIMES if key != "swing_share_*"), "effort_per_distance"),
    "compare": (
        "walking_speed", "step_length_*", "stride_time", "cadence", "stance_share_*",
        "swing_share_*", "double_support_share", _CROUCH, "peak_vertical_force_*_body_weights",
        "ankle_torque_slope_*", "max_friction_ratio_*", "positive_muscle_work",
        "negative_muscle_work", "positive_orthosis_work", "negative_orthosis_work",
        "peak_shin_force_*", "peak_calf_force_*", "peak_cuff_pressure_*", "peak_cuff_shear_*",
        "pistoning_*", "cuff_depth_*", "hinge_difference_*", "effort_per_distance", *_SPRINGS,
        "cost",
    ),
    "batch": ("cost", "walking_speed", "step_length_*", _CROUCH, *_SPRINGS,
              "effort_per_distance"),
    "studies": (
        "cost", "effort_per_distance", "min_stance_knee_flexion_left",
        "min_stance_knee_flexion_right", "step_length_left", "step_length_right",
        "walking_speed", "stride_time", *_SPRINGS,
    ),
}  # fmt: skip
"""What each table shows, in order; measures that no table names stand at the end of every one."""


def measures_in(table: str) -> tuple[Measure, ...]:
    """Return the measures of a table, in order.

    Args:
        table: One of `TABLES`; those of "evaluate" and "report" have their keys beside recordings.
    """
    load_installed()
    named = [key for key in TABLES[table] for key in expanded(key)]
    elsewhere = {key for keys in TABLES.values() for name in keys for key in expanded(name)}
    further = [m.key for m in REGISTRY if m.shown and m.key not in elsewhere]
    found = [measure_of(key) for key in (*named, *further)]
    if table in ("evaluate", "report"):
        return tuple(replace(m, key=m.compared_as or m.key) for m in found)
    return tuple(found)


def expanded(key: str) -> tuple[str, ...]:
    """Return the keys of both sides where a star stands for them."""
    return tuple(key.replace("*", side) for side in SIDES) if "*" in key else (key,)


def measure_of(key: str) -> Measure:
    """Return a measure by its key."""
    return next(measure for measure in REGISTRY if measure.key == key)


def metrics_of(stride: Stride) -> dict[str, Any]:
    """Return the measures of a stride ready for JSON, None for what does not exist.

    Values per phase, coordinate or generator stay together under one key.
    """
    load_installed()
    return {m.key: m.of(stride) for m in REGISTRY if m.kept and m.value is not None}


def numbers_of(stride: Stride) -> dict[str, float]:
    """Return every single number of a stride, e.g. "joint_range.knee_r.min"; SI units."""
    return numbers_in(metrics_of(stride))


def numbers_in(metrics: Mapping[str, Any]) -> dict[str, float]:
    """Return every single number of what `metrics_of` returned."""
    numbers: dict[str, float] = {}
    groups: dict[str, float] = {}
    for key, value in metrics.items():
        if isinstance(value, float):
            numbers[key] = value
        elif isinstance(value, Mapping) and not key.endswith("_per_mass"):
            groups |= _flat(key, value)
    return numbers | groups


def _flat(name: str, values: Mapping[str, Any]) -> dict[str, float]:
    """Return the entries of a measure with several; a pair is least and largest value."""
    flat: dict[str, float] = {}
    for key, value in values.items():
        if isinstance(value, list):
            flat |= {f"{name}.{key}.min": value[0], f"{name}.{key}.max": value[1]}
        elif value is not None:
            flat[f"{name}.{key}"] = value
    return flat
