"""What a check says, as rows for the terminal and as plain values: of a file, and of who walks."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from textwrap import wrap
from typing import Any, Final

from pathwalker_cli.checking.consistency import odd_patient
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.patient import Patient
from pathwalker_cli.patient.blocks import Strengths
from pathwalker_cli.patient.file import healthy_strength
from pathwalker_cli.results.text import notes_together, orthosis_rows

_WIDTH: Final = 80
_COLUMN: Final = 20

Row = tuple[str, str]
Changes = tuple[str, ...]
"""Overrides "dotted.key=value", as from the command line."""


@dataclass(frozen=True)
class Checked:
    """A file that is in order: all there is to know, as rows and as plain values.

    `notes` says what may be meant but is unusual, a sentence each.
    """

    path: str
    kind: str
    rows: tuple[Row, ...]
    content: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return everything as plain values."""
        return {
            "config": self.path,
            "kind": self.kind,
            "ok": True,
            **self.content,
            "notes": list(self.notes),
        }


def checked_lines(checked: Checked) -> Iterator[str]:
    """Yield what a check says, on 80 columns."""
    yield f"{checked.path}: {checked.kind}, in order"
    label_before = ""
    for label, text in (*checked.rows, *(("note", note) for note in checked.notes)):
        shown = "" if label == label_before else label
        label_before = label
        begin = f"  {shown:<{_COLUMN}}"
        yield from wrap(
            text,
            _WIDTH,
            initial_indent=begin,
            subsequent_indent=" " * (_COLUMN + 2),
            break_on_hyphens=False,
            break_long_words=False,
        ) or [begin.rstrip()]


def walker_rows(walker: Walker) -> list[Row]:
    """Return who walks, and what is worn."""
    rows = patient_rows(walker.patient)
    if walker.device.worn:
        rows += orthosis_rows(walker.patient.require_orthosis())
    return rows


def patient_remarks(patient: Patient) -> tuple[str, ...]:
    """Return what is unusual about a patient, then what was filled in."""
    return (*odd_patient(patient), *notes_together(patient.notes))


def orthosis_content(patient: Patient) -> dict[str, Any] | None:
    """Return what is worn as plain values, in the units of the file."""
    return patient.orthosis.model_dump(mode="json") if patient.orthosis is not None else None


def patient_rows(patient: Patient) -> list[Row]:
    """Return who a patient is."""
    source = f", {_shown(patient.source)}" if patient.source else ""
    size = f"{patient.age:g} years, {patient.body_mass:g} kg, {patient.height:g} m"
    rows = [("patient", f"{patient.id}{source}"), ("", f"{patient.sex}, {size}")]
    shares = strength_shares(patient)
    sides = [
        f"{name.replace('_', ' ')} {' / '.join(f'{100 * share:.0f}' for share in values)} %"
        for name, values in shares.items()
    ]
    if sides:
        text = "right / left, of a healthy child of this mass and height: "
        rows.append(("strengths", text + ", ".join(sides)))
    return rows


def _shown(path: Path) -> Path:
    """Return a path as seen from here where it lies below."""
    here = Path.cwd()
    return path.relative_to(here) if path.is_relative_to(here) else path


def patient_content(patient: Patient) -> dict[str, Any]:
    """Return who a patient is as plain values."""
    return {
        "id": patient.id,
        "file": str(patient.source) if patient.source else None,
        "sex": patient.sex,
        "age": patient.age,
        "body_mass": patient.body_mass,
        "height": patient.height,
        "strengths_of_healthy": {k: list(v) for k, v in strength_shares(patient).items()},
    }


def strength_shares(patient: Patient) -> dict[str, tuple[float, ...]]:
    """Return strengths as shares of a healthy child's of the same size: right and left, or one."""
    if patient.strengths is None:
        return {}
    shares = {}
    for name in Strengths.model_fields:
        given = getattr(patient.strengths, name)
        values = (given,) if isinstance(given, float) else (given.right, given.left)
        whole = healthy_strength(name, patient.body_mass, patient.height)
        shares[name] = tuple(round(value / whole, 3) for value in values)
    return shares
