"""One study into one run folder: what a command, a batch and the reproduction all do."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import Any, NamedTuple

from pathwalker_cli.config import StudyConfig, study_patient
from pathwalker_cli.errors import DataError, InputError
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.patient import load_patient
from pathwalker_cli.results.metrics import RunInputs, patient_hash, run_inputs
from pathwalker_cli.results.run_folder import (
    Run,
    check_target,
    config_text,
    load_run,
    warm_start_run,
    write_run,
)
from pathwalker_cli.studies.verdict import Verdict, verdict_of
from pathwalker_cli.studies.verdict_text import verdict_lines

__all__ = ["Outcome", "RunLog", "is_done", "run_study"]


class Outcome(NamedTuple):
    """How a study ended.

    Args:
        solution: How the solve ended.
        metrics: The metrics as they were written.
        verdict: How sure the springs are; None where there is nothing to judge.
    """

    solution: GaitSolution
    metrics: dict[str, Any]
    verdict: Verdict | None


class RunLog:
    """Keeps every iteration and every start of a solve as `lines`."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self._began = time.perf_counter()

    def __call__(self, stage: str, report: ProgressReport) -> None:
        """Take note of one iteration."""
        elapsed = time.perf_counter() - self._began
        self.lines.append(
            f"{stage:<10} iteration {report.iteration:4d}   cost {report.objective:<11.5g} "
            f"infeasibility {report.infeasibility:.1e}   {elapsed:6.1f} s"
        )

    def optimum(self, found: LocalOptimum) -> None:
        """Take note of where one of several starts ended."""
        self.lines.append(
            f"start {found.start:<3d} {found.status}, cost {found.cost:.5g}, "
            f"{found.walking_speed:.3f} m/s, {found.iterations} iterations, {found.description}"
        )


def run_study(
    study: StudyConfig, folder: Path, warm_start: Path | None = None, log: RunLog | None = None
) -> Outcome:
    """Solve a study, judge its springs, and write its run folder.

    Args:
        study: The study.
        folder: The run folder; an earlier run in it is replaced.
        warm_start: Folder of an earlier run to begin with.
        log: Is told of every iteration.

    Raises:
        DataError: If the folder holds something else, or the earlier run cannot be used; if the
            folder cannot be written in the end, the run is in a temporary one that is named.
    """
    log = log or RunLog()
    check_target(folder)
    earlier = None if warm_start is None else warm_start_run(warm_start, study)
    inputs = run_inputs(config_text(study), load_patient(study.patient), warm_start)
    solution = _solve(study, earlier, log)
    verdict = verdict_of(solution) if study.verdict else None
    lines = [*_log_lines(solution, inputs, log), *_verdict_lines(verdict)]
    more = {"verdict": None if verdict is None else verdict.as_dict()}
    try:
        metrics = write_run(folder, solution, lines, inputs, more)
    except DataError as error:
        place = _kept_elsewhere(folder.name, solution, lines, inputs, more)
        mend = error.mend if place is None else f"the run is kept in {place}: move it from there"
        raise DataError(error.what, where=error.where, allowed=error.allowed, mend=mend) from None
    return Outcome(solution, metrics, verdict)


def _kept_elsewhere(name: str, *run: Any) -> Path | None:
    """Return a temporary folder with what took long to solve, if it can be written at all."""
    try:
        place = Path(tempfile.mkdtemp(prefix="pathwalker-")) / name
        write_run(place, *run)
    except (DataError, OSError):
        return None
    return place


def is_done(folder: Path, study: StudyConfig) -> bool:
    """Return whether a folder holds a converged run of just this study.

    A run that is damaged, did not converge, or was made from another config or patient file
    is not done.
    """
    try:
        run = load_run(folder, allow_unconverged=True)
        same = config_text(run.config) == config_text(study)
    except InputError:
        return False
    now = patient_hash(study_patient(study))
    then = run.metrics.get("input_hashes", {}).get("patient")
    sealed = (folder / "NOT_CONVERGED.txt").exists()
    return same and run.metrics["status"] == "converged" and now == then and not sealed


def _solve(study: StudyConfig, earlier: Run | None, log: RunLog) -> GaitSolution:
    """Solve a study, from an earlier run if there is one."""
    motion = None if earlier is None else earlier.motion
    # what few solves need is loaded where it is needed: the others begin 0.4 s sooner
    if study.transcription == "multiple-shooting":
        from pathwalker_cli.gait.by_shooting import solve_by_shooting

        return solve_by_shooting(GaitSolver(study, log), motion)
    if study.starts > 1 and motion is None:
        from pathwalker_cli.gait.starts import solve_from_starts

        return solve_from_starts(study, log.optimum)
    return GaitSolver(study, log).solve(motion)


def _verdict_lines(verdict: Verdict | None) -> list[str]:
    return [] if verdict is None else [f"{label}: {text}" for label, text in verdict_lines(verdict)]


def _log_lines(solution: GaitSolution, inputs: RunInputs, log: RunLog) -> list[str]:
    """Return the lines of `log.txt`: every iteration, then every stage."""
    lines = [f"{solution.config.problem}, patient {solution.walker.patient.id}"]
    lines += [f"{name} sha256 {value}" for name, value in inputs.hashes.items()]
    lines += log.lines
    for stage in solution.stages:
        lines.append(
            f"stage {stage.name}: {stage.status}; {stage.intervals} intervals, "
            f"{stage.unknowns} unknowns, {stage.iterations} iterations, {stage.seconds:.2f} s, "
            f"of which {stage.seconds_functions:.2f} s in functions"
        )
    return [*lines, f"status: {solution.status}"]
