"""Solved neighbours of a run: kept on disk, so that a study goes on where it was interrupted."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Final

import numpy as np

from pathwalker_cli.case import Case, config_text
from pathwalker_cli.errors import DataError, NotConvergedError
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.motion_file import read_arrays
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.io.atomic import atomic_open
from pathwalker_cli.io.processes import results_of_calls
from pathwalker_cli.nlp.result import Multipliers, NlpResult
from pathwalker_cli.results.metrics import sha256
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import require_optimum, resolver_of
from pathwalker_cli.studies.branches import Solve, Values
from pathwalker_cli.studies.measures import measures

STOPPED: Final = "stopped by the user; the same command goes on from there"
"""Why nothing further is solved."""

_NUMBERS: Final = ("objective", "iterations", "seconds", "seconds_functions")


class Journal:
    """Solves neighbours of a run, each only once per folder.

    Args:
        folder: Where solved neighbours are kept, one file each.
        run: The run whose neighbours they are; files made from another run are not used.
        resolver: Solves what is not there yet.
    """

    def __init__(self, folder: Path, run: Run, resolver: Resolver) -> None:
        self.folder = folder
        self.resolver = resolver
        self._origin = f"{run.metrics['motion_hash']} {run.case.content_hash}"
        self.solved = 0
        """Neighbours that were solved by this journal, not read."""

    def resolve(
        self, name: str, case: Case, start: Optimum | None = None, insist: bool = True
    ) -> Optimum:
        """Return a solved neighbour, read or solved now; see `Resolver.resolve`.

        Args:
            name: Name of its file, unique in the study.
            case: Its case.
            start: Neighbour to begin with.
            insist: Whether to try for long.

        Raises:
            NotConvergedError: If the user stopped it: nothing further is wanted then.
        """
        kept = self.kept(name, case)
        if kept is not None:
            return kept
        optimum = self.resolver.resolve(case, start, insist)
        self.solved += 1
        if optimum.result.status == "stopped by the user":
            raise NotConvergedError(STOPPED)
        _write(*self._place(name, case), optimum.result)
        return optimum

    def kept(self, name: str, case: Case) -> Optimum | None:
        """Return a neighbour that was solved before; None if it is not there, or is another one."""
        result = _read(*self._place(name, case))
        return None if result is None else self.resolver.restored(case, result)

    def _place(self, name: str, case: Case) -> tuple[Path, str]:
        """Return the file of a neighbour and what seals it."""
        seal = sha256(f"{self._origin} {config_text(case.config)}".encode())
        return self.folder / f"{name}.npz", seal


def _write(path: Path, seal: str, result: NlpResult) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    facts = {"seal": seal, "status": result.status}
    facts |= {name: getattr(result, name) for name in _NUMBERS}
    with atomic_open(path, "wb") as file:
        np.savez(
            file,
            facts=np.array(json.dumps(facts)),
            unknowns=result.unknowns,
            rows=result.rows,
            bound_multipliers=result.multipliers.unknowns,
            row_multipliers=result.multipliers.rows,
            allow_pickle=False,
        )


def _read(path: Path, seal: str) -> NlpResult | None:
    """Return a result; None if it is not there, damaged or of another origin."""
    if not path.is_file():
        return None
    try:
        arrays = read_arrays(path)
        facts = json.loads(str(arrays["facts"]))
        if facts["seal"] != seal:
            return None
        return NlpResult(
            status=facts["status"],
            unknowns=arrays["unknowns"],
            rows=arrays["rows"],
            multipliers=Multipliers(arrays["bound_multipliers"], arrays["row_multipliers"]),
            **{name: facts[name] for name in _NUMBERS},
        )
    except (DataError, KeyError, ValueError, TypeError):
        return None


class Neighbours(Journal):
    """Solves neighbours of a run in so many iterations at most, and reports each in a line.

    Raises:
        NotConvergedError: If the run itself cannot be solved again.
    """

    def __init__(
        self, run: Run, folder: Path, max_iterations: int, report: Callable[[str], None]
    ) -> None:
        self.run = run
        self._report = report
        limited = run.case.with_values({"solver.max_iterations": max_iterations})
        super().__init__(folder, run, resolver_of(replace(run, case=limited)))
        self.optimum = require_optimum(self.resolver, run, limited.config.solver.tolerance)
        """The run as an optimum, solved to its tolerance."""
        self._count = 0

    def resolve(
        self, name: str, case: Case, start: Optimum | None = None, insist: bool = True
    ) -> Optimum:
        """Return a neighbour, read or solved now; see `Journal.resolve`."""
        solved = self.solved
        optimum = super().resolve(name, case, start, insist)
        self._count += 1
        result = optimum.result
        how = f"{result.iterations} iterations, {result.seconds:.1f} s"
        how = how if self.solved > solved else f"{how}, kept from before"
        outcome = f"cost {optimum.cost:.5g}" if optimum.converged else result.status
        self._report(f"{self._count:4d}  {name:<24} {outcome}, {how}")
        return optimum

    def solver(self, case_at: Callable[[Values], Case]) -> Solve[Optimum]:
        """Return what solves the points of a graph."""
        return lambda name, values, start: self.resolve(name, case_at(values), start)


def motion_distance(one: Optimum, other: Optimum) -> float:
    """Return the root mean square difference of the scaled unknowns of two neighbours."""
    difference = one.result.unknowns - other.result.unknowns
    return float(np.sqrt(np.mean(difference**2)))


def motion_signature(optimum: Optimum) -> np.ndarray:
    """Return speed [m/s] and stiffnesses [N m/rad] of a solution, by which optima differ."""
    motion = optimum.motion
    return np.array([walked_distance(motion) / motion.duration, *motion.parameters])


@dataclass(frozen=True)
class Solved:
    """Where the solve of a neighbour ended.

    Args:
        name: Its name in the journal.
        status: "converged" or the reason why not.
        values: Its measures and unknowns, SI units; empty if it did not converge.
        iterations: Iterations of the last attempt.
        seconds: Wall seconds of the last attempt.
        kept: Whether it was read and not solved now.
    """

    name: str
    status: str
    values: Mapping[str, float]
    iterations: int
    seconds: float
    kept: bool


def solve_all(
    cases: Mapping[str, Case],
    run: Run,
    folder: Path,
    tolerance: float,
    workers: int,
    report: Callable[[int, Solved], None],
) -> list[Solved]:
    """Return solved neighbours by rising name; every one starts from the run itself.

    So it does not matter how many processes there are, and which one solves what.

    Args:
        cases: What to solve, by name in the journal.
        run: The run.
        folder: Folder of the journal.
        tolerance: Optimality tolerance.
        workers: Processes; with one, this process does it.
        report: Hears of every one as they come, counted from 1.

    Raises:
        NotConvergedError: If the user stopped it, or a process was ended from outside.
    """
    source = _solved_here if min(workers, len(cases)) == 1 else _solved_elsewhere
    ends = []
    for done, solved in enumerate(source(cases, (run, folder, tolerance), workers), start=1):
        report(done, solved)
        ends.append(solved)
    return sorted(ends, key=lambda solved: solved.name)


_Origin = tuple[Run, Path, float]
"""Run, folder of the journal, and the tolerance."""


def _journal(origin: _Origin) -> Journal:
    run, folder, tolerance = origin
    return Journal(folder, run, resolver_of(run, tolerance))


def _solved(journal: Journal, name: str, case: Case) -> Solved:
    before = journal.solved
    optimum = journal.resolve(name, case)
    values = measures(optimum) if optimum.converged else {}
    result = optimum.result
    kept = journal.solved == before
    return Solved(name, result.status, values, result.iterations, result.seconds, kept)


def _solved_here(cases: Mapping[str, Case], origin: _Origin, workers: int) -> Iterator[Solved]:
    journal = _journal(origin)
    for name, case in cases.items():
        yield _solved(journal, name, case)


def _solved_elsewhere(cases: Mapping[str, Case], origin: _Origin, workers: int) -> Iterator[Solved]:
    calls = [(origin, name, case) for name, case in cases.items()]
    try:
        yield from results_of_calls(_in_worker, calls, workers)
    except KeyboardInterrupt:
        raise NotConvergedError(STOPPED) from None


_JOURNALS: Final[dict[Path, Journal]] = {}
"""The journal of a worker process by its folder, built once."""


def _in_worker(origin: _Origin, name: str, case: Case) -> Solved:
    if origin[1] not in _JOURNALS:
        _JOURNALS[origin[1]] = _journal(origin)
    return _solved(_JOURNALS[origin[1]], name, case)
