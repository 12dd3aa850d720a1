"""The runs of a report, read and compared with the recordings of their patient."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import cached_property
from pathlib import Path
from typing import Any

from pathwalker_cli.conventions import Side
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.evaluation.evaluate import Evaluation, evaluate_gait
from pathwalker_cli.evaluation.run import run_and_gait
from pathwalker_cli.patient import Patient, load_patient
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.verdict import Verdict, verdict_of_metrics


@dataclass(frozen=True)
class ReportRun:
    """A converged run beside the recordings.

    Its label is its condition, or its folder where several share that; without a verdict nothing
    was judged.
    """

    label: str
    run: Run
    evaluation: Evaluation
    verdict: Verdict | None

    @property
    def patient(self) -> Patient:
        """The patient, with the variation of the config."""
        return self.run.case.patient

    @property
    def worn(self) -> bool:
        """Whether orthoses are worn."""
        return self.run.config.condition == "orthosis"

    @property
    def braced(self) -> tuple[Side, ...]:
        """The sides that wear one."""
        return tuple(self.evaluation.gait.walker.device.elements)

    @property
    def springs(self) -> tuple[str, ...]:
        """The springs that are worn, in the order of `conventions.STIFFNESSES`."""
        return self.evaluation.gait.walker.springs

    @property
    def date(self) -> str:
        """When it was solved, as far as the run tells."""
        told = self.run.metrics.get("date")
        if told:
            return str(told)
        written = (self.run.folder / "metrics.json").stat().st_mtime
        return f"not kept; files of {datetime.fromtimestamp(written, UTC).date().isoformat()}"

    @cached_property
    def patient_changed(self) -> bool:
        """Whether the patient's file says something else of this run's condition than it did.

        Barefoot, the orthosis does not matter.  A file that cannot be read says nothing.
        """
        try:
            today = load_patient(self.run.config.patient)
        except InputError:
            return False
        then = self.run.case.unvaried
        return _of_condition(then, self.worn) != _of_condition(today, self.worn)


def read_runs(folders: Sequence[Path]) -> tuple[ReportRun, ...]:
    """Read runs of one patient, barefoot ones first.

    Raises:
        DataError: If one did not converge, cannot be read, or they are of different patients.
    """
    both = [run_and_gait(folder, folder.resolve().name) for folder in folders]
    runs, gaits = zip(*both, strict=True)
    ids = [gait.walker.patient.id for gait in gaits]
    for folder, each in zip(folders, ids, strict=True):
        if each != ids[0]:
            raise DataError(
                f"is a run of patient {each}, but {folders[0]} is one of {ids[0]}",
                where=str(folder),
                allowed="runs of one patient",
                mend="write a report for each, or name the folder of a batch",
            )
    conditions = [run.config.condition for run in runs]
    unique = len(set(conditions)) == len(conditions)
    names = conditions if unique else _labels(folders)
    found = [
        ReportRun(name, run, evaluate_gait(gait), verdict_of_metrics(run.metrics))
        for name, run, gait in zip(names, runs, gaits, strict=True)
    ]
    return tuple(sorted(found, key=lambda each: each.worn))


def _of_condition(patient: Patient, worn: bool) -> dict[str, Any]:
    """Return what a run of a condition may take from a patient; barefoot recordings bound both."""
    worn_only: dict[str, Any] = {
        "orthosis": True, "contact_points": {"orthosis"}, "recorded": {"orthosis"},
    }  # fmt: skip
    left_out = {"description": True, **({} if worn else worn_only)}
    return patient.model_dump(mode="json", exclude=left_out, exclude_none=True)


def _labels(folders: Sequence[Path]) -> list[str]:
    """Return names of folders; longer ones where they would be the same."""
    names = [folder.resolve().name for folder in folders]
    return [
        name if names.count(name) == 1 else f"{folder.resolve().parent.name}/{name}"
        for name, folder in zip(names, folders, strict=True)
    ]
