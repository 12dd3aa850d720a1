"""What the sections of one call have in common: sizes, folders, runs that are solved once."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from tempfile import mkdtemp
from typing import Any

from measure import Finished, PartFailedError, pathwalker

__all__ = ["Context", "metrics_of"]


@dataclass
class Context:
    """One call of the suite.

    Args:
        folder: Where runs and caches go.
        quick: Whether toy sizes do.
        repetitions: How often everything is measured.
        tell: Is told what is being measured.
    """

    folder: Path
    quick: bool
    repetitions: int
    tell: Callable[[str], None]
    _runs: dict[tuple[str, int | None], Path] = field(default_factory=dict)

    @property
    def intervals(self) -> int:
        """Intervals of the mesh on which problems are compared."""
        return 16 if self.quick else 64

    @property
    def cache(self) -> Path:
        """Cache that all sections share which are not about caching."""
        path = self.folder / "cache"
        path.mkdir(exist_ok=True)
        return path

    def empty(self, name: str) -> Path:
        """Return a new empty folder."""
        return Path(mkdtemp(prefix=f"{name}-", dir=self.folder))

    def solve(self, problem: str, intervals: int | None, cache: Path) -> tuple[Finished, Path]:
        """Solve a shipped problem from the shell.

        Args:
            problem: The problem.
            intervals: Intervals of a mesh that is not refined; None: what the shipped config says.
            cache: Folder for derivative functions.

        Returns:
            The finished command, converged or not, and the run folder.
        """
        out = self.empty(problem) / "run"
        changes = [] if intervals is None else fixed_mesh(intervals)
        changes += ["verdict=false"] if "orthosis" in problem else []
        words = [word for change in changes for word in ("--set", change)]
        arguments = ("solve", problem, problem, "--quiet", *words, "--out", out)
        finished = pathwalker(*arguments, cache=cache, allowed=(0, 1))
        if metrics_of(out)["status"] == "converged":
            self._runs[problem, intervals] = out
        return finished, out

    def run(self, problem: str, intervals: int | None) -> Path:
        """Return the folder of a converged run; it is solved unless there is one.

        Raises:
            PartFailedError: If it does not converge.
        """
        if (problem, intervals) not in self._runs:
            self.tell(f"{problem}, to stand on")
            _, out = self.solve(problem, intervals, self.cache)
            if (problem, intervals) not in self._runs:
                raise PartFailedError(f"{problem}: {metrics_of(out)['status']}")
        return self._runs[problem, intervals]


def fixed_mesh(intervals: int) -> list[str]:
    """Return the changes of a config for a mesh that is not refined."""
    return [f"mesh.intervals={intervals}", "mesh.refinements=0"]


def metrics_of(run: Path) -> dict[str, Any]:
    """Return the metrics of a run.

    Raises:
        PartFailedError: If there are none.
    """
    try:
        return dict(json.loads((run / "metrics.json").read_text(encoding="utf-8")))
    except (OSError, ValueError) as failure:
        raise PartFailedError(f"no metrics in the run folder: {failure}") from failure
