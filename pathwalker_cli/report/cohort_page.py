"""The page about a cohort: one row per case of a batch, failures too."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from pathwalker_cli.conventions import SIDES, to_degrees
from pathwalker_cli.io.csv_file import number, read_rows
from pathwalker_cli.report.content import Fact, Page, Row, Section, Table
from pathwalker_cli.studies.batch.ledger import CASES, CONVERGED, PENDING, TABLE, read_metrics

Rows = Sequence[Mapping[str, str]]

_COLUMNS: Final = ("case", "patient", "problem", "status")
_HEAD: Final = (
    "patient", "problem", "case", "status", "speed [m/s]", "step r, l [m]",
    "least knee flexion r, l [deg]", "K_D r, l [N m/rad]", "K_P r, l [N m/rad]", "effort [s/m]",
    "re-integration [rad, m]",
)  # fmt: skip
_DEGREES: Final = float(to_degrees(1.0))


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
    table = Table(_HEAD, tuple(map(_row, rows)), notes=notes, columns="wwwpnnnnnnn")
    return Section(folder.resolve().name, tables=(table,))


def _row(row: Mapping[str, str]) -> Row:
    """Return a case; one that failed has its reason instead of numbers."""
    lead = f"{row['patient']}--{row['problem']}"
    case = row["case"].removeprefix(lead).strip("-")
    converged = row["status"] == CONVERGED
    cells = (
        row["patient"], row["problem"], case or "-", row["status"],
        number(row, "walking_speed", ".3f"),
        _pair(row, "step_length", ".3f"),
        _pair(row, "min_stance_knee_flexion", ".1f", _DEGREES),
        _pair(row, "dorsiflexion_stiffness", ".1f"),
        _pair(row, "plantarflexion_stiffness", ".1f"),
        number(row, "effort_per_distance", ".3f"),
        number(row, "reintegration_position_error", ".1e") if converged else "-",
    )  # fmt: skip
    return Row(cells, "" if converged else "failed")


def _pair(row: Mapping[str, str], stem: str, form: str, factor: float = 1.0) -> str:
    """Return the values of both sides, "-" where there are none."""
    values = [number(row, f"{stem}_{side}", form, factor) for side in SIDES]
    return "-" if set(values) == {"-"} else ", ".join(values)
