"""Bounds and numbers of a gait problem, from the config and the patient."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from pathwalker_cli.config import BoundsConfig, StudyConfig
from pathwalker_cli.conventions import GRAVITY
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait import choices
from pathwalker_cli.gait.problem import ACTIVATIONS
from pathwalker_cli.io.c3d_plates import LOADED
from pathwalker_cli.io.fields import quantity_at
from pathwalker_cli.model.contact import ContactPattern
from pathwalker_cli.model.numbers import Unknown
from pathwalker_cli.model.skeleton import PLANAR_WALKER, Skeleton
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.ocp.problem import INFINITY, BoundTable
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import orthosis_fault

Range = tuple[float, float]
Entries = dict[tuple[str, ...], Range]
ANYTHING: Final[Range] = (-INFINITY, INFINITY)


@dataclass(frozen=True)
class GaitBounds:
    """The bounds that are a choice, with where they come from.

    Args:
        table: All bounds.
        sources: For every choice (name of the quantity) one clause: value and reason.
        ranges: Range of every unknown of the walker by name [SI].
        keys: Key of the config that each range comes from, or that would change it.
    """

    table: BoundTable
    sources: dict[str, str]
    ranges: dict[str, Range]
    keys: dict[str, str]


def gait_bounds(
    walker: Walker, config: BoundsConfig, free: Mapping[str, Range] | None = None
) -> GaitBounds:
    """Return the bounds of a prediction.

    Joint ranges default to the barefoot recordings widened by the margin: they are known before
    any orthosis is built.

    Args:
        walker: Who walks.
        config: Bounds of the study.
        free: Range of every number that the config frees, by address [SI].

    Raises:
        ConfigError: If a joint has no range, or an orthosis within the ranges could not be.
    """
    sources: dict[str, str] = {}
    entries: Entries = {
        ("pelvis_tx", "first"): (0.0, 0.0),
        ("pelvis_tz",): (0.0, choices.HIGHEST_PELVIS),
    }
    entries |= _each(ACTIVATIONS, (0.0, 1.0))
    entries |= _joint_ranges(walker, config, sources)
    entries |= _each(walker.skeleton.named("velocity"), (-config.joint_speed, config.joint_speed))
    pattern = walker.pattern
    for phase in pattern.phases:
        shortest, longest = config.phase_duration
        usual = (shortest, 2.0 * longest) if phase.compliant else (shortest, longest)
        pair = config.phase_durations.get(phase.name, usual)
        entries[("duration", phase.name)] = pair
        sources[f"duration of {phase.name}"] = f"[{pair[0]:g}, {pair[1]:g}] s, from the config"
    if walker.parts.compliant:
        entries |= _toe_off(pattern)
    else:
        rigid = [point for point in pattern.points if point not in pattern.yielding]
        loads = (f"{point.name}_z" for point in rigid)
        entries |= _each(loads, (config.least_vertical_force, INFINITY))
        heights = (f"{point.name} height" for point in rigid)
        entries |= _each(heights, (config.least_height, INFINITY))
        entries |= _lift_off(pattern)
    entries[("distance",)] = config.distance
    entries[("walking_speed",)] = (_least_speed(walker, config, sources), INFINITY)
    ranges, keys = _unknowns(walker, config, free, sources)
    entries |= {(name,): pair for name, pair in ranges.items()}
    entries |= _each(walker.skeleton.named("reserve"), (0.0, 0.0))
    return GaitBounds(BoundTable(entries), sources, ranges, keys)


def recorded_durations(bounds: GaitBounds, durations: Mapping[str, float]) -> GaitBounds:
    """Return bounds that fix the phases to their recorded durations by name [s]."""
    pairs = durations.items()
    table = bounds.table.replace({("duration", phase): (d, d) for phase, d in pairs})
    sources = {f"duration of {phase}": f"{d:.4g} s, as recorded" for phase, d in pairs}
    return replace(bounds, table=table, sources={**bounds.sources, **sources})


def tracking_bounds(
    skeleton: Skeleton,
    bounds: GaitBounds,
    durations: Mapping[str, float],
    held: Mapping[str, float],
) -> BoundTable:
    """Return the bounds of the first stage: given durations and parameters, free reserves.

    Durations [s] are given by phase, the values that are held [SI] by unknown.
    """
    changes = _each((*skeleton.named("reserve"), "walking_speed"), ANYTHING)
    changes |= _each(skeleton.angles, choices.TRACKING_ANGLES)
    changes |= {(name,): (value, value) for name, value in held.items()}
    return recorded_durations(bounds, durations).table.replace(changes)


def helped_bounds(skeleton: Skeleton, bounds: GaitBounds) -> BoundTable:
    """Return the bounds of a prediction with free reserves at the joints.

    The pelvis gets none: nobody carries the patient.
    """
    helping = (name for name in skeleton.coordinates if name not in skeleton.root)
    return bounds.table.replace(_each((f"{name}_reserve" for name in helping), ANYTHING))


def held(config: StudyConfig, values: Mapping[Unknown, float]) -> dict[str, Any]:
    """Return config values by dotted key with which unknowns are held at values [their units].

    What the config frees by its place is held there, springs by their own key: the structure of
    the problem stays, so that neighbours start warm.
    """
    free: dict[str, Any] = dict(config.free)
    springs: dict[str, Any] = dict(config.bounds.stiffness)
    for unknown, value in values.items():
        if unknown.address in free:
            free[unknown.address] = (value, value)
        else:
            springs[unknown.name] = (value, value)
    return {"free": free, "bounds.stiffness": springs}


def _each(names: Iterable[str], pair: Range) -> Entries:
    """Return the same bounds for several quantities."""
    return {(name,): pair for name in names}


def _lift_off(pattern: ContactPattern) -> Entries:
    """Return zero force at the last instant before a place leaves the ground."""
    return {
        (force.name, phase.name, "end"): (0.0, 0.0)
        for phase, after in zip(pattern.phases, pattern.following, strict=True)
        for force in phase.lifted_off(after)
    }


def _toe_off(pattern: ContactPattern) -> Entries:
    """Return the force at the last instant of each step, where its foot counts as lifted.

    Of feet with toes it is the tip that leaves the ground.
    """
    toes = any(point.soft for point in pattern.points)
    return {
        (force.name, phase.name, "end"): (LOADED, LOADED)
        for phase in pattern.phases
        for force in phase.forces
        if force.bears and force.point.side == phase.step and force.point.soft == toes
    }


def _joint_ranges(walker: Walker, config: BoundsConfig, sources: dict[str, str]) -> Entries:
    recorded, margin = walker.patient.recorded.get("barefoot"), config.joint_range_margin
    entries: Entries = {}
    for name in walker.skeleton.angles:
        if name in config.joint_ranges:
            low, high = config.joint_ranges[name]
            source = "from the config"
        elif recorded is not None and name in recorded.joint_ranges:
            low, high = recorded.joint_ranges[name]
            low, high = low - margin, high + margin
            source = f"barefoot recordings widened by {margin:g} rad"
        elif name not in PLANAR_WALKER.angles:
            low, high, source = choices.FURTHER_ANGLES[name.rpartition("_")[0]]
        elif name in config.fallback_joint_ranges:
            low, high = config.fallback_joint_ranges[name]
            source = "fallback: the patient's file has no recorded ones"
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
        ratio, speed = config.fallback_speed_ratio, fallback_speed(walker.patient, config)
        source = f"fallback: {ratio:g} sqrt(g barefoot leg length), none is recorded in the file"
    sources["walking_speed"] = f"at least {speed:.3f} m/s, {source}"
    return speed


def fallback_speed(patient: Patient, config: BoundsConfig) -> float:
    """Return a slow walk of these legs [m/s].

    The shoe lengthens the leg, but both conditions must be asked for the same speed.
    """
    return config.fallback_speed_ratio * float(np.sqrt(GRAVITY * patient.leg_length))


def _unknowns(
    walker: Walker, config: BoundsConfig, free: Mapping[str, Range] | None, sources: dict[str, str]
) -> tuple[dict[str, Range], dict[str, str]]:
    """Return ranges and keys of the walker's unknowns by name: as freed, else of the springs."""
    ranges = dict(free or {})
    entries: dict[str, Range] = {}
    keys: dict[str, str] = {}
    for unknown in walker.unknowns:
        if unknown.address in ranges:
            pair, reason = ranges[unknown.address], "from the config"
            keys[unknown.name] = f"free.{unknown.address}"
            _check_range(unknown, pair)
        else:
            pair, reason, keys[unknown.name] = _spring_range(walker, config, unknown)
        entries[unknown.name] = pair
        sources[unknown.name] = f"[{pair[0]:g}, {pair[1]:g}] {unknown.unit}, {reason}"
    _check_orthosis(walker, entries, keys)
    return entries, keys


