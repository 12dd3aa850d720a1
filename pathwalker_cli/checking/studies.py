"""Configs of studies: each read by what its command reads it with, and what it would solve."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pathwalker_cli.checking.prediction import described, ready_solver
from pathwalker_cli.checking.report import Changes, Checked, Row, walker_rows
from pathwalker_cli.errors import placed
from pathwalker_cli.studies.base import base_case, load_study
from pathwalker_cli.studies.batch.cases import load_cases
from pathwalker_cli.studies.registry import STUDIES


def check_study(command: str, path: str, changes: Changes = ()) -> Checked:
    """Return what the command of a study around an optimum would do."""
    entry = STUDIES[command]
    kind = entry.load()
    study = load_study(path, kind.model, changes)
    with placed(f"{path}, base"):
        case = base_case(study)
        kind.require(case.config, study.base)
    solver = ready_solver(study.solved_as(case), f"{path}, base {Path(study.base).name}")
    with placed(path):
        plan = kind.plan(study, solver)
    base = described(solver, path)
    about = f"{'at least ' * plan.least}{plan.solves}"
    begin = f"{solver.config.problem}, {solver.walker.condition}, solved unless --run is given"
    rows: list[Row] = [
        ("base", begin),
        *walker_rows(solver.walker),
        ("does", plan.does),
        ("solves", f"{about} neighbours of the base, each from its solution"),
        ("expected time", f"for the base {dict(base.rows)['expected time']}"),
    ]
    content = {"base": base.content, "solves": plan.solves, "solves_are_least": plan.least,
               "does": plan.does}  # fmt: skip
    return Checked(path, entry.name, tuple(rows), content, base.notes)


def check_batch(path: str, changes: Changes = ()) -> Checked:
    """Return what `batch` would do; every case is checked as a prediction is."""
    batch = load_cases(path, changes)
    notes: list[str] = []
    seconds = 0.0
    for case in batch.cases:
        checked = described(ready_solver(case.study, f"{path}, case {case.name}"), path)
        seconds += checked.content["expected_seconds"]["likely"]
        notes += [note for note in checked.notes if note not in notes]
    names = [case.name for case in batch.cases]
    patients = list(dict.fromkeys(case.patient for case in batch.cases))
    problems = list(dict.fromkeys(case.problem for case in batch.cases))
    expected = f"about {seconds:.0f} s of one core in all, on the machine of docs/performance.md"
    rows: list[Row] = [
        ("patients", f"{len(patients)}: {', '.join(patients)}"),
        ("problems", ", ".join(problems)),
        ("solves", f"{len(names)} cases: {', '.join(names)}"),
        ("expected time", expected),
    ]
    content: dict[str, Any] = {
        "patients": patients,
        "problems": problems,
        "cases": names,
        "solves": len(names),
        "expected_seconds": {"likely": round(seconds, 1)},
    }
    return Checked(path, "study of many cases", tuple(rows), content, tuple(notes))
