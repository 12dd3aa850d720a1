"""A gait beside the recordings and the article, and the change from barefoot to orthosis."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.errors import DataError
from pathwalker_cli.evaluation.differences import (
    DIFFERENCES,
    force_rms,
    recorded_force_rms,
    recorded_rms_mean_cycle,
    recorded_rms_one_trial,
    rms_mean_cycle,
    rms_one_trial,
)
from pathwalker_cli.evaluation.norms import PROFILE, norm_note
from pathwalker_cli.evaluation.paper import (
    PATIENT,
    PaperClaim,
    PaperNumber,
    paper_claim,
    paper_number,
)
from pathwalker_cli.evaluation.recorded import (
    Position,
    RecordedGait,
    Spread,
    recorded_gait,
    recorded_numbers,
    reference_stride,
)
from pathwalker_cli.io.recordings import recording_names
from pathwalker_cli.stride.measure import SECTIONS, Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.stride.stride import Stride
from pathwalker_cli.stride.unusual import unusual


@dataclass(frozen=True)
class Row:
    """One measure of a gait; SI units.

    Args:
        measure: What it is.
        value: Its value, None if the gait does not tell.
        recorded: What recordings say, None if they do not; of a difference to recordings, that of
            single recorded strides or stances.
        paper: What the article prints for its own solution of the same problem, or None.
        paper_recorded: What the article prints for the recordings, or None.
    """

    measure: Measure
    value: float | None
    recorded: Spread | None = None
    paper: PaperNumber | None = None
    paper_recorded: PaperNumber | None = None

    @property
    def position(self) -> Position | None:
        """Where the value lies in relation to the recorded range, None without one of them."""
        if self.value is None or self.recorded is None:
            return None
        return self.recorded.position(self.value)


@dataclass(frozen=True)
class Change:
    """How one measure changes from barefoot to orthosis; SI units.

    Args:
        measure: What it is.
        barefoot: Its value barefoot.
        orthosis: Its value with orthoses.
        recorded: Change of the recorded mean, or None.
        paper: Change that the article prints, or says in words, or None.
    """

    measure: Measure
    barefoot: float
    orthosis: float
    recorded: float | None = None
    paper: PaperNumber | PaperClaim | None = None

    @property
    def value(self) -> float:
        """The change; negative: less with orthoses."""
        return self.orthosis - self.barefoot

    @property
    def percent(self) -> str:
        """The change over the barefoot value [%], with its sign; "" where that is zero."""
        return f"{100.0 * self.value / self.barefoot:+.0f}" if self.barefoot else ""


@dataclass(frozen=True)
class Evaluation:
    """A gait beside the recordings.

    Args:
        gait: The gait.
        recorded: The recordings of its condition, None if there are none.
        one_trial: Name of the trial of the comparison at equal time, "" without one.
        rows: All measures in the order of `compared`; those that neither gait nor recordings nor
            article know are left out.
        notes: What could not be compared and what to know, one sentence each.
        unusual: What no child does, one phrase each.
    """

    gait: Stride
    recorded: RecordedGait | None
    one_trial: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...]
    unusual: tuple[str, ...] = ()

    def find(self, key: str) -> Row | None:
        """Return the row of a measure, None if it was left out."""
        return next((row for row in self.rows if row.measure.key == key), None)


def evaluate_gait(
    gait: Stride, trial: str | None = None, recorded: RecordedGait | None = None
) -> Evaluation:
    """Return a gait beside recordings, those beside the patient's file if none are given.

    At equal time it is compared with `trial`; see `reference_stride`.

    Raises:
        DataError: If a recording cannot be used, or the trial does not exist.
    """
    recorded = recorded or recorded_gait(gait.walker)
    reference = reference_stride(recorded, trial) if recorded else None
    values = {measure.key: measure.of(gait) for measure in _measures()}
    spreads: dict[str, Spread] = {}
    notes = gait.notes
    if gait.walker.condition == "barefoot" and gait.part is None:
        notes += (norm_note(gait),)
    if recorded is None:
        notes += (
            f"patient {gait.walker.patient.id} has no {gait.walker.condition} recordings beside "
            "its file: joint angles, ground forces, ankle torques, steps and times are not "
            "compared",
        )
    else:
        spreads = recorded_numbers(recorded, _measures())
        for more, recorded_too, note in _differences(gait, recorded, reference):
            values |= more
            spreads |= recorded_too
            notes += note
    rows = (_row(gait, m, values.get(m.key), spreads.get(m.key)) for m in compared())
    return Evaluation(
        gait=gait,
        recorded=recorded,
        one_trial=reference.name if reference else "",
        rows=tuple(row for row in rows if any((row.value is not None, row.recorded, row.paper))),
        notes=notes,
        unusual=unusual(gait) if gait.part is None else (),
    )


def evaluate_gaits(gaits: Sequence[Stride], trial: str | None = None) -> list[Evaluation]:
    """Return gaits beside the recordings of each, with a trial where its condition has it.

    Raises:
        DataError: If a recording cannot be used, or no condition has the trial.
    """
    names = [recording_names(gait.walker.patient, gait.walker.condition) for gait in gaits]
    if trial is not None and not any(trial in own for own in names):
        raise DataError(
            f"there is no recording '{trial}'",
            where="--trial",
            allowed=", ".join(dict.fromkeys(sum(names, ()))) or "none are there",
            mend="leave it out",
        )
    trials = (trial if trial in own else None for own in names)
    return [evaluate_gait(gait, name) for gait, name in zip(gaits, trials, strict=True)]


def _measures() -> tuple[Measure, ...]:
    """Return what a gait says without recordings."""
    return (*measures_in("evaluate"), *PROFILE)


def compared() -> tuple[Measure, ...]:
    """Return all measures in which a gait is compared, in the order in which they are shown."""
    found = (*_measures(), *DIFFERENCES)
    return tuple(sorted(found, key=lambda measure: SECTIONS.index(measure.section)))


def gait_changes(barefoot: Evaluation, orthosis: Evaluation) -> tuple[Change, ...]:
    """Return the changes from barefoot to orthosis of what both gaits tell."""
    article = barefoot.gait.walker.patient.id == PATIENT
    before = {row.measure.key: row for row in barefoot.rows}
    after = {row.measure.key: row for row in orthosis.rows}
    changes = []
    for measure in _measures():
        first, second = before.get(measure.key), after.get(measure.key)
        if first is None or second is None or first.value is None or second.value is None:
            continue
        both = (first.recorded, second.recorded)
        recorded = both[1].mean - both[0].mean if both[0] and both[1] else None
        paper = paper_number("change", measure.key) or paper_claim(measure.key)
        changes.append(
            Change(measure, first.value, second.value, recorded, paper if article else None)
        )
    return tuple(changes)


def changes_between(evaluations: Sequence[Evaluation]) -> tuple[Change, ...]:
    """Return the changes from a barefoot gait to one with orthoses of the same patient.

    There are none between any others, or if there are more than the two.
    """
    pair = sorted(evaluations, key=lambda each: each.gait.walker.condition)
    walkers = [each.gait.walker for each in pair]
    two = [walker.condition for walker in walkers] == ["barefoot", "orthosis"]
    same = len({walker.patient.id for walker in walkers}) == 1
    return gait_changes(*pair) if two and same else ()


Found = tuple[dict[str, float], dict[str, Spread], tuple[str, ...]]
"""Differences of the gait and of single recorded strides by key, and notes."""


def _differences(gait: Stride, recorded: RecordedGait, reference: Stride | None) -> Iterator[Found]:
    """Yield the differences of ground forces and joint angles, or why there are none."""
    blind = [side for side in SIDES if len(recorded.stance_forces(side)) == 0]
    notes = (
        f"no recorded {side} stance has a measured force: ground forces are not compared, nor the "
        f"torques of the {side} ankle"
        for side in blind
    )
    yield force_rms(gait, recorded), recorded_force_rms(recorded), tuple(notes)
    missing = [side for side in SIDES if not recorded.of("stride", side)]
    if missing:
        note = (
            f"the recordings show no complete {' or '.join(missing)} gait cycle: joint angles are "
            "not compared over the gait cycle"
        )
        yield {}, {}, (note,)
    else:
        cycle = rms_mean_cycle(gait, recorded), recorded_rms_mean_cycle(recorded)
        yield *(_prefixed("rms_mean_cycle_", each) for each in cycle), ()
    if reference is None:
        note = (
            "no recording shows a stride from a left toe-off to the next one: joint angles are not "
            "compared at equal time"
        )
        yield {}, {}, (note,)
    else:
        trial = rms_one_trial(gait, reference), recorded_rms_one_trial(recorded, reference)
        yield *(_prefixed("rms_one_trial_", each) for each in trial), ()


def _prefixed(prefix: str, values: dict[str, Any]) -> Any:
    """Return values under longer names."""
    return {f"{prefix}{key}": value for key, value in values.items()}


def _row(gait: Stride, measure: Measure, value: float | None, recorded: Spread | None) -> Row:
    """Return the row of a measure; the article only for its own patient."""
    printed = printed_recorded = None
    if gait.walker.patient.id == PATIENT:
        printed = paper_number(gait.problem, measure.key)
        printed_recorded = paper_number(f"recorded-{gait.walker.condition}", measure.key)
    return Row(measure, value, recorded, printed, printed_recorded)
