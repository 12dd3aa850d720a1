"""What the neighbours of a run cost: built, solved from it, or told without solving."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Final

from parts.building import timed
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.gait.neighbourhood import Neighbourhood
from pathwalker_cli.gait.resolve import Optimum, Resolver
from pathwalker_cli.gait.solve import GaitSolver
from pathwalker_cli.results.run_folder import load_run
from pathwalker_cli.studies.base import resolver_of

SPRINGS: Final = "one spring 5 % softer, warm"


def figures(folder: str) -> dict[str, Any]:
    """Return CPU seconds and iterations.

    Args:
        folder: A converged run of a problem with orthoses.

    Returns:
        By what was done: `seconds` and `iterations` of all times it was done.
    """
    found: dict[str, dict[str, list[float]]] = {}

    def note(name: str, action: Callable[[], Any]) -> Any:
        seconds, result = timed(action)
        entry = found.setdefault(name, {"seconds": [], "iterations": [], "failed": []})
        entry["seconds"].append(seconds)
        if isinstance(result, Optimum):
            entry["iterations"].append(result.result.iterations)
            entry["failed"].append(0 if result.converged else 1)
        return result

    run = load_run(folder)
    note("blocks of the first case", lambda: GaitSolver(run.case))
    for _ in range(3):
        note("blocks of a further case", lambda: GaitSolver(run.case))
    resolver = note("solver of neighbours", lambda: resolver_of(run))
    note("the run itself, warm, with derivatives", lambda: resolver.optimum)
    _solve(resolver, note)
    around = Neighbourhood(resolver)
    note("KKT factors and Hessian of the springs", lambda: around.cost_hessian)
    for _ in range(3):
        note("one sensitivity, no solve", lambda: around.by_factor("body_mass"))
    optimum = resolver.optimum
    return {
        "intervals": optimum.motion.intervals,
        "unknowns": optimum.program.size,
        "done": found,
    }


def _solve(resolver: Resolver, note: Callable[[str, Callable[[], Any]], Any]) -> None:
    """Solve the neighbours."""
    optimum = resolver.optimum
    note("nothing changed, warm", lambda: resolver.resolve(optimum.case))
    changes: list[tuple[str, Mapping[str, Any]]] = [
        (SPRINGS, {"bounds.stiffness": {name: [0.95 * float(value)] * 2}})
        for name, value in zip(STIFFNESSES, optimum.stiffness, strict=True)
    ]
    changes.append(("all strengths 10 % lower, warm", {"variation.scale": {"strengths": 0.9}}))
    changes.append(("body mass 5 % higher, warm", {"variation.scale": {"body_mass": 1.05}}))
    for name, change in changes:
        note(name, partial(resolver.resolve, optimum.case.with_values(change)))
