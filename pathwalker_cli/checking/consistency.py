"""Values that are allowed one by one and contradict each other, or are unusual.

What is certain to fail is refused; what is merely unusual becomes a note.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GRAVITY, SIDES, SUFFIX, to_degrees
from pathwalker_cli.errors import ConfigError
from pathwalker_cli.gait.bounds import Range, real_springs
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.model.elements.orthosis import stops_of
from pathwalker_cli.patient import OrthosisData, Patient
from pathwalker_cli.patient.proportions import SOURCE, default_length
from pathwalker_cli.studies.verdict import LOADED

_BODY_MASS_INDEX: Final = (11.0, 40.0)
"""[kg/m^2] Wider than three standard deviations at any age in de Onis et al. (2007), Development of
a WHO growth reference for school-aged children and adolescents."""

_FACTOR: Final = 1.25
"""Children's thighs are down to 1 / 1.18 of the adults' share of height (shipped patients)."""

_FROUDE: Final = 0.5
"""Where walking turns to running: Kram, Domingo and Ferris (1997), Effect of reduced gravity on
the preferred walk-run transition speed."""


def odd_patient(patient: Patient) -> Iterator[str]:
    """Yield sentences about size, lengths and springs."""
    index = patient.body_mass / patient.height**2
    low, high = _BODY_MASS_INDEX
    if not low <= index <= high:
        yield (
            f"body_mass {patient.body_mass:g} kg at height {patient.height:g} m is a body mass "
            f"index of {index:.1f} kg/m2; {low:g} to {high:g} is wider than three standard "
            "deviations of the WHO growth reference at any age (de Onis et al. 2007)"
        )
    for name in ("thigh", "shank", "foot"):
        yield from _length(patient, name)
    if patient.orthosis is not None:
        yield from odd_orthosis(patient.orthosis, "orthosis.")


def _length(patient: Patient, name: str) -> Iterator[str]:
    """Yield a sentence for each side whose length is far from body proportions."""
    usual = default_length(name, patient.height)
    for side in SIDES:
        length = patient.length(name, side)
        if not 1.0 / _FACTOR <= length / usual <= _FACTOR:
            yield (
                f"segment_lengths.{name} {side} {length:g} m is {length / usual:.2f} times what "
                f"body proportions give for {patient.height:g} m of height, {usual:g} m "
                f"({SOURCE}); up to {_FACTOR:g} times longer or shorter is usual"
            )


def odd_orthosis(orthosis: OrthosisData, prefix: str = "") -> Iterator[str]:
    """Yield a sentence for each real spring that the range of the search leaves out."""
    if orthosis.springs is None:
        return
    for kind in ("dorsiflexion", "plantarflexion"):
        pairs = getattr(orthosis.stiffness_range, kind).given.values()
        low, high = min(pair[0] for pair in pairs), max(pair[1] for pair in pairs)
        for spring in getattr(orthosis.springs, kind):
            if not low <= spring.stiffness <= high:
                yield (
                    f"{prefix}springs.{kind} '{spring.name}' of {spring.stiffness:g} N m/rad lies "
                    f"outside {prefix}stiffness_range.{kind} [{low:g}, {high:g}], "
                    f"{orthosis.stiffness_range.source}; usually the range spans all real springs"
                )


def odd_speed(patient: Patient, speed: float, source: str) -> Iterator[str]:
    """Yield a sentence about a speed [m/s], which `source` asks for and nobody so tall walks at."""
    leg = patient.leg_length
    froude = speed**2 / (GRAVITY * leg)
    if froude > _FROUDE:
        most = (_FROUDE * GRAVITY * leg) ** 0.5
        yield (
            f"{source} is a Froude number v^2/(g leg length) of {froude:.2f} for legs of "
            f"{leg:.3g} m; above {_FROUDE:g}, here {most:.2f} m/s, people run (Kram et al. 1997)"
        )


_ANGLES = COORDINATES[2:]


def contradictions(solver: GaitSolver) -> Iterator[ConfigError]:
    """Yield what no solution can meet."""
    if not solver.config.fits:
        yield from _speed(solver)
        yield from _distance(solver)
    yield from _flat_feet(solver)
    yield from _springs(solver)


def oddities(solver: GaitSolver) -> Iterator[str]:
    """Yield sentences about what is allowed and probably not meant."""
    yield from _odd_speeds(solver)
    yield from _partly_real_springs(solver)
    yield from _loaded_stops(solver)
    yield from _start_numbers(solver)
    yield from _start_angles(solver)
    yield from _comfort(solver)


def longest_stride(solver: GaitSolver) -> float:
    """Return a length that no stride exceeds [m]: two steps with both legs stretched flat."""
    patient, walker = solver.walker.patient, solver.walker
    legs = sum(patient.length(name, side) for name in ("thigh", "shank") for side in SIDES)
    points = patient.contacts(walker.condition)
    soles = sum(math.hypot(*p) for side in SIDES for p in (points[side].heel, points[side].toe))
    return 2.0 * (legs + soles)


def _speed(solver: GaitSolver) -> Iterator[ConfigError]:
    table = solver.bounds.table.entries
    least = table[("walking_speed",)][0]
    time = sum(table[("duration", p.name)][0] for p in solver.gait.phases)
    time *= 2.0 if solver.config.half_cycle else 1.0
    distance = min(table[("distance",)][1], longest_stride(solver))
    if least * time > distance:
        yield ConfigError(
            f"is {least:.3g} m/s, but a stride of at most {distance:.3g} m takes at least "
            f"{time:.3g} s, the sum of the shortest phases",
            where="bounds.least_walking_speed",
            allowed=f"up to {distance / time:.3g} m/s",
            mend="lower it, or change bounds.distance, phase_duration or phase_durations",
        )


def _distance(solver: GaitSolver) -> Iterator[ConfigError]:
    shortest, most = solver.config.bounds.distance[0], longest_stride(solver)
    if shortest > most:
        yield ConfigError(
            f"begins at {shortest:.3g} m per stride, longer than both legs of "
            f"{solver.walker.patient.id} reach in two steps",
            where="bounds.distance",
            allowed=f"a lower end of up to {most:.3g} m",
        )


def _flat_feet(solver: GaitSolver) -> Iterator[ConfigError]:
    """Yield an error for each foot that joint ranges let stand flat nowhere."""
    table = solver.bounds.table.entries
    base = np.zeros(solver.walker.skeleton.size)
    for side in SIDES:
        pitch = _pitch(solver, base, side)
        names, slopes = [], []
        for name in _ANGLES:
            moved = base.copy()
            moved[solver.walker.skeleton.index(name)] = 0.1
            slope = round((_pitch(solver, moved, side) - pitch) / 0.1)
            if slope:
                names.append(name)
                slopes.append(slope)
        ends = [
            sorted(slope * end for end in table[(name,)])
            for name, slope in zip(names, slopes, strict=True)
        ]
        low, high = pitch + sum(a for a, _ in ends), pitch + sum(b for _, b in ends)
        if not low <= 0.0 <= high:
            yield ConfigError(
                f"let the sole of the {side} foot never lie flat: its pitch stays within "
                f"[{low:.2f}, {high:.2f}] rad over the ranges of {', '.join(names)}",
                where="bounds.joint_ranges",
                mend="widen one of them so that 0 is within; zero pose and signs are in "
                "docs/conventions.md",
            )


def _pitch(solver: GaitSolver, q: np.ndarray, side: str) -> float:
    """Return the pitch of a sole [rad]: 0 if it lies flat, + if the toe is lower."""
    points = solver.walker.foot_points(q)
    first = 2 * ("right", "left").index(side)
    forward, up = points[first + 1] - points[first]
    return -math.atan2(up, forward)


def _spring_ranges(solver: GaitSolver) -> Iterator[tuple[str, Range, Range]]:
    """Yield name, range and range of real springs [N m/rad] of every spring that is sought."""
    for unknown in solver.walker.unknowns:
        kind = unknown.numbers[0].name
        if kind in solver.walker.device.identified:
            pair = solver.bounds.ranges[unknown.name]
            yield unknown.name, pair, real_springs(solver.walker.patient, unknown)


def _springs(solver: GaitSolver) -> Iterator[ConfigError]:
    for name, (low, high), (least, most) in _spring_ranges(solver):
        if low > most or high < least:
            yield ConfigError(
                f"is [{low:g}, {high:g}] N m/rad for {name}, where there is no real spring",
                where=solver.bounds.keys[name],
                allowed=f"within {least:g} to {most:g} N m/rad, the stiffness_range of the "
                "patient's orthosis",
                mend="correct one of the two",
            )
            return


def _partly_real_springs(solver: GaitSolver) -> Iterator[str]:
    for name, (low, high), (least, most) in _spring_ranges(solver):
        if low < least or high > most:
            yield (
                f"{solver.bounds.keys[name]} lets {name} reach [{low:g}, {high:g}] N m/rad; real "
                f"springs end at [{least:g}, {most:g}]"
            )


def _loaded_stops(solver: GaitSolver) -> Iterator[str]:
    """Yield a sentence where stops would carry much, were the ankles bent as far as barefoot."""
    walker, ranges = solver.walker, solver.bounds.ranges
    recorded = walker.patient.recorded.get("barefoot")
    chosen = {address: ranges[u.name] for u in walker.unknowns for address in u.addresses}
    loaded = []
    for side, element in walker.device.elements.items():
        ankle = f"ankle_{SUFFIX[side]}"
        if recorded is None or ankle not in recorded.joint_ranges:
            continue
        ends = zip(*(chosen.get(n.address, (walker.values[n.address],) * 2)
                     for n in element.numbers[:2]), strict=True)  # fmt: skip
        each = (stops_of(element.fixed(walker.values), *springs) for springs in ends)
        for pair, angle in zip(zip(*each, strict=True), recorded.joint_ranges[ankle], strict=True):
            beyond = pair[0].beyond(angle)
            torques = [stop.stiffness * beyond for stop in pair]
            shares = [t / (t + stop.spring) for t, stop in zip(torques, pair, strict=True)]
            if beyond > 0.0 and min(shares) >= LOADED:
                loaded.append(
                    f"{side} {pair[0].name} stop passed by {float(to_degrees(beyond)):.1f} deg, "
                    f"where it would carry {100 * min(shares):.0f} to {100 * max(shares):.0f} %"
                )
    if loaded:
        yield (
            "as far as the ankles were bent barefoot, hard stops would carry much of the "
            f"orthosis' torque: {'; '.join(loaded)}; their stiffness (orthosis.stop_stiffness) "
            "then decides as that of the springs: measure it"
        )


def _start_numbers(solver: GaitSolver) -> Iterator[str]:
    """Yield a sentence for every number of the start that is not free, or outside its range."""
    start = solver.config.start
    given = {f"stiffness.{name}": (name, value) for name, value in start.stiffness.items()}
    given |= {f"free.{place}": (place, value) for place, value in start.free.items()}
    for key, (which, value) in given.items():
        unknown = next((u for u in solver.walker.unknowns if which in (u.name, u.address)), None)
        if unknown is None:
            barefoot = not solver.walker.device.worn and key.startswith("stiffness")
            why = "barefoot" if barefoot else "on what is not free to choose"
            yield f"start.{key} has no effect {why}"
            continue
        low, high = solver.bounds.ranges[unknown.name]
        if not low <= value <= high:
            yield (
                f"start.{key} {value:g} {unknown.unit} lies outside its bounds "
                f"[{low:g}, {high:g}]: the search begins at the nearer end"
            )


def _start_angles(solver: GaitSolver) -> Iterator[str]:
    """Yield a sentence per joint that the start keeps wholly outside its range."""
    stride = solver.stride.trajectory
    for name in _ANGLES:
        low, high = solver.bounds.table.entries[(name,)]
        angles = stride[name]
        if angles.max() < low or angles.min() > high:
            yield (
                f"the {solver.stride.name} start moves {name} between {angles.min():.2f} and "
                f"{angles.max():.2f} rad, all outside its range [{low:.2f}, {high:.2f}]: it "
                "may not converge from there; try another start.knee_flexion or a recorded start"
            )


def _odd_speeds(solver: GaitSolver) -> Iterator[str]:
    patient = solver.walker.patient
    least = solver.bounds.table.entries[("walking_speed",)][0]
    if not solver.config.fits:
        reason = solver.bounds.sources["walking_speed"]
        yield from odd_speed(patient, least, f"the bound on walking speed, {reason},")
    if (begun := solver.config.start.walking_speed) is not None:
        yield from odd_speed(patient, begun, f"start.walking_speed {begun:g} m/s")


def _comfort(solver: GaitSolver) -> Iterator[str]:
    for name, (low, high) in solver.config.cost.comfort_ranges.items():
        least, most = solver.bounds.table.entries.get((name,), (low, high))
        if low > most or high < least:
            yield (
                f"cost.comfort_ranges.{name} [{low:g}, {high:g}] rad lies outside the range that "
                f"the bounds allow, [{least:.3g}, {most:.3g}]"
            )
