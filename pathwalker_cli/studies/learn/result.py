"""What was learnt, how well it explains the recordings, and what the recordings do not tell."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.config.learnt import COST, Learnt
from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.evaluation.differences import (
    force_rms,
    recorded_rms_mean_cycle,
    rms_mean_cycle,
)
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_numbers
from pathwalker_cli.gait.costs import GOALS
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.io.yaml_file import yaml_text
from pathwalker_cli.stride.figures.curves import ANGLES
from pathwalker_cli.stride.measures import measure_of
from pathwalker_cli.stride.stride import Stride
from pathwalker_cli.studies.learn.targets import Target, cycles

FILES: Final = ("learnt.yaml", "learn.csv", "learn.json")

TOLD: Final = 0.5
"""Share of a prior's variance that recordings must take away for them to determine a number."""

_JUDGED: Final = (
    "walking_speed", "stride_time", "step_length_right", "step_length_left",
    "ankle_torque_slope_stance_right", "ankle_torque_slope_stance_left",
    "peak_net_ankle_torque_right", "peak_net_ankle_torque_left",
)  # fmt: skip
"""Numbers of the walk that stand beside the recorded ones."""


@dataclass(frozen=True)
class LeftOut:
    """How single trials are met by what the others teach, to first order [rad].

    Args:
        learnt: RMS difference of the left-out cycles to the prediction, mean of the five joints.
        own: The same to the mean of the other trials' cycles: what no prediction can beat.
        trials: Number of trials that were left out, one by one.
    """

    learnt: float
    own: float
    trials: int


@dataclass(frozen=True)
class LearnResult:
    """A set of learnt numbers beside the recordings that it comes from.

    `misfits` is what was minimised, by start; of it, `prior_misfit` is distance from the priors.
    `active` ranges hold the result; none should. Seconds count after the first prediction.
    """

    problem: str
    learnt: Learnt
    stride: Stride
    recorded: RecordedGait
    targets: tuple[Target, ...]
    misfits: tuple[float, ...]
    prior_misfit: float
    active: tuple[str, ...]
    left_out: LeftOut | None
    solves: int
    iterations: int
    seconds: float
    cpu_seconds: float

    @property
    def told(self) -> dict[str, float]:
        """Share of each prior's variance that the recordings took away, by place, in [0, 1]."""
        left = np.diag(np.array(self.learnt.covariance))
        return {place: float(1.0 - v) for place, v in zip(self.learnt.numbers, left, strict=True)}

    def interval(self, place: str) -> tuple[float, float]:
        """Return the values one standard deviation below and above a learnt one [its unit]."""
        number = self.learnt.numbers[place]
        deviation = float(np.sqrt(1.0 - self.told[place]))
        at = number.deviations(number.learnt)
        low, high = (number.value(at + sign * deviation) for sign in (-1.0, 1.0))
        return low, high

    def unit(self, place: str) -> str:
        """Return the unit of a number."""
        if place.startswith(COST):
            goal = GOALS.get(place.rpartition(".")[2])
            return "rad" if place == "cost.trunk_lean" else f"1/({goal.unit})" if goal else "m/s"
        numbers = self.stride.walker.numbers
        return next((n.unit for n in numbers if place in (n.address, n.place)), "")


