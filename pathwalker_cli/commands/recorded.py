"""Commands about recorded gait: `import`, `ik` and `id`."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from pathwalker_cli.commands.complete import complete_configs, complete_patients
from pathwalker_cli.commands.options import (
    json_option,
    meant_as,
    out_option,
    print_json,
    set_option,
)
from pathwalker_cli.conventions import CONDITIONS, Condition

if TYPE_CHECKING:
    from rich.console import RenderableType

    from pathwalker_cli.inverse.c3d_trials import Progress
    from pathwalker_cli.inverse.strengths import StrengthTable
    from pathwalker_cli.inverse.study import RecordedConfig
    from pathwalker_cli.inverse.trial import Trial
    from pathwalker_cli.patient import Patient

    Config = TypeVar("Config", bound=RecordedConfig)

_OUT = out_option("Output folder.", metavar=None)
_QUIET = click.option("--quiet", is_flag=True, help="Print warnings only.")
_SET = set_option("Override a config value.")


@click.command("import")
@click.argument("c3d", nargs=-1, required=True, metavar="C3D...")
@click.option(
    "--patient",
    required=True,
    help="Shipped id, folder with patient.yaml, or a file.",
    shell_complete=complete_patients,
)
@click.option("--condition", required=True, type=click.Choice(CONDITIONS), help="What was worn.")
@out_option("Output folder.", "-o", required=True, metavar=None)
@click.option("--markers", help="Marker set, a file; by the markers' names if left out.")
@click.option("--subject", metavar="NAME", help="Whose markers, if a file names several.")
@click.option("--mend-plates", is_flag=True, help="Mend plates that are stored wrongly.")
@click.option(
    "--exchange",
    is_flag=True,
    help="Also write .trc, plates as .mot, and C3D copies that hold our angles and moments.",
)
@_QUIET
@json_option
def import_command(
    c3d: tuple[str, ...],
    patient: str,
    condition: Condition,
    out: Path,
    markers: str | None,
    subject: str | None,
    mend_plates: bool,
    exchange: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Turn C3D files, or folders of them, into angles, events and forces.

    Beside a patient's file, in recordings/barefoot or recordings/orthosis, they are found by id and
    by the problems that start from recorded gait.
    """
    from pathwalker_cli.inverse.files import write_exchange, write_trial
    from pathwalker_cli.inverse.study import Paths, RecordedConfig
    from pathwalker_cli.inverse.trials import kinematics_trials, with_torques

    def write(folder: Path, trials: Sequence[Trial], who: Patient) -> None:
        for trial in trials:
            write_trial(folder, trial, who, config.largest_marker_distance)
            if exchange:
                write_exchange(folder, with_torques(trial, who), who.body_mass)

    files = Paths.model_validate({condition: c3d})
    config = RecordedConfig(
        patient=patient,
        conditions=(condition,),
        c3d=files,
        markers=markers,
        subject=subject,
        mend_plates=mend_plates,
    )
    _study(config, kinematics_trials, write, out, quiet, as_json)


@click.command("ik")
@click.argument("config", metavar="CONFIG", shell_complete=complete_configs)
@_OUT
@_SET
@_QUIET
@json_option
def ik_command(
    config: str, out: Path | None, changes: tuple[str, ...], quiet: bool, as_json: bool
) -> None:
    """Compute joint angles from the markers of the C3D files that CONFIG names."""
    from pathwalker_cli.inverse.files import write_kinematics
    from pathwalker_cli.inverse.study import load_inverse_kinematics
    from pathwalker_cli.inverse.trials import kinematics_trials

    def write(folder: Path, trials: Sequence[Trial], patient: Patient) -> None:
        write_kinematics(folder, trials, patient, study.largest_marker_distance)

    with meant_as("inverse-kinematics", config):
        study = load_inverse_kinematics(config, changes)
    _study(study, kinematics_trials, write, out or Path("runs", study.study), quiet, as_json)


