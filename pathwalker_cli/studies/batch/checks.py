"""What can be known of a case without solving it: whether patient, problem and overrides fit."""

from __future__ import annotations

from pathlib import Path

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.errors import ConfigError, InputError, PatientError, placed
from pathwalker_cli.gait.bounds import gait_bounds
from pathwalker_cli.gait.recorded import recorded_passage, recorded_stride, start_recording
from pathwalker_cli.gait.symmetry import require_symmetry
from pathwalker_cli.model.walker import Walker
from pathwalker_cli.results.run_folder import warm_start_run

__all__ = ["check_case", "check_patient", "check_warm_start"]


def check_case(name: str, case: Case, where: str) -> None:
    """Refuse a case that could not even begin.

    Args:
        name: Its name, for the message.
        case: Config and patient.
        where: The study, for the message.

    Raises:
        InputError: If the patient lacks what the problem needs, or a value does not fit.
    """
    config = case.config
    with placed(f"{where}, case {name}"):
        check_patient(case)
        _check_starts(config)
        walker = case.walker(config.model.backend)
        gait_bounds(walker, config.bounds, config.free)
        _check_start(config, walker)


def check_patient(case: Case) -> None:
    """Refuse a patient without what the problem needs.

    Raises:
        PatientError: If orthosis or strengths lack.
    """
    config, patient = case.config, case.unvaried
    if config.condition == "orthosis" and patient.orthosis is None:
        raise PatientError(
            f"patient {patient.id} has no orthosis, which problem {config.problem} needs",
            where=str(patient.source),
            mend="add the orthosis to the file, or choose a barefoot problem for this patient",
        )
    _ = patient.max_isometric_torque


def _check_starts(config: StudyConfig) -> None:
    """Refuse a config for several processes.

    Raises:
        ConfigError: If so.
    """
    if config.starts > 1:
        raise ConfigError(
            f"is {config.starts}",
            where="starts",
            allowed="1, as the cores belong to the cases",
            mend="spread the starts as cases, e.g. grid: {start.knee_flexion: [0.5, 0.7, 0.9]}",
        )


def _check_start(config: StudyConfig, walker: Walker) -> None:
    """Refuse half a cycle of unequal sides, and a recorded start without a recording.

    Raises:
        InputError: If so.
    """
    if config.half_cycle:
        require_symmetry(walker)
    if config.start.gait == "recorded":
        recording = start_recording(walker, config.start)
        (recorded_passage if config.fits else recorded_stride)(walker, recording)


def check_warm_start(folder: Path, config: StudyConfig, where: str) -> None:
    """Refuse an earlier run that the cases of a problem cannot begin with.

    Raises:
        InputError: If it is missing, damaged, not converged or about something else.
    """
    try:
        warm_start_run(folder, config)
    except InputError as error:
        inner = error.where.removeprefix("--warm-start").strip()
        place = f"{where}: {inner}" if inner else where
        raise error.at(place) from None