def left_out_errors(
    targets_without: Callable[[RecordedGait, Collection[str]], tuple[Target, ...]],
    recorded: RecordedGait,
    targets: tuple[Target, ...],
    slopes: np.ndarray,
    deviations: np.ndarray,
    stride: Stride,
    without: Collection[str] = (),
) -> LeftOut | None:
    """Return how the trials are met that are left out one by one, to first order.

    A trial changes only means and spreads, so one Gauss-Newton step from the optimum of all
    trials tells what the others teach; nothing is solved again.

    Args:
        targets_without: Returns the targets without some trials.
        recorded: The recordings.
        targets: What was learnt from.
        slopes: Derivatives of the weighed deviations, then of those from the priors, (m + n, n).
        deviations: The learnt numbers in prior standard deviations from their priors, (n,).
        stride: The stride that they predict.
        without: Trials that were left out anyway.
    """
    rows, at = {}, 0
    for target in targets:
        size = target.mean.size
        rows[target.name] = slopes[at : at + size] / target.scale
        at += size
    shown = {each.name for side in SIDES for each in recorded.of("stride", side)}
    trials = sorted(shown.difference(without))
    errors = []
    for trial in trials if len(trials) > 1 else ():
        rest = {t.name: t for t in targets_without(recorded, (trial,)) if t.name in rows}
        jacobian = np.vstack([rows[name] * target.scale for name, target in rest.items()])
        misses = np.concatenate([target.residual(stride) for target in rest.values()])
        normal = jacobian.T @ jacobian + np.eye(deviations.size)
        step = -np.linalg.solve(normal, jacobian.T @ misses + deviations)
        taught = {name: t.of(stride) + rows[name] @ step for name, t in rest.items()}
        means = {name: target.mean for name, target in rest.items()}
        errors.append([_missed(recorded, trial, curves) for curves in (taught, means)])
    if not errors:
        return None
    learnt, own = np.nanmean(errors, axis=0)
    return LeftOut(float(learnt), float(own), len(errors))


def _missed(recorded: RecordedGait, trial: str, curves: Mapping[str, np.ndarray]) -> float:
    """Return the RMS difference of the angles of a trial's cycles to curves, mean of joints [rad].

    NaN if the trial shows no cycle that there is a curve for.
    """
    joints = []
    for angle in ANGLES:
        squares = [
            np.mean((curves[name] - line) ** 2)
            for side in SIDES
            if (name := f"{angle.key}_{side}") in curves
            for line in cycles(recorded, angle, side).get(trial, ())
        ]
        if squares:
            joints.append(np.deg2rad(np.sqrt(np.mean(squares))))  # the curves are in degrees
    return float(np.mean(joints)) if joints else float("nan")


def write_learnt(result: LearnResult, folder: Path) -> None:
    """Write `learnt.yaml`, `learn.csv` and `learn.json`."""
    folder.mkdir(parents=True, exist_ok=True)
    content = result.learnt.model_dump(mode="json", exclude_none=True)
    heading = "Learnt numbers: a config takes them by `learnt: FILE`. See docs/learning.md."
    with atomic_open(folder / FILES[0], "w") as file:
        file.write(yaml_text(content, heading))
    header = ["number", "unit", "learnt", "one deviation below", "one deviation above", "prior",
              "told by recordings [1]"]  # fmt: skip
    rows = [
        [place, result.unit(place), number.learnt, *result.interval(place), number.prior,
         result.told[place]]
        for place, number in result.learnt.numbers.items()
    ]  # fmt: skip
    write_table(folder / FILES[1], header, rows)
    write_json(folder / FILES[2], learn_content(result))


def learn_content(result: LearnResult) -> dict[str, Any]:
    """Return a result as plain values, SI units."""
    own = recorded_rms_mean_cycle(result.recorded)
    recorded = recorded_numbers(result.recorded)
    left = result.left_out
    return {
        "problem": result.problem,
        "patient": result.learnt.patient,
        "condition": result.learnt.condition,
        "misfits": list(result.misfits),
        "prior_misfit": result.prior_misfit,
        "rms_mean_cycle": rms_mean_cycle(result.stride, result.recorded),
        "rms_own_cycles": {joint: spread.mean for joint, spread in own.items()},
        "force_rms": force_rms(result.stride, result.recorded),
        "left_out": None if left is None else vars(left),
        "walk": {
            key: {"learnt": value, "recorded": None if (r := recorded.get(key)) is None else
                  [r.low, r.mean, r.high]}
            for key, value in _walk(result.stride).items()
        },
        "numbers": {
            place: {"learnt": number.learnt, "prior": number.prior, "unit": result.unit(place),
                    "interval": list(result.interval(place)), "told": result.told[place]}
            for place, number in result.learnt.numbers.items()
        },
        "active_bounds": list(result.active),
        "solves": result.solves,
        "iterations": result.iterations,
        "seconds": result.seconds,
        "seconds_cpu": result.cpu_seconds,
    }  # fmt: skip


