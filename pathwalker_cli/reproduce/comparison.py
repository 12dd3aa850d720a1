"""Every number of the article beside ours, and why the two differ as far as that is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

import numpy as np

from pathwalker_cli.conventions import COORDINATES, GENERATORS, SIDES, SUFFIX, to_degrees
from pathwalker_cli.evaluation.differences import JOINTS
from pathwalker_cli.evaluation.paper import NUMBERS, PaperNumber
from pathwalker_cli.evaluation.recorded import RecordedGait, Spread, recorded_numbers
from pathwalker_cli.inverse.cycles import cycle_band
from pathwalker_cli.patient import load_patient
from pathwalker_cli.reproduce.results import InverseResult, ProblemResult, Results

_PREDICTED: Final = ("mapd-barefoot", "mapd-orthosis", "mapd-ws-orthosis")
_RECORDED: Final = ("recorded-barefoot", "recorded-orthosis")
_BOUNDS: Final = "the authors' bounds are not published"

Spreads = Mapping[str, Mapping[str, Spread]]
"""Recorded numbers by condition and quantity."""
Reasons = Sequence[tuple[tuple[str, ...], str, str]]
"""Subjects of `paper.NUMBERS`, the beginning of a quantity, and a text; the first one counts."""

_REASONS: Final[Reasons] = (
    (("healthy",), "max_isometric_torque",
     "an input of the model: the value in the patient's file that comes with PathWalker"),
    (("patient",), "max_isometric_torque_ankle",
     "which peaks entered the table is not said; the ankle's is ill-conditioned"),
    (("patient",), "max_isometric_torque",
     "default: filtered motion and other stances; single stances scatter widely"),
    (("recorded",), "residual_force_limit",
     "largest mean of a trial, per body mass, printed as N; default counts measured frames only"),
    (("recorded",), "residual_moment_limit",
     "largest mean of a trial, per body mass, printed as N m; table 3 itself has 0.15"),
    (("recorded",), "residual_over_peak_force",
     "largest mean residual of a trial over the mean peak of measured stances; the article "
     "compares 3.3 N/kg with N"),
    (_RECORDED, "residual_up",
     "per body mass, printed as N; default counts measured frames only, published also support "
     "that no plate felt"),
    (_RECORDED, "residual_",
     "per body mass, printed as N and N m; default: filtered motion, measured frames only"),
    (_RECORDED, "largest_deviation",
     "how they were taken is not said; ours: largest standard deviation between strides in the "
     "gait cycle, least and greatest of pelvis, hip, knee, ankle"),
    (_RECORDED, "ankle_torque_slope",
     "how it was taken is not said; ours: mean over measured stances of least-squares lines"),
    (_RECORDED, "", "ours: all recordings; which ones the article counted is not said"),
    (("ls-barefoot",), "rms_one_trial",
     "the right heel of the published fit slides on the ground, ours may not"),
    (("ls-barefoot",), "rms_vertical_force",
     "how forces were averaged is not said; the published motion does not give it either"),
    (("mapd-ws-orthosis",), "walking_speed", f"lambda rewards speed; {_BOUNDS}"),
    (_PREDICTED, "rms_one_trial", f"to one trial at equal time, as computed there; {_BOUNDS}"),
    (_PREDICTED, "rms_vertical_force", f"how forces were averaged is not said; {_BOUNDS}"),
    (_PREDICTED, "walking_speed_weight", "an input of the problem"),
    (_PREDICTED, "walking_speed", f"least effort walks as slowly as it may; {_BOUNDS}"),
    (_PREDICTED, "seconds_solve", "other solver, transcription and hardware"),
    (_PREDICTED, "effort_per_distance",
     f"{_BOUNDS}; nothing published with the article allows to check it"),
    (_PREDICTED, "ankle_torque_slope", f"how it was taken is not said; {_BOUNDS}"),
    (_PREDICTED, "", _BOUNDS),
    (("change",), "min_stance_knee_flexion",
     "both knees of the published barefoot gait rest on a bound of 0.6 rad, which makes the "
     "printed change"),
)  # fmt: skip

_NOT_COMPUTED: Final[Reasons] = (
    (("mapd-orthosis",), "largest_change_after",
     "not computed: the perturbation analysis is no part of this command"),
    (("literature",), "", "not computed: a number of other works"),
)  # fmt: skip
"""Numbers for which nothing is computed, and why."""


@dataclass(frozen=True)
class Ours:
    """Our number, SI units: a value, or a range with its mean."""

    value: float
    low: float | None = None
    high: float | None = None


@dataclass(frozen=True)
class Row:
    """One number of the article and ours, or why there is none, and why the two differ.

    `method` is that of inverse dynamics, "" for anything else.
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
    spreads = {str(name): recorded_numbers(gait) for name, gait in results.recorded.items()}
    rows = []
    for number in NUMBERS:
        inverse = number.quantity.startswith(("residual_", "max_isometric_torque_"))
        if inverse and number.subject != "healthy":
            for method, result in results.inverse.items():
                ours = result if isinstance(result, str) else _inverse(number, result, results)
                rows.append(Row(number, ours, method, _reason(number, _REASONS)))
        else:
            left_out = _reason(number, _NOT_COMPUTED)
            ours = left_out or _ours(number, results, spreads)
            rows.append(Row(number, ours, "", _why(number, results)))
    return tuple(rows)


