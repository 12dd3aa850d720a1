"""The folder of a run: written in one stroke, read back with suspicion."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Final

import numpy as np

from pathwalker_cli.case import Case, config_text
from pathwalker_cli.config import StudyConfig, load_config
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait.costs import ELSEWHERE, GOALS
from pathwalker_cli.gait.motion_file import (
    read_motion,
    read_multipliers,
    write_motion,
    write_multipliers,
)
from pathwalker_cli.gait.recorded import start_recording
from pathwalker_cli.gait.solution import GaitSolution
from pathwalker_cli.io.atomic import check_room, swapped, sweep
from pathwalker_cli.io.json_file import read_json, write_json
from pathwalker_cli.io.lock import locked
from pathwalker_cli.io.recordings import write_recording
from pathwalker_cli.io.yaml_file import validate
from pathwalker_cli.nlp.result import Multipliers
from pathwalker_cli.ocp.phased import PhasedMotion
from pathwalker_cli.patient import load_patient, recordings_beside
from pathwalker_cli.results.metrics import (
    RUN_FORMAT,
    RunInputs,
    RunMetrics,
    run_inputs,
    run_metrics,
    sha256,
)
from pathwalker_cli.results.tables import TABLES
from pathwalker_cli.results.text import shortfall_text

CONFIG: Final = "config.resolved.yaml"
"""The config of a run with every value written out."""
PATIENT: Final = "patient.yaml"
"""The patient of a run: whatever stands on the run takes this one, not the file of today."""
_METRICS, _MOTION, _RECORDINGS = "metrics.json", "motion.npz", "recordings"
_MULTIPLIERS: Final = "multipliers.npz"
_SEAL: Final = "NOT_CONVERGED.txt"

ENTRIES: Final = frozenset(
    {CONFIG, PATIENT, _METRICS, _MOTION, _MULTIPLIERS, _RECORDINGS, _SEAL, "log.txt", "figures"}
    | set(TABLES)
)
"""Everything that a run folder holds; a folder with anything else is never replaced."""


@dataclass(frozen=True)
class Run:
    """A run as it was read back: metrics, the exact motion, and the case that the folder keeps.

    Multipliers are those of a solution by collocation; None if they were not kept.
    """

    folder: Path
    metrics: dict[str, Any]
    motion: PhasedMotion
    case: Case
    multipliers: Multipliers | None = None

    @cached_property
    def result(self) -> RunMetrics:
        """The same metrics, typed."""
        return RunMetrics.model_validate(self.metrics)

    @property
    def config(self) -> StudyConfig:
        """The config with all defaults filled in."""
        return self.case.config


def default_folder(config: StudyConfig, patient: str) -> Path:
    """Return where a run is written if nobody says where; a quick check stands apart."""
    return Path("runs") / f"{config.problem}-{patient}{'-smoke' if config.smoke else ''}"


def write_run(
    folder: str | Path,
    solution: GaitSolution,
    log: Sequence[str] = (),
    inputs: RunInputs | None = None,
    more: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Write a run, converged or not, and return its metrics.

    The folder is there in full at the end or, after an error, as it was before.

    Args:
        folder: The folder; an earlier run in it is replaced.
        solution: How the solve ended.
        log: Lines of `log.txt`.
        inputs: What the run was made from; taken now if left out.
        more: Further entries of `metrics.json`, plain values.

    Raises:
        DataError: If the folder holds something else, or cannot be written.
    """
    case = solution.case
    inputs = inputs or run_inputs(case)
    result = run_metrics(solution, inputs, more)
    with _staged(Path(folder)) as staging:
        (staging / CONFIG).write_text(config_text(case.config), encoding="utf-8")
        (staging / PATIENT).write_text(case.patient_text, encoding="utf-8")
        _keep_recording(staging, solution)
        (staging / "log.txt").write_text("".join(f"{line}\n" for line in log), encoding="utf-8")
        write_motion(staging / _MOTION, solution.last_motion)
        result.motion_hash = sha256((staging / _MOTION).read_bytes())
        if solution.converged and solution.config.transcription == "collocation":
            write_multipliers(staging / _MULTIPLIERS, solution.nlp.multipliers)
            result.multipliers_hash = sha256((staging / _MULTIPLIERS).read_bytes())
        _write_series(staging, solution)
        if not solution.converged:
            (staging / _SEAL).write_text(_seal(solution), encoding="utf-8")
        content = result.content()
        write_json(staging / _METRICS, content)
    return content


def _keep_recording(folder: Path, solution: GaitSolution) -> None:
    """Write the recording that a run began with or followed, where the patient's would stand."""
    start = solution.config.start
    if start.gait == "recorded":
        recording = start_recording(solution.walker, start)
        write_recording(folder / _RECORDINGS / start.condition, recording)


