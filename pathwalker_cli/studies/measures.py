"""What the neighbours of a study are compared by: cost and measures of the gait, SI units."""

from __future__ import annotations

from typing import Final

from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.stride.measures import measures_in, numbers_of
from pathwalker_cli.stride.stride import stride_of

__all__ = ["COMPARED", "all_measures", "measures"]

COMPARED: Final = (
    "cost",
    *(f"{stem}_{side}" for stem in ("min_stance_knee_flexion", "step_length")
      for side in ("left", "right")),
    "walking_speed",
)  # fmt: skip
"""The measures of table 5 of Sreenivasa et al. (2017)."""


def all_measures(optimum: Optimum) -> dict[str, float]:
    """Return the cost and every single number of the gait."""
    return {"cost": optimum.cost, **numbers_of(stride_of(optimum.series))}


def measures(optimum: Optimum) -> dict[str, float]:
    """Return the measures that every study tells, as far as a neighbour has them."""
    numbers = all_measures(optimum)
    return {m.key: numbers[m.key] for m in measures_in("studies") if m.key in numbers}
