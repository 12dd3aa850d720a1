"""A gait beside the recordings and the article, and the change from barefoot to orthosis."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

from pathwalker_cli.evaluation.angle_rms import (
    recorded_rms_mean_cycle,
    recorded_rms_one_trial,
    rms_mean_cycle,
    rms_one_trial,
)
from pathwalker_cli.evaluation.force_rms import force_rms, recorded_force_rms
from pathwalker_cli.evaluation.gait import Gait
from pathwalker_cli.evaluation.numbers import gait_numbers, recorded_numbers
from pathwalker_cli.evaluation.paper import (
    PATIENT,
    PaperClaim,
    PaperNumber,
    paper_claim,
    paper_number,
)
from pathwalker_cli.evaluation.quantities import CHANGES, QUANTITIES, Quantity
from pathwalker_cli.evaluation.recorded import RecordedGait, recorded_gait
from pathwalker_cli.evaluation.reference import ReferenceStride, reference_stride
from pathwalker_cli.evaluation.spread import Position, Spread
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.stride.cycle import BOTH_SIDES

Value = TypeVar("Value")

__all__ = ["Change", "Evaluation", "Row", "evaluate_gait", "gait_changes"]


@dataclass(frozen=True)
class Row:
    """One quantity of a gait; SI units.

    Args:
        quantity: What it is.
        value: Its value, None if the gait does not tell.
        recorded: What recordings say, None if they do not; of a difference to recordings, that of
            single recorded strides or stances.
        paper: What the article prints for its own solution of the same problem, or None.
        paper_recorded: What the article prints for the recordings, or None.
    """

    quantity: Quantity
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
    """How one quantity changes from barefoot to orthosis; SI units.

    Args:
        quantity: What it is.
        barefoot: Its value barefoot.
        orthosis: Its value with orthoses.
        recorded: Change of the recorded mean, or None.
        paper: Change that the article prints, or says in words, or None.
    """

    quantity: Quantity
    barefoot: float
    orthosis: float
    recorded: float | None = None
    paper: PaperNumber | PaperClaim | None = None

    @property
    def value(self) -> float:
        """The change; negative: less with orthoses."""
        return self.orthosis - self.barefoot


@dataclass(frozen=True)
class Evaluation:
    """A gait beside the recordings.

    Args:
        gait: The gait.
        recorded: The recordings of its condition, None if there are none.
        one_trial: Name of the trial of the comparison at equal time, "" without one.
        rows: All quantities in the order of `quantities.QUANTITIES`; those that neither gait nor
            recordings nor article know are left out.
        notes: What could not be compared and what to know, one sentence each.
    """

    gait: Gait
    recorded: RecordedGait | None
    one_trial: str
    rows: tuple[Row, ...]
    notes: tuple[str, ...]

    def row(self, key: str) -> Row:
        """Return the row of a quantity.

        Raises:
            KeyError: If it was left out.
        """
        found = next((row for row in self.rows if row.quantity.key == key), None)
        if found is None:
            raise KeyError(key)
        return found


def evaluate_gait(
    gait: Gait, trial: str | None = None, recorded: RecordedGait | None = None
) -> Evaluation:
    """Return a gait beside the recordings of its patient and condition.

    Args:
        gait: The gait.
        trial: Trial to compare with at equal time; the article's, or the first that shows such a
            stride, if left out.
        recorded: The recordings; those beside the patient's file if left out.

    Raises:
        DataError: If a recording cannot be used, or the trial does not exist.
    """
    recorded = recorded or recorded_gait(gait.walker)
    reference = reference_stride(recorded, trial) if recorded else None
    found = _Found(gait_numbers(gait), {}, gait.notes)
    if recorded is None:
        found += _nothing_recorded(gait.walker)
    else:
        found += _Found({}, recorded_numbers(recorded))
        found += _forces(gait, recorded)
        found += _mean_cycle(gait, recorded)
        found += _one_trial(gait, recorded, reference)
    rows = (_row(gait, quantity, found) for quantity in QUANTITIES)
    return Evaluation(
        gait=gait,
        recorded=recorded,
        one_trial=reference.trial if reference else "",
        rows=tuple(row for row in rows if _told(row)),
        notes=found.notes,
    )


def gait_changes(barefoot: Evaluation, orthosis: Evaluation) -> tuple[Change, ...]:
    """Return the changes from barefoot to orthosis of what both gaits tell.

    Args:
        barefoot: A gait barefoot.
        orthosis: A gait of the same patient with orthoses.
    """
    article = barefoot.gait.walker.patient.id == PATIENT
    before = {row.quantity.key: row for row in barefoot.rows}
    after = {row.quantity.key: row for row in orthosis.rows}
    found = []
    for quantity in CHANGES:
        first, second = before.get(quantity.key), after.get(quantity.key)
        if first is None or second is None or first.value is None or second.value is None:
            continue
        both = (first.recorded, second.recorded)
        recorded = both[1].mean - both[0].mean if both[0] and both[1] else None
        paper = paper_number("change", quantity.key) or paper_claim(quantity.key)
        found.append(
            Change(quantity, first.value, second.value, recorded, paper if article else None)
        )
    return tuple(found)


@dataclass(frozen=True)
class _Found:
    """Values of the gait and of the recordings by key of a quantity, and notes."""

    values: dict[str, float]
    spreads: dict[str, Spread]
    notes: tuple[str, ...] = ()

    def __add__(self, other: _Found) -> _Found:
        return _Found(
            self.values | other.values, self.spreads | other.spreads, self.notes + other.notes
        )


def _nothing_recorded(walker: Walker) -> _Found:
    """Return the note that there are no recordings."""
    note = (
        f"patient {walker.patient.id} has no {walker.condition} recordings beside its file: joint "
        "angles, ground forces, ankle torques, steps and times are not compared"
    )
    return _Found({}, {}, (note,))


def _forces(gait: Gait, recorded: RecordedGait) -> _Found:
    """Return the differences of ground reaction forces."""
    notes = tuple(
        f"no recorded {side} stance has a measured force: ground forces are not compared, nor the "
        f"torques of the {side} ankle"
        for side in BOTH_SIDES
        if len(recorded.stance_forces(side)) == 0
    )
    return _Found(force_rms(gait, recorded), recorded_force_rms(recorded), notes)


def _mean_cycle(gait: Gait, recorded: RecordedGait) -> _Found:
    """Return the differences of joint angles to the mean gait cycle."""
    missing = [side for side in BOTH_SIDES if not any(recorded.cycles(side))]
    if missing:
        note = (
            f"the recordings show no complete {' or '.join(missing)} gait cycle: joint angles are "
            "not compared over the gait cycle"
        )
        return _Found({}, {}, (note,))
    return _Found(
        _prefixed("rms_mean_cycle_", rms_mean_cycle(gait, recorded)),
        _prefixed("rms_mean_cycle_", recorded_rms_mean_cycle(recorded)),
    )


def _one_trial(gait: Gait, recorded: RecordedGait, reference: ReferenceStride | None) -> _Found:
    """Return the differences of joint angles to one trial at equal time."""
    if reference is None:
        note = (
            "no recording shows a stride from a left toe-off to the next one: joint angles are not "
            "compared at equal time"
        )
        return _Found({}, {}, (note,))
    return _Found(
        _prefixed("rms_one_trial_", rms_one_trial(gait, reference)),
        _prefixed("rms_one_trial_", recorded_rms_one_trial(recorded, reference)),
    )


def _prefixed(prefix: str, found: dict[str, Value]) -> dict[str, Value]:
    """Return values under longer names."""
    return {f"{prefix}{key}": value for key, value in found.items()}


def _row(gait: Gait, quantity: Quantity, found: _Found) -> Row:
    """Return the row of a quantity; the article only for its own patient."""
    key, walker = quantity.key, gait.walker
    printed = printed_recorded = None
    if walker.patient.id == PATIENT:
        printed = paper_number(gait.problem, key)
        printed_recorded = paper_number(f"recorded-{walker.condition}", key)
    return Row(quantity, found.values.get(key), found.spreads.get(key), printed, printed_recorded)


def _told(row: Row) -> bool:
    """Return whether anybody has a number for a quantity."""
    return any(part is not None for part in (row.value, row.recorded, row.paper))
