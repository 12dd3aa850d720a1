"""All that a study of many neighbours solves: through a journal, one line told for each."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from pathwalker_cli.case import Case
from pathwalker_cli.errors import DataError
from pathwalker_cli.gait.cost_terms import walked_distance
from pathwalker_cli.gait.resolve import Optimum
from pathwalker_cli.results.run_folder import Run
from pathwalker_cli.studies.base import require_optimum, resolver_of
from pathwalker_cli.studies.graph import Solve, Values
from pathwalker_cli.studies.journal import Journal

__all__ = ["Neighbours", "motion_distance", "motion_signature"]


class Neighbours:
    """Solves neighbours of a run and keeps them in a folder.

    Args:
        run: The run.
        folder: Where they are kept.
        max_iterations: Largest number of iterations of one solve.
        tell: Is told of every neighbour.

    Raises:
        DataError: If the run is by another transcription, so that nothing warm can begin there.
        NotConvergedError: If the run itself cannot be solved again.
    """

    def __init__(
        self, run: Run, folder: Path, max_iterations: int, tell: Callable[[str], None]
    ) -> None:
        if run.config.transcription != "collocation":
            raise DataError(f"was solved by {run.config.transcription}", where=str(run.folder),
                            allowed="a run by collocation")  # fmt: skip
        self.run = run
        self._tell = tell
        limited = run.case.with_values({"solver.max_iterations": max_iterations})
        resolver = resolver_of(replace(run, case=limited))
        self._journal = Journal(folder, run, resolver)
        self.optimum = require_optimum(resolver, run, limited.config.solver.tolerance)
        """The run as an optimum, solved to its tolerance."""
        self._count = 0

    def resolve(self, name: str, case: Case, start: Optimum | None) -> Optimum:
        """Return a neighbour, read or solved now; see `Journal.resolve`."""
        solved = self._journal.solved
        found = self._journal.resolve(name, case, start)
        self._count += 1
        result = found.result
        how = f"{result.iterations} iterations, {result.seconds:.1f} s"
        how = how if self._journal.solved > solved else f"{how}, kept from before"
        outcome = f"cost {found.cost:.5g}" if found.converged else result.status
        self._tell(f"{self._count:4d}  {name:<24} {outcome}, {how}")
        return found

    def solver(self, case_at: Callable[[Values], Case]) -> Solve[Optimum]:
        """Return what solves the points of a graph.

        Args:
            case_at: Returns the case of the values of a point.
        """
        return lambda name, values, start: self.resolve(name, case_at(values), start)


def motion_distance(one: Optimum, other: Optimum) -> float:
    """Return the root mean square difference of the scaled unknowns of two neighbours."""
    difference = one.result.unknowns - other.result.unknowns
    return float(np.sqrt(np.mean(difference**2)))


def motion_signature(optimum: Optimum) -> np.ndarray:
    """Return speed [m/s] and stiffnesses [N m/rad] of a solution, by which optima differ."""
    motion = optimum.motion
    return np.array([walked_distance(motion) / motion.duration, *motion.parameters])
