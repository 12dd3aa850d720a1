"""Draws in words: a table for the terminal, limits, and what could not be solved."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

import numpy as np

from pathwalker_cli.studies.uncertainty.advice import advice
from pathwalker_cli.studies.uncertainty.files import FILES
from pathwalker_cli.studies.uncertainty.result import (
    Spread,
    Uncertainty,
    chance_level,
    shown_text,
    span_text,
    span_words,
)

_LISTED: Final = 5
"""Failed draws that the terminal lists one by one, and inputs of each."""


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
        yield from advice(result)
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
