"""Several runs side by side: metrics, their differences to the first, and differing configs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import groupby
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

from pathwalker_cli.config import StudyConfig
from pathwalker_cli.config.values import differing_values
from pathwalker_cli.evaluation.run import gaits_of_runs
from pathwalker_cli.gait.costs import GOALS
from pathwalker_cli.io.csv_file import write_table
from pathwalker_cli.stride.measure import FORCE, LOADS, Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.stride.stride import Stride

_GOALS: Final = "Clinical goals, whether or not the cost weighs them"
_WIDTH: Final = 80
_NAME: Final = 11
"""Columns of the terminal, and of the name of a run above its values."""


def compared() -> tuple[Measure, ...]:
    """Return what is compared, in order; keys of `metrics.json`, of its parts with a dot."""
    measures = [
        replace(m, section=LOADS) if m.section == FORCE else m for m in measures_in("compare")
    ]
    goals = (
        Measure(f"goals.{name}", name.replace("_", " "), goal.unit, "", None, section=_GOALS)
        for name, goal in GOALS.items()
    )
    at = next(i for i, measure in enumerate(measures) if measure.key == "cost")
    return (*measures[:at], *goals, *measures[at:])


_DEPENDS: Final = {
    "cost": "cost.",
    "effort_per_distance": "cost.activation_power",
    "goals.discomfort": "cost.comfort_ranges",
}
"""Keys of the config, or their beginnings, that say what a metric means."""


@dataclass(frozen=True)
class Compared:
    """One metric of all runs, None where a run does not have it; SI units.

    In the runs of `other` the config gives it another meaning than in the first one: no difference
    is told.
    """

    measure: Measure
    values: tuple[float | None, ...]
    other: frozenset[int] = frozenset()

    @property
    def differences(self) -> tuple[float | None, ...]:
        """Value minus that of the first run; None where it cannot be told."""
        base = self.values[0]
        return tuple(
            None if base is None or v is None or i in self.other else v - base
            for i, v in enumerate(self.values)
        )

    @property
    def shares(self) -> tuple[float | None, ...]:
        """Difference over the size of the first value; None where that is zero."""
        base = self.values[0]
        return tuple(d / abs(base) if d is not None and base else None for d in self.differences)


@dataclass(frozen=True)
class Comparison:
    """Several runs, of which the first is the base, side by side.

    `config` holds the keys of the configs whose values differ, with the value of each run.
    """

    gaits: tuple[Stride, ...]
    rows: tuple[Compared, ...]
    config: Mapping[str, tuple[str, ...]]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the runs."""
        return tuple(gait.name for gait in self.gaits)

    @property
    def notes(self) -> tuple[str, ...]:
        """What to know before numbers of these runs are compared, one sentence each."""
        found = [f"{gait.name}: {note}" for gait in self.gaits for note in gait.notes]
        for what, values in (
            ("patients", [gait.walker.patient.id for gait in self.gaits]),
            ("conditions", [gait.walker.condition for gait in self.gaits]),
            ("problems", [gait.problem for gait in self.gaits]),
        ):
            if len(set(values)) > 1:
                pairs = zip(self.names, values, strict=True)
                found.append(f"different {what}: {', '.join(f'{v} ({n})' for n, v in pairs)}")
        if any(row.other for row in self.rows if row.measure.key == "cost"):
            found.append("costs of different weights or goals cannot be compared")
        return tuple(found)


def compare_runs(folders: Sequence[Path]) -> Comparison:
    """Return converged runs side by side.

    Raises:
        DataError: If a run is named twice, did not converge or cannot be used.
    """
    runs, gaits = zip(*gaits_of_runs(folders), strict=True)
    found = (
        Compared(
            measure,
            tuple(_number(run.metrics, measure.key) for run in runs),
            _other(measure.key, [run.config for run in runs]),
        )
        for measure in compared()
    )
    rows = tuple(row for row in found if any(value is not None for value in row.values))
    return Comparison(gaits, rows, differing_values([run.config for run in runs]))


