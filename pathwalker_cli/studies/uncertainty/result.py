"""How measures spread over draws of a patient: numbers, files, and a table for the terminal.

References:
    Spearman (1904), The American Journal of Psychology 15, 72-101: rank correlation.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np
from scipy import stats

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.learnt import COST
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.results.text import spring_ends
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.studies.measures import Ranges, range_content
from pathwalker_cli.studies.neighbours import Solved
from pathwalker_cli.studies.uncertainty.draws import Draws, Input

FILES: Final = ("draws.csv", "uncertainty.csv", "correlations.csv", "uncertainty.json")

_DIGITS: Final = {"N m/rad": 1, "deg": 1, "m": 3, "m/s": 3, "s": 3, "s/m": 3, "": 4}
"""Digits after the point by unit shown; of others three."""

_LISTED: Final = 5
"""Failed draws that the terminal lists one by one, and inputs of each."""

QUANTILES: Final = (0.05, 0.5, 0.95)
"""What stands for the distribution of a measure: the middle, and the range of 90 % of draws."""

ENOUGH: Final = 20
"""Draws from which on the range of 90 % of them leaves some out; of fewer, all are told."""

_OPEN: Final = 0.25
"""Share of the allowed range that draws must cover for a spring to count as not determined."""

_HELD: Final = 0.5
"""Share of draws at a limit from which on it is the limit that decides."""

_CHANCE: Final = 0.05
"""Probability that among inputs without any effect the strongest one is named all the same."""


@dataclass(frozen=True)
class Uncertainty:
    """All draws and where they ended.

    Args:
        base: Measures at the numbers of the file, SI units.
        ranges: Allowed range by spring and further number [SI].
        further: SI units of the unknowns beside the springs, by name.
        seconds: Wall seconds in all, the solve of the base from nothing apart.
    """

    config: StudyConfig
    patient: str
    intervals: int
    base: Mapping[str, float]
    ranges: Ranges
    measures: tuple[Measure, ...]
    further: Mapping[str, str]
    draws: Draws
    solved: tuple[Solved, ...]
    seconds: float
    workers: int

    @property
    def failed(self) -> tuple[Solved, ...]:
        """Draws that did not converge."""
        return tuple(end for end in self.solved if not end.values)

    @property
    def converged(self) -> tuple[Solved, ...]:
        """Draws that did."""
        return tuple(end for end in self.solved if end.values)

    @cached_property
    def spreads(self) -> tuple[Spread, ...]:
        """How every measure spreads over the converged draws."""
        return tuple(_spread(self, measure) for measure in self.measures)

    def values(self, key: str) -> np.ndarray:
        """Return a measure of all converged draws; at a limit, the limit itself, shape (n,)."""
        values = []
        for end in self.converged:
            at = spring_ends(end.values, self.ranges).get(key)
            limit = None if at is None else self.ranges[key][at == "upper"]
            values.append(end.values[key] if limit is None else limit)
        return np.array(values)


@dataclass(frozen=True)
class Spread:
    """How a measure spreads over the converged draws.

    Args:
        measure: The measure.
        base: Its value at the numbers of the file, SI units.
        quantiles: Its 5 % quantile, median and 95 % quantile; NaN if no draw converged.
        lower: Share of draws at the lower limit; None if there is none.
        upper: Share of draws at the upper limit.
        correlations: Rank correlation with every input; NaN where the measure does not vary.
        strongest: The input of the largest correlation, None if chance alone could make it so.
    """

    measure: Measure
    base: float
    quantiles: tuple[float, ...]
    lower: float | None
    upper: float | None
    correlations: np.ndarray
    strongest: Input | None

    @property
    def place(self) -> str:
        """Place of the strongest input, "" without one."""
        return "" if self.strongest is None else self.strongest.place

    @property
    def strength(self) -> float | None:
        """The largest correlation; None if chance alone could make it."""
        if self.strongest is None:
            return None
        return float(self.correlations[np.nanargmax(np.abs(self.correlations))])


def _spread(result: Uncertainty, measure: Measure) -> Spread:
    values = result.values(measure.key)
    free = measure.key in result.ranges and len(values) > 0
    low, high = result.ranges.get(measure.key, (np.nan, np.nan))
    rows = [i for i, end in enumerate(result.solved) if end.values]
    correlations = rank_correlations(result.draws.values[rows], values)
    return Spread(
        measure=measure,
        base=result.base[measure.key],
        quantiles=tuple(np.quantile(values, QUANTILES).tolist()) if len(values) else (np.nan,) * 3,
        lower=float(np.mean(values == low)) if free and low < high else None,
        upper=float(np.mean(values == high)) if free and low < high else None,
        correlations=correlations,
        strongest=_strongest(result.draws.inputs, correlations, len(values)),
    )


def span_words(draws: int) -> str:
    """Return what the range of a measure is called: few draws have no tails."""
    return "90 % of draws" if draws >= ENOUGH else f"range of {draws}"


def span_text(spread: Spread, values: np.ndarray, limits: tuple[float, float] | None) -> str:
    """Return the range of a measure; the one limit that holds all draws is named as such.

    Args:
        spread: How the measure spreads.
        values: Its values, see `Uncertainty.values`.
        limits: Its allowed range, if it has one.
    """
    low, _, high = spread.quantiles
    if 0 < len(values) < ENOUGH:
        low, high = float(values.min()), float(values.max())
    if limits is not None and low == high and limits[0] < limits[1] and low in limits:
        return f"all at {'lower' if low == limits[0] else 'upper'} limit"
    return f"{shown_text(spread.measure, low)} to {shown_text(spread.measure, high)}"


def rank_correlations(inputs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return Spearman's rank correlation of every input with a measure, shape (m,).

    Args:
        inputs: Shape (n, m).
        values: Shape (n,); without variation, correlations are NaN.
    """
    if len(values) < 3 or np.ptp(values) == 0.0:
        return np.full(inputs.shape[1], np.nan)
    ranks = stats.rankdata(values)
    return np.array([np.corrcoef(stats.rankdata(column), ranks)[0, 1] for column in inputs.T])