def _reason(number: PaperNumber, reasons: Reasons) -> str:
    """Return the text about a number, "" if there is none."""
    texts = (
        text
        for subjects, begin, text in reasons
        if number.subject in subjects and number.quantity.startswith(begin)
    )
    return next(texts, "")


def _ours(number: PaperNumber, results: Results, spreads: Spreads) -> Ours | str:
    """Return our value of a number that does not come from inverse dynamics."""
    if number.subject == "healthy":
        strengths = load_patient("sreenivasa2017-healthy").max_isometric_torque
        name = number.quantity.removeprefix("max_isometric_torque_")
        return Ours(float(strengths[GENERATORS.index(name)]))
    if number.subject == "change":
        values = {change.measure.key: change.value for change in results.changes}
        why = "mapd-barefoot and mapd-orthosis did not both converge"
        return _known(values.get(number.quantity), why)
    if number.subject in results.problems:
        return _gait(number, results.problems[number.subject])
    return _recorded(number, results, spreads)


def _known(value: float | None, why: str) -> Ours | str:
    return f"not computed: {why}" if value is None else Ours(float(value))


def _inverse(number: PaperNumber, result: InverseResult, results: Results) -> Ours | str:
    known = partial(_known, why="inverse dynamics gives none")
    name = number.quantity.removeprefix("max_isometric_torque_").removeprefix("residual_")
    if number.subject == "patient":
        return known(result.strengths.get(name))
    if number.subject != "recorded":
        return known(result.residuals.get(f"{number.subject.removeprefix('recorded-')}_{name}"))
    parts = ("_moment_",) if name == "moment_limit" else ("_forward_", "_up_")
    largest = max(
        (abs(v) for key, v in result.residuals.items() if any(part in key for part in parts)),
        default=None,
    )
    if name != "over_peak_force" or largest is None:
        return known(largest)
    curves = [c for g in results.recorded.values() for s in SIDES for c in g.stance_forces(s)]
    if not curves:
        return "not computed: no forces"
    peak = float(np.mean([curve[:, 1].max() for curve in curves]))
    return Ours(largest * result.body_mass / peak)


def _gait(number: PaperNumber, result: ProblemResult) -> Ours | str:
    if result.evaluation is None:
        return f"not computed: {result.run.config.problem} did not converge"
    values = {row.measure.key: row.value for row in result.evaluation.rows}
    values["seconds_solve"] = result.run.metrics["seconds_solve"]
    values["walking_speed_weight"] = result.run.config.cost.walking_speed_weight
    return _known(values.get(number.quantity), "the run does not tell")


def _recorded(number: PaperNumber, results: Results, spreads: Spreads) -> Ours | str:
    condition = number.subject.removeprefix("recorded-")
    if number.quantity == "largest_deviation" and condition in spreads:
        return _largest_deviation(results.recorded["barefoot"])
    spread = spreads.get(condition, {}).get(number.quantity)
    if spread is None:
        return "not computed: the recordings do not tell"
    if number.quantity.startswith("ankle_torque_slope"):
        return Ours(spread.mean)
    return Ours(spread.mean, spread.low, spread.high)


def _largest_deviation(recorded: RecordedGait) -> Ours:
    """Return the largest standard deviation over the cycle of the least and greatest joint."""
    largest = {"pelvis": 0.0, "hip": 0.0, "knee": 0.0, "ankle": 0.0}
    for side in SIDES:
        band = cycle_band([(trial.motion, trial.cycles) for trial in recorded.trials], side)
        for joint in largest:
            names = [n for n in JOINTS[joint] if len(JOINTS[joint]) == 1 or n[-1] == SUFFIX[side]]
            columns = [COORDINATES.index(name) for name in names]
            largest[joint] = max(largest[joint], float(band.deviation[:, columns].max()))
    values = [*largest.values()]
    return Ours(float(np.mean(values)), min(values), max(values))


def _why(number: PaperNumber, results: Results) -> str:
    """Return the known reason, and which bound this very run rests on."""
    reason, result = _reason(number, _REASONS), results.problems.get(number.subject)
    if result is None or result.evaluation is None:
        return reason
    parts = [
        f"ours rests on its {bound.side} bound, {bound.value:.4g} {number.unit}"
        for bound in result.run.result.bounds
        if bound.name == number.quantity
    ][:1]
    parts.append(reason)
    if number.quantity.startswith("rms_one_trial_"):  # as the article words it
        key = number.quantity.replace("one_trial", "mean_cycle")
        parts += [
            f"to the mean recorded gait cycle ours is {float(to_degrees(row.value)):.2f}"
            for row in result.evaluation.rows
            if row.measure.key == key and row.value is not None
        ]
    return "; ".join(part for part in parts if part)