def _other(key: str, configs: Sequence[StudyConfig]) -> frozenset[int]:
    """Return the runs whose config gives a metric another meaning than that of the first run."""
    beginning, first = _DEPENDS.get(key), configs[0]
    if beginning is None:
        return frozenset()
    return frozenset(
        i
        for i, config in enumerate(configs)
        if (key == "cost" and config.fits != first.fits)
        or any(name.startswith(beginning) for name in differing_values([first, config]))
    )


def _number(metrics: Mapping[str, Any], key: str) -> float | None:
    """Return a number of the metrics, None where there is none."""
    group, _, name = key.rpartition(".")
    value = (metrics.get(group) or {}).get(name) if group else metrics.get(name)
    return float(value) if isinstance(value, int | float) else None


def comparison_lines(found: Comparison) -> Iterator[str]:
    """Yield a table for every run beside the first, then what differs in the configs."""
    for i in range(1, len(found.gaits)):
        yield from _against_base(found, i)
        yield ""
    if not found.config:
        yield "The configs are the same."
        return
    yield "Config values that differ"
    for key, values in found.config.items():
        yield from _config_lines(key, found.names, values)


def _config_lines(key: str, names: Sequence[str], values: Sequence[str]) -> Iterator[str]:
    """Yield a key with the value of every run, in one line if it is short enough."""
    pairs = list(zip(names, values, strict=True))
    line = f" {key}: {', '.join(f'{value} ({name})' for name, value in pairs)}"
    if len(line) <= _WIDTH:
        yield line
        return
    yield f" {key}"
    for name, value in pairs:
        yield from wrap(f"{name}: {value}", _WIDTH, initial_indent=" " * 3,
                        subsequent_indent=" " * 5)  # fmt: skip


def _against_base(found: Comparison, which: int) -> Iterator[str]:
    """Yield the table of one run beside the first."""
    base, other = found.names[0], found.names[which]
    yield f"{other} compared with {base}"
    yield _line("", _cut(base), _cut(other), "change", "[%]", "unit")
    for section, rows in groupby(found.rows, lambda row: row.measure.section):
        yield section
        for row in rows:
            if not row.values[0] and not row.values[which]:  # orthoses that nobody wears
                continue
            measure, share = row.measure, row.shares[which]
            yield _line(
                measure.row,
                measure.text(row.values[0]),
                measure.text(row.values[which]),
                measure.text(row.differences[which], sign=True),
                "-" if share is None else f"{round(100.0 * share, 1) + 0.0:+.1f}",
                measure.shown_unit,
            )


def _line(label: str, base: str, other: str, change: str, share: str, unit: str) -> str:
    return f" {label:<26}{base:>11} {other:>11}{change:>10}{share:>9}  {unit}".rstrip()


def _cut(name: str) -> str:
    """Return the end of a name as a heading of a narrow column."""
    return name if len(name) <= _NAME else f"..{name[2 - _NAME :]}"


def write_comparison_csv(path: Path, found: Comparison) -> None:
    """Write a row per metric: value of every run, differences to the first, those also in %."""
    names = found.names
    header = ["metric", "unit", *names]
    header += [f"{name} - {names[0]}" for name in names[1:]]
    header += [f"{name} - {names[0]} [%]" for name in names[1:]]
    rows = []
    for row in found.rows:
        percent = (None if share is None else 100.0 * share for share in row.shares[1:])
        about = row.measure.key, row.measure.unit
        rows.append([*about, *row.values, *row.differences[1:], *percent])
    write_table(path, header, rows)


def comparison_content(found: Comparison) -> dict[str, Any]:
    """Return everything that was compared, ready for JSON; SI units, shares of 1."""
    return {
        "runs": [
            {"name": gait.name, "problem": gait.problem, "patient": gait.walker.patient.id,
             "condition": gait.walker.condition}
            for gait in found.gaits
        ],
        "base": found.names[0],
        "metrics": {
            row.measure.key: {
                "unit": row.measure.unit,
                "values": dict(zip(found.names, row.values, strict=True)),
                "differences": dict(zip(found.names[1:], row.differences[1:], strict=True)),
                "shares": dict(zip(found.names[1:], row.shares[1:], strict=True)),
            }
            for row in found.rows
        },
        "config": {
            key: dict(zip(found.names, values, strict=True)) for key, values in found.config.items()
        },
        "notes": list(found.notes),
    }  # fmt: skip
