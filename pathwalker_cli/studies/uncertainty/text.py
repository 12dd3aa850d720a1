"""An uncertainty study as files and as a table for the terminal."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.io.json_file import write_json
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.studies.pool import Solved
from pathwalker_cli.studies.springs import free_springs
from pathwalker_cli.studies.uncertainty.result import Spread, Uncertainty, chance_level, spreads

__all__ = [
    "FILES",
    "failure_lines",
    "shown_text",
    "uncertainty_content",
    "uncertainty_lines",
    "write_uncertainty",
]

FILES: Final = ("draws.csv", "uncertainty.csv", "correlations.csv", "uncertainty.json")

_DIGITS: Final = {"N m/rad": 1, "deg": 1, "m": 3, "m/s": 3, "s": 3, "s/m": 3, "": 4}
"""Digits after the point by unit shown."""

_TOLD: Final = 5
"""Failed draws that the terminal tells of one by one, and inputs of each."""


def write_uncertainty(result: Uncertainty, folder: Path) -> None:
    """Write `draws.csv`, `uncertainty.csv`, `correlations.csv` and `uncertainty.json`."""
    _write_draws(result, folder / FILES[0])
    found = spreads(result)
    names = [entry.place for entry in result.draws.inputs]
    header = ["measure", "unit", "base", "quantile 0.05", "median", "quantile 0.95", "draws [1]",
              "share at lower limit [1]", "share at upper limit [1]", "strongest input",
              "rank correlation [1]"]  # fmt: skip
    rows = []
    for spread in found:
        numbers = [_number(value) for value in (spread.base, *spread.quantiles)]
        rows.append([spread.measure.key, spread.measure.unit, *numbers, len(result.converged),
                     spread.lower, spread.upper, *_strongest(spread)])  # fmt: skip
    write_table(folder / FILES[1], header, rows)
    table = np.array([spread.correlations for spread in found]).T
    keys = [f"{spread.measure.key} [1]" for spread in found]
    write_table(
        folder / FILES[2],
        ["input", *keys],
        ([name, *map(_number, row)] for name, row in zip(names, table.tolist(), strict=True)),
    )
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
        "base": dict(result.base),
        "stiffness_ranges": {name: list(pair) for name, pair in result.ranges.items()},
        "spreads": {spread.measure.key: _spread_content(spread) for spread in spreads(result)},
    }


def _spread_content(spread: Spread) -> dict[str, Any]:
    place, strength = _strongest(spread)
    return {
        "quantiles": dict(
            zip(("0.05", "0.5", "0.95"), map(_number, spread.quantiles), strict=True)
        ),
        "share_at_lower_limit": spread.lower,
        "share_at_upper_limit": spread.upper,
        "strongest_input": place or None,
        "rank_correlation": strength,
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


def _strongest(spread: Spread) -> tuple[str, float | None]:
    """Return the input that a measure follows most, and how closely."""
    if spread.strongest is None:
        return "", None
    return spread.strongest.place, _strength(spread)


def _strength(spread: Spread) -> float:
    return float(spread.correlations[np.nanargmax(np.abs(spread.correlations))])


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
        yield _line("", "base", "median", "90 % of draws", "follows most", "rank corr.")
        found = spreads(result)
        for spread in found:
            yield _row(spread)
        yield ""
        yield from _limits(result, found)
        level = chance_level(converged, inputs)
        yield f"a correlation up to {level:.2f} may be chance among {inputs} inputs: none is named"
    yield ""
    yield from failure_lines(result)
    yield _seconds(result)


def _row(spread: Spread) -> str:
    measure = spread.measure
    unit = f" [{measure.shown_unit}]" if measure.shown_unit else ""
    low, middle, high = (shown_text(measure, value) for value in spread.quantiles)
    place, strength = _strongest(spread)
    told = "" if strength is None else f"{strength:+.2f}"
    base = shown_text(measure, spread.base)
    return _line(f"{measure.label}{unit}", base, middle, f"{low} to {high}", place or "-", told)


def shown_text(measure: Measure, value: float) -> str:
    """Return a value of a measure in the unit for people."""
    return f"{measure.in_shown_unit(value):.{_DIGITS.get(measure.shown_unit, 3)}f}"


def _line(label: str, base: str, middle: str, span: str, place: str, strength: str) -> str:
    return f"{label:<37}{base:>8}{middle:>9}{span:>18}  {place:<34}{strength:>10}".rstrip()


def _limits(result: Uncertainty, found: list[Spread]) -> Iterator[str]:
    """Yield how often each spring sits at a limit."""
    for spread in found:
        key = spread.measure.key
        if spread.lower is None or spread.upper is None:
            if key in result.ranges:
                yield f"{spread.measure.label}: prescribed at {spread.base:.4g} N m/rad"
            continue
        low, high = result.ranges[key]
        yield (
            f"{spread.measure.label}: at its lower limit of {low:g} N m/rad in "
            f"{100.0 * spread.lower:.0f} % of the draws, at its upper one of {high:g} in "
            f"{100.0 * spread.upper:.0f} %"
        )
    if not free_springs(result.ranges):
        yield "no spring is free"


def failure_lines(result: Uncertainty) -> Iterator[str]:
    """Yield what happened to draws that did not converge."""
    if not result.failed:
        return
    share = 100.0 * len(result.failed) / len(result.solved)
    yield (
        f"{len(result.failed)} draws ({share:.0f} %) did not converge and are left out above; what "
        f"was drawn for them stands in {FILES[0]}:"
    )
    numbers = {end.name: number for number, end in enumerate(result.solved)}
    for end in result.failed[:_TOLD]:
        yield f"  draw {numbers[end.name]}: {end.status}; {_extremes(result, numbers[end.name])}"
    if len(result.failed) > _TOLD:
        yield f"  and {len(result.failed) - _TOLD} more"


def _extremes(result: Uncertainty, number: int) -> str:
    """Return the inputs of a draw that are furthest from the middle of all draws."""
    values = result.draws.values
    spread = np.maximum(values.std(axis=0), np.finfo(float).tiny)
    far = np.argsort(-np.abs(values[number] - np.median(values, axis=0)) / spread)[:_TOLD]
    parts = []
    for i in sorted(far):
        entry, value = result.draws.inputs[i], values[number, i]
        parts.append(f"{entry.place} {f'x {value:.3g}' if entry.relative else f'{value:+.3g}'}")
    return ", ".join(parts)


def _seconds(result: Uncertainty) -> str:
    """Return how long it took."""
    fresh = [end for end in result.solved if not end.kept]
    kept = len(result.solved) - len(fresh)
    there = f", {kept} were there already" if kept else ""
    text = f"{result.seconds:.0f} s in all, {_processes(result.workers)}{there}"
    return f"{text}; {_per_draw(fresh)}" if fresh else text


def _processes(count: int) -> str:
    return "one process" if count == 1 else f"{count} processes"


def _per_draw(fresh: list[Solved]) -> str:
    seconds = [end.seconds for end in fresh]
    iterations = [end.iterations for end in fresh]
    return (
        f"per draw {np.median(seconds):.1f} s and {np.median(iterations):.0f} iterations at the "
        f"median, {max(seconds):.1f} s and {max(iterations)} at most"
    )
