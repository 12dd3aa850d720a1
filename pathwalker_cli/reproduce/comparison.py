"""Every number of the article beside ours."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GENERATORS, SIDES, SUFFIX, to_degrees
from pathwalker_cli.evaluation.differences import JOINTS
from pathwalker_cli.evaluation.paper import NUMBERS, PaperNumber
from pathwalker_cli.evaluation.recorded import RecordedGait, Spread, recorded_numbers
from pathwalker_cli.inverse.bands import cycle_band
from pathwalker_cli.patient import load_patient
from pathwalker_cli.reproduce.inverse_study import InverseResult
from pathwalker_cli.reproduce.reasons import NOT_COMPUTED, reason_for
from pathwalker_cli.reproduce.results import ProblemResult, Results

__all__ = ["Ours", "Row", "all_rows", "number_rows"]

_HEALTHY: Final = "sreenivasa2017-healthy"
_INVERSE: Final = ("residual_", "max_isometric_torque_")
"""Quantities that inverse dynamics gives, by two methods."""
_JOINTS: Final = ("pelvis", "hip", "knee", "ankle")


@dataclass(frozen=True)
class Ours:
    """Our number, SI units: a value, or a range with its mean.

    Args:
        value: The value; of a range, its mean.
        low: Lower end of a range, or None.
        high: Upper end of a range, or None.
    """

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Row:
    """One number of the article and ours.

    Args:
        number: What the article prints.
        ours: Our number, or why there is none.
        method: Method of inverse dynamics that gave it, "" for anything else.
        why: Why the two differ, as far as it is known.
    """

    number: PaperNumber
    ours: Ours | str
    method: str = ""
    why: str = ""

    @property
    def agrees(self) -> bool:
        """Whether ours prints as the article's number, or lies in its range."""
        return isinstance(self.ours, Ours) and self.number.agrees(self.ours.value)


def all_rows(results: Results) -> tuple[Row, ...]:
    """Return a row for every number of the article, two where two methods give it."""
    return tuple(number_rows(NUMBERS, results))


def number_rows(numbers: Iterable[PaperNumber], results: Results) -> Iterator[Row]:
    """Yield the rows of some numbers."""
    spreads = {str(name): recorded_numbers(gait) for name, gait in results.recorded.items()}
    for number in numbers:
        if number.subject != "healthy" and number.quantity.startswith(_INVERSE):
            for method, found in results.inverse.items():
                ours = found if isinstance(found, str) else _inverse(number, found, results)
                yield Row(number, ours, method, reason_for(number))
            continue
        ours = _ours(number, results, spreads)
        yield Row(number, ours, "", _why(number, results))


def _ours(
    number: PaperNumber, results: Results, spreads: Mapping[str, Mapping[str, Spread]]
) -> Ours | str:
    """Return our value of a number that does not come from inverse dynamics."""
    left_out = next((each for each in NOT_COMPUTED if each.covers(number)), None)
    if left_out is not None:
        return left_out.text
    if number.subject == "healthy":
        strengths = load_patient(_HEALTHY).max_isometric_torque
        name = number.quantity.removeprefix("max_isometric_torque_")
        return Ours(float(strengths[GENERATORS.index(name)]))
    if number.subject == "change":
        return _change(number, results)
    if number.subject in results.problems:
        return _gait(number, results.problems[number.subject])
    return _recorded(number, results, spreads)


def _inverse(number: PaperNumber, found: InverseResult, results: Results) -> Ours | str:
    """Return what one method of inverse dynamics says."""
    values = found.residuals
    if number.subject == "patient":
        name = number.quantity.removeprefix("max_isometric_torque_")
        return _known(found.strengths.get(name))
    if number.subject == "recorded":
        moment = number.quantity == "residual_moment_limit"
        parts = ("_moment_",) if moment else ("_forward_", "_up_")
        largest = max(
            (abs(v) for key, v in values.items() if any(part in key for part in parts)),
            default=None,
        )
        if number.quantity != "residual_over_peak_force" or largest is None:
            return _known(largest)
        peaks = _peak_forces(results)
        return Ours(largest * found.body_mass / peaks) if peaks else "not computed: no forces"
    condition = number.subject.removeprefix("recorded-")
    return _known(values.get(f"{condition}_{number.quantity.removeprefix('residual_')}"))


