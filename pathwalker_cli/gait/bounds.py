"""Bounds and numbers of a gait problem, from the config and the patient."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pathwalker_cli.config import BoundsConfig
from pathwalker_cli.conventions import (
    CONTACT_FORCES,
    CONTACT_POINTS,
    COORDINATES,
    GRAVITY,
    ROOT,
    STIFFNESSES,
)
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.problem import ACTIVATIONS, RESERVES, VELOCITIES
from pathwalker_cli.model.contact import PHASES
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.problem import INFINITY, BoundTable

__all__ = ["GaitBounds", "gait_bounds", "recorded_durations", "tracking_bounds"]

Range = tuple[float, float]


@dataclass(frozen=True)
class GaitBounds:
    """The bounds that are a choice, with where they come from.

    Args:
        table: All bounds.
        sources: For every choice (name of the quantity) one clause: value and reason.
    """

    table: BoundTable
    sources: dict[str, str]


def gait_bounds(walker: Walker, config: BoundsConfig) -> GaitBounds:
    """Return the bounds of a prediction.

    Joint ranges default to the barefoot recordings widened by the margin: they are known before
    any orthosis is built.

    Args:
        walker: Who walks.
        config: Bounds of the study.

    Raises:
        ConfigError: If a joint has no range, or stops and springs of a range do not fit.
    """
    sources: dict[str, str] = {}
    entries: dict[tuple[str, ...], Range] = _always()
    entries |= _joint_ranges(walker, config, sources)
    for name in VELOCITIES:
        entries[(name,)] = (-config.joint_speed, config.joint_speed)
    for phase in PHASES:
        pair = config.phase_durations.get(phase.name, config.phase_duration)
        entries[("duration", phase.name)] = pair
        sources[f"duration of {phase.name}"] = f"[{pair[0]:g}, {pair[1]:g}] s, from the config"
    for force in CONTACT_FORCES:
        if force.endswith("z"):
            entries[(force,)] = (config.least_vertical_force, INFINITY)
    for point in CONTACT_POINTS:
        entries[(f"{point} height",)] = (config.least_height, INFINITY)
    entries |= _lift_off()
    entries[("distance",)] = config.distance
    entries[("walking_speed",)] = (_least_speed(walker, config, sources), INFINITY)
    entries |= _stiffness(walker, config, sources)
    entries |= {(name,): (0.0, 0.0) for name in RESERVES}
    return GaitBounds(BoundTable(entries), sources)


def recorded_durations(bounds: GaitBounds, durations: np.ndarray) -> GaitBounds:
    """Return bounds that fix the phases to their recorded durations [s], shape (8,)."""
    pairs = list(zip(PHASES, durations.tolist(), strict=True))
    table = bounds.table.replace({("duration", phase.name): (d, d) for phase, d in pairs})
    sources = {f"duration of {phase.name}": f"{d:.4g} s, as recorded" for phase, d in pairs}
    return GaitBounds(table, {**bounds.sources, **sources})


def tracking_bounds(bounds: GaitBounds, durations: np.ndarray, stiffness: np.ndarray) -> BoundTable:
    """Return the bounds of the first stage: given durations and stiffness, free reserves.

    Args:
        bounds: Bounds of the prediction.
        durations: Phase durations [s], shape (8,).
        stiffness: Stiffness to hold [N m/rad], shape (4,), or empty.
    """
    changes: dict[tuple[str, ...], Range] = {(name,): (-INFINITY, INFINITY) for name in RESERVES}
    changes |= {(name,): (-2.5, 2.5) for name in COORDINATES[2:]}
    changes[("walking_speed",)] = (-INFINITY, INFINITY)
    for phase, duration in zip(PHASES, durations, strict=True):
        changes[("duration", phase.name)] = (float(duration), float(duration))
    for name, value in zip(STIFFNESSES, stiffness, strict=False):
        changes[(name,)] = (float(value), float(value))
    return bounds.table.replace(changes)


def helped_bounds(bounds: GaitBounds) -> BoundTable:
    """Return the bounds of a prediction with free reserves at the joints.

    The pelvis gets none: nobody carries the patient.
    """
    free: dict[tuple[str, ...], Range]
    free = {(name,): (-INFINITY, INFINITY) for name in RESERVES[len(ROOT) :]}
    return bounds.table.replace(free)


def _always() -> dict[tuple[str, ...], Range]:
    """Return bounds that are no choice: where the walk starts, what can not be negative."""
    entries: dict[tuple[str, ...], Range] = {("pelvis_tx", "first"): (0.0, 0.0)}
    entries[("pelvis_tz",)] = (0.0, 2.0)
    entries |= {(name,): (0.0, 1.0) for name in ACTIVATIONS}
    return entries


def _lift_off() -> dict[tuple[str, ...], Range]:
    """Return zero force at the last instant before a point leaves the ground."""
    following = PHASES[1:] + PHASES[:1]
    return {
        (force, phase.name, "end"): (0.0, 0.0)
        for phase, after in zip(PHASES, following, strict=True)
        for force in phase.lifted_off(after)
    }


def _joint_ranges(
    walker: Walker, config: BoundsConfig, sources: dict[str, str]
) -> dict[tuple[str, ...], Range]:
    recorded = walker.patient.recorded.get("barefoot")
    margin = config.joint_range_margin
    entries: dict[tuple[str, ...], Range] = {}
    for name in COORDINATES[2:]:
        if name in config.joint_ranges:
            low, high = config.joint_ranges[name]
            source = "from the config"
        elif recorded is not None and name in recorded.joint_ranges:
            low, high = recorded.joint_ranges[name]
            low, high = low - margin, high + margin
            source = f"barefoot recordings widened by {margin:g} rad"
        elif name in config.fallback_joint_ranges:
            low, high = config.fallback_joint_ranges[name]
            source = "fallback: the patient has no recordings"
        else:
            raise ConfigError(
                f"has no range for {name}", where="bounds", mend="add it to bounds.joint_ranges"
            )
        entries[(name,)] = (low, high)
        sources[name] = f"[{low:.3f}, {high:.3f}] rad, {source}"
    return entries


def _least_speed(walker: Walker, config: BoundsConfig, sources: dict[str, str]) -> float:
    """Return the lower bound of the walking speed [m/s]."""
    recorded = walker.patient.recorded.get("barefoot")
    if config.least_walking_speed != "recorded":
        speed, source = float(config.least_walking_speed), "from the config"
    elif recorded is not None:
        speed, source = recorded.walking_speed.mean, "mean of the barefoot recordings"
    else:
        ratio = config.fallback_speed_ratio
        # The shoe lengthens the leg, but both conditions must be asked for the same speed.
        speed = ratio * float(np.sqrt(GRAVITY * walker.patient.leg_length))
        source = f"fallback: {ratio:g} sqrt(g barefoot leg length), the patient has no recordings"
    sources["walking_speed"] = f"at least {speed:.3f} m/s, {source}"
    return speed


def _stiffness(
    walker: Walker, config: BoundsConfig, sources: dict[str, str]
) -> dict[tuple[str, ...], Range]:
    if walker.orthosis is None:
        return {}
    orthosis = walker.patient.require_orthosis()
    real = orthosis.stiffness_range
    entries: dict[tuple[str, ...], Range] = {}
    for name in STIFFNESSES:
        kind = name.split("_")[0]
        given = config.stiffness.get(name) or getattr(config, f"{kind}_stiffness")
        pair = given or getattr(real, kind)
        fault = orthosis.spring_fault(kind, *pair)
        if fault is not None:
            key = f"stiffness.{name}" if name in config.stiffness else f"{kind}_stiffness"
            raise ConfigError(f"is {fault[0]}", where=f"bounds.{key}", allowed=fault[1])
        entries[(name,)] = pair
        reason = "from the config" if given else f"real springs: {real.source}"
        sources[name] = f"[{pair[0]:g}, {pair[1]:g}] N m/rad, {reason}"
    return entries
