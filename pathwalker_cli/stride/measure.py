"""What a measure is: a number of a stride with its key, its names for people and its unit."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from typing import Any, Final

import numpy as np

from pathwalker_cli.conventions import SIDES, Side, to_degrees
from pathwalker_cli.stride.stride import NotKnownError, Part, Stride

WALK: Final = "Steps and time"
KNEE: Final = "Least knee flexion in stance"
TRIAL: Final = "Joint angles, RMS difference to one trial at equal time"
CYCLE: Final = "Joint angles, RMS difference to the recorded mean over the gait cycle"
TYPICAL: Final = "Movement Analysis Profile and Gait Profile Score, sagittal part"
FORCE: Final = "Ground reaction forces"
LOADS: Final = "Loads"
ANKLE: Final = "Net ankle torque in stance, muscles and orthosis"
MUSCLE: Final = "Ankle extensor muscles"
WORK: Final = "Work over the stride"
EFFORT: Final = "Effort and springs"
SOLUTION: Final = "Solution"
FURTHER: Final = "Further measures"
SECTIONS: Final = (WALK, KNEE, TRIAL, CYCLE, TYPICAL, FORCE, LOADS, ANKLE, MUSCLE, WORK, EFFORT,
                   SOLUTION, FURTHER)  # fmt: skip
"""Headings of tables, in order."""

_DIGITS: Final = {"m/s": 3, "m": 3, "s": 3, "1": 3, "rad": 2, "rad^2": 3, "body weights": 2, "N": 1,
                  "N m": 1, "N m/rad": 1, "Pa": 0, "s/m": 3, "1/min": 1, "J": 2}  # fmt: skip
"""Digits after the point by unit; angles as degrees, shares of the stride in per cent."""

_SHOWN_UNIT: Final = {"rad": "deg", "body weights": "BW", "1": ""}
"""Units that people read in another way."""


@dataclass(frozen=True)
class Measure:
    """One number of a stride, or several under one key.

    Args:
        key: Its name in files.
        label: Its name for people.
        unit: SI unit in files; "1" for shares and activations, "body weights" for such.
        meaning: What it is and how it is computed, for the reference.
        value: Its value of a stride, a mapping if it is several; None for the cost, which is of
            the solve.  It may raise `NotKnownError`.
        row: Its name in a table under the heading of its section; the label if left out.
        short: Its name as the heading of a narrow column; the label if left out.
        section: That heading.
        part: Of what a recording gives one value.
        side: The side that it is about; None for both.
        family: Key of both sides, with a star.
        compared_as: Its key beside recordings, where that is another.
        kept: Whether `metrics.json` and the sensitivities have it.
        shown: Whether tables that do not name it have it too.
        small: Whether people read it in millimetres.
    """

    key: str
    label: str
    unit: str
    meaning: str
    value: Callable[[Stride], Any] | None
    row: str = ""
    short: str = ""
    section: str = FURTHER
    part: Part = "stride"
    side: Side | None = None
    family: str = ""
    compared_as: str = ""
    kept: bool = True
    shown: bool = True
    small: bool = False

    def __post_init__(self) -> None:
        """Let every name be the label unless it is given."""
        defaults = {"row": self.label, "short": self.label, "family": self.key}
        for name, text in defaults.items():
            if not getattr(self, name):
                object.__setattr__(self, name, text)

    def of(self, stride: Stride) -> Any:
        """Return its value of a stride as JSON knows it, None where it cannot be known."""
        other_part = stride.part not in (None, self.part)
        other_side = stride.side is not None and self.side not in (None, stride.side)
        if self.value is None or other_part or other_side:
            return None
        try:
            return _plain(self.value(stride))
        except NotKnownError:
            return None

    @property
    def column(self) -> str:
        """Heading of its column in files, e.g. "stride_time [s]"."""
        return f"{self.key} [{self.unit}]"

    @property
    def is_share(self) -> bool:
        """Whether people read it in per cent of the stride."""
        return "_share" in self.key

    @property
    def shown_unit(self) -> str:
        """Unit for people: degrees for angles, none for plain numbers."""
        if self.small:
            return "mm"
        return "%" if self.is_share else _SHOWN_UNIT.get(self.unit, self.unit)

    @property
    def digits(self) -> int:
        """Digits behind the point for people."""
        return 1 if self.is_share or self.small else _DIGITS.get(self.unit, 3)

    def in_shown_unit(self, value: float) -> float:
        """Return a value in the unit for people."""
        if self.is_share:
            return 100.0 * value
        if self.small:
            return 1000.0 * value
        return float(to_degrees(value)) if self.unit == "rad" else value

    def text(self, value: float | None, sign: bool = False) -> str:
        """Return a value as people read it, "-" for none."""
        if value is None:
            return "-"
        shown = round(self.in_shown_unit(value), self.digits) + 0.0  # adding 0.0 makes 0.0 of -0.0
        return f"{shown:{'+' if sign else ''}.{self.digits}f}"


def per_side(
    key: str, label: str, unit: str, meaning: str, value: Callable[..., Any],
    row: str = "", short: str = "", compared_as: str = "", **more: Any,
) -> tuple[Measure, ...]:  # fmt: skip
    """Return a measure of the right and of the left side; a star in a name stands for the side."""
    return tuple(
        Measure(
            key.replace("*", side),
            label.replace("*", side),
            unit,
            meaning,
            partial(value, side=side),
            row=row.replace("*", side),
            short=short.replace("*", side[0]),
            compared_as=compared_as.replace("*", side),
            side=side,
            family=key,
            **more,
        )
        for side in SIDES
    )


def _plain(value: Any) -> Any:
    """Return a value without NumPy types, tuples and numbers that JSON does not know."""
    if isinstance(value, Mapping):
        return {key: _plain(entry) for key, entry in value.items()}
    if isinstance(value, tuple):
        return [_plain(entry) for entry in value]
    return float(value) if np.isfinite(value) else None