@click.command("id")
@click.argument("config", metavar="CONFIG", shell_complete=complete_configs)
@_OUT
@_SET
@click.option(
    "--update-patient",
    is_flag=True,
    help="Put strengths, speed, steps and joint ranges into the patient's file.",
)
@_QUIET
@json_option
def id_command(
    config: str,
    out: Path | None,
    changes: tuple[str, ...],
    update_patient: bool,
    quiet: bool,
    as_json: bool,
) -> None:
    """Compute joint torques, pelvis residuals and muscle strengths from recorded gait.

    With --update-patient the blocks `strengths` and `recorded` of the patient's file are replaced,
    or added; everything else in it, comments too, stays as it is.
    """
    from pathwalker_cli.inverse.files import write_dynamics
    from pathwalker_cli.inverse.recorded import require_own_patient
    from pathwalker_cli.inverse.residuals import residual_tables, study_warnings
    from pathwalker_cli.inverse.strengths import strength_table
    from pathwalker_cli.inverse.study import load_inverse_dynamics
    from pathwalker_cli.inverse.text import (
        dynamics_content,
        residuals_renderable,
        strengths_renderable,
    )
    from pathwalker_cli.inverse.trials import dynamics_trials
    from pathwalker_cli.patient import load_patient

    def write(folder: Path, trials: Sequence[Trial], patient: Patient) -> _Findings:
        tables = residual_tables(trials, patient, study)
        strengths = strength_table(trials, patient, study)
        write_dynamics(folder, trials, tables, strengths, patient, study)
        warnings = study_warnings(trials, tables, patient, study.largest_residual)
        shown = (residuals_renderable(tables), strengths_renderable(strengths))
        changed = _updated(patient, trials, strengths, study.method) if update_patient else ""
        return _Findings(warnings, shown, changed, dynamics_content(tables, strengths))

    with meant_as("inverse-dynamics", config):
        study = load_inverse_dynamics(config, changes)
    if update_patient:
        require_own_patient(load_patient(study.patient))
    _study(study, dynamics_trials, write, out or Path("runs", study.study), quiet, as_json)


def _updated(patient: Patient, trials: Sequence[Trial], table: StrengthTable, method: str) -> str:
    """Put what was found into the patient's file; return a sentence about it."""
    from pathwalker_cli.inverse.files import strengths_source
    from pathwalker_cli.inverse.recorded import recorded_blocks, require_own_patient, update_patient

    path, blocks = require_own_patient(patient), recorded_blocks(patient, trials)
    update_patient(path, table.strengths, strengths_source(method), blocks)
    new = ["strengths"] * (table.strengths is not None)
    new.append(f"recorded gait ({', '.join(blocks)})")
    return f"Updated {path}: {' and '.join(new)}"


@dataclass(frozen=True)
class _Findings:
    """What a command has to say beside the table of trials."""

    warnings: Sequence[str] = ()
    tables: Sequence[RenderableType] = ()
    changed: str = ""
    content: Mapping[str, Any] = field(default_factory=dict)


def _study(
    config: Config,
    evaluate: Callable[[Config, Patient, Progress], Sequence[Trial]],
    write: Callable[[Path, Sequence[Trial], Patient], _Findings | None],
    out: Path,
    quiet: bool,
    as_json: bool,
) -> None:
    """Evaluate the trials of a config, write all files or none, and report."""
    from rich.console import Console

    from pathwalker_cli.inverse.text import (
        laboratory_renderable,
        stance_notes,
        trial_content,
        trials_renderable,
        warnings,
    )
    from pathwalker_cli.io.atomic import staged_folder
    from pathwalker_cli.patient import load_patient

    patient, limit = load_patient(config.patient), config.largest_marker_distance
    with staged_folder(out) as folder:
        with Console(stderr=True, quiet=quiet).status("") as status:
            trials = evaluate(config, patient, status.update)
        findings = write(folder, trials, patient) or _Findings()
    if as_json:
        print_json(
            {
                "folder": str(out),
                "trials": [trial_content(trial, patient, limit) for trial in trials],
                **findings.content,
                "updated": findings.changed or None,
                "warnings": list(findings.warnings),
            }
        )
    # As wide as the terminal, or wide enough without one.
    console = Console(quiet=quiet or as_json, width=None if Console().is_terminal else 120)
    said = [
        f"note: {trial.name}: {note}"
        for trial in trials
        for note in (*trial.remarks, *stance_notes(trial))
    ]
    beside = laboratory_renderable(trials, patient.body_mass)
    ends = [f"Written to {out}", *filter(None, [findings.changed])]
    for part in (trials_renderable(trials), *said, beside, *findings.tables, *ends):
        plain = isinstance(part, str)
        if part is not None:
            console.print(part, soft_wrap=plain, markup=not plain, highlight=not plain)
    every = [
        f"{trial.name}: {w}" for trial in trials for w in warnings(trial, patient.height, limit)
    ]
    for warning in (*every, *findings.warnings):
        click.echo(f"warning: {warning}", err=True)
