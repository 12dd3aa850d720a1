"""What was seen and examined of a child before any recording, and what it decides."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final, Literal

import numpy as np

from pathwalker_cli.config.schema import BoundsConfig
from pathwalker_cli.conventions import SIDES, SUFFIX, Side
from pathwalker_cli.errors import DataError, did_you_mean
from pathwalker_cli.patient.blocks import Examination

Brace = Literal["none", "planned", "worn"]
BRACES: Final[tuple[Brace, ...]] = ("none", "planned", "worn")
EXAMINED: Final = tuple(Examination.model_fields)

_DEGREES: Final = re.compile(r"(-?\d+(?:\.\d+)?) *(?:deg)?")
_KNEE: Final = (3.0, 85.0)
"""Least knee flexion in stance that a walk can begin with [deg]."""
_REACH: Final = (-90.0, 120.0)
"""Angles that are examined on a couch [deg]."""
_SPEED: Final = (0.05, 2.5)
"""Speeds of walking [m/s]."""
_STRAIGHTER: Final = 0.2
"""How much straighter a knee may become with orthoses than it was barefoot [rad]: as with
recordings, see `bounds.joint_range_margin`."""


@dataclass(frozen=True)
class Seen:
    """What is known of a child without recordings; what is not is None or left out.

    Args:
        brace: Whether an orthosis is worn, planned or neither.
        speed: Walking speed barefoot [m/s].
        knee_flexion: Least knee flexion in stance barefoot, right and left [rad].
        examination: Range of motion by `Examination`'s names, right and left [deg].
    """

    brace: Brace = "planned"
    speed: float | None = None
    knee_flexion: tuple[float, float] | None = None
    examination: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    @property
    def with_orthosis(self) -> bool:
        """Whether there is an orthosis."""
        return self.brace != "none"

    def config_values(self, with_orthosis: bool) -> dict[str, str]:
        """Return what it means for a prediction: values of the config by dotted key, as YAML."""
        values = {}
        if self.speed is not None:
            values["bounds.least_walking_speed"] = f"{self.speed:g}"
        if self.knee_flexion is not None:
            widest, free = BoundsConfig().fallback_joint_ranges, _STRAIGHTER * with_orthosis
            knees: dict[Side, float] = dict(zip(SIDES, self.knee_flexion, strict=True))
            ranges = ", ".join(
                f"knee_{SUFFIX[side]}: [{knee - free:.3f}, "
                f"{max(widest[f'knee_{SUFFIX[side]}'][1], knee + 0.5):.3f}]"
                for side, knee in knees.items()
            )
            values["bounds.joint_ranges"] = f"{{{ranges}}}"
        if self.examination:
            values["model"] = ""
            values["model.tissue"] = "true"
        return values


def seen_of(brace: Brace, speed: float | None, knee_flexion: str, examined: Iterable[str]) -> Seen:
    """Return what was seen, from the words of a user.

    Args:
        brace: Whether an orthosis is worn, planned or neither.
        speed: Walking speed [m/s].
        knee_flexion: Least knee flexion in stance, e.g. "35", "35 deg" or "40,30": right, left;
            "" if nobody looked.
        examined: Entries "name=angles", e.g. "popliteal_angle=50,45".

    Raises:
        DataError: If they say something that cannot be.
    """
    if speed is not None and not _SPEED[0] <= speed <= _SPEED[1]:
        allowed = f"{_SPEED[0]:g} to {_SPEED[1]:g} m/s"
        raise DataError(f"is {speed:g} m/s", where="--speed", allowed=allowed)
    knees = _angles(knee_flexion, "--knee-flexion", _KNEE) if knee_flexion.strip() else None
    radians = None if knees is None else (float(np.deg2rad(knees[0])), float(np.deg2rad(knees[1])))
    examination = {}
    for entry in examined:
        name, _, angles = entry.partition("=")
        name = name.strip()
        if name not in EXAMINED:
            raise DataError(
                f"names {name or 'nothing'}", where="--examined",
                allowed=", ".join(EXAMINED), mend=did_you_mean(name, EXAMINED),
            )  # fmt: skip
        examination[name] = _angles(angles, f"--examined {name}", _REACH)
    return Seen(brace, speed, radians, examination)


def _angles(text: str, where: str, allowed: tuple[float, float]) -> tuple[float, float]:
    """Return one angle for both sides, or right and left [deg]."""
    found = [_DEGREES.fullmatch(part.strip()) for part in text.split(",")]
    values = [float(each[1]) for each in found if each is not None]
    if len(values) != len(found) or len(values) > 2:
        raise DataError(f"is '{text}'", where=where, allowed="degrees, or right,left: 40,30")
    if not all(allowed[0] <= value <= allowed[1] for value in values):
        raise DataError(f"is {text.strip()} deg", where=where,
                        allowed=f"{allowed[0]:g} to {allowed[1]:g} deg")  # fmt: skip
    return values[0], values[-1]
