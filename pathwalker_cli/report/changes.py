"""What orthoses change in walking, judged against the child's own variation."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from pathwalker_cli.conventions import SIDES, SUFFIX
from pathwalker_cli.evaluation.recorded import Spread
from pathwalker_cli.ocp.violations import ActiveBound
from pathwalker_cli.report.content import Row, Section, Table
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import expanded
from pathwalker_cli.studies.verdict import SHARE

Judgement = Literal["better", "worse", "same"]

JUDGED: Final[Mapping[str, bool]] = {
    "walking_speed": True,
    "step_length_*": True,
    "min_stance_knee_flexion_*": False,
    "effort_per_distance": False,
    "gait_profile_score": False,
}
"""What is judged, in order, and whether more of it is better."""

_PLAIN: Final = {
    "least stance knee flexion": "crouch: least knee flexion in stance",
    "sagittal Gait Profile Score": "distance from typical walking (sagittal Gait Profile Score)",
}
"""What people call some of them."""

MARKS: Final[Mapping[Judgement, str]] = {
    "better": "▲ better", "worse": "▼ worse", "same": "= same",
}  # fmt: skip

_ENOUGH: Final = 3
"""Recorded values from which on their standard deviation tells how much a child varies."""


@dataclass(frozen=True)
class Outcome:
    """One measure of walking barefoot and with orthoses, in each run; SI units.

    `recorded` is by condition; `set_by_bound` says in which runs the config set it.
    """

    measure: Measure
    more_is_better: bool
    values: tuple[float, ...]
    recorded: Mapping[str, Spread]
    set_by_bound: tuple[bool, ...]

    @property
    def varies_by(self) -> float | None:
        """One standard deviation of the child's own barefoot strides, None if they do not tell."""
        own = self.recorded.get("barefoot")
        return own.sd if own is not None and own.count >= _ENOUGH and own.sd else None

    def judged(self, run: int, base: int) -> Judgement:
        """Return whether a run is better than another one by more than the child varies."""
        change = self.values[run] - self.values[base]
        margin = self.varies_by or SHARE * abs(self.values[base])
        if abs(change) <= margin:
            return "same"
        return "better" if (change > 0.0) == self.more_is_better else "worse"


def outcomes(runs: Sequence[ReportRun]) -> tuple[Outcome, ...]:
    """Return everything that is judged and that all runs tell."""
    found = []
    for family, more in JUDGED.items():
        for key in expanded(family):
            rows = [run.evaluation.find(key) for run in runs]
            values = [row.value for row in rows if row is not None and row.value is not None]
            if len(values) == len(runs):
                recorded: dict[str, Spread] = {
                    run.run.config.condition: row.recorded
                    for run, row in zip(runs, rows, strict=True)
                    if row is not None and row.recorded is not None
                }
                held = tuple(any(_holds(b, key) for b in run.run.result.bounds) for run in runs)
                measure = next(row.measure for row in rows if row is not None)
                found.append(Outcome(measure, more, tuple(values), recorded, held))
    return tuple(found)


def _holds(bound: ActiveBound, key: str) -> bool:
    """Return whether a bound is one of the measure itself, which then was not predicted."""
    knees = {f"knee_{SUFFIX[side]}": f"min_stance_knee_flexion_{side}" for side in SIDES}
    return key == (knees.get(bound.name) if bound.side == "lower" else None) or key == bound.name


def base_of(runs: Sequence[ReportRun]) -> int | None:
    """Return which run the others are judged against: the barefoot one, None without just one."""
    barefoot = [i for i, run in enumerate(runs) if not run.worn]
    return barefoot[0] if len(barefoot) == 1 and len(runs) > 1 else None


def change_section(runs: Sequence[ReportRun], found: Sequence[Outcome]) -> Section:
    """Return the table of what changes in walking, the barefoot value beside it."""
    base = base_of(runs)
    conditions = [c for c in ("barefoot", "orthosis") if any(c in each.recorded for each in found)]
    head, columns = ["", "unit"], "ww"
    for i, run in enumerate(runs):
        judged = base is not None and i != base
        head += [run.label, *(["against barefoot"] if judged else [])]
        columns += "nw" if judged else "n"
    if any(each.varies_by for each in found) and base is not None:
        head.append("child varies by ±")
        columns += "n"
    head += [f"recorded {condition}" for condition in conditions]
    columns += "n" * len(conditions)
    rows = tuple(_outcome_row(each, runs, base, conditions, len(head)) for each in found)
    notes = _notes(found, base)
    title = "What changes in walking" if base is not None else "Walking"
    return Section(title, tables=(Table(tuple(head), rows, notes=notes, columns=columns),))


def _outcome_row(
    each: Outcome,
    runs: Sequence[ReportRun],
    base: int | None,
    conditions: Sequence[str],
    width: int,
) -> Row:
    measure = each.measure
    label = measure.label
    for name, plain in _PLAIN.items():
        label = label.replace(name, plain)
    cells = [label, measure.shown_unit]
    for i in range(len(runs)):
        cells.append(short(measure, each.values[i]) + "*" * each.set_by_bound[i])
        if base is not None and i != base:
            cells.append(MARKS[each.judged(i, base)])
    if width > len(cells) + len(conditions):
        cells.append(short(measure, each.varies_by) if each.varies_by else "-")
    for condition in conditions:
        own = each.recorded.get(condition)
        cells.append(f"{short(measure, own.mean)}" if own else "-")
    return Row(tuple(cells))


def _notes(found: Sequence[Outcome], base: int | None) -> tuple[str, ...]:
    notes = []
    if base is not None:
        notes.append(
            "same: the change is at most one standard deviation of the child's own barefoot "
            f"strides, or {100 * SHARE:g} % where none were recorded"
        )
    if any(any(each.set_by_bound) for each in found):
        notes.append("* set by a bound of the config, not predicted")
    return tuple(notes)


def short(measure: Measure, value: float) -> str:
    """Return a value with as many digits as matter to a person."""
    shown = measure.in_shown_unit(value)
    return f"{shown:.1f}" if measure.unit == "rad" else f"{shown:.2f}"


def sides_of(found: Sequence[Outcome], family: str) -> tuple[Outcome, ...]:
    """Return what is known of a measure, right and left."""
    return tuple(each for each in found if each.measure.family == family)


def together(found: Sequence[Outcome], run: int, base: int) -> Judgement | None:
    """Return the one judgement of both sides, None where they differ."""
    judged = {each.judged(run, base) for each in found}
    return judged.pop() if len(judged) == 1 else None