def chance_level(draws: int, inputs: int) -> float:
    """Return what the strongest correlation of so many idle inputs exceeds in 5 % of studies."""
    if draws < 3:
        return 1.0
    return float(min(1.0, stats.norm.ppf(1.0 - _CHANCE / (2.0 * inputs)) / np.sqrt(draws - 1.0)))


def _strongest(inputs: Sequence[Input], correlations: Iterable[float], draws: int) -> Input | None:
    sizes = [abs(c) if np.isfinite(c) else 0.0 for c in correlations]
    best = int(np.argmax(sizes))
    return inputs[best] if sizes[best] > chance_level(draws, len(inputs)) else None


def write_tables(result: Uncertainty, folder: Path) -> None:
    """Write `draws.csv`, `uncertainty.csv`, `correlations.csv` and `uncertainty.json`."""
    _write_draws(result, folder / FILES[0])
    header = ["measure", "unit", "base", "quantile 0.05", "median", "quantile 0.95", "draws [1]",
              "share at lower limit [1]", "share at upper limit [1]", "strongest input",
              "rank correlation [1]"]  # fmt: skip
    rows = []
    for spread in result.spreads:
        numbers = [_number(value) for value in (spread.base, *spread.quantiles)]
        rows.append([spread.measure.key, spread.measure.unit, *numbers, len(result.converged),
                     spread.lower, spread.upper, spread.place, spread.strength])  # fmt: skip
    write_table(folder / FILES[1], header, rows)
    columns: list[list[Any]] = [["input", *(entry.place for entry in result.draws.inputs)]]
    columns += [[f"{s.measure.key} [1]", *map(_number, s.correlations)] for s in result.spreads]
    names, *lines = zip(*columns, strict=True)
    write_table(folder / FILES[2], names, lines)
    write_json(folder / FILES[3], uncertainty_content(result))


def uncertainty_content(result: Uncertainty) -> dict[str, Any]:
    """Return how everything spreads as plain values; SI units."""
    return {
        "problem": result.config.problem,
        "patient": result.patient,
        "tolerance": result.config.solver.tolerance,
        "intervals": result.intervals,
        "seconds": result.seconds,
        "draws": len(result.solved),
        "failed": [end.name for end in result.failed],
        "base": result.base,
        **range_content(result.ranges),
        **({"further": result.further} if result.further else {}),
        "spreads": {
            spread.measure.key: {
                "quantiles": dict(
                    zip(map(str, QUANTILES), map(_number, spread.quantiles), strict=True)
                ),
                "share_at_lower_limit": spread.lower,
                "share_at_upper_limit": spread.upper,
                "strongest_input": spread.place or None,
                "rank_correlation": spread.strength,
            }
            for spread in result.spreads
        },
        "advice": list(_advice(result)) if result.converged else [],
    }


def _write_draws(result: Uncertainty, path: Path) -> None:
    """Write one row per draw: what was drawn, where it ended, and how to solve it again."""
    header = ["draw", *(entry.heading for entry in result.draws.inputs), "status"]
    header += [measure.column for measure in result.measures]
    header += ["iterations", "seconds [s]", "variation"]
    rows = []
    for number, end in enumerate(result.solved):
        variation = result.config.variation.merged(result.draws.variation(number))
        text = json.dumps(variation.model_dump(mode="json"))
        values = [end.values.get(m.key) for m in result.measures]
        drawn = result.draws.values[number].tolist()
        rows.append([number, *drawn, end.status, *values, end.iterations, end.seconds, text])
    write_table(path, header, rows)


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def uncertainty_lines(result: Uncertainty) -> Iterator[str]:
    """Yield the table of the terminal: medians, ranges, limits and the inputs that matter most."""
    inputs, count, converged = len(result.draws.inputs), len(result.solved), len(result.converged)
    yield (
        f"{result.config.problem}, patient {result.patient}, {result.intervals} intervals: "
        f"{count} draws of {inputs} inputs, {converged} converged"
    )
    if converged:
        yield ""
        yield _line("", "base", "median", span_words(converged), "follows most", "rank corr.")
        yield from (_row(result, spread) for spread in result.spreads)
        yield ""
        yield from _limits(result)
        yield from _advice(result)
        level = chance_level(converged, inputs)
        yield f"a correlation up to {level:.2f} may be chance among {inputs} inputs: none is named"
    yield ""
    yield from _failures(result)
    yield _seconds(result)


