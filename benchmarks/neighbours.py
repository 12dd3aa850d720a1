"""What one case of a study costs: cold, with derivatives there, warm, and without solving at all.

Run on a quiet machine: ``python benchmarks/neighbours.py RUN [RUN ...]`` with converged runs of
problems with orthoses.  CPU seconds of one process; medians of several repetitions.
"""

from __future__ import annotations

import argparse
import json
import resource
import statistics
import time
from collections.abc import Callable
from typing import TypeVar

from pathwalker_cli.config import with_values
from pathwalker_cli.conventions import STIFFNESSES
from pathwalker_cli.ocp.neighbourhood import Neighbourhood
from pathwalker_cli.ocp.resolve import Optimum
from pathwalker_cli.ocp.solve import GaitSolver
from pathwalker_cli.output.run_folder import load_run
from pathwalker_cli.studies.base import resolver_of

T = TypeVar("T")
CHANGES = (
    ("spring, -5 %", "bounds.stiffness", None),
    ("strengths, -10 %", "variation.scale", {"strengths": 0.9}),
    ("body mass, +5 %", "variation.scale", {"body_mass": 1.05}),
)


def timed(action: Callable[[], T]) -> tuple[float, T]:
    """Return CPU seconds of an action, and its result."""
    began = time.process_time()
    result = action()
    return time.process_time() - began, result


def resolves(optimum: Optimum, resolve: Callable[..., Optimum]) -> dict[str, object]:
    """Return iterations and CPU seconds of warm re-solves."""
    found: dict[str, object] = {}
    for name, key, value in CHANGES:
        seconds, iterations = [], []
        springs = STIFFNESSES if value is None else ("",)
        for spring in springs:
            stiffness = 0.95 * float(optimum.stiffness[STIFFNESSES.index(spring or STIFFNESSES[0])])
            change = {spring: [stiffness, stiffness]} if spring else value
            config = with_values(optimum.config, {key: change})
            spent, neighbour = timed(lambda config=config: resolve(config))  # type: ignore[misc]
            assert neighbour.converged, (name, neighbour.result.status)
            seconds.append(spent)
            iterations.append(neighbour.result.iterations)
        found[name] = {
            "iterations": iterations,
            "cpu_seconds": [round(value, 2) for value in seconds],
            "median": round(statistics.median(seconds), 2),
        }
    return found


def figures(folder: str) -> dict[str, object]:
    """Return what the neighbours of one run cost."""
    run = load_run(folder)
    build, _ = timed(lambda: GaitSolver(run.config))
    again = [timed(lambda: GaitSolver(run.config))[0] for _ in range(5)]
    resolver = resolver_of(run)
    first, optimum = timed(lambda: resolver.optimum)
    solver, _ = timed(lambda: resolver.resolve(run.config))
    around = Neighbourhood(resolver)
    factors, _ = timed(lambda: around.cost_hessian)
    answers = [timed(lambda: around.by_factor("body_mass"))[0] for _ in range(3)]
    return {
        "run": folder,
        "intervals": optimum.motion.intervals,
        "unknowns": optimum.program.program.size,
        "cpu_seconds_build_first": round(build, 2),
        "cpu_seconds_build_again": round(statistics.median(again), 3),
        "cpu_seconds_first_warm_solve_with_derivatives": round(first + solver, 2),
        "warm": resolves(optimum, resolver.resolve),
        "cpu_seconds_kkt_factors_and_springs": round(factors, 2),
        "cpu_seconds_per_sensitivity": round(statistics.median(answers), 2),
    }


def main() -> None:
    """Print the figures of all runs as JSON."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("runs", nargs="+", metavar="RUN")
    found = [figures(folder) for folder in parser.parse_args().runs]
    peak = round(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024)
    print(json.dumps({"runs": found, "peak_memory_mb": peak}, indent=2))


if __name__ == "__main__":
    main()
