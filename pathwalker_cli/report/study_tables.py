"""Studies around the optimum of a run as tables of a page."""

from __future__ import annotations

import csv
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.errors import DataError
from pathwalker_cli.report.content import Row, Section, Table
from pathwalker_cli.report.folders import Study
from pathwalker_cli.studies.measures import COMPARED, MEASURES, measure_of
from pathwalker_cli.studies.sensitivity.text import label_of

__all__ = ["study_section"]

_LEAST: Final = 1e-3
"""Elasticity [% per %] below which a number moves nothing that matters."""

_K_D: Final = "dorsiflexion_stiffness [N m/rad]"
_K_P: Final = "plantarflexion_stiffness [N m/rad]"


def study_section(study: Study) -> Section:
    """Return the table of a study.

    Raises:
        DataError: If its files are not those that the command wrote.
    """
    make = {"sensitivity": _sensitivity, "perturb": _perturbation, "landscape": _landscape}
    try:
        return make[study.kind](study)
    except (KeyError, TypeError, AttributeError, ValueError) as problem:
        what = f"does not hold what `pathwalker {study.kind}` writes: {problem!r}"
        raise DataError(what, where=str(study.folder), mend="make the study again") from None


def _sensitivity(study: Study) -> Section:
    """Return what one per cent more of every number changes."""
    found: Mapping[str, Mapping[str, Any]] = study.content["elasticities"]
    shown = [m for m in MEASURES if any(_moves(values.get(m.key)) for values in found.values())]
    rows = []
    for place, values in found.items():
        numbers = [values.get(measure.key) for measure in shown]
        if any(map(_moves, numbers)):
            rows.append(Row((label_of(place), *map(_elasticity, numbers))))
    table = Table(
        ("one per cent more of", *(m.short for m in shown)),
        tuple(rows),
        caption="Elasticities at the optimum, % per %; a spring moves with the others following",
        notes=(
            f"a dot is less than {_LEAST:g}; numbers that move nothing are left out",
            "beyond a change of the active set the numbers no longer hold",
        ),
    )
    return Section("Sensitivity", tables=(table,))


def _moves(value: float | None) -> bool:
    """Return whether an elasticity is worth showing."""
    return value is not None and abs(value) >= _LEAST


def _elasticity(value: float | None) -> str:
    if value is None:
        return "-"
    return f"{value:.3f}" if _moves(value) else "."


def _perturbation(study: Study) -> Section:
    """Return what moved springs change."""
    rows = []
    for row in study.content["rows"]:
        label = f"{measure_of(row['spring']).label} {100.0 * (row['factor'] - 1.0):+.3g} %"
        changes = (row["changes"].get(key) for key in COMPARED)
        cells = (label, f"{row['stiffness']:.1f}", *map(_change, changes), row["note"])
        rows.append(Row(cells, "" if row["status"] == "converged" else "failed"))
    head = ("spring", "[N m/rad]", *(f"{measure_of(key).short} [%]" for key in COMPARED), "remark")
    columns = f"wn{'n' * len(COMPARED)}p"
    caption = "Changes when one spring is moved and all the rest is optimal again"
    return Section(
        "Perturbation of the springs", tables=(Table(head, tuple(rows), caption, columns=columns),)
    )


def _change(share: float | None) -> str:
    # adding 0.0 makes +0.00 of -0.00
    return "no solution" if share is None else f"{round(100.0 * share, 2) + 0.0:+.2f}"


def _landscape(study: Study) -> Section:
    """Return the cost over K_D and K_P as a table, with the region of nearly best springs."""
    content = study.content
    tolerance, side = content["tolerance"], content["side"]
    cells = _increases(study.folder / "landscape.csv")
    k_d, k_p = content["dorsiflexion_stiffness"], content["plantarflexion_stiffness"]
    rows = []
    for low in k_p:
        found = (cells.get((_key(high), _key(low))) for high in k_d)
        rows.append(Row((f"{low:.3g}", *(_increase(value, tolerance) for value in found))))
    best, region = content["best"], content["region"]
    lines = [
        f"Least cost at K_D {best['dorsiflexion_stiffness']:.1f}, "
        f"K_P {best['plantarflexion_stiffness']:.1f} N m/rad ({_side(side)})."
    ]
    if region is not None:
        (d_low, d_high), (p_low, p_high) = (region[_K_D.split(" ")[0]], region[_K_P.split(" ")[0]])
        lines.append(
            f"Within {100 * tolerance:g} % of it: K_D {d_low:.1f} to {d_high:.1f}, K_P {p_low:.1f} "
            f"to {p_high:.1f} N m/rad, {100 * region['share_of_points']:.0f} % of the grid points."
        )
    table = Table(
        ("K_P \\ K_D [N m/rad]", *(f"{value:.3g}" for value in k_d)),
        tuple(rows),
        caption="Cost above the least [%]; * marks springs in that region",
    )
    return Section("Landscape of the springs", tuple(lines), tables=(table,))


def _side(side: str) -> str:
    return "both sides tied" if side == "both" else f"{side} side"


def _key(value: float) -> str:
    """Return a stiffness as the table writes it."""
    return f"{float(value):.9g}"


def _increases(path: Path) -> dict[tuple[str, str], str]:
    """Return the cost above the least by K_D and K_P; of several optima the best."""
    found: dict[tuple[str, str], str] = {}
    try:
        with path.open(encoding="utf-8", newline="") as file:
            for row in csv.DictReader(file):
                if row["branch"] in ("0", "1"):
                    found[_key(float(row[_K_D])), _key(float(row[_K_P]))] = row["cost_increase [1]"]
    except (OSError, UnicodeDecodeError, csv.Error) as problem:
        raise DataError(f"cannot be read: {problem}", where=str(path)) from None
    return found


def _increase(text: str | None, tolerance: float) -> str:
    if not text:
        return "no solution" if text == "" else "-"
    return f"{100.0 * float(text):.1f}{'*' if float(text) <= tolerance else ''}"
