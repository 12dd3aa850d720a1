"""The command `doctor`: whether everything is there and works."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import click

from pathwalker_cli.commands.options import json_option, print_json


@dataclass(frozen=True)
class Finding:
    """One thing that was looked at, what was found, or what is missing and how to get it.

    Without what is needed nothing can be solved.
    """

    name: str
    ok: bool
    needed: bool
    detail: str


@click.command("doctor")
@json_option
@click.pass_context
def doctor_command(context: click.Context, as_json: bool) -> None:
    """Check versions, dynamics back ends, solver and shipped data; exit code 0 if all is usable."""
    all_findings = findings()
    usable = all(finding.ok for finding in all_findings if finding.needed)
    if as_json:
        print_json({"usable": usable, "findings": [asdict(finding) for finding in all_findings]})
    else:
        for finding in all_findings:
            mark = "ok" if finding.ok else ("MISSING" if finding.needed else "-")
            click.echo(f"{mark:<8}{finding.name:<28}{finding.detail}")
        click.echo("PathWalker is ready." if usable else "PathWalker cannot solve problems here.")
    context.exit(0 if usable else 1)


def findings() -> tuple[Finding, ...]:
    """Look at everything; what breaks is reported instead of raised."""
    parts = (_versions, _backends, _solver, _speed, _data)
    return tuple(finding for part in parts for finding in _looked_at(part))


def _looked_at(part: Callable[[], list[Finding]]) -> list[Finding]:
    """Return what a check found; a library that does not load is a finding too."""
    from pathwalker_cli.errors import PathwalkerError

    try:
        return part()
    except (ImportError, OSError, PathwalkerError) as error:
        name = part.__name__.removeprefix("_")
        return [Finding(name, ok=False, needed=True, detail=" ".join(str(error).split()))]


def _versions() -> list[Finding]:
    from pathwalker_cli.versions import MISSING, versions

    return [Finding(name, text != MISSING, True, text) for name, text in versions().items()]


def _backends() -> list[Finding]:
    from pathwalker_cli.model.backends import backend_report

    reports = backend_report()
    at_work = next((report.name for report in reports if report.available), "")
    entries = [Finding(f"dynamics {r.name}", r.available, False, r.detail) for r in reports]
    detail = f"{at_work} is at work" if at_work else "no back end can be used"
    return [*entries, Finding("dynamics", bool(at_work), True, detail)]


def _solver() -> list[Finding]:
    import casadi as ca

    if not ca.has_nlpsol("ipopt"):
        return [Finding("IPOPT", False, True, "CasADi came without it: install casadi with pip")]
    x = ca.SX.sym("x")
    options: dict[str, Any] = {
        "ipopt": {"linear_solver": "mumps", "print_level": 0, "sb": "yes"},
        "print_time": False,
        "error_on_fail": False,
    }
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "f": (x - 1.0) ** 2}, options)
    solution = solver(x0=0.0)
    ok = bool(solver.stats()["success"]) and abs(float(solution["x"]) - 1.0) < 1e-6
    detail = "solved a test problem" if ok else "failed on a test problem: install casadi again"
    return [Finding("IPOPT with MUMPS", ok, True, detail)]


def _speed() -> list[Finding]:
    from pathwalker_cli.nlp.kernels import kernels_path
    from pathwalker_cli.nlp.tape_store import cache_folder, kept_files

    path, folder = kernels_path(), cache_folder()
    slow = "none: solves take several times as long; install again with a C++ compiler at hand"
    kernels = Finding("compiled kernels", path is not None, False, path.name if path else slow)
    if folder is None:
        return [
            kernels,
            Finding("derivatives cache", False, False, "off: PATHWALKER_CACHE says so"),
        ]
    files = kept_files(folder)
    size = sum(file.stat().st_size for file in files) / 1e6
    detail = f"{folder}: {len(files)} files, {size:.0f} MB"
    return [kernels, Finding("derivatives cache", True, False, detail)]


def _data() -> list[Finding]:
    from pathwalker_cli.paths import shipped
    from pathwalker_cli.patient import load_patient, shipped_patients

    configs = sorted(path.stem for path in shipped("configs").glob("*.yaml"))
    patients = shipped_patients()
    for patient in patients:
        load_patient(patient)
    lost = "none: install pathwalker-cli again"
    return [
        Finding("shipped configs", bool(configs), True, ", ".join(configs) or lost),
        Finding("shipped patients", bool(patients), True, ", ".join(patients) or lost),
    ]
