"""The page about recorded gait: stances, torques, residuals and strengths that `id` found."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Final

from pathwalker_cli.conventions import CONDITIONS, SIDES, SUFFIX, Condition
from pathwalker_cli.errors import DataError
from pathwalker_cli.inverse.files import ORIGIN, READING
from pathwalker_cli.inverse.laboratory import SHOWN, Difference, laboratory_rows
from pathwalker_cli.inverse.trials import read_trials
from pathwalker_cli.io.csv_file import number, read_rows
from pathwalker_cli.io.json_file import read_json
from pathwalker_cli.report.content import Drawing, Fact, Page, Row, Section, Table
from pathwalker_cli.report.figures import torque_drawing

Rows = Sequence[Mapping[str, str]]

_STANCES: Final = ("condition", "trial", "side", "strike", "toe-off", "measured", "reason")
_STRENGTHS: Final = ("generator", "strength", "stances", "remark")
_RESIDUALS: Final = ("condition", "part", "trial", "up mean")


def recorded_page(folders: Sequence[Path]) -> Page:
    """Return the page about one or more folders of `id`, of any patients.

    Raises:
        DataError: If a file cannot be used.
    """
    origins = [_origin(folder) for folder in folders]
    sections = [
        part
        for i, (folder, origin) in enumerate(zip(folders, origins, strict=True))
        for part in _sections(folder, origin, i)
    ]
    patients = ", ".join(dict.fromkeys(str(origin["patient"]) for origin in origins))
    dates = ", ".join(dict.fromkeys(str(origin["date"]) for origin in origins))
    measured = [read_rows(folder / "stances.csv", _STANCES) for folder in folders]
    known = sum(row["measured"] == "yes" for rows in measured for row in rows)
    seen = sum(map(len, measured))
    answer = (
        f"Joint torques are known in {known} of {seen} recorded stances; muscle strengths come "
        "from the barefoot ones.",
    )
    facts = (Fact("Patients" if "," in patients else "Patient", patients), Fact("Date", dates))
    return Page(f"Recorded gait of {patients}", facts, answer, (), tuple(sections))


def _origin(folder: Path) -> dict[str, Any]:
    """Return whose gait a folder holds."""
    if not (folder / ORIGIN).is_file():
        raise DataError(
            f"lacks {ORIGIN}, which says whose gait it is",
            where=str(folder),
            allowed="a folder that `pathwalker id` wrote",
            mend="compute it again",
        )
    origin = read_json(folder / ORIGIN)
    missing = [k for k in ("patient", "age", "body_mass", "height", "method") if k not in origin]
    if missing or not isinstance(origin["body_mass"], int | float) or not origin["body_mass"] > 0.0:
        raise DataError("does not say whose gait it is", where=str(folder / ORIGIN),
                        mend="compute it again")  # fmt: skip
    return {"date": "not kept", **origin}


def _sections(folder: Path, origin: Mapping[str, Any], index: int) -> list[Section]:
    """Return everything about one folder."""
    stances = read_rows(folder / "stances.csv", _STANCES)
    who = str(origin["patient"])
    facts = tuple(
        Fact(label, f"{_plain(origin[key])} {unit}".strip())
        for label, key, unit in (
            ("Age", "age", "years"), ("Mass", "body_mass", "kg"), ("Height", "height", "m"),
            ("Method", "method", ""),
        )
    )  # fmt: skip
    sections = [Section(f"Recorded stances, {who}", facts=facts, tables=(_stance_table(stances),))]
    drawings = [
        drawing
        for condition in CONDITIONS
        for drawing in _torques(folder, condition, stances, origin, index)
    ]
    if drawings:
        sections.append(Section(f"Net joint torques, {who}", drawings=tuple(drawings)))
    if (folder / "strengths.csv").is_file():
        rows = read_rows(folder / "strengths.csv", _STRENGTHS)
        sections.append(Section(f"Muscle strengths, {who}", tables=(_strength_table(rows),)))
    if (folder / "residuals.csv").is_file():
        rows = read_rows(folder / "residuals.csv", _RESIDUALS)
        sections.append(Section(f"Pelvis residuals, {who}", tables=(_residual_table(rows),)))
    try:
        sections += _readings(folder, who)
    except (LookupError, TypeError, ValueError) as problem:
        what = f"holds a *{READING} that cannot be used: {problem}"
        raise DataError(what, where=str(folder), mend="compute it again") from None
    notes = [str(note) for note in origin.get("notes") or ()]
    versions = ", ".join(f"{n} {v}" for n, v in (origin.get("versions") or {}).items())
    lines = (*(f"{note}." for note in notes), *([f"Versions: {versions}."] if versions else []))
    sections.append(Section(f"What was assumed, {who}", tuple(lines)))
    return sections


def _plain(value: Any) -> str:
    return f"{value:g}" if isinstance(value, int | float) else str(value)


def _stance_table(rows: Rows) -> Table:
    """Return how many stances were recorded and measured, and why the others were not."""
    table_rows = []
    for condition in dict.fromkeys(row["condition"] for row in rows):
        for side in SIDES:
            own = [r for r in rows if (r["condition"], r["side"]) == (condition, side)]
            known = [row for row in own if row["measured"] == "yes"]
            why = Counter(row["reason"] for row in own if row["measured"] != "yes")
            reasons = "; ".join(f"{count}: {reason}" for reason, count in why.most_common())
            trials = len({row["trial"] for row in own})
            cells = (condition, side, str(trials), str(len(own)), str(len(known)), reasons or "-")
            table_rows.append(Row(cells))
    head = ("condition", "side", "trials", "stances", "measured", "why not measured")
    return Table(head, tuple(table_rows), columns="wwnnnp")


def _torques(
    folder: Path, condition: Condition, stances: Rows, origin: Mapping[str, Any], index: int
) -> list[Drawing]:
    """Return the figure of the torques of a condition, none without measured strides."""
    try:
        trials = read_trials(folder, condition, stances)
    except (ValueError, KeyError) as problem:
        raise DataError(f"cannot be used: {problem}", where=str(folder / condition)) from None
    if not any(trial.tau and any(map(trial.measured, trial.cycles)) for trial in trials):
        return []
    title = (
        f"Net joint torques [N m/kg] over the gait cycle, {condition}: {origin['patient']}, mean "
        "and range of the measured strides"
    )
    name = f"torques-{index}-{condition}"
    return [torque_drawing(trials, float(origin["body_mass"]), name, title)]


def _readings(folder: Path, who: str) -> list[Section]:
    """Return how C3D files were read, and ours beside their laboratory's angles and moments."""
    found = [read_json(path) for path in sorted(folder.glob(f"*/*{READING}"))]
    said = tuple(
        f"{reading['condition']}, {reading['trial']}: {sentence}."
        for reading in found
        for sentence in (*reading.get("notes", ()), *reading.get("warnings", ()))
    )
    tables = [
        Table(("", *(f"{what}, {side}" for what in SHOWN.values() for side in SIDES)),
              tuple(Row((f"{condition}, {name}", *cells)) for name, cells in rows))
        for condition in CONDITIONS
        if (rows := laboratory_rows(
            Difference(**each) for reading in found if reading["condition"] == condition
            for each in reading.get("laboratory", ())
        ))
    ]  # fmt: skip
    sections = [Section(f"Beside the laboratory's own model, {who}", tables=tuple(tables))]
    read = [Section(f"How the files were read, {who}", said)]
    return sections * bool(tables) + read * bool(said)