def _write_series(folder: Path, solution: GaitSolution) -> None:
    """Write tables and figures; no figures of a last iterate that holds no numbers."""
    series, wanted = solution.last_iterate, solution.config.figures
    for name, write in TABLES.items():
        write(folder / name, series)
    if wanted != "none" and all(
        np.isfinite(values).all() for values in (series.q, series.force, series.net_torque)
    ):
        # Matplotlib takes half a second to load, which a run without figures need not wait for
        from pathwalker_cli.inverse.figures import recorded_reference
        from pathwalker_cli.stride.figures.save import FORMATS, save_figures

        reference = recorded_reference(series.walker.patient, series.walker.condition)
        formats = FORMATS if wanted == "all" else (wanted,)
        save_figures(series, folder / "figures", reference, formats)


def _seal(solution: GaitSolution) -> str:
    """Return what `NOT_CONVERGED.txt` says."""
    why = solution.shortfall
    lines = [
        f"{solution.config.problem} did not converge: {solution.status}.",
        *([] if why is None else [f"Why: {shortfall_text(why)}."]),
        "The files beside this one show the last iterate, which is no solution: do not use it.",
        "Largest violations, each in its own unit:",
        *(f"  {violation.amount:.3g}  {violation.name}" for violation in solution.violations),
    ]
    return "\n".join(lines) + "\n"


def check_target(folder: str | Path) -> Path:
    """Return the real path of an output folder.

    Raises:
        DataError: If something stands there that is no run, or it cannot be written.
    """
    target, mend = Path(os.path.realpath(folder)), "choose another --out"
    here = Path.cwd()
    if target == here or target in here.parents:
        raise DataError("is the current folder or one above it", where=str(folder), mend=mend)
    above = next(path for path in (target, *target.parents) if path.exists())
    if not above.is_dir():
        raise DataError("is a file, not a folder", where=str(above), mend=mend)
    for place in {above, target.parent} if target.exists() else {above}:
        if not os.access(place, os.W_OK | os.X_OK):
            raise DataError("cannot be written", where=str(place), mend=mend)
    check_room(target)
    names = {path.name for path in target.iterdir()} if target.exists() else set()
    foreign = sorted(names - ENTRIES) if _METRICS in names else sorted(names)
    if foreign:
        what = f"is not empty and no run folder: it holds {foreign[0]}"
        raise DataError(
            what, where=str(folder), allowed="a new folder or an earlier run", mend=mend
        )
    return target


@contextmanager
def claimed_run(folder: str | Path, wait: bool = False) -> Iterator[None]:
    """Keep other processes from writing a run folder meanwhile, and tidy up after killed ones.

    Args:
        folder: The run folder.
        wait: Whether to wait for another process that is at work there.

    Raises:
        DataError: If another process is at work there, or no run can be written there.
    """
    target = check_target(folder)
    with locked(target.with_name(f".{target.name}.lock"), Path(folder), wait):
        _recover(target)
        sweep(target.parent, target.name)
        yield


def release_runs(folder: Path) -> None:
    """Tidy up after killed processes that wrote run folders in a folder."""
    for lock in folder.glob(".*.lock"):
        run = folder / lock.name.removeprefix(".").removesuffix(".lock")
        with suppress(DataError), claimed_run(run):  # who is at work there still, goes on
            pass


def _recover(target: Path) -> None:
    """Put a run back whose process was killed while it moved another one into its place."""
    for old in target.parent.glob(f".{glob.escape(target.name)}.????????.tmp/old"):
        if not target.exists():
            old.rename(target)


@contextmanager
def _staged(folder: Path) -> Iterator[Path]:
    """Yield an empty folder that takes the place of `folder` when the block ends without error."""
    target = check_target(folder)
    beside = next(path for path in target.parents if path.exists())
    staging = None
    try:
        staging = Path(tempfile.mkdtemp(prefix=f".{target.name}.", suffix=".tmp", dir=beside))
        fresh = staging / "new"
        fresh.mkdir()
        yield fresh
        target.parent.mkdir(parents=True, exist_ok=True)
        _exchange(fresh, check_target(folder), staging / "old")
    except OSError as problem:
        reason = problem.strerror or str(problem)
        raise DataError(
            f"cannot be written: {reason}", where=str(folder), mend="choose another --out"
        ) from None
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)


def _exchange(fresh: Path, target: Path, old: Path) -> None:
    """Move a folder to its place; an older one comes back if that fails."""
    if target.exists():
        if swapped(fresh, target):
            return
        target.rename(old)
    try:
        fresh.rename(target)
    except BaseException:
        if old.exists():
            old.rename(target)
        raise


