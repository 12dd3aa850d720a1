"""The page about a cohort: one row per case of a batch, failures too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import groupby
from operator import attrgetter
from pathlib import Path
from typing import Final

from pathwalker_cli.conventions import SIDES
from pathwalker_cli.io.csv_file import number, read_rows
from pathwalker_cli.report.content import Fact, Page, Row, Section, Table
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import measures_in
from pathwalker_cli.studies.batch.ledger import CASES, CONVERGED, PENDING, TABLE, read_metrics

Rows = Sequence[Mapping[str, str]]

_COLUMNS: Final = ("case", "patient", "problem", "status")
_WHO: Final = ("patient", "problem", "case", "status")
_PROOF: Final = "re-integration [rad, m]"


def cohort_page(folders: Sequence[Path]) -> Page:
    """Return the page about the folders of one or more batches.

    Raises:
        DataError: If a table cannot be read.
    """
    tables = {folder: read_rows(folder / TABLE, _COLUMNS) for folder in folders}
    rows = [row for own in tables.values() for row in own]
    counts = _counts(rows)
    patients = dict.fromkeys(row["patient"] for row in rows)
    facts = (
        Fact("Cases", str(len(rows))),
        Fact("Patients", str(len(patients))),
        *(Fact(label, str(count)) for label, count in counts.items()),
    )
    answer = (f"{counts['Converged']} of {len(rows)} cases of {len(patients)} patients converged.",)
    sections = tuple(_section(folder, own) for folder, own in tables.items())
    return Page("Cohort", facts, answer, tuple(_warnings(counts, tables)), sections)


def _counts(rows: Rows) -> dict[str, int]:
    states = [row["status"] for row in rows]
    done, waiting = states.count(CONVERGED), states.count(PENDING)
    return {"Converged": done, "Failed": len(rows) - done - waiting, "Not yet run": waiting}


def _warnings(counts: Mapping[str, int], tables: Mapping[Path, Rows]) -> Iterator[str]:
    """Yield what must be known before the table is used."""
    if counts["Failed"]:
        yield f"{counts['Failed']} cases failed: they have no gait and no springs"
    if counts["Not yet run"]:
        yield f"{counts['Not yet run']} cases have not been run yet"
    cases = [folder / CASES / row["case"] for folder, rows in tables.items() for row in rows]
    quick = sum(bool((read_metrics(case) or {}).get("smoke")) for case in cases)
    if quick:
        yield f"{quick} cases are quick checks on coarse meshes: numbers for orientation only"


def _section(folder: Path, rows: Rows) -> Section:
    notes = (
        "re-integration: by how much an independent integrator misses the next node at most",
        "r, l: right, left; springs are those of least effort, K_D against dorsiflexion, K_P "
        "against plantarflexion",
    )
    families = _families()
    head = (*_WHO, *map(_heading, families), _PROOF)
    table = Table(
        head,
        tuple(_row(row, families) for row in rows),
        notes=notes,
        columns="wwwp" + "n" * (len(families) + 1),
    )
    return Section(folder.resolve().name, tables=(table,))


def _families() -> list[tuple[Measure, ...]]:
    """Return the measures of a batch but the cost, those of both sides together."""
    shown = [measure for measure in measures_in("batch") if measure.key != "cost"]
    return [tuple(group) for _, group in groupby(shown, attrgetter("family"))]


def _heading(family: tuple[Measure, ...]) -> str:
    first, sides = family[0], len(family) > 1
    label = first.label.removesuffix(SIDES[0]).rstrip(", ") + " r, l" if sides else first.label
    return f"{label} [{first.shown_unit}]" if first.shown_unit else label


def _row(row: Mapping[str, str], families: Sequence[tuple[Measure, ...]]) -> Row:
    """Return a case; one that failed has its reason instead of numbers."""
    lead = f"{row['patient']}--{row['problem']}"
    case = row["case"].removeprefix(lead).strip("-")
    converged = row["status"] == CONVERGED
    cells = (
        row["patient"], row["problem"], case or "-", row["status"],
        *(_shown(row, family) for family in families),
        number(row, "reintegration_position_error", ".1e") if converged else "-",
    )  # fmt: skip
    return Row(cells, "" if converged else "failed")


def _shown(row: Mapping[str, str], family: Sequence[Measure]) -> str:
    """Return a measure, or the values of both sides, "-" where there are none."""
    values = [number(row, m.key, f".{m.digits}f", m.in_shown_unit(1.0)) for m in family]
    return "-" if set(values) == {"-"} else ", ".join(values)
