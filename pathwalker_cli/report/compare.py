"""Several runs side by side: metrics, their differences to the first, and differing configs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.values import differing_values
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.quantities import QUANTITIES, Quantity
from pathwalker_cli.evaluation.run import gaits_of_runs
from pathwalker_cli.gait.costs import GOALS

__all__ = ["Compared", "Comparison", "compare_runs"]

_LOADS: Final = "Loads"
_WORK: Final = "Work over the stride"
_GOALS: Final = "Clinical goals, whether or not the cost weighs them"
_SOLUTION: Final = "Solution"


def _named(*keys: str) -> tuple[Quantity, ...]:
    """Return quantities of an evaluation whose keys are those of the metrics too."""
    found = {quantity.key: quantity for quantity in QUANTITIES}
    return tuple(found[key] for key in keys)


def _sides(stem: str, label: str, unit: str, section: str, end: str = "") -> tuple[Quantity, ...]:
    return tuple(
        Quantity(f"{stem}_{side}{end}", f"{label}, {side}", unit, section)
        for side in ("right", "left")
    )


_BOTH: Final = ("right", "left")

COMPARED: Final = (
    *_named(
        "walking_speed",
        *(f"step_length_{side}" for side in _BOTH),
        "stride_time",
        "cadence",
        *(f"{stem}_{side}" for stem in ("stance_share", "swing_share") for side in _BOTH),
        "double_support_share",
        *(f"min_stance_knee_flexion_{side}" for side in _BOTH),
    ),
    *_sides("peak_vertical_force", "vertical peak", "body weights", _LOADS, "_body_weights"),
    *_sides("ankle_torque_slope", "ankle torque slope", "N m/rad", _LOADS),
    *_sides("max_friction_ratio", "friction ratio", "1", _LOADS),
    Quantity("positive_muscle_work", "muscles, positive", "J", _WORK),
    Quantity("negative_muscle_work", "muscles, negative", "J", _WORK),
    Quantity("positive_orthosis_work", "orthoses, positive", "J", _WORK),
    Quantity("negative_orthosis_work", "orthoses, negative", "J", _WORK),
    *_named(
        "effort_per_distance",
        *(f"{kind}_stiffness_{s}" for kind in ("dorsiflexion", "plantarflexion") for s in _BOTH),
    ),
    *(
        Quantity(f"goals.{name}", name.replace("_", " "), goal.unit, _GOALS)
        for name, goal in GOALS.items()
    ),
    Quantity("cost", "cost", "1", _SOLUTION),
)
"""The metrics that are compared, in order; keys of `metrics.json`, of its parts with a dot."""

_DEPENDS: Final = {
    "cost": "cost.",
    "effort_per_distance": "cost.activation_power",
    "goals.discomfort": "cost.comfort_ranges",
}
"""Keys of the config, or their beginnings, that say what a metric means."""


@dataclass(frozen=True)
class Compared:
    """One metric of all runs; SI units.

    Args:
        quantity: What it is.
        values: Its value in each run, None where a run does not have it.
        other: Runs whose config gives it another meaning than the first run's: no difference is
            told.
    """

    quantity: Quantity
    values: tuple[float | None, ...]
    other: frozenset[int] = frozenset()

    @property
    def differences(self) -> tuple[float | None, ...]:
        """Value minus that of the first run; None where it cannot be told."""
        base = self.values[0]
        return tuple(
            None if base is None or v is None or i in self.other else v - base
            for i, v in enumerate(self.values)
        )

    @property
    def shares(self) -> tuple[float | None, ...]:
        """Difference over the size of the first value; None where that is zero."""
        base = self.values[0]
        return tuple(d / abs(base) if d is not None and base else None for d in self.differences)


@dataclass(frozen=True)
class Comparison:
    """Several runs side by side.

    Args:
        gaits: Their gaits under names that differ; the first is the base.
        rows: Metrics that some run has.
        config: Keys of the configs whose values differ, with the value of each run.
    """

    gaits: tuple[Gait, ...]
    rows: tuple[Compared, ...]
    config: Mapping[str, tuple[str, ...]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(gait.name for gait in self.gaits)

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know before numbers of these runs are compared, one sentence each."""
        found = [f"{gait.name}: {note}" for gait in self.gaits for note in gait.notes]
        for what, values in (
            ("patients", [gait.walker.patient.id for gait in self.gaits]),
            ("conditions", [gait.walker.condition for gait in self.gaits]),
            ("problems", [gait.problem for gait in self.gaits]),
        ):
            if len(set(values)) > 1:
                pairs = zip(self.names, values, strict=True)
                found.append(f"different {what}: {', '.join(f'{v} ({n})' for n, v in pairs)}")
        if any(row.other for row in self.rows if row.quantity.key == "cost"):
            found.append("costs of different weights or goals cannot be compared")
        return tuple(found)


def compare_runs(folders: Sequence[Path]) -> Comparison:
    """Return converged runs side by side.

    Raises:
        DataError: If a run is named twice, did not converge or cannot be used.
    """
    runs, gaits = zip(*gaits_of_runs(folders), strict=True)
    found = (
        Compared(
            quantity,
            tuple(_number(run.metrics, quantity.key) for run in runs),
            _other(quantity.key, [run.config for run in runs]),
        )
        for quantity in COMPARED
    )
    rows = tuple(row for row in found if any(value is not None for value in row.values))
    return Comparison(gaits, rows, differing_values([run.config for run in runs]))


def _other(key: str, configs: Sequence[StudyConfig]) -> frozenset[int]:
    """Return the runs whose config gives a metric another meaning than that of the first run."""
    beginning, first = _DEPENDS.get(key), configs[0]
    if beginning is None:
        return frozenset()
    return frozenset(
        i
        for i, config in enumerate(configs)
        if (key == "cost" and config.fits != first.fits)
        or any(name.startswith(beginning) for name in differing_values([first, config]))
    )


def _number(metrics: Mapping[str, Any], key: str) -> float | None:
    """Return a number of the metrics, None where there is none."""
    group, _, name = key.rpartition(".")
    value = (metrics.get(group) or {}).get(name) if group else metrics.get(name)
    return float(value) if isinstance(value, int | float) else None