def _row(result: Uncertainty, spread: Spread) -> str:
    measure = spread.measure
    span = span_text(spread, result.values(measure.key), result.ranges.get(measure.key))
    unit = f" [{measure.shown_unit}]" if measure.shown_unit else ""
    middle = shown_text(measure, spread.quantiles[1])
    strength = "" if spread.strength is None else f"{spread.strength:+.2f}"
    base, label = shown_text(measure, spread.base), f"{measure.label}{unit}"
    return _line(label, base, middle, span, spread.place or "-", strength)


def shown_text(measure: Measure, value: float) -> str:
    """Return a value of a measure in the unit for people."""
    return f"{measure.in_shown_unit(value):.{_DIGITS.get(measure.shown_unit, 3)}f}"


def _line(label: str, base: str, middle: str, span: str, place: str, strength: str) -> str:
    return f"{label:<37}{base:>8}{middle:>9}{span:>18}  {place:<34}{strength:>10}".rstrip()


def _limits(result: Uncertainty) -> Iterator[str]:
    """Yield how often each spring and further number sits at a limit."""
    for spread in result.spreads:
        key, unit = spread.measure.key, spread.measure.unit
        if spread.lower is None or spread.upper is None:
            if key in result.ranges:
                yield f"{spread.measure.label}: prescribed at {spread.base:.4g} {unit}"
            continue
        low, high = result.ranges[key]
        yield (
            f"{spread.measure.label}: at its lower limit of {low:g} {unit} in "
            f"{100.0 * spread.lower:.0f} % of the draws, at its upper one of {high:g} in "
            f"{100.0 * spread.upper:.0f} %"
        )
    if not any(low < high for low, high in result.ranges.values()):
        yield "no spring is free"


def _advice(result: Uncertainty) -> Iterator[str]:
    """Yield, of learnt numbers, which springs they leave open, and what to measure first.

    What walking costs cannot be measured; tissue, range of motion and strength can.
    """
    rows = [i for i, entry in enumerate(result.draws.inputs)
            if entry.distribution is None and not entry.place.startswith(COST)]  # fmt: skip
    level = chance_level(len(result.converged), len(result.draws.inputs))
    most = "90 %" if len(result.converged) >= ENOUGH else "nearly all"
    for spread in result.spreads:
        low, high = result.ranges.get(spread.measure.key, (0.0, 0.0))
        if not rows or not low < high:
            continue
        label, unit = spread.measure.label, spread.measure.unit
        share = (spread.quantiles[2] - spread.quantiles[0]) / (high - low)
        held = max(spread.lower or 0.0, spread.upper or 0.0) > _HELD
        found = "held by its limit, not determined" if held else "determined"
        text = (
            f"{label}: {'not determined' if share > _OPEN else found} by what was learnt, "
            f"{spread.quantiles[0]:.0f} to "
            f"{spread.quantiles[2]:.0f} {unit} in {most} of the draws"
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


def _failures(result: Uncertainty) -> Iterator[str]:
    if not result.failed:
        return
    share = 100.0 * len(result.failed) / len(result.solved)
    yield (
        f"{len(result.failed)} draws ({share:.0f} %) did not converge and are left out above; what "
        f"was drawn for them stands in {FILES[0]}:"
    )
    numbers = {end.name: number for number, end in enumerate(result.solved)}
    for end in result.failed[:_LISTED]:
        yield f"  draw {numbers[end.name]}: {end.status}; {_extremes(result, numbers[end.name])}"
    if len(result.failed) > _LISTED:
        yield f"  and {len(result.failed) - _LISTED} more"


def _extremes(result: Uncertainty, number: int) -> str:
    """Return the inputs of a draw that are furthest from the middle of all draws."""
    values = result.draws.values
    spread = np.maximum(values.std(axis=0), np.finfo(float).tiny)
    far = np.argsort(-np.abs(values[number] - np.median(values, axis=0)) / spread)[:_LISTED]
    parts = []
    for i in sorted(far):
        entry, value = result.draws.inputs[i], values[number, i]
        parts.append(f"{entry.place} {f'x {value:.3g}' if entry.relative else f'{value:+.3g}'}")
    return ", ".join(parts)


def _seconds(result: Uncertainty) -> str:
    fresh = [end for end in result.solved if not end.kept]
    kept = len(result.solved) - len(fresh)
    there = f", {kept} were there already" if kept else ""
    processes = "one process" if result.workers == 1 else f"{result.workers} processes"
    text = f"{result.seconds:.0f} s in all, {processes}{there}"
    if not fresh:
        return text
    seconds, iterations = [end.seconds for end in fresh], [end.iterations for end in fresh]
    return (
        f"{text}; per draw {np.median(seconds):.1f} s and {np.median(iterations):.0f} iterations "
        f"at the median, {max(seconds):.1f} s and {max(iterations)} at most"
    )