def _strength_table(rows: Rows) -> Table:
    table_rows = tuple(
        Row((_muscles(row["generator"]), number(row, "strength", ".1f"),
             number(row, "patient file", ".1f"), number(row, "deviation", "+.0f"),
             row["stances"] or "-", _span(row), row["remark"] or "-"))
        for row in rows
    )  # fmt: skip
    head = ("muscle group", "strength [N m]", "patient's file [N m]", "deviation [%]", "stances",
            "single stances [N m]", "remark")  # fmt: skip
    return Table(head, table_rows, columns="wnnnnnp")


def _muscles(generator: str) -> str:
    """Return "hip extension, right" for "hip_extension_r"."""
    for side in SIDES:
        if generator.endswith(f"_{SUFFIX[side]}"):
            return f"{generator[:-2].replace('_', ' ')}, {side}"
    return generator.replace("_", " ")


def _span(row: Mapping[str, str]) -> str:
    """Return what single stances give, "-" without any."""
    ends = [number(row, f"{end} of single stances", ".1f") for end in ("least", "largest")]
    return "-" if "-" in ends else " to ".join(ends)


def _residual_table(rows: Rows) -> Table:
    """Return what inverse dynamics leaves over, means over trials."""
    table_rows = tuple(
        Row((f"{row['condition']}, {row['part']}, {row['trial']}",
             number(row, "forward mean", ".1f"), number(row, "up mean", ".1f"),
             number(row, "moment mean", ".2f")))
        for row in rows
        if row["trial"].endswith("over trials")
    )  # fmt: skip
    return Table(("", "forward [N]", "up [N]", "moment [N m]"), table_rows)
