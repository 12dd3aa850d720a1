"""The page about one patient: recommended springs, gait, curves, studies, assumptions."""

from __future__ import annotations

from collections.abc import Sequence

from pathwalker_cli.conventions import SIDES, STIFFNESSES, to_degrees
from pathwalker_cli.evaluation.evaluate import Change, changes_between
from pathwalker_cli.evaluation.tables import spread_text
from pathwalker_cli.report.assumptions import assumption_section
from pathwalker_cli.report.content import Fact, Page, Row, Section, Table
from pathwalker_cli.report.figures import curve_section
from pathwalker_cli.report.folders import Study
from pathwalker_cli.report.runs import ReportRun
from pathwalker_cli.report.springs import prescribed, recommended, spring_section
from pathwalker_cli.report.study_tables import study_section
from pathwalker_cli.stride.measure import KNEE, Measure
from pathwalker_cli.stride.measures import measure_of, measures_in
from pathwalker_cli.studies.verdict import snapped_warning


def gait_page(runs: Sequence[ReportRun], studies: Sequence[Study] = ()) -> Page:
    """Return the page about runs of one patient, barefoot ones first, with studies around them."""
    patient, changes = runs[0].patient, changes_between([r.evaluation for r in runs])
    with_orthoses = [run for run in runs if run.worn]
    sections = [spring_section(run) for run in with_orthoses]
    sections += [gait_section(runs, changes), curve_section(runs)]
    sections += [study_section(study, _base(study, runs)) for study in studies]
    sections.append(assumption_section(runs))
    facts = (
        Fact("Patient", patient.id),
        Fact("Age", f"{patient.age:g} years"),
        Fact("Mass", f"{patient.body_mass:g} kg"),
        Fact("Height", f"{patient.height:g} m"),
        *_of_runs(runs),
    )
    answer = " ".join(_answer(run, changes) for run in with_orthoses or runs)
    return Page(f"Gait of {patient.id}", facts, answer, tuple(_warnings(runs)), tuple(sections))


def _base(study: Study, runs: Sequence[ReportRun]) -> ReportRun:
    """Return the run that a study stands on."""
    return next((run for run in runs if study.stands_on(run.run.metrics)), runs[-1])


def _of_runs(runs: Sequence[ReportRun]) -> list[Fact]:
    """Return problem and date of every run; one date where they agree."""
    problems = ", ".join(f"{run.run.config.problem} ({run.label})" for run in runs)
    dates = dict.fromkeys(run.date for run in runs)
    if len(dates) == 1:
        date = next(iter(dates))
    else:
        date = ", ".join(f"{run.date} ({run.label})" for run in runs)
    return [Fact("Problems" if len(runs) > 1 else "Problem", problems), Fact("Date", date)]


def _answer(run: ReportRun, changes: Sequence[Change]) -> str:
    """Return what a run says in one sentence."""
    row = run.evaluation.row
    speed = row("walking_speed").measure.text(row("walking_speed").value)
    knees = " and ".join(
        f"{to_degrees(row(f'min_stance_knee_flexion_{side}').value or 0.0):.1f} deg {side}"
        for side in SIDES
    )
    gait = f"at {speed} m/s with a least stance knee flexion of {knees}"
    if not run.worn:
        return f"Predicted {run.label} gait walks {gait}."
    effort = next((c for c in changes if c.measure.key == "effort_per_distance"), None)
    saved = ""
    if effort is not None:
        values = [effort.measure.text(v) for v in (effort.barefoot, effort.orthosis)]
        saved = f", with {values[1]} s/m of effort instead of {values[0]} barefoot"
        saved += f" ({effort.percent} %)"
    real = run.verdict is not None and run.verdict.snapped is not None
    kind = "Springs to take" if real else "Springs found"
    if all(prescribed(run, name) for name in STIFFNESSES):
        kind = "Springs worn"
    return f"{kind}: {_springs(run)}; predicted gait walks {gait}{saved}."


def _springs(run: ReportRun) -> str:
    """Return the springs with how sure they are, sides that agree together."""
    stiffness, verdict = recommended(run), run.verdict
    sure = {name: "prescribed" for name in STIFFNESSES if prescribed(run, name)}
    sure |= {s.name: s.determined for s in verdict.springs} if verdict else {}
    parts: dict[str, list[str]] = {}
    for name, value in stiffness.items():
        kind, _, side = measure_of(name).label.rpartition(" ")
        words = f"{kind} {value:.1f} N m/rad"
        words += f" ({sure[name]})" if name in sure else ""
        parts.setdefault(words, []).append(side)
    return ", ".join(f"{words} {' and '.join(sides)}" for words, sides in parts.items())


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


def gait_section(runs: Sequence[ReportRun], changes: Sequence[Change]) -> Section:
    """Return the table of steps, times, crouch, forces and effort."""
    head, columns = ["", "unit"], "ww"
    for run in runs:
        head += [run.label, *(["recorded, mean [min, max]", "is"] if _compared(run) else [])]
        columns += "nnw" if _compared(run) else "n"
    if changes:
        head += ["change", "[%]", "recorded change"]
        columns += "nnn"
    rows = [_row(measure, runs, changes) for measure in measures_in("report")]
    notes = ["BW: body weight with what is worn; is: below, in or above the recorded range"]
    notes += [note for run in runs for note in run.evaluation.notes]
    found = tuple(row for row in rows if row is not None)
    table = Table(tuple(head), found, notes=tuple(dict.fromkeys(notes)), columns=columns)
    return Section("Gait", tables=(table,))


def _compared(run: ReportRun) -> bool:
    return run.evaluation.recorded is not None


def _row(measure: Measure, runs: Sequence[ReportRun], changes: Sequence[Change]) -> Row | None:
    """Return the row of a measure, None if no run tells it."""
    found = [
        next((row for row in run.evaluation.rows if row.measure.key == measure.key), None)
        for run in runs
    ]
    if not any(found):
        return None
    label = measure.label.replace("flexion", "flexion (crouch)", measure.section == KNEE)
    cells = [label, measure.shown_unit]
    for run, row in zip(runs, found, strict=True):
        cells.append(measure.text(row.value if row else None))
        if _compared(run):
            cells.append(spread_text(row.recorded if row else None, measure))
            cells.append((row.position or "") if row else "")
    if changes:
        change = next((c for c in changes if c.measure.key == measure.key), None)
        value, recorded = (change.value, change.recorded) if change else (None, None)
        cells += [measure.text(value, sign=True), (change and change.percent) or "-"]
        cells.append(measure.text(recorded, sign=True))
    return Row(tuple(cells))
