"""What draws of learnt numbers leave open, and what to measure first to know more.

What walking costs cannot be measured; tissue, range of motion and strength can.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from pathwalker_cli.config.learnt import COST
from pathwalker_cli.studies.uncertainty.result import (
    Spread,
    Uncertainty,
    chance_level,
    most,
)

_OPEN: Final = 0.25
"""Share of the allowed range that draws must cover for a spring to count as not determined."""

_HELD: Final = 0.5
"""Share of draws at a limit from which on it is the limit that decides."""

_K_D: Final = "dorsiflexion_stiffness_"
"""Beginning of the names of the springs that one measurement is chosen for."""


def advice(result: Uncertainty) -> Iterator[str]:
    """Yield, of learnt numbers, which springs they leave open, and what to measure first."""
    rows, level = _measurable(result), _level(result)
    for spread in _free(result) if rows else ():
        low, high = result.ranges[spread.measure.key]
        share = (spread.quantiles[2] - spread.quantiles[0]) / (high - low)
        held = max(spread.lower or 0.0, spread.upper or 0.0) > _HELD
        found = "held by its limit, not determined" if held else "determined"
        text = (
            f"{spread.measure.label}: {'not determined' if share > _OPEN else found} by what was "
            f"learnt, {spread.quantiles[0]:.0f} to {spread.quantiles[2]:.0f} "
            f"{spread.measure.unit} in {most(len(result.converged))} of the draws"
        )
        sizes = np.nan_to_num(np.abs(spread.correlations[rows]))
        if sizes.any():
            best = rows[int(np.argmax(sizes))]
            chance = ", which may be chance" if sizes.max() <= level else ""
            text += (
                f"; what to measure first: {result.draws.inputs[best].place} (rank correlation "
                f"{spread.correlations[best]:+.2f}{chance})"
            )
        yield text
    first = measure_first(result)
    if first is not None and len(_free(result)) > 1:
        chance = ", which may be chance" if first["chance"] else ""
        yield (
            f"of all measurements, that of {first['place']} would narrow K_D most: "
            f"{100.0 * first['share']:.0f} % of its spread go with it{chance}"
        )


def measure_first(result: Uncertainty) -> dict[str, Any] | None:
    """Return the one measurement that would narrow K_D of all sides most.

    It is the learnt number whose ranks explain the largest share of the variance of the ranks of
    K_D, sides that vary counting alike: its `place`, that `share`, and whether `chance` alone could
    make it.  None where no K_D varies, or nothing that was drawn can be measured.
    """
    rows = _measurable(result)
    followed = [s.correlations[rows] for s in _free(result) if s.measure.key.startswith(_K_D)]
    varying = np.array([each for each in followed if np.isfinite(each).all()])
    if not varying.size:
        return None
    shares = (varying**2).mean(axis=0)
    best = int(np.argmax(shares))
    chance = bool(np.abs(varying[:, best]).max() <= _level(result))
    place = result.draws.inputs[rows[best]].place
    return {"place": place, "share": float(shares[best]), "chance": chance}


def _measurable(result: Uncertainty) -> list[int]:
    """Return which inputs are learnt numbers that can be measured; none without a solution."""
    inputs = enumerate(result.draws.inputs if result.converged else ())
    return [i for i, x in inputs if x.distribution is None and not x.place.startswith(COST)]


def _free(result: Uncertainty) -> list[Spread]:
    """Return the spreads of what the problem may choose."""
    ranges = ((spread, result.ranges.get(spread.measure.key)) for spread in result.spreads)
    return [spread for spread, ends in ranges if ends is not None and ends[0] < ends[1]]


def _level(result: Uncertainty) -> float:
    return chance_level(len(result.converged), len(result.draws.inputs))
