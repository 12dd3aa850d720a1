"""Mean and range of a number that several trials give."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np

__all__ = ["Position", "Spread", "spread"]

Position = Literal["below", "in", "above"]
"""Where a value lies in relation to a recorded range."""


@dataclass(frozen=True)
class Spread:
    """Mean and range over trials, strides or stances.

    Args:
        mean: Mean.
        low: Smallest value.
        high: Largest value.
        count: Number of values.
    """

    mean: float
    low: float
    high: float
    count: int

    def position(self, value: float) -> Position:
        """Return where a value lies in relation to the range."""
        if value < self.low:
            return "below"
        return "above" if value > self.high else "in"


def spread(values: Iterable[float]) -> Spread | None:
    """Return mean and range of some values, None without any."""
    found = np.array(list(values), dtype=float)
    if found.size == 0:
        return None
    return Spread(float(found.mean()), float(found.min()), float(found.max()), found.size)
