"""What the neighbours of a study are compared by: cost and gait metrics as plain numbers."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Final

from pathwalker_cli.conventions import STIFFNESSES, to_degrees
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.stride.metrics import gait_metrics

__all__ = [
    "COMPARED",
    "MEASURES",
    "Measure",
    "all_measures",
    "measure_of",
    "measures",
]


@dataclass(frozen=True)
class Measure:
    """One number of a neighbour.

    Args:
        key: Its name in files.
        label: Its name for people.
        unit: SI unit in files.
        short: Its name as the heading of a narrow column.
    """

    key: str
    label: str
    unit: str
    short: str

    @property
    def column(self) -> str:
        """Heading of its column in files, e.g. "stride_time [s]"."""
        return f"{self.key} [{self.unit}]"

    @property
    def shown_unit(self) -> str:
        """Unit for people: degrees for angles."""
        return "deg" if self.unit == "rad" else self.unit

    def shown(self, value: float) -> float:
        """Return a value in the unit for people."""
        return float(to_degrees(value)) if self.unit == "rad" else value


_SPRINGS: Final = tuple(
    Measure(name, f"K_{name[0].upper()} {name.rsplit('_', 1)[1]}", "N m/rad",
            f"K_{name[0].upper()} {name.rsplit('_', 1)[1][0]}")
    for name in STIFFNESSES
)  # fmt: skip

MEASURES: Final = (
    Measure("cost", "cost", "1", "cost"),
    Measure("effort_per_distance", "effort per distance", "s/m", "effort"),
    Measure("min_stance_knee_flexion_left", "least stance knee flexion, left", "rad", "knee l"),
    Measure("min_stance_knee_flexion_right", "least stance knee flexion, right", "rad", "knee r"),
    Measure("step_length_left", "step length, left", "m", "step l"),
    Measure("step_length_right", "step length, right", "m", "step r"),
    Measure("walking_speed", "walking speed", "m/s", "speed"),
    Measure("stride_time", "stride time", "s", "stride"),
    *_SPRINGS,
)  # fmt: skip
"""The measures that every study tells, in order; barefoot there are no springs."""

COMPARED: Final = ("cost", *(m.key for m in MEASURES[2:7]))
"""The measures of table 5 of Sreenivasa et al. (2017)."""


def measure_of(key: str) -> Measure:
    """Return a measure by its key."""
    return next(measure for measure in MEASURES if measure.key == key)


def all_measures(optimum: Optimum) -> dict[str, float]:
    """Return the cost and every gait metric that is one number; SI units."""
    values = gait_metrics(optimum.series).as_dict()
    numbers = {k: v for k, v in values.items() if isinstance(v, float)}
    for name in ("joint_range", "peak_joint_moment", "peak_activation", "phase_durations"):
        numbers |= _flat(name, values[name])
    return {"cost": optimum.cost, **numbers}


def _flat(name: str, values: Mapping[str, Any]) -> dict[str, float]:
    """Return the entries of a metric with several; a pair is least and largest value."""
    flat: dict[str, float] = {}
    for key, value in values.items():
        if isinstance(value, list):
            flat |= {f"{name}.{key}.min": value[0], f"{name}.{key}.max": value[1]}
        elif value is not None:
            flat[f"{name}.{key}"] = float(value)
    return flat


def measures(optimum: Optimum) -> dict[str, float]:
    """Return the numbers of `MEASURES` that a neighbour has; SI units."""
    found = all_measures(optimum)
    return {m.key: found[m.key] for m in MEASURES if m.key in found}