def load_run(folder: str | Path, allow_unconverged: bool = False) -> Run:
    """Read a run.

    Args:
        folder: The folder of the run.
        allow_unconverged: Whether the last iterate of a failed solve is wanted, knowingly.

    Raises:
        DataError: If the folder is no run, or a file of it is missing, truncated or foreign.
        NotConvergedError: If the run did not converge.
    """
    folder = Path(folder)
    metrics = _read_metrics(folder)
    if (metrics["status"] != "converged" or (folder / _SEAL).exists()) and not allow_unconverged:
        raise NotConvergedError(
            f"{folder}: {metrics['problem']} did not converge there ({metrics['status']}); "
            "its last iterate is no solution"
        )
    motion = read_motion(folder / _MOTION)
    _check_hash(folder / _MOTION, metrics["motion_hash"])
    multipliers = None
    if (folder / _MULTIPLIERS).exists():
        multipliers = read_multipliers(folder / _MULTIPLIERS)
        _check_hash(folder / _MULTIPLIERS, metrics.get("multipliers_hash"))
    ELSEWHERE.update(metrics.get("goals", {}).keys() - GOALS.keys())
    case = _kept_case(folder)
    config = case.config
    expected = len(case.parts.unknowns(tuple(config.free)))
    phases = tuple(phase.name for phase in motion.phases)
    fits = motion.parameters.size == expected and phases == config.model.pattern.names
    if config.problem != metrics["problem"] or not fits:
        where = str(folder / CONFIG)
        raise DataError("does not belong to metrics.json beside it", where=where)
    return Run(folder, metrics, motion, case, multipliers)


def _kept_case(folder: Path) -> Case:
    """Return what was solved, and for whom; recordings that are not kept stand where they did."""
    config = load_config(_file(folder, CONFIG))
    if not (folder / PATIENT).is_file():
        raise DataError(f"keeps no {PATIENT}: it is damaged or of an older version",
                        where=str(folder), mend="solve again")  # fmt: skip
    patient = load_patient(folder / PATIENT, (recordings_beside(config.patient),))
    return Case(config, patient)


def _check_hash(path: Path, expected: str | None) -> None:
    """Refuse a file that is not the one that was written with `metrics.json`."""
    if sha256(path.read_bytes()) != expected:
        raise DataError("does not belong to metrics.json beside it", where=str(path),
                        mend="solve again")  # fmt: skip


def _file(folder: Path, name: str) -> Path:
    """Return a file of a run that must be there."""
    path = folder / name
    if not folder.is_dir():
        what = "is a file" if folder.exists() else "no such folder"
        raise DataError(what, where=str(folder), allowed="the folder of a run")
    if not path.is_file():
        raise DataError(f"is no run folder: {name} is missing", where=str(folder),
                        allowed="a folder that `pathwalker solve` wrote")  # fmt: skip
    return path


def _read_metrics(folder: Path) -> dict[str, Any]:
    path = _file(folder, _METRICS)
    metrics = read_json(path, mend="solve again")
    if "run_format" not in metrics:
        raise DataError("lacks the key run_format", where=str(path),
                        allowed="metrics that `pathwalker solve` wrote")  # fmt: skip
    if metrics["run_format"] != RUN_FORMAT:
        raise DataError(f"has run_format {metrics['run_format']}", where=str(path),
                        allowed=str(RUN_FORMAT), mend="solve again")  # fmt: skip
    validate(metrics, RunMetrics, where=str(path), error=DataError)
    return metrics


def load_converged(folder: str | Path, where: str = "", mend: str = "") -> Run:
    """Return a run that somebody named at `where`.

    Raises:
        DataError: If it cannot be used or did not converge.
    """
    try:
        return load_run(folder)
    except NotConvergedError as error:
        raise DataError(str(error), where=where, allowed="a converged run", mend=mend) from None


def warm_start_run(folder: str | Path, config: StudyConfig) -> Run:
    """Return the run that a solve shall begin with.

    Raises:
        DataError: If it cannot be used, did not converge or is about another condition.
    """
    run = load_converged(folder, "--warm-start", "solve it again first")
    if run.config.condition != config.condition:
        raise DataError(
            f"is a run of {run.config.problem} ({run.config.condition}), whose free parameters "
            f"are not those of {config.problem} ({config.condition})",
            where=f"--warm-start {folder}",
            allowed=f"a run of the {config.condition} condition",
        )
    if run.config.fits != config.fits:
        raise DataError(
            f"is a run of {run.config.problem}, which is no start for {config.problem}",
            where=f"--warm-start {folder}",
            allowed="fits start from fits, predictions from predictions",
        )
    if run.config.model.toes != config.model.toes:
        raise DataError(
            f"is a run of feet {'with' if run.config.model.toes else 'without'} toes",
            where=f"--warm-start {folder}",
            allowed=f"model.toes {str(config.model.toes).lower()}, as in the config",
        )
    if run.config.shelled != config.shelled:
        raise DataError(
            f"is a run of orthoses with model.orthosis {run.config.model.orthosis}",
            where=f"--warm-start {folder}",
            allowed=f"model.orthosis {config.model.orthosis}, as in the config",
        )
    return run
