"""What every study is: config, plan, run and result, and the optimum that it begins with."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final, Generic, Literal, TypeVar

from pydantic import Field

from pathwalker_cli.case import Case
from pathwalker_cli.config import StudyConfig, load_config, place_of, read_config, with_values
from pathwalker_cli.errors import ConfigError, DataError, NotConvergedError
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.io.atomic import check_room, sweep
from pathwalker_cli.io.fields import YamlModel
from pathwalker_cli.io.lock import locked
from pathwalker_cli.results.run_folder import Run, load_converged, load_run
from pathwalker_cli.studies.run import RunLog, done_run, run_study

_TRANSCRIPTION: Final = "collocation"


class NeighbourStudy(YamlModel):
    """A study around one optimum.

    `base` is the config of the problem, `set` overrides its values by dotted key.
    """

    base: str
    set: dict[str, Any] = Field(default_factory=dict)

    def based_on(self, case: Case) -> Case:
        """Return the case of the base as the study wants it solved first."""
        return case

    def solved_as(self, case: Case) -> Case:
        """Return a case as the study solves it: to a tolerance of its own where it has one."""
        return case


Study = TypeVar("Study", bound=NeighbourStudy)
Result = TypeVar("Result")


@dataclass(frozen=True)
class Plan:
    """What a study would do, in words, and how many neighbours it would solve, or at least."""

    does: str
    solves: int
    least: bool = False


@dataclass(frozen=True)
class Work:
    """Where a study works, and who hears of it.

    Args:
        folder: Its folder; what is solved there already is not solved again.
        report: Is given a line for every neighbour.
        log: Hears every iteration of solves on new meshes.
        workers: Processes to solve on.
    """

    folder: Path
    report: Callable[[str], None] = lambda line: None
    log: RunLog = field(default_factory=RunLog)
    workers: int = 1


@dataclass(frozen=True)
class StudyKind(Generic[Study, Result]):
    """A kind of study.

    Args:
        model: Its config.
        files: Names of the files and folders that it writes, the base apart.
        varies: What the base must have: "springs", or "numbers" that it may choose, springs or
            others; "" for nothing.
        plan: What would be done around the base that a solver would solve; nothing is solved.
        run: Does it around the converged run of the base.
        write: Writes all files of a result into a folder.
        content: A result as plain values for JSON, SI units.
        lines: A result as lines for the terminal.
        failed: What of a result in a folder did not converge, in one sentence; "" if nothing.
        predicts: Whether the base must not follow a recording.
        whole_cycle: Whether the base must be a whole stride, in which sides may differ.
    """

    model: type[Study]
    files: frozenset[str]
    varies: Literal["", "numbers", "springs"]
    plan: Callable[[Study, GaitSolver], Plan]
    run: Callable[[Study, Run, Work], Result]
    write: Callable[[Result, Path], None]
    content: Callable[[Result], Mapping[str, Any]]
    lines: Callable[[Result], Iterable[str]]
    failed: Callable[[Result, Path], str] = lambda result, folder: ""
    predicts: bool = False
    whole_cycle: bool = True

    def require(self, config: StudyConfig, where: str) -> None:
        """Refuse a problem that the study cannot take.

        Raises:
            ConfigError: If it lacks what is varied, or its neighbours cannot be solved.
        """
        require_neighbours(config, where, self.varies, self.predicts, self.whole_cycle)


def require_neighbours(
    config: StudyConfig,
    where: str,
    varies: Literal["", "numbers", "springs"] = "",
    predicts: bool = False,
    whole_cycle: bool = True,
) -> None:
    """Refuse a problem that lacks what is varied, or whose neighbours cannot be solved.

    Args:
        config: The config of the problem.
        where: What the user called it.
        varies: See `StudyKind`, as the others.
        predicts: Whether it must not follow a recording.
        whole_cycle: Whether it must be a whole stride.

    Raises:
        ConfigError: If it does.
    """
    springless = config.condition != "orthosis" and not (varies == "numbers" and config.free)
    refusals = (
        (bool(varies) and springless,
         f"{config.problem} is walked barefoot and has no springs",
         "a problem with orthoses, e.g. mapd-orthosis", ""),
        (config.transcription != _TRANSCRIPTION,
         f"is solved by {config.transcription}, but neighbours are solved by {_TRANSCRIPTION}",
         "", f"solve it with transcription: {_TRANSCRIPTION}"),
        (predicts and config.fits, f"is {config.problem}, which follows a recording",
         "a prediction, e.g. mapd-orthosis", ""),
        (whole_cycle and config.half_cycle,
         "is solved as half a cycle, in which the numbers of one side cannot change alone",
         "", "solve it with half_cycle: false"),
    )  # fmt: skip
    for refused, what, allowed, mend in refusals:
        if refused:
            raise ConfigError(what, where=where, allowed=allowed, mend=mend)


def load_study(path: str | Path, model: type[Study], changes: tuple[str, ...] = ()) -> Study:
    """Read the config of a study; a path in `base` becomes a full one.

    Args:
        path: The YAML file, or the name of a shipped one.
        model: Model of its content.
        changes: Overrides "dotted.key=value" of the study's own keys.

    Raises:
        ConfigError: If file or overrides are wrong.
    """
    study, source = read_config(path, model, changes)
    beside = place_of("base", source, changes) / study.base
    if study.base and os.path.isfile(beside):
        return study.model_copy(update={"base": str(beside.resolve())})
    return study


def base_case(study: NeighbourStudy) -> Case:
    """Return the problem that a study is about, and its patient.

    Raises:
        ConfigError: If there is no such config, or it is wrong.
        PatientError: If there is no such patient, or its file is refused.
    """
    unlearnt = "learnt" in study.set and study.set["learnt"] is None
    config = load_config(study.base, changes=("learnt=null",) if unlearnt else ())
    case = Case.of(with_values(config, study.set, f"set of the study on {study.base}"))
    return study.based_on(case)


def planned(
    kind: StudyKind[Study, Any], study: Study, given: Path | None = None
) -> tuple[Case, Run | None]:
    """Return the base of a study once all is checked that can be known without a solve.

    Args:
        kind: The kind of the study.
        study: Its config.
        given: Folder of the run to stand on; None for the base of the study.

    Returns:
        The case, and its run if one was given.

    Raises:
        ConfigError: If the study cannot take the base, or asks for what it does not have.
        DataError: If the run cannot be used.
    """
    run = None if given is None else _given(study, given)
    case, where = (base_case(study), f"base {study.base}") if run is None else (
        run.case, f"--run {given}")  # fmt: skip
    kind.require(case.config, where)
    kind.plan(study, GaitSolver(study.solved_as(case)))
    return case, run


def _given(study: NeighbourStudy, folder: Path) -> Run:
    if study.set:
        raise ConfigError(
            "overrides values of the base, but --run brings a config of its own",
            where="set",
            mend="leave one of the two out",
        )
    return load_converged(folder, "--run")


def base_run(case: Case, folder: Path, log: RunLog | None = None) -> Run:
    """Return the converged run of a case in a folder; it is solved unless it is there.

    Raises:
        NotConvergedError: If it does not converge: there is nothing to stand on then.
        DataError: If the folder holds something else.
    """
    run = done_run(folder, case)
    if run is None:
        solution = run_study(case, folder, log=log).solution
        if not solution.converged:
            raise NotConvergedError(
                f"{case.config.problem}, on which the study stands, did not converge: "
                f"{solution.status}; its last iterate is in {folder}"
            )
    return run or load_run(folder)


def resolver_of(run: Run, tolerance: float | None = None) -> Resolver:
    """Return a solver of the neighbours of a run."""
    return Resolver(run.case, run.motion, run.multipliers, tolerance)


def require_optimum(resolver: Resolver, run: Run, tolerance: float) -> Optimum:
    """Return the optimum around which a resolver solves neighbours.

    Raises:
        NotConvergedError: If the optimum cannot be solved to the tolerance.
    """
    optimum = resolver.optimum
    if not optimum.converged:
        raise NotConvergedError(
            f"the optimum in {run.folder} could not be solved to a tolerance of {tolerance:g}: "
            f"{optimum.result.status}"
        )
    return optimum


def check_folder(folder: Path, entries: frozenset[str], command: str) -> None:
    """Refuse a folder that cannot take the results, before anything is computed.

    Args:
        folder: Where results shall go.
        entries: Names of all files and folders that the command writes there.
        command: The command, for the message.

    Raises:
        DataError: If it is a file or holds something else.
    """
    if folder.exists() and not folder.is_dir():
        raise DataError("is a file, not a folder", where=str(folder), mend="choose another --out")
    check_room(folder)
    there = {path.name for path in folder.iterdir()} if folder.is_dir() else set()
    foreign = sorted(name for name in there - entries if not name.startswith("."))
    if foreign:
        raise DataError(
            f"is not empty and holds {foreign[0]}, which is no result of this command",
            where=str(folder),
            allowed=f"a new folder, or one that an earlier `pathwalker {command}` began",
            mend="choose another --out",
        )


@contextmanager
def claimed_folder(folder: Path, entries: frozenset[str], command: str) -> Iterator[None]:
    """Keep others out of the folder of a study, see `check_folder`, and tidy up after killed ones.

    Raises:
        DataError: If it cannot take the results, or another process is at work there.
    """
    check_folder(folder, entries, command)
    with locked(folder / ".lock", folder):
        sweep(folder, deep=True)
        yield