def _check_range(unknown: Unknown, pair: Range) -> None:
    """Refuse a range whose ends the patient's file would not take."""
    place = unknown.numbers[0].place
    if place.partition(".")[0] not in Patient.model_fields:
        return  # a number without a key of its own
    quantity = quantity_at(Patient, place)
    for value in pair:
        if not quantity.lower <= value <= quantity.upper:
            raise ConfigError(
                f"reaches {value:g} {quantity.unit}",
                where=f"free.{unknown.address}",
                allowed=quantity.allowed,
                mend=quantity.below if value < quantity.lower else quantity.above,
            )


def _spring_range(walker: Walker, config: BoundsConfig, unknown: Unknown) -> tuple[Range, str, str]:
    """Return range, reason and key of a spring that the config does not free by its address."""
    kind = unknown.numbers[0].name
    given = config.stiffness.get(unknown.name) or getattr(config, kind)
    own = f"stiffness.{unknown.name}"
    key = f"bounds.{own if unknown.name in config.stiffness else kind}"
    if given:
        return given, "from the config", key
    source = walker.patient.require_orthosis().stiffness_range.source
    return real_springs(walker.patient, unknown), f"real springs: {source}", key


def real_springs(patient: Patient, unknown: Unknown) -> Range:
    """Return the stiffnesses of real springs for an unknown, on all its sides [N m/rad]."""
    given = patient.require_orthosis().stiffness_range
    pairs = [getattr(given, n.name.removesuffix("_stiffness"))[n.side] for n in unknown.numbers]
    return max(low for low, _ in pairs), min(high for _, high in pairs)