def _walk(stride: Stride) -> dict[str, float]:
    values = {key: measure_of(key).of(stride) for key in _JUDGED}
    return {key: value for key, value in values.items() if value is not None}


def learn_lines(result: LearnResult) -> Iterator[str]:
    """Yield a result as lines for the terminal."""
    yield from _fit_lines(result)
    yield from _walk_lines(result)
    yield f"\n{'learnt number':<46}{'value':>10}  {'one deviation':>20}{'prior':>10}  told by"
    for place, number in result.learnt.numbers.items():
        low, high = result.interval(place)
        told = "recordings" if result.told[place] > TOLD else "prior alone"
        name = f"{place} [{unit}]" if (unit := result.unit(place)) else place
        yield (f"{name:<46}{number.learnt:>10.4g}  {f'{low:.4g} to {high:.4g}':>20}"
               f"{number.prior:>10.4g}  {told} ({100.0 * result.told[place]:.0f} %)")  # fmt: skip
    silent = [place for place, told in result.told.items() if told <= TOLD]
    if silent:
        yield (
            f"\nthe recordings do not determine {len(silent)} of {len(result.told)} numbers, which "
            "stay where their priors put them or follow from others: compare no child by them"
        )
    acting = ", ".join(result.active) or "none"
    yield f"\nranges that hold the result: {acting}"
    starts = ", ".join(f"{misfit:.2f}" for misfit in result.misfits)
    yield (
        f"misfit by start: {starts} (of the best, distance from the priors "
        f"{result.prior_misfit:.2f})"
    )
    yield (f"{result.solves} predictions, {result.iterations} iterations, "
           f"{result.cpu_seconds:.0f} CPU s after the first")  # fmt: skip


def _fit_lines(result: LearnResult) -> Iterator[str]:
    rms, own = rms_mean_cycle(result.stride, result.recorded), recorded_rms_mean_cycle(
        result.recorded
    )  # fmt: skip
    rows: Mapping[str, Mapping[str, float]] = {
        "learnt": rms,
        "own cycles": {joint: spread.mean for joint, spread in own.items()},
    }
    yield f"{'RMS to the mean cycle [deg]':<30}" + "".join(f"{j:>9}" for j in (*rms, "mean"))
    for name, values in rows.items():
        each = [float(to_degrees(values[joint])) for joint in rms if joint in values]
        if len(each) == len(rms):
            yield f"{name:<30}" + "".join(f"{x:>9.1f}" for x in (*each, float(np.mean(each))))
    if (left := result.left_out) is not None:
        yield (f"trials left out one by one, to first order: {float(to_degrees(left.learnt)):.1f} "
               f"deg (the other trials' mean: {float(to_degrees(left.own)):.1f})")  # fmt: skip
    for key, value in force_rms(result.stride, result.recorded).items():
        yield f"{key.replace('_', ' '):<30}{value:>9.1f} N"


def _walk_lines(result: LearnResult) -> Iterator[str]:
    recorded = recorded_numbers(result.recorded)
    yield f"\n{'the walk':<46}{'learnt':>10}  {'recorded':>20}"
    for key, value in _walk(result.stride).items():
        measure, r = measure_of(key), recorded.get(key)
        beside = "" if r is None else f"{r.mean:.3g} ({r.low:.3g} to {r.high:.3g})"
        yield f"{f'{measure.label} [{measure.unit}]':<46}{value:>10.3g}  {beside:>20}"
