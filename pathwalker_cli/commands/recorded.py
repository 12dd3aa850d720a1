"""Commands about recorded gait: `import`, `ik` and `id`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from pathwalker_cli.conventions import CONDITIONS, Condition

if TYPE_CHECKING:
    from pathwalker_cli.inverse.evaluate import StudyTrial
    from pathwalker_cli.inverse.study import InverseDynamicsConfig, RecordedConfig
    from pathwalker_cli.inverse.study_tables import ResidualTable, StrengthTable
    from pathwalker_cli.patient import Patient

__all__ = ["id_command", "ik_command", "import_command"]

_QUIET = click.option("--quiet", is_flag=True, help="Print warnings only.")
_SET = click.option(
    "--set", "changes", multiple=True, metavar="KEY=VALUE", help="Override a config value."
)


@click.command("import")
@click.argument("c3d", nargs=-1, required=True, metavar="C3D...")
@click.option("--patient", required=True, help="Shipped id, folder with patient.yaml, or a file.")
@click.option("--condition", required=True, type=click.Choice(CONDITIONS), help="What was worn.")
@click.option("-o", "--out", required=True, type=click.Path(path_type=Path), help="Output folder.")
@click.option("--markers", help="Marker set; the shipped markers.yaml if left out.")
@_QUIET
def import_command(
    c3d: tuple[str, ...],
    patient: str,
    condition: Condition,
    out: Path,
    markers: str | None,
    quiet: bool,
) -> None:
    """Turn C3D files, or folders of them, into angles, events and forces.

    Beside a patient's file, in recordings/barefoot or recordings/orthosis, they are found by id and
    by the problems that start from recorded gait.
    """
    from pathwalker_cli.inverse.study import Paths, RecordedConfig
    from pathwalker_cli.output.recorded_files import staged_folder, write_trial
    from pathwalker_cli.patient import load_patient

    who = load_patient(patient)
    config = RecordedConfig(
        patient=patient,
        conditions=(condition,),
        c3d=Paths.model_validate({condition: c3d}),
        markers=markers,
    )
    with staged_folder(out) as folder:
        trials = _kinematics(config, who, quiet)
        for trial in trials:
            write_trial(folder, trial)
    _report(trials, who, config, quiet, out)


@click.command("ik")
@click.argument("config", metavar="CONFIG")
@click.option("--out", type=click.Path(path_type=Path), help="Output folder.")
@_SET
@_QUIET
def ik_command(config: str, out: Path | None, changes: tuple[str, ...], quiet: bool) -> None:
    """Compute joint angles from the markers of the C3D files that CONFIG names."""
    from pathwalker_cli.inverse.study import load_inverse_kinematics
    from pathwalker_cli.output.recorded_figures import save_recorded_figures
    from pathwalker_cli.output.recorded_files import (
        by_condition,
        staged_folder,
        write_marker_table,
        write_trial,
    )
    from pathwalker_cli.patient import load_patient

    study = load_inverse_kinematics(config, changes)
    who = load_patient(study.patient)
    target = out or Path("runs") / "inverse-kinematics"
    with staged_folder(target) as folder:
        trials = _kinematics(study, who, quiet)
        for condition, own in by_condition(trials).items():
            for trial in own:
                write_trial(folder / condition, trial)
            save_recorded_figures(own, folder / condition, who.body_mass)
        write_marker_table(folder / "marker_residuals.csv", trials)
    _report(trials, who, study, quiet, target)


@click.command("id")
@click.argument("config", metavar="CONFIG")
@click.option("--out", type=click.Path(path_type=Path), help="Output folder.")
@_SET
@_QUIET
def id_command(config: str, out: Path | None, changes: tuple[str, ...], quiet: bool) -> None:
    """Compute joint torques, pelvis residuals and muscle strengths from recorded gait."""
    from pathwalker_cli.inverse.evaluate import dynamics_trials
    from pathwalker_cli.inverse.study import load_inverse_dynamics
    from pathwalker_cli.inverse.study_tables import (
        residual_tables,
        strength_table,
        study_warnings,
    )
    from pathwalker_cli.output.recorded_files import staged_folder
    from pathwalker_cli.output.recorded_text import residuals_renderable, strengths_renderable
    from pathwalker_cli.patient import load_patient

    study = load_inverse_dynamics(config, changes)
    who = load_patient(study.patient)
    target = out or Path("runs") / "inverse-dynamics"
    with staged_folder(target) as folder:
        trials = _watched(quiet, lambda progress: dynamics_trials(study, who, progress))
        tables = residual_tables(trials, who, study)
        strengths = strength_table(trials, who, study)
        _write_dynamics(folder, trials, tables, strengths, who, study)
    warnings = study_warnings(trials, tables, who, study.largest_residual)
    _report(trials, who, study, quiet, target, warnings)
    if not quiet:
        _show(residuals_renderable(tables))
        if strengths.rows:
            _show(strengths_renderable(strengths))
        else:
            click.echo(f"No strengths: {strengths.reason}.")


def _write_dynamics(
    folder: Path,
    trials: Sequence[StudyTrial],
    tables: Sequence[ResidualTable],
    strengths: StrengthTable,
    patient: Patient,
    config: InverseDynamicsConfig,
) -> None:
    """Write all files of an inverse dynamics study."""
    from pathwalker_cli.output import recorded_files as files
    from pathwalker_cli.output.recorded_figures import save_recorded_figures

    for condition, own in files.by_condition(trials).items():
        for trial in own:
            files.write_trial(folder / condition, trial)
        save_recorded_figures(own, folder / condition, patient.body_mass)
    files.write_residuals(folder / "residuals.csv", tables)
    files.write_stances(folder / "stances.csv", trials)
    if any(trial.markers for trial in trials):
        files.write_marker_table(folder / "marker_residuals.csv", trials)
    if strengths.strengths is not None:
        files.write_strengths(folder / "strengths.csv", strengths)
        source = f"inverse dynamics of recorded barefoot gait, method {config.method}"
        files.write_strengths_yaml(folder / "strengths.yaml", strengths.strengths, source)


def _kinematics(config: RecordedConfig, patient: Patient, quiet: bool) -> tuple[StudyTrial, ...]:
    """Return the trials of a config with the one at work shown."""
    from pathwalker_cli.inverse.evaluate import kinematics_trials

    return _watched(quiet, lambda progress: kinematics_trials(config, patient, progress))


def _watched(
    quiet: bool, work: Callable[[Callable[[str], None]], tuple[StudyTrial, ...]]
) -> tuple[StudyTrial, ...]:
    """Do work that names its trials; show the one at work on a terminal."""
    from rich.console import Console

    with Console(stderr=True, quiet=quiet).status("") as status:
        return work(lambda name: status.update(name))


def _report(
    trials: Sequence[StudyTrial],
    patient: Patient,
    config: RecordedConfig,
    quiet: bool,
    out: Path,
    more: Sequence[str] = (),
) -> None:
    """Print the table of trials, what to know about them and where the files are."""
    from pathwalker_cli.output.recorded_text import (
        stance_notes,
        trial_warnings,
        trials_renderable,
    )

    if not quiet:
        _show(trials_renderable(trials))
        for note in stance_notes(trials):
            click.echo(f"note: {note}")
        click.echo(f"Written to {out}")
    limit = config.largest_marker_distance
    for warning in (*trial_warnings(trials, patient.height, limit), *more):
        click.echo(f"warning: {warning}", err=True)


def _show(renderable: Any) -> None:
    """Print something of rich, as wide as the terminal, or wide enough without one."""
    from rich.console import Console

    console = Console()
    if not console.is_terminal:
        console = Console(width=120)
    console.print(renderable)
