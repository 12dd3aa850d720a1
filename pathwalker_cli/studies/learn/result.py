"""What was learnt, how well it explains the recordings, and what the recordings do not tell."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
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

    @cached_property
    def content(self) -> dict[str, Any]:
        """Everything as plain values, SI units; files and terminal tell what stands here."""
        own = recorded_rms_mean_cycle(self.recorded)
        walk = {key: measure_of(key).of(self.stride) for key in _JUDGED}
        recorded = recorded_numbers(self.recorded)
        return {
            "problem": self.problem,
            "patient": self.learnt.patient,
            "condition": self.learnt.condition,
            "misfits": list(self.misfits),
            "prior_misfit": self.prior_misfit,
            "rms_mean_cycle": rms_mean_cycle(self.stride, self.recorded),
            "rms_own_cycles": {joint: spread.mean for joint, spread in own.items()},
            "force_rms": force_rms(self.stride, self.recorded),
            "left_out": None if self.left_out is None else vars(self.left_out),
            "walk": {
                key: {"learnt": value, "recorded": None if (r := recorded.get(key)) is None else
                      [r.low, r.mean, r.high]}
                for key, value in walk.items()
                if value is not None
            },
            "numbers": dict(self._numbers()),
            "active_bounds": list(self.active),
            "solves": self.solves,
            "iterations": self.iterations,
            "seconds": self.seconds,
            "seconds_cpu": self.cpu_seconds,
        }  # fmt: skip

    def _numbers(self) -> Iterator[tuple[str, dict[str, Any]]]:
        """Yield every number by its place, with the values one standard deviation away.

        What it is told is the share of its prior's variance that the recordings took away.
        """
        left = np.diag(np.array(self.learnt.covariance))
        for (place, number), variance in zip(self.learnt.numbers.items(), left, strict=True):
            told = float(1.0 - variance)
            at, deviation = number.deviations(number.learnt), float(np.sqrt(1.0 - told))
            interval = [number.value(at + sign * deviation) for sign in (-1.0, 1.0)]
            yield place, {"learnt": number.learnt, "prior": number.prior, "unit": self._unit(place),
                          "interval": interval, "told": told}  # fmt: skip

    def _unit(self, place: str) -> str:
        """Return the unit of a number."""
        if place.startswith(COST):
            goal = GOALS.get(place.rpartition(".")[2])
            return "rad" if place == "cost.trunk_lean" else _inverse(goal.unit) if goal else "m/s"
        numbers = self.stride.walker.numbers
        return next((n.unit for n in numbers if place in (n.address, n.place)), "")


def _inverse(unit: str) -> str:
    """Return the unit of a weight of what has this unit, e.g. "s m" of "1/(s m)"."""
    return unit[3:-1] if unit.startswith("1/(") else f"1/({unit})"


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
        [place, number["unit"], number["learnt"], *number["interval"], number["prior"],
         number["told"]]
        for place, number in result.content["numbers"].items()
    ]  # fmt: skip
    write_table(folder / FILES[1], header, rows)
    write_json(folder / FILES[2], result.content)


def learn_lines(result: LearnResult) -> Iterator[str]:
    """Yield a result as lines for the terminal."""
    content = result.content
    yield from _fit_lines(content)
    yield f"\n{'the walk':<46}{'learnt':>10}  {'recorded':>20}"
    for key, each in content["walk"].items():
        measure = measure_of(key)
        low, mean, high = each["recorded"] or (None, None, None)
        beside = "" if mean is None else f"{mean:.3g} ({low:.3g} to {high:.3g})"
        yield f"{f'{measure.label} [{measure.unit}]':<46}{each['learnt']:>10.3g}  {beside:>20}"
    yield f"\n{'learnt number':<46}{'value':>10}  {'one deviation':>20}{'prior':>10}  told by"
    for place, each in content["numbers"].items():
        span = "{:.4g} to {:.4g}".format(*each["interval"])
        told = "recordings" if each["told"] > TOLD else "prior alone"
        name = f"{place} [{each['unit']}]" if each["unit"] else place
        yield (f"{name:<46}{each['learnt']:>10.4g}  {span:>20}"
               f"{each['prior']:>10.4g}  {told} ({100.0 * each['told']:.0f} %)")  # fmt: skip
    told_of = [each["told"] for each in content["numbers"].values()]
    if silent := sum(told <= TOLD for told in told_of):
        yield (
            f"\nthe recordings do not determine {silent} of {len(told_of)} numbers, which "
            "stay where their priors put them or follow from others: compare no child by them"
        )
    yield f"\nranges that hold the result: {', '.join(result.active) or 'none'}"
    starts = ", ".join(f"{misfit:.2f}" for misfit in result.misfits)
    yield (
        f"misfit by start: {starts} (of the best, distance from the priors "
        f"{result.prior_misfit:.2f})"
    )
    yield (f"{result.solves} predictions, {result.iterations} iterations, "
           f"{result.cpu_seconds:.0f} CPU s after the first")  # fmt: skip


def _fit_lines(content: Mapping[str, Any]) -> Iterator[str]:
    rms, left = content["rms_mean_cycle"], content["left_out"]
    yield f"{'RMS to the mean cycle [deg]':<30}" + "".join(f"{j:>9}" for j in (*rms, "mean"))
    for name, values in (("learnt", rms), ("own cycles", content["rms_own_cycles"])):
        each = [float(to_degrees(values[joint])) for joint in rms if joint in values]
        if len(each) == len(rms):
            yield f"{name:<30}" + "".join(f"{x:>9.1f}" for x in (*each, float(np.mean(each))))
    if left is not None:
        learnt, others = (float(to_degrees(left[key])) for key in ("learnt", "own"))
        yield (
            f"trials left out one by one, to first order: {learnt:.1f} deg (the other trials' "
            f"mean: {others:.1f})"
        )
    for key, value in content["force_rms"].items():
        yield f"{key.replace('_', ' '):<30}{value:>9.1f} N"
