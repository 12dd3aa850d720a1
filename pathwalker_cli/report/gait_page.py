"""The page about one patient: the answer, springs, changes, curves, studies, assumptions."""

from __future__ import annotations

from collections.abc import Sequence

from pathwalker_cli.conventions import worn_words
from pathwalker_cli.report.answer import answer, hinge_section
from pathwalker_cli.report.assumptions import assumption_section
from pathwalker_cli.report.changes import JUDGED, change_section, outcomes
from pathwalker_cli.report.content import Fact, Page, Row, Section, Table
from pathwalker_cli.report.figures import curve_section, walk_section
from pathwalker_cli.report.folders import Study
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.report.springs import spring_section
from pathwalker_cli.report.study_tables import study_section
from pathwalker_cli.stride.measure import Measure
from pathwalker_cli.stride.measures import expanded, measures_in
from pathwalker_cli.studies.verdict.words import snapped_warning, stop_sentence


def gait_page(runs: Sequence[ReportRun], studies: Sequence[Study] = ()) -> Page:
    """Return the page about runs of one patient, barefoot ones first, with studies around them."""
    patient, found = runs[0].patient, outcomes(runs)
    sections = [spring_section(run) for run in runs if run.worn]
    sections += [change_section(runs, found), walk_section(runs), hinge_section(runs, studies)]
    sections += [curve_section(runs), gait_section(runs)]
    for study in studies:
        base = next((run for run in runs if study.stands_on(run.run.metrics)), runs[-1])
        sections.append(study_section(study, base))
    sections.append(assumption_section(runs))
    facts = (
        Fact("Age", f"{patient.age:g} years"),
        Fact("Mass", _mass(runs)),
        Fact("Height", f"{patient.height:g} m"),
        *_of_runs(runs),
    )
    named = ", ".join(
        worn_words(run.braced) if run.label == "orthosis" else run.label for run in runs
    )
    title = f"Gait of {patient.id}: {named}"
    return Page(title, facts, answer(runs, found, studies), tuple(_warnings(runs)), tuple(sections))


def _mass(runs: Sequence[ReportRun]) -> str:
    """Return the body mass, and what it is with what is worn."""
    worn = dict.fromkeys(
        f"{run.evaluation.gait.walker.total_mass:.1f} kg {worn_words(run.braced)}"
        for run in runs
        if run.worn
    )
    more = f" ({', '.join(worn)})" if worn else ""
    return f"{runs[0].patient.body_mass:g} kg{more}"


def _of_runs(runs: Sequence[ReportRun]) -> list[Fact]:
    """Return problem and date of every run; one date where they agree."""
    problems = ", ".join(f"{run.run.config.problem} ({run.label})" for run in runs)
    dates = dict.fromkeys(run.date for run in runs)
    date = ", ".join(dates if len(dates) == 1 else (f"{run.date} ({run.label})" for run in runs))
    return [Fact("Problems" if len(runs) > 1 else "Problem", problems), Fact("Date", date)]


def _warnings(runs: Sequence[ReportRun]) -> list[str]:
    """Return what must be known before the answer is used."""
    warnings = []
    for run in runs:
        if run.run.config.smoke:
            warnings.append(
                f"{run.label}: a quick check on a coarse mesh: numbers for orientation only"
            )
        if run.verdict is not None and (warning := snapped_warning(run.verdict)):
            warnings.append(f"{run.label}, springs to take: {warning}")
        if run.verdict is not None and stop_sentence(run.verdict):
            warnings.append(
                f"{run.label}: hard stops carry much of what the orthoses exert; how much, and "
                "what stiffer ones would change, stands below"
            )
        if _coarse(run):
            warnings.append(
                f"{run.label}: an independent integrator misses the mesh by more than the config "
                "asks for: the mesh is too coarse"
            )
        if run.patient_changed:
            warnings.append(
                f"{run.label}: the patient's file is no longer that of the run; this page is about "
                "the patient of the run"
            )
    return warnings


def _coarse(run: ReportRun) -> bool:
    """Return whether re-integration misses the nodes by more than the mesh was to allow."""
    mesh = run.run.config.mesh
    asked = {"position": mesh.position_tolerance, "velocity": mesh.velocity_tolerance}
    reached = {kind: run.run.metrics.get(f"reintegration_{kind}_error") for kind in asked}
    return any(value is not None and value > asked[kind] for kind, value in reached.items())


def gait_section(runs: Sequence[ReportRun]) -> Section:
    """Return the table of times, shares and forces, both sides in one row."""
    head, columns = ["", "unit"], "ww"
    for run in runs:
        recorded = run.evaluation.recorded is not None
        head += [run.label, *(["recorded range", "is"] if recorded else [])]
        columns += "nnw" if recorded else "n"
    judged = {key for family in JUDGED for key in expanded(family)}
    families: dict[str, list[Measure]] = {}
    for measure in measures_in("report"):
        if measure.key not in judged:
            families.setdefault(measure.family, []).append(measure)
    found = tuple(filter(None, (_row(sides, runs) for sides in families.values())))
    notes = ["BW: body weight with what is worn; is: below, in or above the recorded range; two "
             "values: right, left"]  # fmt: skip
    notes += [f"{run.label}: {note}" for run in runs for note in run.evaluation.notes]
    table = Table(tuple(head), found, notes=tuple(dict.fromkeys(notes)), columns=columns)
    return Section("Times and forces", tables=(table,))


def _row(sides: Sequence[Measure], runs: Sequence[ReportRun]) -> Row | None:
    """Return the row of a measure, None if no run tells it."""
    first, cells, told = sides[0], [], False
    for run in runs:
        rows = [run.evaluation.find(measure.key) for measure in sides]
        known = [row for row in rows if row is not None]
        told = told or bool(known)
        cells.append(", ".join(first.text(row.value) for row in known) or "-")
        if run.evaluation.recorded is not None:
            spans = [
                f"{first.text(row.recorded.low)} to {first.text(row.recorded.high)}"
                for row in known
                if row.recorded is not None
            ]
            cells.append(", ".join(spans) or "-")
            cells.append(", ".join(row.position for row in known if row.position) or "-")
    label = first.label.removesuffix(f", {first.side}")
    return Row((label, first.shown_unit, *cells)) if told else None