def require_worn(walker: Walker, config: StudyConfig) -> None:
    """Refuse a config that names springs or the hinge of a side that wears no orthosis.

    Raises:
        ConfigError: If so.
    """
    worn = tuple(walker.device.elements)
    for name in sorted(config.bounds.joint_ranges):
        if name not in walker.skeleton.angles:
            raise ConfigError(
                f"bounds {name} of a side on which {walker.patient.id} wears no orthosis",
                where="bounds.joint_ranges",
                allowed=", ".join(walker.skeleton.angles),
                mend="leave it out, or correct orthosis.sides of the patient",
            )
    for where, named in (("bounds", config.bounds.stiffness), ("start", config.start.stiffness)):
        for name in named:
            side = name.rpartition("_")[2]
            if worn and side not in worn:
                raise ConfigError(
                    f"names a spring of the {side} side, on which {walker.patient.id} wears no "
                    "orthosis",
                    where=f"{where}.stiffness.{name}",
                    allowed=f"springs of the {' and '.join(worn)}",
                    mend="leave it out, or correct orthosis.sides of the patient",
                )


def _check_orthosis(walker: Walker, ranges: Mapping[str, Range], keys: Mapping[str, str]) -> None:
    """Refuse ranges of stops, free play and springs with which a torque curve is not exact."""
    chosen = {address: u.name for u in walker.unknowns for address in u.addresses}
    for element in walker.device.elements.values():
        free = {n.name: chosen[n.address] for n in element.numbers if n.address in chosen}
        fixed = {n.name: (walker.values[n.address],) * 2 for n in element.numbers}
        values = {**fixed, **{name: ranges[unknown] for name, unknown in free.items()}}
        fault = orthosis_fault(values, element.side)
        if fault is not None:
            where = next((keys[free[name]] for name in fault.numbers if name in free), "orthosis")
            what = f"is {fault.what}" if fault.spring else f"leaves room for {fault.what}"
            raise ConfigError(what, where=where, allowed=fault.allowed)