def _known(value: float | None) -> Ours | str:
    """Return a value, or that there is none."""
    return "not computed: inverse dynamics gives none" if value is None else Ours(value)


def _peak_forces(results: Results) -> float | None:
    """Return the mean of the peak vertical forces of all measured stances [N], or None."""
    peaks = [
        float(curve[:, 1].max())
        for gait in results.recorded.values()
        for side in SIDES
        for curve in gait.stance_forces(side)
    ]
    return float(np.mean(peaks)) if peaks else None


def _change(number: PaperNumber, results: Results) -> Ours | str:
    """Return a change from barefoot to orthosis."""
    found = next((c for c in results.changes if c.measure.key == number.quantity), None)
    if found is None:
        return "not computed: mapd-barefoot and mapd-orthosis did not both converge"
    return Ours(found.value)


def _gait(number: PaperNumber, result: ProblemResult) -> Ours | str:
    """Return a number of a solved problem."""
    if result.evaluation is None:
        return f"not computed: {result.problem} did not converge"
    if number.quantity == "seconds_solve":
        return Ours(float(result.metrics["seconds_solve"]))
    if number.quantity == "walking_speed_weight":
        return Ours(float(result.config.cost.walking_speed_weight))
    rows = {row.measure.key: row.value for row in result.evaluation.rows}
    value = rows.get(number.quantity)
    return "not computed: the run does not tell" if value is None else Ours(value)


def _recorded(
    number: PaperNumber, results: Results, spreads: Mapping[str, Mapping[str, Spread]]
) -> Ours | str:
    """Return what the recordings say."""
    condition = number.subject.removeprefix("recorded-")
    if number.quantity == "largest_deviation" and condition in spreads:
        return _largest_deviation(results.recorded["barefoot"])
    found = spreads.get(condition, {}).get(number.quantity)
    if found is None:
        return "not computed: the recordings do not tell"
    if number.quantity.startswith("ankle_torque_slope"):
        return Ours(found.mean)
    return Ours(found.mean, found.low, found.high)


def _largest_deviation(recorded: RecordedGait) -> Ours:
    """Return the largest standard deviation over the cycle of the least and greatest joint."""
    largest: dict[str, list[float]] = {}
    for side in SIDES:
        band = cycle_band([(trial.motion, trial.cycles) for trial in recorded.trials], side)
        for joint in _JOINTS:
            names = [n for n in JOINTS[joint] if len(JOINTS[joint]) == 1 or n[-1] == SUFFIX[side]]
            columns = [COORDINATES.index(name) for name in names]
            largest.setdefault(joint, []).append(float(band.deviation[:, columns].max()))
    values = [max(found) for found in largest.values()]
    return Ours(float(np.mean(values)), min(values), max(values))


def _why(number: PaperNumber, results: Results) -> str:
    """Return the known reason, and which bound this very run rests on."""
    parts = [_resting(number, results), reason_for(number), _over_cycle(number, results)]
    return "; ".join(part for part in parts if part)


def _over_cycle(number: PaperNumber, results: Results) -> str:
    """Return a difference of joint angles to the mean recorded cycle, as the article words it."""
    result = results.problems.get(number.subject)
    if not number.quantity.startswith("rms_one_trial_") or result is None:
        return ""
    key = number.quantity.replace("one_trial", "mean_cycle")
    found = (
        [row.value for row in result.evaluation.rows if row.measure.key == key]
        if result.evaluation
        else []
    )
    if not found or found[0] is None:
        return ""
    return f"to the mean recorded gait cycle ours is {float(to_degrees(found[0])):.2f}"


def _resting(number: PaperNumber, results: Results) -> str:
    """Return that a quantity sits at its bound in this run, "" if it does not."""
    result = results.problems.get(number.subject)
    if result is None or not result.converged:
        return ""
    for bound in result.bounds:
        if bound.name == number.quantity:
            return f"ours rests on its {bound.side} bound, {bound.value:.4g} {number.unit}"
    return ""
