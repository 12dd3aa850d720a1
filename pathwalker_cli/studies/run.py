"""One study into one run folder: what a command, a batch and the reproduction all do."""

from __future__ import annotations

import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any, Final, NamedTuple

from pathwalker_cli.case import Case, config_text
from pathwalker_cli.config import StudyConfig
from pathwalker_cli.errors import DataError, InputError, NotConvergedError
from pathwalker_cli.gait.resolve import Resolver
from pathwalker_cli.gait.solution import GaitSolution, LocalOptimum
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.nlp.watch import ProgressReport
from pathwalker_cli.results.metrics import RunInputs, run_inputs
from pathwalker_cli.results.run_folder import (
    Run,
    check_target,
    load_run,
    warm_start_run,
    write_run,
)
from pathwalker_cli.studies.verdict import Verdict
from pathwalker_cli.studies.verdict.judge import verdict_of
from pathwalker_cli.studies.verdict.words import verdict_lines

SAME_RUN: Final = "earlier run of the same problem"
"""Start of a solve that begins at the optimum that it is to find."""


class Outcome(NamedTuple):
    """How a study ended, its metrics as written, and how sure springs are that were judged."""

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

    def optimum(self, end: LocalOptimum) -> None:
        """Take note of where one of several starts ended."""
        self.lines.append(
            f"start {end.start:<3d} {end.status}, cost {end.cost:.5g}, "
            f"{end.walking_speed:.3f} m/s, {end.iterations} iterations, {end.description}"
        )


def run_study(
    study: StudyConfig | Case,
    folder: Path,
    warm_start: Path | Run | None = None,
    log: RunLog | None = None,
    found: GaitSolution | None = None,
) -> Outcome:
    """Solve a study, judge its springs, and write its run folder.

    Args:
        study: The study; the patient of a config is read now.
        folder: The run folder; an earlier run in it is replaced.
        warm_start: An earlier run to begin with, or its folder.
        log: Hears every iteration.
        found: The solution, if it is known already.

    Raises:
        DataError: If the folder holds something else, or the earlier run cannot be used; if the
            folder cannot be written in the end, the run is in a temporary one that is named.
    """
    log, case = log or RunLog(), Case.of(study)
    check_target(folder)
    earlier = warm_start if isinstance(warm_start, Run | None) else (
        warm_start_run(warm_start, case.config))  # fmt: skip
    inputs = run_inputs(case, None if earlier is None else earlier.folder)
    solution = found or _solve(case, earlier, log)
    verdict = verdict_of(solution) if case.config.verdict else None
    lines = _log_lines(solution, inputs, log)
    told = verdict_lines(verdict, case.config.learnt, folder) if verdict else ()
    lines += [": ".join(filter(None, pair)) for pair in told]
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


def done_run(folder: Path, case: Case) -> Run | None:
    """Return the converged run of just this case that a folder holds.

    None if it is damaged, did not converge, or was made from another config or patient's file.
    """
    try:
        run = load_run(folder)
    except (InputError, NotConvergedError):
        return None
    same = config_text(run.config) == config_text(case.config)
    return run if same and _same_patient(run, case) else None


def _same_patient(run: Run, case: Case) -> bool:
    return bool(run.metrics.get("input_hashes", {}).get("patient") == case.content_hash)


def _same_problem(run: Run, case: Case) -> bool:
    """Return whether a run solved just this problem, whatever was asked about it afterwards."""
    kept = run.config
    asked = {"verdict": kept.verdict, "starts": kept.starts, "figures": kept.figures}
    same = config_text(case.config.model_copy(update=asked)) == config_text(kept)
    return same and _same_patient(run, case)


def _solve(case: Case, earlier: Run | None, log: RunLog) -> GaitSolution:
    """Solve a study, from an earlier run if there is one; at its optimum if it is of the same."""
    motion = None if earlier is None else earlier.motion
    if earlier is not None and earlier.multipliers is not None and _same_problem(earlier, case):
        resolver = Resolver(case, earlier.motion, earlier.multipliers)
        if resolver.begins_there and resolver.optimum.converged:
            return replace(resolver.optimum.solution, start=SAME_RUN)
    # what few solves need is loaded where it is needed: the others begin 0.4 s sooner
    if case.config.transcription == "multiple-shooting":
        from pathwalker_cli.gait.shooting import solve_by_shooting

        return solve_by_shooting(GaitSolver(case, log), motion)
    if case.config.starts > 1 and motion is None:
        from pathwalker_cli.gait.starts import solve_from_starts

        return solve_from_starts(case, log.optimum)
    return GaitSolver(case, log).solve(motion)


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
