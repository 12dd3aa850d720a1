"""What a predicted stride is held against: recorded curves and numbers, in the child's own spread.

Every curve counts as one observation, whatever the number of its points: the points of a curve are
not independent of each other.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final, Literal

import numpy as np

from pathwalker_cli.conventions import SIDES, Side
from pathwalker_cli.evaluation.recorded import RecordedGait
from pathwalker_cli.stride.figures.curves import ANGLES, FORCES, MOMENTS, CycleCurve
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.stride.stride import Stride

Group = Literal["angles", "forces", "moments", "walk"]

LEAST_SPREAD: Final = {"angle": 3.0, "force_vertical": 8.0, "force_forward": 3.0, "moment": 0.12}
"""Spread below which no curve is known, as it adds to the child's own: repeatability of joint
angles [deg] (McGinley et al. 2009), of forces [% body weight] and moments [N m/kg] what two-point
feet cannot follow; with one recorded stride it is all there is."""

WALK: Final = {"walking_speed": 0.08, "stride_time": 0.1, "step_length_right": 0.05,
               "step_length_left": 0.05}  # fmt: skip
"""Numbers of the walk [m/s, s, m], and what counts as one deviation: about the spread of a child's
strides in a laboratory."""

_EVERY: Final = 4
"""Points of a curve that are compared: every so many per cent of the gait cycle."""
_FEW: Final = 3
"""Strides from which a spread can be told."""


@dataclass(frozen=True)
class Target:
    """A recorded curve or number.

    Args:
        name: Its name, e.g. "angle_knee_right".
        group: What it belongs to.
        mean: Mean over strides, shape (k,).
        spread: What counts as one deviation, in its unit.
        weight: How much it counts.
        of: Returns the same of a stride, shape (k,).
    """

    name: str
    group: Group
    mean: np.ndarray
    spread: float
    weight: float
    of: Callable[[Stride], np.ndarray]

    @property
    def scale(self) -> float:
        """Weighed deviations per unit of the curve."""
        return float(self.weight / self.spread / np.sqrt(self.mean.size))

    def residual(self, stride: Stride) -> np.ndarray:
        """Return the weighed deviations of a stride, whose squares add up to their mean, (k,)."""
        return np.asarray(self.scale * (self.of(stride) - self.mean))


def targets_of(
    recorded: RecordedGait, weights: Mapping[str, float], without: Collection[str] = ()
) -> tuple[Target, ...]:
    """Return all that recordings say of a stride.

    Args:
        recorded: The recordings.
        weights: Weight of every group; what has none is left out.
        without: Names of trials to leave out.
    """
    groups: tuple[tuple[Group, Sequence[CycleCurve]], ...] = (
        ("angles", ANGLES),
        ("forces", FORCES),
        ("moments", MOMENTS),
    )
    curves = (
        _curve(recorded, curve, side, group, weights.get(group, 0.0), without)
        for group, shown in groups
        for curve in shown
        for side in SIDES
    )
    numbers = (_number(recorded, key, weights.get("walk", 0.0), without) for key in WALK)
    return tuple(t for t in (*curves, *numbers) if t is not None and t.weight > 0.0)


def carried_weight(recorded: RecordedGait, without: Collection[str] = ()) -> float | None:
    """Return the load of both feet over a stride [body weights], 1 for the right body.

    None if the forces of a side were not measured.
    """
    means = []
    for side in SIDES:
        lines = cycles(recorded, FORCES[0], side, without).values()
        if not lines:
            return None
        means.append(np.mean([line[:-1].mean() for each in lines for line in each]))
    return float(sum(means)) / 100.0  # the curve is in % of body weight


def cycles(
    recorded: RecordedGait, curve: CycleCurve, side: Side, without: Collection[str] = ()
) -> dict[str, list[np.ndarray]]:
    """Return a curve of every recorded gait cycle of a side that shows it, by trial."""
    found: dict[str, list[np.ndarray]] = {}
    for stride in recorded.of("stride", side):
        if stride.name not in without:
            found.setdefault(stride.name, []).extend(_lines(curve, side, stride))
    return {name: lines for name, lines in found.items() if lines}


def _lines(curve: CycleCurve, side: Side, stride: Stride) -> np.ndarray:
    return curve.lines(stride, side, 101)[:, ::_EVERY]


def _curve(
    recorded: RecordedGait,
    curve: CycleCurve,
    side: Side,
    group: Group,
    weight: float,
    without: Collection[str],
) -> Target | None:
    lines = np.array([x for each in cycles(recorded, curve, side, without).values() for x in each])
    if not lines.size:
        return None
    own = float(np.sqrt(lines.var(axis=0, ddof=1).mean())) if len(lines) >= _FEW else 0.0
    least = next(value for start, value in LEAST_SPREAD.items() if curve.key.startswith(start))
    shared = np.sqrt(0.5) if curve.midline else 1.0  # both sides see the same trunk
    return Target(
        f"{curve.key}_{side}", group, lines.mean(axis=0), float(np.hypot(own, least)),
        weight * shared, partial(_first_line, curve, side),
    )  # fmt: skip


def _first_line(curve: CycleCurve, side: Side, stride: Stride) -> np.ndarray:
    return np.asarray(_lines(curve, side, stride)[0])


def _number(
    recorded: RecordedGait, key: str, weight: float, without: Collection[str]
) -> Target | None:
    measure = measure_of(key)
    strides = (stride for stride in recorded.strides if stride.name not in without)
    values = [value for stride in strides if (value := measure.of(stride)) is not None]
    if not values:
        return None
    return Target(
        key, "walk", np.array([np.mean(values)]), WALK[key], weight,
        lambda stride: np.array([measure.of(stride)]),
    )  # fmt: skip


def residuals(targets: Iterable[Target], stride: Stride) -> np.ndarray:
    """Return the weighed deviations of a stride from all targets, one after the other."""
    return np.concatenate([target.residual(stride) for target in targets])
