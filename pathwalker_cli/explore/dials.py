"""The dials of a run: which of its numbers can be turned, how far, and the case that results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final, Literal

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.errors import InputError
from pathwalker_cli.gait.bounds import held
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.io.fields import quantity_at
from pathwalker_cli.model.numbers import Number, Unknown
from pathwalker_cli.model.skeleton import Side
from pathwalker_cli.patient import Patient

Settings = Mapping[str, float | None]
"""Value of every dial by its key [its unit]; None for one that the problem chooses."""

_SPEED: Final = "bounds.least_walking_speed"
_HURRY: Final = "cost.goals.time"
_FASTEST: Final = 1.5
"""Upper end of the dial of speed [m/s]."""

_ORTHOSIS: Final = {
    "neutral_angle": 0.1, "dorsiflexion_stop": 0.1, "plantarflexion_stop": 0.1,
    "free_play": 0.02, "preload_torque": 3.0, "hinge_forward": 0.02, "hinge_up": 0.02,
}  # fmt: skip
"""How far numbers of the device are turned from where they are [their unit]."""

_STRENGTH: Final = (0.5, 1.5)
_MASS: Final = (0.25, 2.0)
_HURRIES: Final = (0.25, 4.0)
"""Factors between which strengths, masses of the device and the price of time are turned."""
_EXAMINED: Final = 30.0
"""How far what was measured on the couch is turned [deg]."""


@dataclass(frozen=True)
class Dial:
    """A number that can be turned.

    Args:
        key: Its place in config or patient's file.
        group: Heading that it stands under.
        label: Its name without side.
        unit: Its unit, SI but for examined angles [deg].
        side: The side that it belongs to; None for both.
        low: Least value.
        high: Largest value.
        value: Its value in the run.
        unknown: The unknown of the problem that it holds; then the problem may choose it too.
        kind: Whether it is added to what the patient's file says, put in its place, or a value of
            the config; "held" for an unknown.
    """

    key: str
    group: str
    label: str
    unit: str
    side: Side | None
    low: float
    high: float
    value: float
    kind: Literal["held", "shift", "number", "config"]
    unknown: Unknown | None = None


def dials_of(optimum: Optimum) -> tuple[Dial, ...]:
    """Return the dials of a run, by group."""
    found = (*_springs(optimum), *_device(optimum), *_wish(optimum), *_body(optimum))
    return tuple(dial for dial in found if dial.low < dial.high)


def settings_of(dials: Sequence[Dial]) -> dict[str, float | None]:
    """Return the settings of the run itself, every number held where it was found."""
    return {dial.key: dial.value for dial in dials}


def case_at(base: Case, dials: Sequence[Dial], settings: Settings) -> Case:
    """Return the case of a run with some dials turned; others stand where the run has them.

    Raises:
        InputError: If config or patient refuse the numbers.
    """
    at = settings_of(dials) | dict(settings)
    holding = {d.unknown: float(v) for d in dials if d.unknown and (v := at[d.key]) is not None}
    changes = dict(held(base.config, holding))
    variation = base.config.variation
    shift, numbers = dict(variation.shift), dict(base.config.numbers)
    for dial in dials:
        value = at[dial.key]
        if value is None or value == dial.value:
            continue
        if dial.kind == "config":
            changes[dial.key] = value
        elif dial.kind == "number":
            numbers[dial.key] = value
        elif dial.kind == "shift":
            # rounded to read well, far below what any number is known to
            shift[dial.key] = round(shift.get(dial.key, 0.0) + value - dial.value, 9)
    changes |= {"variation.shift": shift, "numbers": numbers}
    return base.with_values(changes)


def _springs(optimum: Optimum) -> Iterator[Dial]:
    """Yield the unknowns of the problem: springs, and what else it may choose."""
    for unknown in optimum.solver.walker.unknowns:
        low, high = optimum.range(unknown)
        value = optimum.value(unknown)
        if low == high:
            low, high = 0.25 * value, 2.0 * value
        first = unknown.numbers[0]
        yield Dial(unknown.address, "Springs and what else is identified", first.label,
                   unknown.unit, unknown.side, low, high, float(np.clip(value, low, high)), "held",
                   unknown)  # fmt: skip


def _device(optimum: Optimum) -> Iterator[Dial]:
    device = optimum.walker.device
    if not device.worn:
        return
    for number in (number for element in device.forces for number in element.numbers):
        if number.name in _ORTHOSIS:
            value = optimum.walker.values[number.address]
            reach = _ORTHOSIS[number.name]
            if "stop" in number.name:  # it stays on its side of the neutral angle
                reach = min(reach, 0.9 * abs(value))
            yield from _dial(optimum, "Orthosis", number, value - reach, value + reach)
    for number in device.added_mass.values():
        value = optimum.walker.values[number.address]
        yield from _dial(optimum, "Orthosis", number, *(f * value for f in _MASS))


def _body(optimum: Optimum) -> Iterator[Dial]:
    """Yield strengths, and what was measured on the couch if the model has tissue."""
    for muscle in optimum.walker.muscles:
        value = optimum.walker.values[muscle.numbers[0].address]
        yield from _dial(optimum, "Strength", muscle.numbers[0], *(f * value for f in _STRENGTH))
    for number in (number for element in optimum.walker.tissue for number in element.numbers):
        if number.address.startswith("examination."):
            value = optimum.walker.values[number.address]
            yield from _dial(optimum, "Tightness", number, value - _EXAMINED, value + _EXAMINED)


def _wish(optimum: Optimum) -> Iterator[Dial]:
    config, group = optimum.config, "Wish"
    least = optimum.solver.bounds.table.entries[("walking_speed",)][0]
    yield Dial(_SPEED, group, "least walking speed", "m/s", None, 0.5 * least,
               max(_FASTEST, least), least, "config")  # fmt: skip
    if weight := config.cost.goals.get("time"):
        low, high = (factor * weight for factor in _HURRIES)
        yield Dial(_HURRY, group, "hurry: weight of time", "", None, low, high, weight, "config")


def _dial(optimum: Optimum, group: str, number: Number, low: float, high: float) -> Iterator[Dial]:
    """Yield the dial of a number of the patient, in the way and the place that the file allows.

    What the file has once for both sides is turned once, with the number of the right side.
    """
    if any(number.address in unknown.addresses for unknown in optimum.solver.walker.unknowns):
        return
    value = optimum.walker.values[number.address]
    if number.place.partition(".")[0] in Patient.model_fields:
        allowed = quantity_at(Patient, number.place)
        low, high = max(low, allowed.lower), min(high, allowed.upper)
    step = 1e-3 * max(abs(value), 1e-3)
    ways: tuple[tuple[str, str, dict[str, Any]], ...] = (
        ("shift", number.address, {"variation.shift": {number.address: step}}),
        ("shift", number.place, {"variation.shift": {number.place: step}}),
        ("number", number.address, {"numbers": {number.address: value + step}}),
    )
    for kind, key, change in ways:
        if key == number.place and number.side == "left":
            continue
        if _allowed(optimum.case, change):
            side = number.side if key == number.address else None
            yield Dial(key, group, number.label, number.unit, side, low, high, value, kind)  # type: ignore[arg-type]
            return


def _allowed(case: Case, change: Mapping[str, dict[str, float]]) -> bool:
    """Return whether the patient takes a change beside those of the config."""
    (key, entry), config = next(iter(change.items())), case.config
    now = config.numbers if key == "numbers" else config.variation.shift
    try:
        _ = case.with_values({key: {**now, **entry}}).patient
    except InputError:
        return False
    return True
